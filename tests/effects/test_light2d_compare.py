"""Every render target of the flat effects on every backend, within the bounds that rounding allows."""

from __future__ import annotations

import numpy as np
import pytest

import passgraph as pg
from passgraph.effects.lens.lens import dirt_texture, dirty_lens
from passgraph.effects.light2d import Light2D, Mover, Wall, Window, light_map, lit, moving_shadows, occlusion, smoothed
from passgraph.effects.light2d.distance_grid import distance_grid
from passgraph.effects.light2d.lens_spots import dirty_lens_map, dirty_lens_spots, light_spots
from tests.agreement import assert_within_bounds

pytestmark = pytest.mark.slow

WINDOW = Window(0, 0, 16, 12)
SIZE = (40, 30)
LIGHTS = [Light2D((4.1, 5.2), (1.0, 0.8, 0.5), 12, 0.5), Light2D((13.3, 9.1), (0.2, 0.4, 1.0), 8)]
WALLS = [Wall.box(7.03, 4.04, 8.01, 6.13), Wall(((9.1, 9.3), (11.2, 7.7)))]
MOVERS = (Mover((6.1, 8.2), (0.5, 0.3), 0.3), Mover((12.6, 8.3), (0.5, 0.5)))


def scene() -> pg.Target:
    return pg.Input("scene", "rgba32f", SIZE)


def graphs() -> dict[str, pg.Target]:
    dirt = pg.Input("dirt", "rgba16f", SIZE, static=True, default=dirt_texture(SIZE))
    spots = light_spots(WINDOW, LIGHTS, SIZE)
    exact = light_map(WINDOW, LIGHTS, WALLS, SIZE)
    return {
        "exact": lit(scene(), exact),
        "rotate": light_map(WINDOW, LIGHTS, WALLS, SIZE, "rotate", 2),
        "move": light_map(WINDOW, LIGHTS[:1], WALLS, SIZE, "move", 2),
        "mixed": light_map(WINDOW, LIGHTS[:1], WALLS, SIZE, "mixed"),
        "smoothed": smoothed(light_map(WINDOW, LIGHTS, WALLS, SIZE, "none")),
        "rims": occlusion(scene(), distance_grid(WINDOW, WALLS, 1.0), 1.0),
        "fan": moving_shadows(scene(), WINDOW, LIGHTS, pg.Value("movers", default=MOVERS), 2, near="fan"),
        "lens": dirty_lens(scene(), dirt),
        "spots": dirty_lens_spots(scene(), dirt, spots),
        "map": dirty_lens_map(scene(), dirt, spots, WINDOW, Window(3.1, 2.2, 11.3, 9.4)),
    }


@pytest.mark.parametrize("name", graphs())
def test_every_target_is_within_its_bounds(name: str) -> None:
    target = graphs()[name]
    given = np.random.default_rng(6).random((SIZE[1], SIZE[0], 4), np.float32)
    inputs = {"scene": given} if any(n.name == "scene" for n in pg.graph(target)) else {}
    assert_within_bounds(target, SIZE, **inputs)
