"""What every number of a picture takes part in: a histogram, sums and medians, beside NumPy and OpenCV.

    python tests/benchmarks/bench_counts.py [rounds]

The histogram is of 1280 x 720 bytes, sums of 1920 x 1080 pixels of four float32, medians of as many bytes.
"""

from __future__ import annotations

import sys

import numpy as np
from harness import Job, Ratio, interleaved, ratio_of

import passgraph as pg
from passgraph.effects import median

#: What a histogram may take of NumPy's count; of OpenGL nothing is asked, which may be software.
ASKED: dict[str, float | None] = {"numpy": 2.0, "opencl": 2.0, "gl": None}


def jobs() -> dict[str, Job]:
    import cv2

    random = np.random.default_rng(0)
    small = random.integers(0, 256, (720, 1280), np.uint8)
    bytes_, colours = random.integers(0, 256, (1080, 1920), np.uint8), random.random((1080, 1920, 4), np.float32)
    made: dict[str, Job] = {
        "np.bincount": lambda: np.bincount(small.ravel(), minlength=256),
        "np.sum": lambda: colours.sum((0, 1)),
        "OpenCV median": lambda: cv2.medianBlur(bytes_, 3),
    }
    for backend in ASKED:
        counts = pg.compile(pg.histogram(pg.Input("frame", "r8"), channel=0), backend=backend)
        total = pg.compile(pg.reduce(pg.Input("frame", "rgba32f"), "sum"), backend=backend)
        made[f"histogram, {backend}"] = lambda counts=counts: counts(frame=small)
        made[f"sum, {backend}"] = lambda total=total: total(frame=colours)
    middle, room = pg.compile(median(pg.Input("frame", "r8"), into=pg.target("made", "r8"))), np.empty_like(bytes_)
    made["median of bytes"] = lambda: middle(frame=bytes_, into={"made": room})
    return made


def ratios(rounds: int) -> list[Ratio]:
    times = interleaved(jobs(), rounds, warm_up=3)
    rows: list[tuple[str, str, float | None]] = []
    for backend, most in ASKED.items():
        rows += [(f"histogram, {backend}", "np.bincount", most), (f"sum, {backend}", "np.sum", 1.0)]
    rows.append(("median of bytes", "OpenCV median", 1.5))
    return [ratio_of(f"{ours} / {other}", times[ours], times[other], most) for ours, other, most in rows]


if __name__ == "__main__":
    for ratio in ratios(int(sys.argv[1]) if len(sys.argv) > 1 else 25):
        wanted = "" if ratio.wanted is None else f" (wanted {ratio.wanted})"
        print(f"{ratio.what:36} {ratio.got:5.2f}{wanted}   {ratio.ms:.2f} ms / {ratio.other_ms:.2f} ms")
