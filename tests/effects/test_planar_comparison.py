"""Planar projection beside contact penumbra: what hangs high, and how wide an edge is."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import pytest

import passgraph as pg
from tests.effects.planar_comparison import PlanarComparison, planar_comparison
from tests.effects.scenes import Float64, Picture, cube, floor, floor_places, from_above, render, sun
from tests.effects.test_planar import slab

SIZE = (192, 64)
MAP, THRESHOLD, DARKNESS = 32, 0.4, 0.8
CAMERA = from_above(8.0, 0.0)
#: Slabs one unit wide, by the place of their middle and their height; the map holds all three.
SLABS = {-2.0: 0.0, 0.0: 0.1, 2.0: 1.0}
OVER = 0.001
TEXEL = 5.0 * (1 + 8 / MAP) / MAP


def compared() -> PlanarComparison:
    # a foot on the floor far below keeps the map's width, whatever is over the threshold
    feet = [cube((x, 0, 2.45), 0.1) for x in (-2.45, 2.45)]
    of = pg.Scene((floor(6.0), *(slab((x, y + OVER, 0)) for x, y in SLABS.items()), *feet), CAMERA, (sun(85, 0),))
    return planar_comparison(of, threshold=THRESHOLD, darkness=DARKNESS, map_size=MAP)


@lru_cache
def shares(backend: str) -> tuple[Picture, Picture]:
    made = compared()
    found = render(made.projected_share, made.contact_share, size=SIZE, backend=backend)
    return found["projected share"][:, :, 0], found["contact share"][:, :, 0]


def across() -> Float64:
    """World x along the middle row."""
    return floor_places(CAMERA, SIZE)[0][SIZE[1] // 2]


def darkness_at(picture: Picture, x: float) -> float:
    near = abs(across() - x) < 0.25
    return float(1.0 - picture[SIZE[1] // 2, near].mean())


@pytest.mark.parametrize(("x", "y"), SLABS.items())
def test_projection_takes_all_and_contact_what_is_near(x: float, y: float, backend_name: str) -> None:
    projected, contact = shares(backend_name)
    assert darkness_at(projected, x) == pytest.approx(DARKNESS, abs=1e-3)
    left = max(1.0 - (y + OVER) / THRESHOLD, 0.0)
    assert darkness_at(contact, x) == pytest.approx(DARKNESS * left, abs=1e-3)


def edge_width(picture: Picture, x: float) -> float:
    """From 10 to 90 % of the way from the slab's middle out of it, scene units, pixels interpolated."""
    row = picture[SIZE[1] // 2]
    places = across()
    part = (places > x - 1.0) & (places < x)
    value, at = row[part].astype(float), places[part]
    share = (value - value[-1]) / (value[0] - value[-1])
    low = np.interp(-0.9, -share, at)
    high = np.interp(-0.1, -share, at)
    return float(high - low)


def test_a_projected_edge_is_a_pixel_wide_and_a_filtered_one_a_texel(backend_name: str) -> None:
    projected, contact = shares(backend_name)
    pixel = float(np.diff(across())[0])
    assert 2 * pixel < TEXEL
    for x in (-2.0, 0.0):
        # one pixel to the next, 80 % of which are between 10 and 90 %
        assert edge_width(projected, x) <= 0.8 * pixel + 1e-3
        # a bilinear step from texel to texel; a pixel samples it no finer than its own width
        assert edge_width(contact, x) == pytest.approx(0.8 * TEXEL, abs=pixel)
    assert edge_width(contact, 0.0) > 2 * edge_width(projected, 0.0)
    values = np.unique(projected[SIZE[1] // 2])
    assert len(values) == 2
