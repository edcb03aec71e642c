"""Lens flare against the published sum in float64, and where ghosts and halos of a lamp must lie."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy import ndimage

import passgraph as pg
from passgraph.effects import lens_flare
from tests.agreement import assert_within_bounds
from tests.conftest import DEVICES
from tests.effects.scenes import Float64, Picture, render
from tests.effects.test_god_rays import picture, places, read, source

FRAME = pg.Input("frame")
every_backend = pytest.mark.parametrize("backend_name", ["reference", *DEVICES], indirect=True)


def shown(target: pg.Target, backend: str = "numpy", **given: Any) -> Float64:
    (made,) = render(target, size=None, backend=backend, **given).values()
    return made.astype(np.float64)


def smooth(x: Float64) -> Float64:
    t = np.clip(x, 0.0, 1.0)
    return np.asarray(t * t * (3.0 - 2.0 * t))


def direction(x: Float64, y: Float64) -> tuple[Float64, Float64]:
    far = np.hypot(x, y)
    return x / np.where(far > 0.0, far, 1.0), y / np.where(far > 0.0, far, 1.0)


def expected(frame: Picture, ghosts: int, spacing: float, halo: float, radius: float, apart: float) -> Float64:
    """With threshold 0.5 and intensity 0.7."""
    bright = source(frame, 0.5, None)
    x, y = (1.0 - at for at in places(bright.shape))

    def channels(x: Float64, y: Float64) -> Float64:
        across, down = direction(0.5 - x, 0.5 - y)
        reads = [read(bright, x + k * apart * across, y + k * apart * down, "grid-constant") for k in (1, 0, -1)]
        return np.stack([reads[k][..., k] for k in range(3)], axis=-1)

    total = np.zeros_like(bright)
    for i in range(ghosts):
        there = x + (0.5 - x) * spacing * i, y + (0.5 - y) * spacing * i
        total += channels(*there) * (1.0 - smooth(np.hypot(there[0] - 0.5, there[1] - 0.5) / 0.75))[..., None]
    wide = bright.shape[1] / bright.shape[0]
    across, down = direction((x - 0.5) * wide, y - 0.5)
    ring = 1.0 - smooth(np.abs(np.hypot((x - 0.5) * wide, y - 0.5) - radius) / 0.1)
    total += halo * ring[..., None] * channels(x - across * radius / wide, y - down * radius)
    for axis in (0, 1):
        total = ndimage.gaussian_filter1d(total, 1.5, axis, mode="nearest", radius=5)
    made, (x, y) = frame.astype(np.float64), places(frame.shape)
    halves = [0.5 * whole / half for whole, half in zip(frame.shape, bright.shape[:2], strict=False)]
    made[..., :3] += 0.7 * read(total, x * halves[1], y * halves[0], "nearest")
    return made


@every_backend
@pytest.mark.parametrize("size", [(1, 1), (24, 32), (17, 31)], ids=str)
def test_it_is_the_published_sum(size: tuple[int, int], backend_name: str) -> None:
    frame = picture(size)
    made = lens_flare(FRAME, 0.5, 0.7, 4, pg.Value("spacing"), 0.8, pg.Value("radius"), 0.03)
    given = {"spacing": 0.4, "radius": 0.35}
    np.testing.assert_allclose(
        shown(made, backend_name, frame=frame, **given), expected(frame, 4, 0.4, 0.8, 0.35, 0.03), atol=5e-4
    )


@pytest.mark.parametrize("number", [0, 1, 2, 4])
def test_ghosts_lie_on_the_line_through_the_middle(number: int) -> None:
    frame, spacing = np.zeros((200, 300, 4), np.float32), 0.6
    frame[95:97, 135:137] = 1000.0
    way = np.array([136.0 - 150.0, 96.0 - 100.0])
    ghosts = [
        shown(lens_flare(FRAME, ghosts=count, spacing=spacing, halo=0.0, dispersion=0.0), frame=frame) - frame
        for count in (number, number + 1)
    ]
    ghost = (ghosts[1] - ghosts[0])[..., 1]
    y, x = np.mgrid[:200, :300] + 0.5
    middle = np.array([(ghost * x).sum(), (ghost * y).sum()]) / ghost.sum()
    np.testing.assert_allclose(middle - (150.0, 100.0), -way / (1.0 - number * spacing), atol=1.0)


def test_colors_of_a_ghost_lie_beside_one_another_on_that_line() -> None:
    frame, size = np.zeros((200, 300, 4), np.float32), np.array([300.0, 200.0])
    frame[75:77, 95:97] = 1000.0
    ghost = (shown(lens_flare(FRAME, ghosts=1, halo=0.0, dispersion=0.03), frame=frame) - frame)[..., :3]
    y, x = np.mgrid[:200, :300] + 0.5
    middles = [np.array([(ghost[..., k] * x).sum(), (ghost[..., k] * y).sum()]) / ghost[..., k].sum() for k in range(3)]
    way = np.array([96.0, 76.0]) / size - 0.5
    # red is the farthest from the middle
    apart = -0.03 * way / np.hypot(*way) * size
    np.testing.assert_allclose(middles[0] - middles[1], apart, atol=1.0)
    np.testing.assert_allclose(middles[1] - middles[2], apart, atol=1.0)


def test_a_lamp_in_the_middle_has_a_ring() -> None:
    frame = np.zeros((160, 240, 4), np.float32)
    frame[79:81, 119:121] = 1000.0
    flare = (shown(lens_flare(FRAME, ghosts=0, halo_radius=0.3, dispersion=0.02), frame=frame) - frame)[..., :3]
    y, x = np.mgrid[:160, :240] + 0.5
    far = np.hypot(x - 120.0, y - 80.0)
    mean = [(flare[..., k] * far).sum() / flare[..., k].sum() for k in range(3)]
    assert mean[1] == pytest.approx(0.3 * 160.0, abs=1.5)
    assert flare[far < 24.0].max() == 0.0


def test_without_light_or_intensity_pictures_stay() -> None:
    frame = picture((17, 31))
    np.testing.assert_array_equal(shown(lens_flare(FRAME, intensity=0.0), frame=frame), frame)
    np.testing.assert_array_equal(shown(lens_flare(FRAME, threshold=100.0), frame=frame), frame)


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_what_is_no_number_does_not_spread(value: float) -> None:
    frame = picture((17, 31))
    frame[8, 9, 1] = value
    with pg.compile(lens_flare(FRAME), "numpy", non_finite="keep") as program:
        assert (~np.isfinite(program(frame=frame)["lens_flare"])).sum() == 1


@pytest.mark.slow
def test_lens_flare_within_bounds_of_the_reference() -> None:
    assert_within_bounds(lens_flare(FRAME, 0.5, ghosts=3), frame=picture((9, 13)))
