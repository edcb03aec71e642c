"""What a stencil test costs: draws with it and the same draws without, on each backend.

    python tests/benchmarks/bench_stencil.py [WIDTHxHEIGHT] [runs]

``gl`` is the driver's stencil, in hardware where there is a graphics card (Mesa's llvmpipe is software too: the
device is printed), ``opencl`` and ``numpy`` are this project's rasterisers.  Marking: eight layers over the whole
picture set the stencil.  Once: the same layers darken each pixel where the stencil allows it, which it does for
the first; without the stencil all eight do.  Planar: the whole effect on the shipped scene.  Runs with and without
go in turn; medians, and the median of the ratios of neighbours.
"""

from __future__ import annotations

import statistics
import sys
import time
from collections.abc import Callable
from pathlib import Path
from unittest.mock import patch

import numpy as np

import passgraph as pg
from passgraph.backends.registry import backend_class
from passgraph.effects.planar_shadows.planar import planar_passes

sys.path.insert(0, str(Path(__file__).parent))
from harness import Ratio

BACKENDS = ("gl", "opencl", "numpy")
LAYERS = 8
KERNELS = """
class Corner:
    position: vec4

def place(vertex: Vertex, shift: float) -> Corner:
    return Corner(vec4(vertex.position.xy, shift, 1.0))

def dim(corner: Corner) -> vec4:
    return vec4(0.9, 0.9, 0.9, 1.0)
"""
PLACE = pg.vertex(source=KERNELS, name="place")
DIM = pg.fragment(source=KERNELS, name="dim")
MARK = pg.Stencil("always", 1, passed="replace")
ONCE = pg.Stencil("equal", 0, passed="invert")


def layers(stencil: pg.Stencil | None, shown: bool) -> pg.Target:
    """One draw of full-screen squares; ``shown`` blends them, else nothing but the stencil is written."""
    corners = np.tile([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], (LAYERS, 1))
    first = 4 * np.arange(LAYERS)[:, None, None]
    mesh = pg.Mesh.make(corners, (np.array([[0, 1, 2], [0, 2, 3]]) + first).reshape(-1, 3))
    made: pg.Target = pg.draw(
        mesh, vertex=PLACE, fragment=DIM, into=pg.target("color", "rgba16f", clear=1.0),
        depth=pg.target("depth", "depth32f_stencil8"), stencil=stencil, depth_compare="always", depth_write=False,
        blend="multiply" if shown else None, color_mask=(shown,) * 4, shift=pg.Value("shift", float),
    )  # fmt: skip
    return made


def planar(with_stencil: bool) -> pg.Target:
    """The whole effect; without the stencil, reflection and shadows leave the plane and shadows add up."""
    if with_stencil:
        return planar_passes(pg.Scene.shipped()).picture
    draw = pg.draw
    with patch.object(pg, "draw", lambda *given, stencil=None, **named: draw(*given, **named)):
        return planar_passes(pg.Scene.shipped()).picture


def by_shift(program: pg.Program, frame: int) -> None:
    program.run(shift=1e-4 * frame)


def by_camera(program: pg.Program, frame: int) -> None:
    camera = pg.Scene.shipped().camera
    eye = (camera.eye[0] + 1e-3 * frame, *camera.eye[1:])
    program.run(camera=pg.Camera(eye, camera.target, camera.up, camera.vertical_fov_rad, camera.near, camera.far))


def measure(
    pair: tuple[pg.Target, pg.Target], backend: str, size: tuple[int, int], runs: int,
    step: Callable[[pg.Program, int], None],
) -> tuple[float, float, float]:  # fmt: skip
    """Milliseconds with and without, and their ratio."""
    programs = [pg.compile(target, backend=backend, size=size) for target in pair]
    times: tuple[list[float], list[float]] = ([], [])
    for frame in range(runs + 1):
        for program, kept in zip(programs, times, strict=True):
            begin = time.perf_counter()
            step(program, frame)
            program.finish()
            if frame:
                kept.append(1e3 * (time.perf_counter() - begin))
    for program in programs:
        program.close()
    ratio = statistics.median(a / b for a, b in zip(*times, strict=True))
    return statistics.median(times[0]), statistics.median(times[1]), ratio


def cases() -> dict[str, tuple[tuple[pg.Target, pg.Target], Callable[[pg.Program, int], None]]]:
    """With and without, and what moves them from frame to frame."""
    return {
        "marking": ((layers(MARK, False), layers(None, False)), by_shift),
        "once": ((layers(ONCE, True), layers(None, True)), by_shift),
        "planar": ((planar(True), planar(False)), by_camera),
    }


def ratios(size: tuple[int, int] = (1280, 720), runs: int = 9, backends: tuple[str, ...] = BACKENDS) -> list[Ratio]:
    found = []
    for backend in backends:
        for name, (pair, step) in cases().items():
            stencil, none, ratio = measure(pair, backend, size, runs, step)
            found.append(Ratio(f"stencil, {name}, {backend}: with / without", ratio, None, stencil, none))
    return found


def main() -> None:
    width, height = (int(v) for v in (sys.argv[1] if len(sys.argv) > 1 else "1280x720").split("x"))
    runs = int(sys.argv[2]) if len(sys.argv) > 2 else 15
    print(f"{width}x{height}, medians of {runs} runs, ms")
    for backend in BACKENDS:
        print(f"{backend}: {backend_class(backend).devices()[0].name}")
        for name, (pair, step) in cases().items():
            stencil, none, ratio = measure(pair, backend, (width, height), runs, step)
            print(f"  {name:8} with stencil {stencil:8.2f}   without {none:8.2f}   ratio {ratio:.2f}")


if __name__ == "__main__":
    main()
