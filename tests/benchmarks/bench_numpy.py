"""B&W and a 15-tap Gaussian on ``numpy`` beside a parallel copy and OpenCV: medians and ratios of one process.

python tests/benchmarks/bench_numpy.py
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

import numpy as np

import passgraph as pg
from passgraph.backends.numpy.machine.workers import thread_count
from passgraph.effects import black_and_white, gaussian_blur

SIZE = (1920, 1080)
RUNS = 25


def interleaved(jobs: dict[str, Callable[[], object]]) -> dict[str, float]:
    """Median milliseconds of each job, run in turn so that the machine's drift meets all alike."""
    times: dict[str, list[float]] = {name: [] for name in jobs}
    for job in jobs.values():
        job()
    for _ in range(RUNS):
        for name, job in jobs.items():
            begin = time.perf_counter()
            job()
            times[name].append(time.perf_counter() - begin)
    return {name: statistics.median(values) * 1e3 for name, values in times.items()}


def parallel_copy(source: np.ndarray, target: np.ndarray) -> Callable[[], object]:
    count = thread_count()
    pool = ThreadPoolExecutor(count)
    parts = list(zip(np.array_split(source, count), np.array_split(target, count), strict=True))
    return lambda: list(pool.map(lambda part: np.copyto(part[1], part[0]), parts))


def main() -> dict[str, float]:
    import cv2

    picture = np.random.default_rng(0).random((SIZE[1], SIZE[0], 4), np.float32)
    frame = pg.Input("frame", "rgba32f", SIZE)
    gray = pg.compile(black_and_white(frame, into=pg.target("gray", "rgba32f")), backend="numpy", non_finite="keep")
    blur = pg.compile(gaussian_blur(frame, sigma_px=3.0, radius_px=7), backend="numpy", non_finite="keep")
    weights = cv2.getGaussianKernel(15, 3, cv2.CV_32F)
    flat = picture.ravel()
    jobs = {
        "parallel copy": parallel_copy(flat, np.empty_like(flat)),
        "B&W": lambda: gray.run(frame=picture),
        "Gaussian 15": lambda: blur.run(frame=picture),
        "OpenCV sepFilter2D 15": lambda: cv2.sepFilter2D(
            picture, -1, weights, weights, borderType=cv2.BORDER_REPLICATE
        ),
    }
    times = interleaved(jobs)
    for name, value in times.items():
        print(f"{name:24} {value:7.2f} ms")
    print(f"B&W / parallel copy      {times['B&W'] / times['parallel copy']:7.2f} (at most 2)")
    print(f"Gaussian / OpenCV        {times['Gaussian 15'] / times['OpenCV sepFilter2D 15']:7.2f} (at most 1)")
    return times


if __name__ == "__main__":
    main()
