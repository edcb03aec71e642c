"""Tilt-shift against Gaussians summed pixel by pixel in float64, and what must stay as it is."""

from __future__ import annotations

from math import ceil, cos, sin
from typing import Any

import numpy as np
import pytest
from scipy import ndimage

import passgraph as pg
from passgraph.effects import tilt_shift
from tests.agreement import assert_within_bounds
from tests.conftest import DEVICES
from tests.effects.scenes import Float64, Picture, render

FRAME = pg.Input("frame")
every_backend = pytest.mark.parametrize("backend_name", ["reference", *DEVICES], indirect=True)


def picture(size: tuple[int, int]) -> Picture:
    """HDR, negative, any alpha."""
    return np.asarray(5.0 * np.random.default_rng(size[0]).random((*size, 4)) - 1.0, np.float32)


def shown(target: pg.Target, backend: str = "numpy", **given: Any) -> Float64:
    (made,) = render(target, size=None, backend=backend, **given).values()
    return made.astype(np.float64)


def sigmas(size: tuple[int, int], y: float, angle: float, band: float, most: float) -> Float64:
    """By the distance from a line in the plane, its rows counted upward, in heights."""
    row, column = np.mgrid[: size[0], : size[1]] + 0.5
    right, up = (column - size[1] / 2) / size[0], y - row / size[0]
    away = np.abs(up * cos(angle) - right * sin(angle))
    return np.asarray(most * np.clip(2.0 * (away - band / 2), 0.0, 1.0))


def expected(frame: Picture, sigma: Float64, most: float) -> Float64:
    made = frame.astype(np.float64)
    for axis in (1, 0):
        around = np.pad(made, [(99, 99) if a == axis else (0, 0) for a in range(3)], "edge")
        after = made.copy()
        for at in np.argwhere(sigma >= 0.1):
            s = sigma[tuple(at)]
            reach = min(int(3 * s) + 1, ceil(3 * most))
            weights = np.exp(-0.5 * (np.arange(-reach, reach + 1) / s) ** 2)
            first = at[axis] + 99 - reach
            taps = np.take(around, range(first, first + 2 * reach + 1), axis)
            after[tuple(at)] = weights / weights.sum() @ (taps[at[0]] if axis == 1 else taps[:, at[1]])
        made = after
    return made


@every_backend
@pytest.mark.parametrize("size", [(1, 1), (24, 16), (17, 31)], ids=str)
def test_each_pixel_has_a_gaussian_of_its_own_width(size: tuple[int, int], backend_name: str) -> None:
    frame, lens = picture(size), (0.6, 0.4, 0.2)
    made = tilt_shift(FRAME, pg.Value("y"), pg.Value("angle"), pg.Value("band"), 2.5)
    given = dict(zip(("y", "angle", "band"), lens, strict=True))
    np.testing.assert_allclose(
        shown(made, backend_name, frame=frame, **given), expected(frame, sigmas(size, *lens, 2.5), 2.5), atol=2e-5
    )


def test_far_from_the_band_it_is_the_blur_of_scipy() -> None:
    frame = picture((80, 40))
    made = shown(tilt_shift(FRAME, -1.0, 0.0, 0.0, 2.0), frame=frame)
    whole = frame.astype(np.float64)
    for axis in (0, 1):
        whole = ndimage.gaussian_filter1d(whole, 2.0, axis, mode="nearest", radius=6)
    np.testing.assert_allclose(made, whole, atol=1e-5)


@every_backend
def test_the_band_stays_to_the_bit(backend_name: str) -> None:
    frame = picture((40, 30))
    made = shown(tilt_shift(FRAME, 0.5, 0.0, 0.3), backend_name, frame=frame)
    np.testing.assert_array_equal(made[14:26], frame[14:26])
    assert np.abs(made - frame)[:10].mean() > 0.5
    assert tilt_shift(FRAME, sigma_px=0.0) is FRAME


def test_even_pictures_stay_even_and_a_band_may_stand_upright() -> None:
    even = np.full((17, 31, 4), (0.5, 3.0, -1.0, 0.25), np.float32)
    np.testing.assert_allclose(shown(tilt_shift(FRAME), frame=even), even, rtol=1e-6)
    frame = picture((30, 30))
    upright = shown(tilt_shift(FRAME, 0.5, np.pi / 2), frame=frame)
    np.testing.assert_allclose(upright[:, 14:16], frame[:, 14:16], atol=1e-6)


def test_tilt_shift_within_bounds_of_the_reference() -> None:
    assert_within_bounds(tilt_shift(FRAME, 0.4, 0.3, sigma_px=2.0), frame=picture((13, 17)))
