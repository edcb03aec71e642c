"""Nothing that belongs to the host process or to another library is changed, not even for a moment."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import passgraph as pg

WALK = r"""
import os, signal, sys, warnings, locale, logging, threading, gc, decimal, random, types
from pathlib import Path
import numpy as np
import PIL.Image, numba.core.config, av, cv2, trimesh, networkx  # what these set is theirs
import moderngl, OpenEXR, OpenImageIO
import pyopencl, scipy.optimize, scipy.sparse, scipy.spatial, scipy.special, tifffile, zarr

changes = []

def watch(module):
    class Watched(types.ModuleType):
        def __setattr__(self, name, value):
            if name.isupper() or name in ("level", "filters"):
                changes.append(f"{module.__name__}.{name}")
            super().__setattr__(name, value)
    module.__class__ = Watched

def calls(module, *names):
    for name in names:
        real = getattr(module, name)
        def recorded(*args, real=real, name=name, **named):
            file = sys._getframe(1).f_code.co_filename
            # pyopencl warns of whatever a compiler says, and only a filter keeps its cache of binaries and silences it.
            if file.endswith("backends/opencl/programs.py"):
                return real(*args, **named)
            if any(part in file for part in ("/passgraph/", "/backends/", "/effects/")) and "site-packages" not in file:
                changes.append(f"{module.__name__}.{name} in {file}:{sys._getframe(1).f_lineno}")
            return real(*args, **named)
        setattr(module, name, recorded)

calls(warnings, "simplefilter", "filterwarnings", "catch_warnings", "resetwarnings")
calls(signal, "signal", "set_wakeup_fd", "siginterrupt", "pthread_sigmask")
calls(os, "putenv", "unsetenv", "chdir", "umask", "nice", "sched_setaffinity")
calls(locale, "setlocale")
calls(gc, "disable", "enable", "set_threshold", "freeze")
calls(sys, "setrecursionlimit", "setswitchinterval", "settrace", "setprofile")
calls(threading, "stack_size")
calls(np, "seterr", "set_printoptions", "seterrcall")
calls(np.random, "seed")
calls(cv2, "setNumThreads", "setUseOptimized")
calls(random, "seed")
calls(logging, "basicConfig", "disable", "captureWarnings")
calls(av.logging, "set_level", *(["set_libav_level"] if hasattr(av.logging, "set_libav_level") else []))
for module in (PIL.Image, numba.core.config):
    watch(module)

def state():
    names = [None, "trimesh", "PIL", "numba", "networkx", "libav", "distributed", "matplotlib", "warnings"]
    return {
        "environment": dict(os.environ), "filters": list(warnings.filters), "numpy": np.geterr(),
        "printing": repr(np.get_printoptions()), "folder": os.getcwd(), "locale": locale.setlocale(locale.LC_ALL),
        "signals": [signal.getsignal(n) for n in (signal.SIGINT, signal.SIGTERM, signal.SIGPIPE)],
        "hooks": (sys.excepthook, sys.unraisablehook, threading.excepthook, sys.displayhook),
        "limits": (sys.getrecursionlimit(), sys.getswitchinterval(), gc.get_threshold(), threading.stack_size()),
        "levels": {name: (logging.getLogger(name).level, list(logging.getLogger(name).handlers)) for name in names},
        "threads": (cv2.getNumThreads(), cv2.useOptimized(), numba.get_num_threads(), numba.core.config.OPT),
        "random": (random.getstate(), repr(np.random.get_state())), "pixels": PIL.Image.MAX_IMAGE_PIXELS,
        "decimal": repr(decimal.getcontext()), "av": av.logging.get_level(), "streams": (sys.stdout, sys.stderr),
        "affinity": os.sched_getaffinity(0), "meta": list(sys.meta_path), "path": list(sys.path),
    }

numba.get_num_threads()
before = state()
import passgraph as pg
from passgraph.effects import bloom, gaussian_blur, soft_shadow
from passgraph import frames
from passgraph.files import Pictures, ToPictures, ToVideo, ToAnimation, Video
from passgraph.verify.compare import compare

folder = Path(sys.argv[1])
picture = np.linspace(0, 1, 32 * 48 * 4, dtype=np.float32).reshape(32, 48, 4)
opaque = np.concatenate([picture[..., :3], np.ones_like(picture[..., :1])], -1)
wide = np.round(picture * 65535).astype(np.uint16)
for name in ("a.png", "a.tif", "a.webp", "a.npy", "a.exr", "a.jpg"):
    pg.save(folder / name, opaque, like=folder / "a.png" if name != "a.png" else None)
    pg.load(folder / name)
for name in ("b.png", "b.tif"):
    pg.save(folder / name, wide)
    pg.load(folder / name)

text = pg.kernel(source="def k(c: Image, s: float = 2.0) -> vec4:\n    \'a \\d docstring\'\n    return c[0, 0] * s")
image = pg.Input("image", "rgba32f")
for backend in ("numpy", "reference", "gl", "opencl"):
    with pg.compile(bloom(text(image)), backend=backend) as program:
        program(image=picture)
compare(text(image), ["numpy"], image=picture)
scene = pg.Scene.shipped()
for backend in ("numpy", "gl"):
    with pg.compile(soft_shadow(scene), backend=backend, size=(48, 32)) as program:
        program(camera=scene.camera, light=scene.lights[0])
(folder / "cube.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 nan 0\nv 0 1 0\nf 1 2 4\n")
try:
    pg.Scene.load(folder / "cube.obj")
except pg.InputError:
    pass
with pg.compile(gaussian_blur(pg.Input("frame")), backend="numpy") as program:
    pictures = Pictures([folder / "a.png"] * 3)
    for sink in (ToPictures({n: folder / f"c{n}.png" for n in (1, 2, 3)}), ToVideo(folder / "c.mp4"),
                 ToAnimation(folder / "c.gif")):
        assert frames(program, pictures, sink).whole
    assert frames(program, Video(folder / "c.mp4"), ToVideo(folder / "d.mkv")).whole
pg.tiled(gaussian_blur(pg.Input("frame")), {"frame": folder / "a.tif"}, folder / "t.tif")
pg.tiled(gaussian_blur(pg.Input("frame")), {"frame": folder / "a.tif"}, folder / "t.zarr")
pg.load_shader(str(folder / "x.glsl")) if (folder / "x.glsl").exists() else None
pg.from_data(pg.to_data(text(image)))

after = state()
different = {name: (before[name], after[name]) for name in before if before[name] != after[name]}
assert not changes, changes
assert not different, list(different.items())[:1]
"""


def test_globals_of_others_stay(tmp_path: Path) -> None:
    made = subprocess.run([sys.executable, "-W", "ignore", "-c", WALK, tmp_path], capture_output=True, text=True)
    assert made.returncode == 0, made.stderr[-3000:]


def test_unknown_escapes_in_a_docstring_do_not_warn() -> None:
    """Warnings are errors here."""
    text = "def k(c: Image) -> vec4:\n    'two \\d, \\\\ and \\' \\' are told'  # and \\w\n    return c[0, 0]"
    assert pg.kernel(source=text).name == "k"
