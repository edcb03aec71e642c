"""Whole calls on ``numpy``, from an array of bytes to an array of bytes, beside OpenCV and a parallel copy.

    python tests/benchmarks/bench_arrays.py [rounds]

1920 x 1080, two sizes of pixel: RGBA, and RGB as OpenCV and Pillow hold pictures.  Results are written into arrays that
are there already, for both sides.
"""

from __future__ import annotations

import sys
from typing import Any

import numpy as np
from bench_numpy import parallel_copy
from harness import Job, Ratio, interleaved, ratio_of

import passgraph as pg
from passgraph.effects import black_and_white, gaussian_blur

SIZE = (1920, 1080)
RADIUS, SIGMA = 7, 3.0


def call(effect: Any, frame: np.ndarray, **options: Any) -> Job:
    """The whole of a run: the caller's picture in, the caller's picture out."""
    format = f"{'rgba'[: frame.shape[2]]}8"
    program = pg.compile(effect(pg.Input("frame"), into=pg.target("made", format), **options))
    room = np.empty_like(frame)
    return lambda: program(frame=frame, into={"made": room})


def jobs() -> dict[str, Job]:
    import cv2

    four = np.random.default_rng(0).integers(0, 256, (SIZE[1], SIZE[0], 4), np.uint8)
    three = np.ascontiguousarray(four[..., :3])
    grey, back, soft = np.empty(SIZE[::-1], np.uint8), np.empty_like(four), np.empty_like(four)

    def there_and_back() -> None:
        cv2.cvtColor(four, cv2.COLOR_RGBA2GRAY, dst=grey)
        cv2.cvtColor(grey, cv2.COLOR_GRAY2RGBA, dst=back)

    return {
        "copy": parallel_copy(four, np.empty_like(four)),
        "OpenCV grey": there_and_back,
        "OpenCV blur": lambda: cv2.GaussianBlur(four, (2 * RADIUS + 1,) * 2, SIGMA, dst=soft),
        "grey": call(black_and_white, four),
        "grey, RGB": call(black_and_white, three),
        "blur": call(gaussian_blur, four, sigma_px=SIGMA, radius_px=RADIUS),
        "blur, RGB": call(gaussian_blur, three, sigma_px=SIGMA, radius_px=RADIUS),
    }


#: Ours, the other, the most that ours may take of it.
ASKED = (
    ("grey", "copy", 2.0),
    ("grey", "OpenCV grey", 1.0),
    ("grey, RGB", "grey", 1.3),
    ("blur", "OpenCV blur", 0.6),
    ("blur, RGB", "blur", None),
)


def ratios(rounds: int) -> list[Ratio]:
    times = interleaved(jobs(), rounds, warm_up=3)
    return [ratio_of(f"{ours} / {other}", times[ours], times[other], most) for ours, other, most in ASKED]


if __name__ == "__main__":
    for ratio in ratios(int(sys.argv[1]) if len(sys.argv) > 1 else 60):
        wanted = "" if ratio.wanted is None else f" (wanted {ratio.wanted})"
        print(f"{ratio.what:22} {ratio.got:5.2f}{wanted}   {ratio.ms:.2f} ms / {ratio.other_ms:.2f} ms")
