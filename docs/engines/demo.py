"""What the examples for engines share: what a scene in an engine must do here, and effects to show in it.

Each example is a module with a class ``Scene`` that does what `Scene` lists; the table (``table.py``), the tests
(``play.py``) and the example's own picture use it.
"""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

root = Path(__file__).resolve().parent.parent.parent
if sys.path[0] == str(root / "docs" / "engines"):
    sys.path[0] = str(root)  # examples are called like their engines, which are meant by `import`

import passgraph as pg
from passgraph.backends.gl.context import Current
from passgraph.backends.gl.gl_functions import Functions
from passgraph.effects import black_and_white, gaussian_blur
from passgraph.effects.ambient.ambient_occlusion import occlusion
from passgraph.effects.surfaces.depth_normals import depth_normals
from passgraph.engines.attachment import Attachment
from passgraph.hosts.gl_isolation import current_state
from passgraph.language import Image, vec4

Picture = NDArray[np.uint8]
FOLDER = root / "docs" / "images" / "engines"
SIZE = (640, 400)
#: After which a process that hangs is ended; nothing is measured by it.
ENOUGH_S = 600


class Scene(Protocol):
    """A scene in an engine, drawn off screen, that moves a little from frame to frame, each time alike.

    Attributes
    ----------
    engine : the distribution that is installed, such as "panda3d"
    hook : where the effect runs, in the engine's words
    shown : the effect that the example's picture shows
    """

    engine: str
    hook: str
    shown: Callable[..., pg.Target]

    def __init__(self, size: tuple[int, int]) -> None: ...

    def draw(self) -> None:
        """The next frame, the effect in it."""

    def picture(self) -> Picture:
        """The frame drawn last, (height, width, 3) uint8, row 0 on top."""

    def attach(self, effect: Callable[..., pg.Target], **values: Any) -> Attachment: ...

    def hook_in(self, call: Callable[[], object]) -> Callable[[], object]:
        """Call something where the effect is called; returns what takes it out again."""

    def resize(self, size: tuple[int, int]) -> None: ...

    def close(self) -> None: ...


def functions() -> Functions:
    """OpenGL's, of the context that is current."""
    current = Current()
    return Functions(current.system(current_state(current)).address)


def installed(engine: str) -> str | None:
    """The engine's version, or None."""
    try:
        return version(engine)
    except PackageNotFoundError:
        return None


@pg.kernel
def dimmed(color: Image, visibility: Image) -> vec4:
    """Colours times the share of light that arrives."""
    here = color[0, 0]
    return vec4(here.rgb * visibility[0, 0].r, here.a)


def occluded(frame: pg.Target, depth: pg.Target, camera: pg.Value, radius: float = 1.0) -> pg.Target:
    """Ambient occlusion from the engine's depth and camera."""
    found = occlusion(depth, depth_normals(depth, camera), camera, radius=radius, power=2.0)
    return dimmed(frame, found.visibility, into=pg.target("occluded", "rgba8"))


@pg.kernel
def shifted_inverse(color: Image) -> vec4:
    """Exact in 8 bits, and another result where a picture is upside down or off by a pixel."""
    return vec4(1.0 - color[2, 1].rgb, color[0, 0].a)


def inverse(frame: pg.Target) -> pg.Target:
    """What tests attach; see `inverse_of`."""
    return shifted_inverse(frame, into=pg.target("inverse", "rgba8"))


def inverse_of(picture: Picture) -> Picture:
    """What `inverse` makes of a picture."""
    height, width, _ = picture.shape
    shifted = picture[np.minimum(np.arange(height) + 1, height - 1)]
    return 255 - shifted[:, np.minimum(np.arange(width) + 2, width - 1)]


def gray_and_soft(frame: pg.Target) -> pg.Target:
    """Black and white, then 15 taps across and down: what the table measures."""
    gray = black_and_white(frame, into=pg.target("gray", "rgba8"))
    return gaussian_blur(gray, 3.0, 7, into=pg.target("soft", "rgba8"))


def played(engine: str, *options: str, under: tuple[str, ...] = ()) -> dict[str, Any]:
    """What ``play.py`` makes of an example in a process of its own, and what it logged; ``under``: what starts it.

    Raises RuntimeError where it fails, with what it said.
    """
    with TemporaryDirectory() as folder:
        file = Path(folder, "frames.npz")
        command = [*under, sys.executable, str(root / "docs/engines/play.py"), engine, str(file), *options]
        ran = subprocess.run(command, capture_output=True, text=True, timeout=ENOUGH_S, check=False, cwd=folder)
        if ran.returncode:
            raise RuntimeError(f"{' '.join(command)}\n{ran.stdout}\n{ran.stderr}")
        with np.load(file) as loaded:
            return {**{name: loaded[name] for name in loaded.files}, "log": ran.stderr}


def show(scene: type[Scene], **values: Any) -> None:
    """Write an example's picture: left as the engine draws it, right with the effect."""
    made = scene(SIZE)
    made.draw()
    plain = made.picture()
    with made.attach(scene.shown, **values) as attached:
        made.draw()
        changed = made.picture()
    if attached.error is not None:
        raise attached.error
    made.close()
    FOLDER.mkdir(parents=True, exist_ok=True)
    path = FOLDER / f"{scene.engine}.png"
    pg.save(path, np.concatenate([plain, changed], axis=1))
    print(f"{path}: left as {scene.engine} {installed(scene.engine)} draws it, right with the effect")
