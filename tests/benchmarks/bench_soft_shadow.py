"""A whole soft-shadow frame: ``numpy`` and ``opencl`` beside ``gl``.

    python tests/benchmarks/bench_soft_shadow.py [--size WIDTHxHEIGHT] [--frames COUNT]

Of the shipped scene, whose floor has textures and relief, and of a model of about 70,000 triangles without textures.
Shadow map, surfaces, shadows, blur and picture are drawn anew each frame (the light moves); reading back is left out.
Backends take turns, and processor time of all their threads is counted, which other work on the machine hardly
changes.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable
from itertools import count
from pathlib import Path

import numpy as np

import passgraph as pg
from passgraph.effects import soft_shadow
from passgraph.scene import Material, Node
from passgraph.scene.ground import floor_node
from passgraph.scene.teapot import teapot_mesh

sys.path.insert(0, str(Path(__file__).parent))
from harness import Ratio, interleaved, ratio_of

SIZE, FRAMES = (1280, 720), 9
#: Backend → most times gl's.
WANTED = {"numpy": 0.5, "opencl": None}


def plain() -> pg.Scene:
    """The teapot in about 70,000 triangles, untextured, on the shipped floor's plane."""
    shipped = pg.Scene.shipped()
    pot = Node(teapot_mesh(segments=33), Material("glaze", (0.1, 0.4, 0.45, 1.0)), np.eye(4))
    floor = floor_node(pot.bounds)
    flat = Node(floor.mesh, Material("floor", (0.6, 0.55, 0.5, 1.0)), floor.transform)
    return shipped.with_(nodes=(pot, flat))


def frames(program: pg.Program, light: pg.Light) -> Callable[[], None]:
    """Return a function that draws a frame with the light moved a little further each time."""
    number = count()

    def draw() -> None:
        x, *others = light.direction
        moved = (x + 0.001 * next(number), *others)
        program.run(light=pg.Light.directional(moved, light.color, light.intensity, light.radius))
        program.finish()

    return draw


def ratios(size: tuple[int, int] = SIZE, rounds: int = FRAMES) -> list[Ratio]:
    found = []
    for what, scene in (("the shipped scene", pg.Scene.shipped()), ("a model without textures", plain())):
        programs = {name: pg.compile(soft_shadow(scene), backend=name, size=size) for name in ("gl", *WANTED)}
        jobs = {name: frames(program, scene.lights[0]) for name, program in programs.items()}
        times = interleaved(jobs, rounds, clock=time.process_time)
        for name, most in WANTED.items():
            row = f"processor time of a soft_shadow frame of {what}, {name} / gl"
            found.append(ratio_of(row, times[name], times["gl"], most))
        for program in programs.values():
            program.close()
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n", maxsplit=1)[0])
    parser.add_argument("--size", default="x".join(map(str, SIZE)))
    parser.add_argument("--frames", type=int, default=FRAMES)
    given = parser.parse_args()
    width, height = (int(side) for side in given.size.split("x"))
    for ratio in ratios((width, height), given.frames):
        print(f"{ratio.what:72} {ratio.got:.2f}   {ratio.ms:.1f} / {ratio.other_ms:.1f} ms")


if __name__ == "__main__":
    main()
