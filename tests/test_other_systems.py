"""Windows and macOS, which these tests do not run on: what Linux alone has is used there only behind a guard."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

root = Path(__file__).resolve().parent.parent

#: What Python has on Unix alone, by its documentation ("Availability: Unix"). Not os.statvfs and O_NONBLOCK, which
#: `shutil` uses here.
MODULES = ("fcntl", "grp", "pwd", "resource", "termios", "tty", "pty", "syslog")
OS_NAMES = (
    "fork", "register_at_fork", "getuid", "geteuid", "getgid", "getegid", "getpgid", "setsid", "killpg", "fchown",
    "chown", "lchown", "mkfifo", "memfd_create", "MFD_CLOEXEC", "sched_getaffinity", "sched_setaffinity", "sysconf",
    "confstr", "pread", "pwrite", "readv", "writev", "posix_fallocate", "posix_fadvise", "sendfile", "uname",
    "getloadavg", "nice", "openpty", "wait4", "O_DIRECTORY", "O_NOFOLLOW", "O_CLOEXEC", "O_PATH",
    "O_TMPFILE", "O_DIRECT", "RTLD_NOLOAD", "RTLD_LAZY", "RTLD_NOW", "RTLD_GLOBAL", "WNOHANG",
)  # fmt: skip
SIGNALS = ("SIGPIPE", "SIGHUP", "SIGALRM", "SIGKILL", "SIGUSR1", "SIGUSR2", "SIGCHLD", "SIGWINCH", "setitimer")
OPTIONAL = ("anywidget", "av", "dask.array", "distributed", "embreex", "hypothesis", "moderngl", "playwright.sync_api",
    "pyopencl", "skimage.metrics", "starlette", "tifffile", "uvicorn", "websockets", "wgpu", "zarr")  # fmt: skip
#: Libraries load first: those for Linux may use it.
LIKE_WINDOWS = f"""
import asyncio, concurrent.futures, ctypes.util, importlib, multiprocessing, os, pkgutil, shutil, signal, subprocess
import sys, tempfile, uuid, webbrowser
import click, llvmlite.binding, networkx, numpy, OpenImageIO, PIL.Image, trimesh
import rich.console, rich.progress, rich.table
for name in {OPTIONAL!r}:
    try:
        importlib.import_module(name)
    except ImportError:
        pass
for name in {MODULES!r}:
    sys.modules[name] = None
for module, names in ((os, {OS_NAMES!r}), (signal, {SIGNALS!r})):
    for name in names:
        vars(module).pop(name, None)
os.supports_dir_fd.clear()
sys.platform = "win32"
"""
USE = """
import passgraph as pg
from passgraph.commands.entry import run
frame = numpy.linspace(0.0, 1.0, 8 * 16 * 4, dtype=numpy.float32).reshape(8, 16, 4)
pg.save("in.png", frame[..., :3])
pg.save("in.exr", frame[..., :3])
assert numpy.array_equal(pg.load("in.exr")[..., :3], frame[..., :3])
assert run(["apply", "gaussian-blur", "in.png", "-o", "out.png"]) == 0
assert pg.load("out.png").shape == (8, 16, 4)
assert run(["plan", "in.png", "--effect", "bloom"]) == 0
assert os.listdir(os.environ["PASSGRAPH_CACHE"])
for module in pkgutil.walk_packages(pg.__path__, "passgraph."):
    if not module.name.endswith("__main__"):
        try:
            importlib.import_module(module.name)
        except ImportError as error:
            assert str(error.name).partition(".")[0] not in MODULES, error
print("done")
"""


def test_nothing_that_windows_lacks_is_used(tmp_path: Path) -> None:
    """Import every module, and apply an effect to a file, without the modules and names that Windows does not have."""
    code = f"{LIKE_WINDOWS}\nMODULES = {MODULES!r}\n{USE}"
    environment = {"PASSGRAPH_CACHE": str(tmp_path / "cache"), "PATH": "", "HOME": str(tmp_path)}
    command = [sys.executable, "-c", code]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False, env=environment)
    assert done.stdout.endswith("done\n"), done.stderr


@pytest.mark.slow
@pytest.mark.parametrize("platform", ["win32", "darwin"])
def test_types_hold_on_other_systems(platform: str, tmp_path: Path) -> None:
    """Python's stubs name what each system lacks; mypy reads the guards."""
    command = [
        sys.executable,
        "-m",
        "mypy",
        "--platform",
        platform,
        "--no-warn-unreachable",
        "--cache-dir",
        str(tmp_path),
    ]
    done = subprocess.run(command, cwd=root, capture_output=True, text=True, check=False)
    assert done.stdout.startswith("Success"), done.stdout
