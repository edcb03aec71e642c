"""Light maps by lists of tiles: against rays, with lights and walls by the hundred, and with all of them moving."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from math import cos, sin
from typing import Any

import numpy as np
import pytest

import passgraph as pg
from passgraph.effects.light2d import Light2D, Wall, Window, light_map, live_light_map
from passgraph.effects.light2d.light_tiles import LAYERS, most_edges, tile_tables
from tests.conftest import present_devices
from tests.effects.flat_truth import RAYS, faded, places, share_in_sight
from tests.effects.scenes import Float64, Picture

pytestmark = pytest.mark.slow

WINDOW = Window(0, 0, 16, 12)
SIZE = (64, 48)


def red(
    lights: Sequence[Light2D], walls: Sequence[Wall], backend: str = "reference", tile_px: int = 16,
    size: tuple[int, int] = SIZE,
) -> Picture:  # fmt: skip
    made = light_map(WINDOW, list(lights), list(walls), size, format="rgba32f", tile_px=tile_px)
    with pg.compile(made, backend=backend) as program:
        return program()["light_map"][:, :, 0]


def truth(lights: Sequence[Light2D], walls: Sequence[Wall], every_px: int = 1) -> Float64:
    at = some(places(SIZE, WINDOW), every_px)
    seen = (share_in_sight(light, walls, SIZE, WINDOW, every_px=every_px) * faded(light, at) for light in lights)
    return np.sum(list(seen), axis=0)


def some(picture: Float64 | Picture, every_px: int) -> Any:
    """The pixels that :func:`truth` has of."""
    return picture[every_px // 2 :: every_px, every_px // 2 :: every_px]


@lru_cache
def truth_of_mixed() -> Float64:
    return truth(LIGHTS, MIXED)


def polygon(x: float, y: float, radius: float, corners: int, dent: float = 0.0) -> Wall:
    angles = 0.3 + 2 * np.pi * np.arange(corners) / corners
    far = radius * (1 - dent * (np.arange(corners) % 2))
    return Wall(tuple((x + r * cos(a), y + r * sin(a)) for a, r in zip(angles, far, strict=True)))


MIXED = [
    polygon(4.1, 6.2, 0.9, 5), polygon(9.3, 4.1, 1.2, 8, 0.6), polygon(12.2, 9.1, 0.5, 3),
    Wall.box(6.03, 8.04, 6.31, 11), Wall(((7.1, 1.2), (8.3, 2.4), (7.9, 3.3)), closed=False),
    Wall(((11.03, 1.1), (13.2, 3.7))),
]  # fmt: skip
LIGHTS = [Light2D((2.1, 3.2), radius=14, size=0.7), Light2D((10.2, 7.1), radius=9, size=0.4)]


@pytest.mark.parametrize("tile_px", [4, 16, 64])
def test_walls_of_every_kind_shade_as_rays_say(tile_px: int, backend_name: str) -> None:
    """An interval's two ends are each off by half a ray at most; few pixels see more than three intervals."""
    got, expected = red(LIGHTS, MIXED, backend_name, tile_px), truth_of_mixed()
    off = abs(got - expected)
    assert np.quantile(off, 0.999) < 3 * len(LIGHTS) / RAYS
    assert np.sqrt(np.mean(off**2)) < 1e-3


def test_lamps_in_rooms_shade_as_rays_say() -> None:
    """Edges that face a tile are left out only where the lamp is outside their wall."""
    room, walls = Wall.box(1, 1, 9, 11), [polygon(4, 6, 0.8, 6), Wall.box(11, 4, 12, 8)]
    for place in ((3.0, 3.0), (14.0, 6.0)):
        lamp = Light2D(place, radius=15, size=0.5)
        got, expected = red([lamp], [room, *walls]), truth([lamp], [room, *walls])
        assert np.sqrt(np.mean((got - expected) ** 2)) < 1e-3
        assert (expected > 0.1).mean() > 0.05


def test_point_lamps_have_hard_shadows(backend_name: str) -> None:
    lamps = [Light2D(light.position, radius=light.radius) for light in LIGHTS]
    off = abs(red(lamps, MIXED, backend_name) - truth(lamps, MIXED))
    assert (off > 1e-4).mean() < 0.002


def test_more_lamps_than_one_pass_takes_add_up(backend_name: str) -> None:
    rng = np.random.default_rng(3)
    lamps = [Light2D((float(x), float(y)), (0.1,) * 3, 20, 0.2) for x, y in rng.uniform((0, 0), (16, 2), (70, 2))]
    walls = [Wall.box(2 * i + 0.5, 5, 2 * i + 1.5, 5.5) for i in range(8)]
    tables = tile_tables(WINDOW, lamps, walls, SIZE, 16)
    assert len(tables.tiles) > 1
    # every fourth pixel each way: 16 of each tile
    np.testing.assert_allclose(
        some(red(lamps, walls, backend_name), 4), 0.1 * truth(lamps, walls, 4), atol=70 * 0.1 * 3 / RAYS
    )


def test_a_fence_of_many_edges_takes_a_pass_of_its_own(backend_name: str) -> None:
    fence = [Wall(((7.0 + 0.02 * i, 5.0), (7.01 + 0.02 * i, 5.0))) for i in range(100)]
    lamp = Light2D((8.0, 2.0), radius=12, size=1.0)
    assert LAYERS[1] in tile_tables(WINDOW, [lamp], fence, SIZE, 16).layers
    off = abs(red([lamp], fence, backend_name) - truth([lamp], fence))
    # rays meet slits as wide as they lie apart by chance
    assert off.max() < 0.1
    assert off.mean() < 0.003


def crowd(count: int, wide: float, high: float) -> tuple[list[Light2D], list[Wall]]:
    """As many lights as walls, spread over an area."""
    rng = np.random.default_rng(9)
    at = rng.uniform((0, 0), (wide, high), (2 * count, 2))
    lights = [Light2D((float(x), float(y)), (0.2, 0.15, 0.1), 1.5, 0.05) for x, y in at[:count]]
    walls = [Wall.box(float(x), float(y), float(x) + 0.2, float(y) + 0.15) for x, y in at[count:]]
    # walls may not reach into lamps
    free = [w for w in walls if all(np.hypot(*(np.array(w.points).mean(0) - light.position)) > 0.2 for light in lights)]
    return lights, free


def test_lights_and_walls_by_the_hundred_agree_with_the_reference() -> None:
    """In tiles of few pixels: lists are as long as in a larger picture."""
    lights, walls = crowd(140, 16, 12)
    assert min(len(lights), len(walls)) >= 100
    small = {"tile_px": 8, "size": (32, 24)}
    expected = red(lights, walls, **small)
    assert expected.max() > 0.5
    for name in present_devices():
        off = abs(red(lights, walls, name, **small) - expected) > 1e-4 * expected.max()
        assert off.mean() <= 0.002, name


def test_the_lists_grow_with_the_world_and_not_with_lights_times_walls() -> None:
    """Twice the area with twice the lights and walls makes lists twice as long."""
    texels = []
    for count, wide in ((100, 16), (200, 32), (400, 64)):
        lights, walls = crowd(count, wide, 12)
        tables = tile_tables(Window(0, 0, wide, 12), lights, walls, (wide * 20, 240), 16)
        texels.append(float(tables.tiles[0][:, :, 1:].sum()))
    assert texels[1] / texels[0] == pytest.approx(2.0, rel=0.25)
    assert texels[2] / texels[1] == pytest.approx(2.0, rel=0.25)


def test_a_live_map_is_the_map_of_what_each_run_brings(backend_name: str) -> None:
    live = live_light_map(WINDOW, SIZE, room=4096, format="rgba32f", tile_px=16)
    with pg.compile(live.target, backend=backend_name) as program:
        for shift in (0.0, 1.0):
            lights = [light.moved((shift, 0.3)) for light in LIGHTS]
            walls = MIXED[: 6 - int(shift)]
            got = program(**live.inputs(lights, walls))["live_light"][:, :, 0]
            np.testing.assert_array_equal(got, red(lights, walls, backend_name))
        assert program.replanned <= 1


def test_a_live_map_refuses_more_than_it_has_room_for() -> None:
    with pytest.raises(pg.GraphError, match="the limit is 1024; raise room"):
        live_light_map(WINDOW, (640, 480), room=1024, tile_px=4).inputs(LIGHTS, MIXED)
    with pytest.raises(pg.GraphError, match="more than 1 lights with edges in front of them; raise shaded"):
        live_light_map(WINDOW, SIZE, shaded=1).inputs(LIGHTS, MIXED)
    with pytest.raises(pg.GraphError, match="room must be 1024 to"):
        live_light_map(WINDOW, SIZE, room=1)
    with pytest.raises(pg.GraphError, match="shaded must be 1 to 1024"):
        live_light_map(WINDOW, SIZE, shaded=0)


def test_the_walk_through_edges_stays_within_what_a_kernel_may_loop() -> None:
    for lights in (1, 2, 31, 64, 1024):
        edges = most_edges(lights)
        assert lights * (2 * edges + 1) * edges <= 65536 < lights * (2 * edges + 3) * (edges + 1)
