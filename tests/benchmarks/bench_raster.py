"""Draws alone: a shadow map and a G-buffer of about 70,000 and 1,000,000 triangles, ``numpy`` beside ``gl``.

    python tests/benchmarks/bench_raster.py [WIDTHxHEIGHT] [frames]

The shadow map is 1024 squared.  Runs take turns, so that the machine's drift meets both alike; a run ends when the
device has finished it.  The ratio is the median of neighbouring pairs.
"""

from __future__ import annotations

import statistics
import sys
import time

import numpy as np

import passgraph as pg
from passgraph.effects import soft_shadow_passes
from passgraph.scene import Material, Node
from passgraph.scene.ground import floor_node
from passgraph.scene.teapot import teapot_mesh

BACKENDS = ("numpy", "gl")


def scene(segments: int) -> pg.Scene:
    """The teapot with that many segments along a patch, and the shipped floor without its textures."""
    pot = Node(teapot_mesh(segments=segments), Material("glaze", (0.1, 0.4, 0.45, 1.0)), np.eye(4))
    floor = floor_node(pot.bounds)
    plain = Node(floor.mesh, Material("floor", (0.6, 0.55, 0.5, 1.0)), floor.transform)
    return pg.Scene.shipped().with_(nodes=(pot, plain))


def targets(made: pg.Scene) -> dict[str, tuple[pg.Target, ...]]:
    passes = soft_shadow_passes(made, map_size=1024)
    return {"shadow map": passes.shadow_maps, "G-buffer": (passes.base_color, passes.normals, passes.depth)}


def measure(made: pg.Scene, name: str, size: tuple[int, int], frames: int) -> float:
    programs = {b: pg.compile(list(targets(made)[name]), backend=b, size=size) for b in BACKENDS}
    times: dict[str, list[float]] = {b: [] for b in BACKENDS}
    direction = made.lights[0].direction
    for frame in range(frames + 2):
        # One of both is what moves; the other is not there.
        moved = pg.Light.directional((direction[0] + 0.001 * frame, *direction[1:]))
        for backend, program in programs.items():
            given = {"light": moved} if "light" in program.plan.values else {}
            begin = time.perf_counter()
            program.run(**given)
            program.finish()
            if frame >= 2:
                times[backend].append(time.perf_counter() - begin)
    for program in programs.values():
        program.close()
    ratio = statistics.median(x / y for x, y in zip(times["numpy"], times["gl"], strict=True))
    mine, other = (statistics.median(times[b]) * 1e3 for b in BACKENDS)
    print(f"{made.triangle_count:8} triangles, {name:10}  numpy {mine:7.1f} ms  gl {other:7.1f} ms  ratio {ratio:.2f}")
    return ratio


def main(size: str = "1920x1080", frames: int = 9) -> None:
    width, height = (int(v) for v in size.split("x"))
    for segments in (33, 125):
        made = scene(segments)
        for name in ("shadow map", "G-buffer"):
            measure(made, name, (width, height), frames)


if __name__ == "__main__":
    main(*sys.argv[1:2], *(int(v) for v in sys.argv[2:3]))
