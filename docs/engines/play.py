"""Frames of an example's scene as arrays, with an effect in some of them: for tests, which run this in a process.

    python docs/engines/play.py ENGINE FILE.npz [--effect 2 3] [--resize 4] [--isolation guard] [--leave CALL]

The file has the pictures "0", "1" …, and "before" and "after": how many OpenGL objects there were.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable
from importlib import import_module
from pathlib import Path

import numpy as np

root = Path(__file__).resolve().parent.parent.parent
if sys.path[0] == str(root / "docs" / "engines"):
    sys.path[0] = str(root)

import passgraph as pg
from docs.engines.by_hand import ByHand
from docs.engines.demo import Scene, functions, gray_and_soft, inverse
from passgraph.backends.gl.gl_functions import Functions
from passgraph.engines.attachment import Attachment

KINDS = ("Texture", "Buffer", "Framebuffer", "Program", "Renderbuffer", "Sampler", "Shader", "VertexArray")
#: Names that are looked at: more than these scenes have objects.
NAMES = 2000


def count_objects() -> list[int]:
    """How many of each kind the current context has."""
    gl = functions()
    return [sum(bool(getattr(gl, f"Is{kind}")(name)) for name in range(1, NAMES)) for kind in KINDS]


def in_hook(scene: Scene, call: Callable[[], object]) -> list[object]:
    """Draw a frame, with a call in the engine's hook, and what that returned."""
    got: list[object] = []
    take_out = scene.hook_in(lambda: got.append(call()))
    scene.draw()
    take_out()
    return got


#: States that an effect could leave behind, by name; each breaks a later frame of some engine.
LEFT: dict[str, Callable[[Functions], object]] = {
    "depth test off": lambda gl: gl.Disable(0x0B71),
    "blending off": lambda gl: gl.Disable(0x0BE2),
    "colour mask": lambda gl: gl.ColorMask(0, 1, 1, 1),
    "outlines": lambda gl: gl.PolygonMode(0x0408, 0x1B01),
    "front face": lambda gl: gl.FrontFace(0x900),
    "program": lambda gl: gl.UseProgram(0),
    "sampler": lambda gl: [_bound_sampler(gl, unit) for unit in range(8)],
}


def _bound_sampler(gl: Functions, unit: int) -> None:
    sampler = gl.new("Sampler")
    for parameter, value in {0x2801: 0x2600, 0x2800: 0x2600, 0x2802: 0x812F, 0x2803: 0x812F}.items():
        gl.SamplerParameteri(sampler, parameter, value)
    gl.BindSampler(unit, sampler)


def broken(frame: pg.Target) -> pg.Target:
    """An effect that can be planned and not run: a value is missing."""
    kernel = pg.kernel(source="def broken(c: Image, gain: float) -> vec4: return c[0, 0] * gain")
    return kernel(frame, pg.Value("gain", float), into=pg.target("broken", "rgba8"))


EFFECTS = {"inverse": inverse, "broken": broken, "soft": gray_and_soft, "soft by hand": None}


class _ByHand:
    """What the table measures by hand, as if it were an attachment."""

    isolation = error = None

    def __init__(self, scene: Scene) -> None:
        self.close = scene.hook_in(self)
        self.scene = scene
        self.made: ByHand | None = None

    def __call__(self) -> None:
        self.made = self.made or ByHand(self.scene.picture().shape[1::-1])
        self.made()


def attach(scene: Scene, told: argparse.Namespace) -> Attachment | _ByHand:
    effect = EFFECTS[told.which]
    return _ByHand(scene) if effect is None else scene.attach(effect, isolation=told.isolation)


def resident_bytes() -> int:
    return int(Path("/proc/self/statm").read_text().split()[1]) * 4096


def many(scene: Scene, told: argparse.Namespace) -> dict[str, object]:
    """Memory and objects after a fifth of many frames and after all."""
    attached = attach(scene, told)
    noted: list[tuple[int, list[int]]] = []
    for frames in (told.many // 5, told.many - told.many // 5):
        for _ in range(frames):
            scene.draw()
        noted.append((resident_bytes(), in_hook(scene, count_objects)[-1]))
    attached.close()
    return {"resident": [n[0] for n in noted], "held": [n[1] for n in noted], "failed": str(attached.error or "")}


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("engine")
    parser.add_argument("file", type=Path)
    parser.add_argument("--frames", type=int, default=7)
    parser.add_argument("--effect", type=int, nargs="*", default=[], help="frames that have it")
    parser.add_argument("--resize", type=int, help="the frame before which the size changes")
    parser.add_argument("--isolation", default="auto")
    parser.add_argument("--leave", choices=LEFT, help="leave this state behind in the first frame with the effect")
    parser.add_argument("--which", choices=EFFECTS, default="inverse", help='the effect; "broken" fails when it runs')
    parser.add_argument("--many", type=int, help="so many frames more, with the effect, of which memory is noted")
    parser.add_argument("--size", type=int, nargs=2, default=(67, 45))
    parser.add_argument("--samples", type=int, help="a pixel; of scenes that take a number of them")
    told = parser.parse_args()
    samples = {} if told.samples is None else {"samples": told.samples}
    scene: Scene = import_module(f"docs.engines.{told.engine}").Scene(tuple(told.size), **samples)
    made: dict[str, object] = {}
    scene.draw()
    in_hook(scene, count_objects)  # engines make things at their first frames
    made["before"] = in_hook(scene, count_objects)[-1]
    attached = None
    for number in range(told.frames):
        if number == told.resize:
            scene.resize((told.size[0] + 20, told.size[1] - 7))
        wanted = number in told.effect
        if wanted and attached is None:
            attached = attach(scene, told)
            leave = LEFT[told.leave] if told.leave else lambda gl: None
            take_out = scene.hook_in(lambda leave=leave: leave(functions()))
        elif not wanted and attached is not None:
            attached.close()
            take_out()
            attached = None
        scene.draw()
        made[str(number)] = scene.picture()
        if attached is not None:
            made["isolation"], made["error"] = attached.isolation or "", str(attached.error or "")
    if attached is not None:
        attached.close()
        take_out()
    if told.many:
        made |= many(scene, told)
    made["after"] = in_hook(scene, count_objects)[-1]
    scene.close()
    np.savez(told.file, **made)


if __name__ == "__main__":
    main()
