"""Bloom: its energy, what it leaves alone, and every backend against the reference."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import pytest

import passgraph as pg
from passgraph.effects import bloom
from tests.agreement import assert_within_bounds
from tests.effects.scenes import Picture

FRAME = pg.Input("frame")


def run(picture: Picture, backend: str = "reference", **options: float) -> Picture:
    with pg.compile(bloom(FRAME, **options), backend=backend, non_finite="keep") as program:  # type: ignore[arg-type]
        return program(frame=picture)["bloom"]


def noise(height: int = 37, width: int = 50) -> Picture:
    return np.random.default_rng(8).random((height, width, 4), np.float32) * 3


def test_intensity_0_leaves_the_picture_as_it_is() -> None:
    np.testing.assert_array_equal(run(noise(), intensity=0.0), noise())


def test_what_is_below_the_threshold_does_not_glow() -> None:
    np.testing.assert_array_equal(run(noise(), threshold=3.0, softness=0.0), noise())
    np.testing.assert_array_equal(run(noise() / 2, threshold=3.0), noise() / 2)


@pytest.mark.parametrize(
    ("top", "glow"),
    [(0.4, 0.0), (0.5, 0.0), (0.75, 0.25**2 / 2), (1.0, 0.125), (1.25, 0.75**2 / 2), (1.5, 0.5), (3.0, 2.0)],
)
def test_light_near_the_threshold_glows_less(top: float, glow: float) -> None:
    """The excess is a parabola from 0.5 to 1.5, which has the values and the slopes of both lines at its ends."""
    picture = np.full((16, 16, 4), top, np.float32)
    shown = run(picture, threshold=1.0, softness=0.5, intensity=1.0, levels=2)
    np.testing.assert_allclose(shown[:, :, :3], top + glow, rtol=1e-6)


def test_a_photograph_glows_by_default() -> None:
    """Its white is 1: displayed pictures have no more."""
    photograph = np.full((128, 128, 4), (0.2, 0.2, 0.2, 1.0), np.float32)
    photograph[48:80, 48:80, :3] = 1.0
    glow = (run(photograph, "numpy") - photograph)[:, :, 0]
    step = 1.0 / 255.0
    assert glow[64, 64] > 8 * step and glow[44, 64] > 4 * step
    assert glow[2, 2] < step


@pytest.mark.parametrize("levels", [1, 3, 8])
def test_a_constant_picture_stays_constant(levels: int) -> None:
    picture = np.full((21, 34, 4), 2.0, np.float32)
    np.testing.assert_allclose(run(picture, levels=levels)[:, :, :3], 2.6, rtol=1e-6)


@pytest.mark.parametrize("levels", [1, 2, 3])
def test_the_glow_holds_the_light_above_the_threshold(levels: int) -> None:
    picture = np.zeros((128, 128, 4), np.float32)
    picture[60:66, 59:67, :3] = (5.0, 2.5, 0.0)
    glow = run(picture, threshold=1.0, intensity=1.0, levels=levels) - picture
    excess = 48 * 5.0 * (4.0 / 5.0)
    assert glow[:, :, 0].sum() == pytest.approx(excess, rel=1e-5)
    assert glow[:, :, 1].sum() == pytest.approx(excess / 2, rel=1e-5)
    assert (glow[:, :, 2:] == 0.0).all()


def test_each_level_widens_the_glow() -> None:
    picture = np.zeros((128, 128, 4), np.float32)
    picture[64, 64] = 100.0
    widths = []
    for levels in (1, 2, 3, 4):
        glow = (run(picture, levels=levels) - picture)[:, :, 0]
        x = np.arange(128) - (glow.sum(0) * np.arange(128)).sum() / glow.sum()
        widths.append(float(np.sqrt((glow.sum(0) * x * x).sum() / glow.sum())))
    for narrow, wide in pairwise(widths):
        assert 1.6 < wide / narrow < 2.4


def test_nan_and_infinity_do_not_spread() -> None:
    picture = np.ones((16, 16, 4), np.float32)
    picture[8, 8] = np.nan
    picture[4, 4] = np.inf
    shown = run(picture, levels=2)
    assert np.isnan(shown[:, :, 0]).sum() == 1
    assert np.isinf(shown[:, :, 0]).sum() == 1


@pytest.mark.parametrize("options", [{}, {"levels": 1, "threshold": 0.0}, {"levels": 6, "intensity": 2.0}])
@pytest.mark.slow
def test_every_backend_agrees_with_the_reference(options: dict[str, Any]) -> None:
    assert_within_bounds(bloom(FRAME, **options), frame=noise())


def test_what_cannot_be_is_refused() -> None:
    with pytest.raises(pg.GraphError, match="levels must be 1 to 8"):
        bloom(FRAME, levels=0)
    with pytest.raises(pg.GraphError, match="intensity must be 0 or more"):
        bloom(FRAME, intensity=-1.0)
