"""Filling by push and pull against loops over pixels in float64, and what must stay as it is."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy import ndimage

import passgraph as pg
from passgraph.effects import fill
from passgraph.effects.pictures.alpha import on_straight_alpha
from tests.agreement import assert_within_bounds
from tests.conftest import DEVICES
from tests.effects.scenes import Float64, Picture, render

FRAME, MASK = pg.Input("frame"), pg.Input("mask")
every_backend = pytest.mark.parametrize("backend_name", ["reference", *DEVICES], indirect=True)


def picture(size: tuple[int, int]) -> Picture:
    """HDR, negative, opaque but for many holes and some half open pixels; multiplied by alpha."""
    random = np.random.default_rng(size[0])
    light = 9.0 * random.random((*size, 4)) - 3.0
    light[..., 3] = random.choice([0.0, 0.4, 1.0], size, p=[0.5, 0.1, 0.4])
    light[..., :3] *= light[..., 3:]
    return np.asarray(light, np.float32)


def shown(target: pg.Target, backend: str = "numpy", **given: Any) -> Float64:
    (made,) = render(target, size=None, backend=backend, **given).values()
    return made.astype(np.float64)


def filled(known: Float64, levels: int) -> Float64:
    """Color times weight and weight, level by level."""
    if levels == 0:
        return known
    height, width = known.shape[:2]
    half = np.zeros(((height + 1) // 2, (width + 1) // 2, 4))
    for y, x in np.ndindex(half.shape[:2]):
        block = known[2 * y : 2 * y + 2, 2 * x : 2 * x + 2].reshape(-1, 4).sum(axis=0)
        half[y, x] = block / max(block[3], 1.0)
    coarse, made = filled(half, levels - 1), known.copy()
    for y, x in np.ndindex(height, width):
        at = [[(y + 0.5) / 2 - 0.5], [(x + 0.5) / 2 - 0.5]]
        around = np.array([ndimage.map_coordinates(coarse[..., c], at, order=1, mode="nearest")[0] for c in range(4)])
        if around[3] > 0.0:
            made[y, x] += (1.0 - known[y, x, 3]) * around / around[3]
    return made


@every_backend
@pytest.mark.parametrize("levels", [1, 5])
@pytest.mark.parametrize("size", [(1, 1), (16, 24), (17, 31)], ids=str)
def test_holes_are_filled_level_by_level(size: tuple[int, int], levels: int, backend_name: str) -> None:
    frame = picture(size)
    made = shown(fill(FRAME, levels=levels), backend_name, frame=frame)
    np.testing.assert_allclose(made, filled(frame.astype(np.float64), levels), atol=2e-5)


@every_backend
def test_what_is_known_stays_to_the_bit(backend_name: str) -> None:
    frame, mask = picture((17, 31)), np.zeros((17, 31, 1), np.float32)
    mask[5:12, 8:20] = 1.0
    made = shown(fill(FRAME, MASK), backend_name, frame=frame, mask=mask)
    stays = (frame[..., 3] == 1.0) & (mask[..., 0] == 0.0)
    np.testing.assert_array_equal(made[stays], frame[stays])
    np.testing.assert_allclose(made[..., 3], 1.0, rtol=1e-6)
    masked = frame.astype(np.float64) * (1.0 - mask)
    np.testing.assert_allclose(made, filled(masked, 10), atol=2e-5)


def test_a_hole_has_the_color_around_it_and_no_other() -> None:
    frame = np.full((40, 60, 4), (0.3, 2.0, -1.0, 1.0), np.float32)
    frame[9:33, 17:50] = 0.0
    np.testing.assert_allclose(
        shown(fill(FRAME), frame=frame), np.broadcast_to((0.3, 2.0, -1.0, 1.0), (40, 60, 4)), rtol=1e-6
    )
    random = picture((40, 60))
    seen = random[..., 3] > 0.0
    colors = random[seen][:, :3] / random[seen][:, 3:]
    made = shown(fill(FRAME), frame=random)[..., :3].reshape(-1, 3)
    assert (made.min(axis=0) >= colors.min(axis=0) - 1e-5).all()
    assert (made.max(axis=0) <= colors.max(axis=0) + 1e-5).all()


def test_straight_alpha_is_filled_alike() -> None:
    frame = picture((17, 31))
    straight = frame.copy()
    straight[..., :3] = np.where(frame[..., 3:] > 0.0, frame[..., :3] / np.maximum(frame[..., 3:], 1e-9), 7.0)
    np.testing.assert_allclose(
        shown(on_straight_alpha(fill)(FRAME), frame=straight), shown(fill(FRAME), frame=frame), atol=1e-5
    )


def test_what_is_no_number_is_a_hole_and_nothing_known_stays_nothing() -> None:
    frame = np.full((9, 9, 4), 0.5, np.float32)
    frame[..., 3] = 1.0
    frame[4, 4, 0], frame[2, 3, 1], frame[6, 6, 3] = np.nan, np.inf, np.nan
    with pg.compile(fill(FRAME), "numpy", non_finite="keep") as program:
        np.testing.assert_allclose(
            program(frame=frame)["fill"], np.broadcast_to((0.5, 0.5, 0.5, 1.0), (9, 9, 4)), rtol=1e-6
        )
    assert (shown(fill(FRAME), frame=np.zeros((5, 7, 4), np.float32)) == 0.0).all()


def test_fill_within_bounds_of_the_reference() -> None:
    assert_within_bounds(fill(FRAME, levels=3), frame=picture((13, 9)))
