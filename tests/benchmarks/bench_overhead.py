"""What a pass costs besides its pixels: the host's time, from graphs of many passes over one small picture.

    python tests/benchmarks/bench_overhead.py

Time of a run with many passes less that of a run with one, over the number of passes more; a run ends when the
device has finished.  Passes are not fused, and each has a parameter that changes from run to run.
"""

from __future__ import annotations

import statistics
import sys
from pathlib import Path

import numpy as np

import passgraph as pg

sys.path.insert(0, str(Path(__file__).parent))
from harness import Job, Ratio, interleaved

#: Pixels of the picture: a single texel, so that a pass has next to nothing to compute.
SIZE = (1, 1)
FEW, MANY = 1, 41
#: Microseconds a pass on the host.
WANTED = 30.0
STEP = pg.kernel(source="def step(c: Image, by: float) -> vec4: return c[0, 0] * by")


def program(passes: int, backend: str, size: tuple[int, int] = SIZE) -> pg.Program:
    """A chain of passes, none of them fused."""
    target: pg.Input | pg.Target = pg.Input("frame", "rgba32f", size, static=True)
    by = pg.Value("by", float)
    for number in range(passes):
        target = STEP(target, by, into=pg.target(f"step{number}", "rgba32f"))
    return pg.compile(target, backend=backend, options=pg.Options(fuse=False))


def runs(made: pg.Program, size: tuple[int, int] = SIZE) -> Job:
    """One run with another value each time."""
    picture = np.ones((size[1], size[0], 4), np.float32)
    values = iter(range(1 << 30))

    def run() -> None:
        made.run(frame=picture, by=1.0 + 1e-6 * next(values))
        made.finish()

    return run


def ratios(rounds: int = 41) -> list[Ratio]:
    found = []
    for backend in ("numpy", "gl", "opencl"):
        with program(FEW, backend) as few, program(MANY, backend) as many:
            times = interleaved({"few": runs(few), "many": runs(many)}, rounds, warm_up=3)
        each = [1e3 * (b - a) / (MANY - FEW) for a, b in zip(times["few"], times["many"], strict=True)]
        found.append(Ratio(f"a pass of one pixel, {backend}", statistics.median(each), WANTED, unit="µs"))
        print(f"{backend:8} {found[-1].got:7.1f} µs a pass")
    return found


if __name__ == "__main__":
    ratios()
