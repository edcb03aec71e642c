"""Pixel passes on ``numpy`` beside their peers at 1920 x 1080, in turn in one process: medians and ratios.

    python tests/benchmarks/bench_cpu_table.py [rounds]

Ratios are of medians within a round; of several rounds the smallest is printed last, since other load on the machine
only ever adds to it.  Needs opencv-python-headless, halide and a GL driver (llvmpipe).
"""

from __future__ import annotations

import statistics
import sys
import time
from collections.abc import Callable
from typing import Any

import numpy as np
from bench_numpy import parallel_copy
from numba import njit, prange

import passgraph as pg
from passgraph.effects import black_and_white, gaussian_blur
from passgraph.effects.filters.blur import depth_aware_blur, gaussian_weights

SIZE = (1920, 1080)
RUNS = 9
RADIUS = 7
Job = Callable[[], object]


def compare_kernel(radius: int) -> Any:
    """Percentage-closer filtering: how many texels around a place lie behind this pixel."""

    @pg.kernel
    def lit(place: pg.Image, shadow_map: pg.Image) -> pg.vec4:
        p = place[0, 0]
        at = pg.ivec2(p.xy)
        total = 0.0
        for i in range(-radius, radius + 1):
            for j in range(-radius, radius + 1):
                total += 1.0 if shadow_map.texel(at + pg.ivec2(i, j)).r >= p.z else 0.0
        return pg.vec4(total / ((2.0 * radius + 1.0) * (2.0 * radius + 1.0)))

    return lit


def steps(output: pg.Target, pictures: dict[str, Any], backend: str = "numpy") -> Job:
    """A frame without its uploads, which are copies of their own.

    ``numpy`` reads pictures in place and drops them after each run, so it is given them again.
    """
    program = pg.compile(output, backend=backend, non_finite="keep")
    program.run(**pictures)
    if backend == "numpy":
        return lambda: program.run(**pictures)
    execution = program._execution
    assert execution is not None
    values = execution._values({})

    def frame() -> None:
        for unit in execution.units:
            unit.execute(values)
        program.finish()

    return frame


def halide_gaussian(picture: np.ndarray) -> Job:
    """Both directions in one pipeline over interleaved numbers: tiles in parallel, each with a copy of its rows that is
    clamped once, vectors of sixteen.  The quickest of nine schedules tried, among them sliding windows of rows."""
    import halide as hl

    width, height = SIZE[0] * 4, SIZE[1]
    source = hl.Buffer(picture.reshape(height, width))
    weights = [hl.f32(float(np.float32(weight))) for weight in gaussian_weights(3.0, RADIUS)]
    i, y, column, strip, inner, row = (hl.Var(name) for name in ("i", "y", "column", "strip", "inner", "row"))
    padded, across, down = hl.Func("padded"), hl.Func("across"), hl.Func("down")
    place = hl.select(i < 0, i & 3, i >= width, width - 4 + (i & 3), hl.likely(i))
    padded[i, y] = source[hl.unsafe_promise_clamped(place, 0, width - 1), hl.clamp(y, 0, height - 1)]
    total = padded[i, y] * weights[0]
    for tap in range(1, RADIUS + 1):
        total += (padded[i + 4 * tap, y] + padded[i - 4 * tap, y]) * weights[tap]
    across[i, y] = total
    total = across[i, y] * weights[0]
    for tap in range(1, RADIUS + 1):
        total += (across[i, y + tap] + across[i, y - tap]) * weights[tap]
    down[i, y] = total
    down.tile(i, y, column, strip, inner, row, 640, 135).parallel(strip).vectorize(inner, 16)
    across.compute_at(down, column).vectorize(i, 16)
    padded.compute_at(across, y).vectorize(i, 16)
    result = hl.Buffer(np.empty((height, width), np.float32))
    down.compile_jit(hl.get_jit_target_from_environment())
    return lambda: down.realize(result)


@njit(parallel=True)
def plain_blur(mask: Any, depth: Any, result: Any, tolerance: Any, dx: Any, dy: Any) -> None:  # type: ignore[no-untyped-def]
    """The depth-aware blur as one would write it down: every tap clamped, one pixel after another."""
    height, width = depth.shape
    one, zero, least = np.float32(1.0), np.float32(0.0), np.float32(1e-30)
    for y in prange(height):
        for x in range(width):
            here = one / max(depth[y, x], least)
            ahead = one / max(depth[min(y + dy, height - 1), min(x + dx, width - 1)], least) - here
            behind = here - one / max(depth[max(y - dy, 0), max(x - dx, 0)], least)
            slope = ahead if abs(ahead) < abs(behind) else behind
            r, g, b, a = mask[y, x, 0], mask[y, x, 1], mask[y, x, 2], mask[y, x, 3]
            weight = one
            scale = one / max(tolerance * here, least)
            for i in range(1, RADIUS + 1):
                t = np.float32(i) / np.float32(RADIUS + 1)
                window = (one - t * t) * (one - t * t)
                for side in range(2):
                    s = i - 2 * i * side
                    u, v = min(max(x + s * dx, 0), width - 1), min(max(y + s * dy, 0), height - 1)
                    off = abs(one / max(depth[v, u], least) - here - slope * np.float32(s)) * scale
                    w = window * max(one - off, zero)
                    r += mask[v, u, 0] * w
                    g += mask[v, u, 1] * w
                    b += mask[v, u, 2] * w
                    a += mask[v, u, 3] * w
                    weight += w
            result[y, x, 0], result[y, x, 1] = r / weight, g / weight
            result[y, x, 2], result[y, x, 3] = b / weight, a / weight


def numba_depth_aware(mask: np.ndarray, depth: np.ndarray) -> Job:
    between, result, tolerance = np.empty_like(mask), np.empty_like(mask), np.float32(0.05)

    def frame() -> None:
        plain_blur(mask, depth, between, tolerance, 1, 0)
        plain_blur(between, depth, result, tolerance, 0, 1)

    return frame


def opencv_gaussian(picture: np.ndarray) -> Job:
    import cv2

    weights = cv2.getGaussianKernel(2 * RADIUS + 1, 3, cv2.CV_32F)
    result = np.empty_like(picture)
    return lambda: cv2.sepFilter2D(picture, -1, weights, weights, result, borderType=cv2.BORDER_REPLICATE)


def jobs() -> tuple[dict[str, Job], list[tuple[str, str, float]]]:
    """What is timed, and which ratios are asked for."""
    width, height = SIZE
    random = np.random.default_rng(0)
    picture = random.random((height, width, 4), np.float32)
    y, x = np.mgrid[:height, :width].astype(np.float32)
    depth = np.float32(5.0) + np.float32(0.01) * y + np.float32(3.0) * (np.floor(x / 100) % 2)
    place = np.stack([x + 3.0 * random.random(x.shape), y + 3.0 * random.random(x.shape), depth, depth], 2)
    place = np.ascontiguousarray(place, np.float32)
    frame = pg.Input("frame", "rgba32f", SIZE)
    deep = pg.Input("depth", "r32f", SIZE)
    at, shadow_map = pg.Input("place", "rgba32f", SIZE), pg.Input("map", "r32f", SIZE)
    flat = picture.ravel()
    made: dict[str, Job] = {
        "parallel copy": parallel_copy(flat, np.empty_like(flat)),
        "B&W": steps(black_and_white(frame, into=pg.target("gray", "rgba32f")), {"frame": picture}),
        "Gaussian": steps(gaussian_blur(frame, 3.0, RADIUS), {"frame": picture}),
        "Gaussian, Halide": halide_gaussian(picture),
        "Gaussian, OpenCV": opencv_gaussian(picture),
        "depth-aware": steps(depth_aware_blur(frame, deep, RADIUS), {"frame": picture, "depth": depth}),
        "depth-aware, numba": numba_depth_aware(picture, depth),
    }
    asked = [
        ("B&W", "parallel copy", 1.3),
        ("Gaussian", "Gaussian, Halide", 1.0),
        ("Gaussian", "Gaussian, OpenCV", 0.4),
        ("depth-aware", "depth-aware, numba", 0.5),
    ]
    given = {"place": place, "map": depth}
    for radius in (1, 2):
        lit = compare_kernel(radius)(at, shadow_map, into=pg.target("lit", "rgba32f"))
        name = f"compare {2 * radius + 1}x{2 * radius + 1}"
        made[name], made[f"{name}, llvmpipe"] = steps(lit, given), steps(lit, given, "gl")
        asked.append((name, f"{name}, llvmpipe", 0.25))
    return made, asked


def medians(made: dict[str, Job]) -> tuple[dict[str, float], dict[str, float]]:
    """Milliseconds of each job by the clock and of all cores, run in turn so that drift meets all alike."""
    clocks = (time.perf_counter, time.process_time)
    times: list[dict[str, list[float]]] = [{name: [] for name in made} for _ in clocks]
    for _ in range(RUNS):
        for name, job in made.items():
            begin = [clock() for clock in clocks]
            job()
            for column, clock, start in zip(times, clocks, begin, strict=True):
                column[name].append(clock() - start)
    wall, cores = ({name: statistics.median(values) * 1e3 for name, values in column.items()} for column in times)
    return wall, cores


def main(rounds: int) -> dict[str, float]:
    made, asked = jobs()
    for job in made.values():
        job()
    seen = [medians(made) for _ in range(rounds)]
    for name in made:
        print(f"{name:22}", *(f"{wall[name]:8.2f} ({cores[name]:7.2f})" for wall, cores in seen), "ms (of all cores)")
    least = {}
    for ours, peer, most in asked:
        ratios = [(wall[ours] / wall[peer], cores[ours] / cores[peer]) for wall, cores in seen]
        by_clock, by_cores = (min(column) for column in zip(*ratios, strict=True))
        least[f"{ours} / {peer}"] = by_clock
        columns = " ".join(f"{clock:5.2f} ({core:5.2f})" for clock, core in ratios)
        print(f"{ours + ' / ' + peer:38} {columns}  least {by_clock:5.2f} ({by_cores:5.2f}), at most {most}")
    return least


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 3)
