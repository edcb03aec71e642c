"""Shadows of moving things by sprites."""

from __future__ import annotations

from math import atan, hypot, inf, pi

import numpy as np
import pytest

import passgraph as pg
from passgraph.effects.light2d import Light2D, Window
from passgraph.effects.light2d.sprites import FADE, LampCache, Mover, moving_shadows, nearest, sprite_table
from tests.effects.scenes import Picture

WINDOW = Window(-8, -8, 8, 8)
LAMP = Light2D((-4.0, 0.0), radius=12.0)
OTHER = Light2D((6.0, 6.0), radius=6.0)
SIDE = 64
WHITE = np.ones((SIDE, SIDE, 4), np.float32)


def far(place: tuple[float, float]) -> float:
    return inf


def run(movers: list[Mover], backend: str = "reference") -> Picture:
    made = moving_shadows(pg.Input("scene"), WINDOW, [LAMP, OTHER], pg.Value("movers"), 4)
    with pg.compile(made, backend=backend) as program:
        return program(scene=WHITE, movers=movers)["moving_shadows"]


@pytest.mark.parametrize("angle", [0.0, 0.3, pi / 4, 2.0])
def test_the_width_is_the_projection_of_the_corners(angle: float) -> None:
    mover = Mover((0, 0), (1.0, 0.4), angle)
    corners = np.array([[1, 0.4], [1, -0.4], [-1, 0.4], [-1, -0.4]])
    turned = corners @ np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    assert mover.across(1.0, 0.0) == pytest.approx(np.ptp(turned[:, 1]))
    assert mover.across(0.6, 0.8) == pytest.approx(np.ptp(turned @ [-0.8, 0.6]))


def test_two_sprites_are_turned_by_the_angle_that_the_lamp_sees() -> None:
    table = sprite_table([Mover((0, 0), (0.5, 0.5))], [LAMP], far, 1)
    half = atan(0.5 / 4)
    np.testing.assert_allclose(np.arctan2(table[[1, 3], 1], table[[1, 3], 0]), [-half, half], atol=1e-6)
    np.testing.assert_allclose(np.hypot(table[[1, 3], 2], table[[1, 3], 3]), 0.5, atol=1e-6)


def test_far_away_one_sprite_is_twice_as_opaque() -> None:
    table = sprite_table([Mover((4, 0), (0.2, 0.2))], [LAMP], far, 1)
    assert table[0, 2] == 2.0
    assert not table[2:].any()


def test_near_the_lamp_the_shadow_fades_out() -> None:
    opacity = [sprite_table([Mover((-4 + way, 0))], [LAMP], far, 1)[0, 2] for way in (0.4, 0.7, 0.8, 2.0)]
    assert opacity[0] == 0.0
    assert 0.0 < opacity[1] < opacity[2] < opacity[3] == 1.0
    assert 2 * atan(0.5 / 0.4) > FADE[1]


def test_shadows_end_where_the_grid_says() -> None:
    table = sprite_table([Mover((0, 0))], [LAMP], lambda place: 2.5, 1)
    assert hypot(table[1, 0], table[1, 1]) == pytest.approx(2.5)
    pair = sprite_table([Mover((0, 0))], [LAMP], far, 1)  # two sprites part beyond the way from the lamp
    assert hypot(pair[1, 0], pair[1, 1]) == pytest.approx(4.0)


def test_each_thing_is_shaded_by_the_nearest_lamp_alone() -> None:
    assert nearest([LAMP, OTHER], (0.0, 0.0)) is LAMP
    assert nearest([LAMP, OTHER], (5.0, 5.0)) is OTHER
    assert nearest([OTHER], (-5.0, -5.0)) is None
    with pytest.raises(pg.GraphError, match="exceed count=1"):
        sprite_table([Mover((0, 0)), Mover((1, 1))], [LAMP], far, 1)


def test_it_is_darkest_behind_the_middle_and_bright_before_and_beside() -> None:
    shown = run([Mover((0, 0), (1.0, 1.0))])[:, :, 0]
    x, y = (int(v) for v in WINDOW.pixels((1.5, 0.0), (SIDE, SIDE)))
    column = shown[:, x]
    assert column[y] < 0.6
    assert column[y] <= column.min() + 0.02
    assert column[y - 25] == column[y + 25] == 1.0
    np.testing.assert_allclose(shown, shown[::-1], atol=2e-3)
    assert shown[y, int(WINDOW.pixels((-2.0, 0.0), (SIDE, SIDE))[0])] == 1.0


def test_a_shadow_that_jumps_fades_over(backend_name: str) -> None:
    made = moving_shadows(pg.Input("scene"), WINDOW, [LAMP], pg.Value("movers"), 1, share=0.5)
    here, there = [Mover((0, 0))], [Mover((0, 5))]
    shadow = 1.0 - run(here)
    with pg.compile(made, backend=backend_name) as program:
        for frame in range(4):
            left = 1.0 - program(scene=WHITE, movers=here if frame < 3 else there)["moving_shadows"]
            if frame < 3:
                np.testing.assert_allclose(left, shadow * (1 - 0.5 ** (frame + 1)), atol=4e-3)
    moved = 1.0 - run(there)
    np.testing.assert_allclose(left, 0.5 * moved + 0.5 * 0.875 * shadow, atol=4e-3)


def test_near_a_lamp_a_fan_of_sprites_keeps_the_shadow_that_fades_otherwise() -> None:
    """Under 1.85 radian two sprites are gone; five cover the lamp's whole cone behind the thing."""
    mover = Mover((-4.0 + 0.75, 0.0), (0.3, 1.0))
    faded, fan = (sprite_table([mover], [LAMP], far, 1, near) for near in ("fade", "fan"))
    assert faded[0, 2] == 0.0
    assert (fan[0::2, 2] == 1.0).all()
    ends = np.arctan2(fan[1::2, 1], fan[1::2, 0])
    angle = 2 * atan(1.0 / 0.75)
    np.testing.assert_allclose(ends, np.linspace(-0.5, 0.5, 5) * angle, atol=1e-6)
    far_off = Mover((3.0, 0.0))
    np.testing.assert_array_equal(
        sprite_table([far_off], [LAMP], far, 1, "fan")[:4], sprite_table([far_off], [LAMP], far, 1)
    )


def test_nearest_lamps_are_looked_for_once_a_cell_and_again_when_lamps_change() -> None:
    cache = LampCache([LAMP, OTHER], cell=1.0)
    places = [(x * 0.25 + 0.01, 0.3) for x in range(16)]
    for _ in range(3):
        assert [cache(place) for place in places] == [nearest([LAMP, OTHER], (int(x) + 0.5, 0.5)) for x, _ in places]
    assert cache.computed == 4
    cache.change([LAMP, OTHER])
    cache(places[0])
    assert cache.computed == 4
    cache.change([OTHER])
    assert cache(places[0]) is nearest([OTHER], (0.5, 0.5))
    assert cache.computed == 5
    table = sprite_table([Mover((0.5, 0.5))], LampCache([LAMP, OTHER]), far, 1)
    np.testing.assert_array_equal(table, sprite_table([Mover((0.5, 0.5))], [LAMP, OTHER], far, 1))
