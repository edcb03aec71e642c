"""A whole soft-shadow frame of a model of about 70,000 triangles: ``numpy`` beside ``gl`` and ``opencl``.

    python tests/benchmarks/bench_soft_shadow.py [WIDTHxHEIGHT]

Shadow map, surfaces, shadows, blur and picture are drawn anew each frame (the light moves); reading back is left out.
Frames are run in turn, so that the machine's drift meets all backends alike; medians and ratios are printed.
"""

from __future__ import annotations

import statistics
import sys
import time

import numpy as np

import passgraph as pg
from passgraph.effects import soft_shadow
from passgraph.scene import Material, Node
from passgraph.scene.ground import floor_node
from passgraph.scene.teapot import teapot_mesh

FRAMES = 9


def scene() -> pg.Scene:
    """The teapot in about 70,000 triangles, untextured, on the shipped floor's plane."""
    shipped = pg.Scene.shipped()
    pot = Node(teapot_mesh(segments=33), Material("glaze", (0.1, 0.4, 0.45, 1.0)), np.eye(4))
    floor = floor_node(pot.bounds)
    plain = Node(floor.mesh, Material("floor", (0.6, 0.55, 0.5, 1.0)), floor.transform)
    return shipped.with_(nodes=(pot, plain))


def main() -> dict[str, float]:
    width, height = (int(v) for v in (sys.argv[1] if len(sys.argv) > 1 else "1920x1080").split("x"))
    made = scene()
    light = made.lights[0]
    programs = {n: pg.compile(soft_shadow(made), backend=n, size=(width, height)) for n in ("numpy", "gl", "opencl")}
    times: dict[str, list[float]] = {name: [] for name in programs}
    for frame in range(FRAMES + 1):
        for name, program in programs.items():
            moved = pg.Light.directional(
                (light.direction[0] + 0.001 * frame, *light.direction[1:]), light.color, light.intensity, light.radius
            )
            begin = time.perf_counter()
            program.run(light=moved)
            program.finish()
            if frame:
                times[name].append(time.perf_counter() - begin)
    medians = {name: statistics.median(values) * 1e3 for name, values in times.items()}
    print(f"{made.triangle_count} triangles, {width}x{height}")
    for name, value in medians.items():
        print(f"{name:8} {value:8.1f} ms   {value / medians['gl']:.2f} of gl")
    for program in programs.values():
        program.close()
    return medians


if __name__ == "__main__":
    main()
