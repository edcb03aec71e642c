"""FSR 1 against its formulas in NumPy, and what enlarging and sharpening must keep."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import passgraph as pg
from passgraph.effects import fsr1
from tests.conftest import DEVICES

Float64 = NDArray[np.float64]
Picture = NDArray[np.float32]
FRAME = pg.Input("frame")
every_backend = pytest.mark.parametrize("backend_name", ["reference", *DEVICES], indirect=True)
#: (width, height) before and after: twice, less, as much, and what has hardly a pixel.
SIZES = [((24, 17), (48, 34)), ((25, 19), (33, 28)), ((11, 9), (11, 9)), ((1, 1), (3, 2)), ((2, 5), (7, 9))]


def shown(graph: Any, backend: str, **given: Any) -> Picture:
    with pg.compile(graph, backend=backend, non_finite="keep") as program:
        return np.array(program(**given)["fsr1"])


def picture(size: tuple[int, int]) -> Picture:
    """Smooth edges at several angles, flat places, a little noise, and alpha."""
    x, y = np.meshgrid(np.arange(size[0]), np.arange(size[1]))
    ramps = np.stack([1.3 * x - 9.0, 0.7 * y - 4.0, 0.6 * x - 0.5 * y, 0.4 * x + 0.3 * y - 5.0], axis=-1)
    noise = np.random.default_rng(2).normal(0.0, 0.02, ramps.shape)
    return np.clip(0.5 + 0.45 * np.tanh(ramps) + noise, 0.02, 0.98).astype(np.float32)


def easu(frame: Picture, after: tuple[int, int]) -> Float64:
    """The description of AMD's header, texel by texel; four rows of letters around f, g, j and k."""
    height, width = frame.shape[:2]
    luma = frame[..., 0] * 0.5 + frame[..., 1].astype(np.float64) + frame[..., 2] * 0.5
    made = np.zeros((after[1], after[0], 4))
    for row, column in np.ndindex(made.shape[:2]):
        px, py = (column + 0.5) * width / after[0] - 0.5, (row + 0.5) * height / after[1] - 0.5
        fx, fy = int(np.floor(px)), int(np.floor(py))
        px, py = px - fx, py - fy

        def at(dx: int, dy: int, fx: int = fx, fy: int = fy) -> tuple[int, int]:
            return int(np.clip(fy + dy, 0, height - 1)), int(np.clip(fx + dx, 0, width - 1))

        direction, length = np.zeros(2), 0.0
        for dx, dy, weight in (
            (0, 0, (1 - px) * (1 - py)), (1, 0, px * (1 - py)), (0, 1, (1 - px) * py), (1, 1, px * py)
        ):  # fmt: skip
            c = luma[at(dx, dy)]
            for axis, (before, behind) in enumerate(
                ((luma[at(dx - 1, dy)], luma[at(dx + 1, dy)]), (luma[at(dx, dy - 1)], luma[at(dx, dy + 1)]))
            ):
                direction[axis] += (behind - before) * weight
                most = max(abs(behind - c), abs(c - before), 1 / 65536)
                length += np.clip(abs(behind - before) / most, 0.0, 1.0) ** 2 * weight
        steep = direction @ direction
        direction = direction / np.sqrt(steep) if steep >= 1 / 32768 else np.array([1.0, 0.0])
        length = (length / 2) ** 2
        stretch = 1.0 / np.abs(direction).max()
        across, along = 1 + (stretch - 1) * length, 1 - length / 2
        lobe = 0.5 + (0.25 - 0.04 - 0.5) * length
        color, total = np.zeros(4), 0.0
        for dx, dy in [(0, -1), (1, -1), *((x, y) for y in (0, 1) for x in (-1, 0, 1, 2)), (0, 2), (1, 2)]:
            out = np.array([dx - px, dy - py])
            v = np.array([out @ direction * across, (out[1] * direction[0] - out[0] * direction[1]) * along])
            d2 = min(v @ v, 1 / lobe)
            weight = (25 / 16 * (2 / 5 * d2 - 1) ** 2 - (25 / 16 - 1)) * (lobe * d2 - 1) ** 2
            color, total = color + frame[at(dx, dy)].astype(np.float64) * weight, total + weight
        around = np.array([frame[at(dx, dy)] for dx in (0, 1) for dy in (0, 1)])
        made[row, column] = np.clip(color / total, around.min(axis=0), around.max(axis=0))
    return made


def rcas(frame: Float64, stops: float) -> Float64:
    padded = np.pad(frame, ((1, 1), (1, 1), (0, 0)), mode="edge")
    ring = np.stack([padded[:-2, 1:-1], padded[2:, 1:-1], padded[1:-1, :-2], padded[1:-1, 2:]])[..., :3]
    e = frame[..., :3]
    low, high = ring.min(axis=0), ring.max(axis=0)
    hit_low = np.minimum(low, e) / (4 * high)
    hit_high = (1 - np.maximum(high, e)) / (4 * low - 4)
    lobe = np.maximum(-0.1875, np.minimum(np.maximum(-hit_low, hit_high).max(axis=-1, keepdims=True), 0.0))
    lobe = lobe * 2.0**-stops
    return np.concatenate([(ring.sum(axis=0) * lobe + e) / (4 * lobe + 1), frame[..., 3:]], axis=-1)


@pytest.mark.sampled
@every_backend
@pytest.mark.parametrize(("before", "after"), SIZES, ids=str)
def test_it_is_its_formulas(before: tuple[int, int], after: tuple[int, int], backend_name: str) -> None:
    frame = picture(before)
    into = pg.target("fsr1", "rgba32f", after)
    larger = easu(frame, after)
    np.testing.assert_allclose(
        shown(fsr1(FRAME, sharpness=0.0, into=into), backend_name, frame=frame), larger, atol=2e-5
    )
    made = shown(fsr1(FRAME, sharpness=2.0**-0.2, into=into), backend_name, frame=frame)
    np.testing.assert_allclose(made, rcas(larger, 0.2), atol=5e-5)


@every_backend
def test_no_channel_leaves_the_range_of_what_is_around(backend_name: str) -> None:
    """Of the nearest four without sharpening; from 0 to 1 with all of it, and of one color no bit changes."""
    frame = np.round(picture((21, 15)) * 2.0) * 0.5
    made = shown(fsr1(FRAME, 2.0, 1.0), backend_name, frame=frame.astype(np.float32))
    assert made.min() >= 0.0
    assert made.max() <= 1.0
    even = np.full((7, 9, 4), 0.25, np.float32)
    np.testing.assert_allclose(shown(fsr1(FRAME, 1.7, 1.0), backend_name, frame=even), 0.25, rtol=1e-6)


@every_backend
def test_light_outside_of_the_range_is_enlarged_and_not_sharpened(backend_name: str) -> None:
    frame = picture((20, 16)) * np.float32(40.0) - np.float32(10.0)
    plain, sharp = (shown(fsr1(FRAME, 2.0, share), backend_name, frame=frame) for share in (0.0, 1.0))
    assert np.isfinite(plain).all()
    outside = ~((plain > 0.0) & (plain < 1.0))[..., :3].any(axis=-1)
    assert outside.sum() > 100
    np.testing.assert_array_equal(sharp[outside], plain[outside])


@every_backend
def test_a_mirrored_picture_gives_the_mirrored_one(backend_name: str) -> None:
    frame = picture((18, 13))
    made = shown(fsr1(FRAME), backend_name, frame=frame)
    mirrored = shown(fsr1(FRAME), backend_name, frame=np.ascontiguousarray(frame[::-1, ::-1]))
    np.testing.assert_allclose(mirrored[::-1, ::-1], made, atol=2e-5)


def test_edges_are_smoother_than_by_a_filter_that_sees_none() -> None:
    """A slanted edge with smooth pixels, twice as large, against itself sampled as finely."""
    from passgraph.effects import resize

    def edge(size: int, per_pixel: int) -> Picture:
        n = size * per_pixel * 4
        x, y = np.meshgrid((np.arange(n) + 0.5) / n * size, (np.arange(n) + 0.5) / n * size)
        value = ((x - 0.35 * y) > size / 3).astype(np.float64).reshape(size * per_pixel, 4, size * per_pixel, 4)
        return np.repeat(value.mean(axis=(1, 3))[..., None], 4, axis=2).astype(np.float32)

    frame, truth = edge(32, 1), edge(32, 2)
    made = shown(fsr1(FRAME, 2.0, 0.0), "numpy", frame=frame)
    other = shown(resize(FRAME, 2.0, "bilinear", into=pg.target("fsr1", "rgba32f", (64, 64))), "numpy", frame=frame)
    error, without = (float(np.sqrt(np.mean((one - truth)[4:-4, 4:-4] ** 2))) for one in (made, other))
    assert error < 0.7 * without
