"""Radial blur against means of SciPy's bilinear reads, and pictures that zooms and turns leave as they are."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy import ndimage

import passgraph as pg
from passgraph.effects import radial_blur
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


def mean(image: Float64, times: Float64, zoom: float, spin: float, place: tuple[float, float]) -> Float64:
    """Of the picture, zoomed and turned about a place, at these times."""
    rows, columns = image.shape[:2]
    y, x = np.mgrid[:rows, :columns] + 0.5
    away = (x - place[0] * columns) + 1j * (y - place[1] * rows)
    total = np.zeros_like(image)
    for t in times:
        there = away * (1.0 + zoom) ** t * np.exp(1j * spin * t)
        at = np.stack([there.imag + place[1] * rows - 0.5, there.real + place[0] * columns - 0.5])
        total += np.dstack([ndimage.map_coordinates(c, at, order=1, mode="nearest") for c in image.transpose(2, 0, 1)])
    return total / len(times)


EIGHT = np.arange(8) - 3.5


@every_backend
@pytest.mark.parametrize("motion", [(0.3, 0.0), (0.0, -0.5), (0.2, 0.4)], ids=["zoom", "spin", "both"])
@pytest.mark.parametrize("size", [(1, 1), (24, 16), (17, 31)], ids=str)
def test_it_is_the_mean_over_an_exposure(size: tuple[int, int], motion: tuple[float, float], backend_name: str) -> None:
    frame, place = picture(size), (0.6, 0.3)
    made = radial_blur(FRAME, pg.Value("zoom"), pg.Value("spin"), pg.Value("x"), pg.Value("y"))
    given = dict(zip(("zoom", "spin", "x", "y"), (*motion, *place), strict=True))
    expected = mean(mean(frame.astype(np.float64), EIGHT / 64.0, *motion, place), EIGHT / 8.0, *motion, place)
    np.testing.assert_allclose(shown(made, backend_name, frame=frame, **given), expected, atol=2e-4)


def test_two_passes_are_one_mean_of_64_times() -> None:
    """But for what is read between texels twice."""
    y, x = np.mgrid[:60, :80]
    frame = np.repeat((1.0 + np.sin(0.2 * x + 0.1 * y))[..., None], 4, axis=2).astype(np.float32)
    one = mean(frame.astype(np.float64), (np.arange(64) - 31.5) / 64.0, 0.2, 0.3, (0.5, 0.5))
    made = shown(radial_blur(FRAME, 0.2, 0.3), frame=frame)
    # each bilinear read takes up to an eighth of the second difference
    assert np.abs(made - one)[12:-12, 12:-12].max() < 2 * 0.125 * (0.2**2 + 0.1**2) + 1e-3


def test_rings_stay_when_turned_and_rays_when_zoomed() -> None:
    y, x = np.mgrid[:81, :81] - 40.0
    rings = np.repeat(np.sin(0.3 * np.hypot(x, y))[..., None], 4, axis=2).astype(np.float32)
    rays = np.repeat(np.sin(4.0 * np.arctan2(y, x))[..., None], 4, axis=2).astype(np.float32)
    inside = (np.hypot(x, y) < 30.0) & (np.hypot(x, y) > 12.0)
    for frame, still, moved in ((rings, (0.0, 1.0), (0.3, 0.0)), (rays, (0.3, 0.0), (0.0, 1.0))):
        assert np.abs(shown(radial_blur(FRAME, *still), frame=frame) - frame)[inside].max() < 0.04
        assert np.abs(shown(radial_blur(FRAME, *moved), frame=frame) - frame)[inside].mean() > 0.08


@every_backend
def test_the_place_stays_and_without_motion_all(backend_name: str) -> None:
    frame = picture((17, 31))
    np.testing.assert_allclose(shown(radial_blur(FRAME, 0.0), backend_name, frame=frame), frame, atol=2e-4)
    made = shown(radial_blur(FRAME, 0.3, 0.3, 10.5 / 31, 7.5 / 17), backend_name, frame=frame)
    np.testing.assert_allclose(made[7, 10], frame[7, 10], atol=2e-4)


def test_radial_blur_within_bounds_of_the_reference() -> None:
    assert_within_bounds(radial_blur(FRAME, 0.1, 0.1), frame=picture((9, 13)))
