"""Light maps of flat worlds: what can be said without a second renderer, and against sampled truth."""

from __future__ import annotations

from functools import lru_cache
from math import cos, radians, sin
from typing import Any

import numpy as np
import pytest

import passgraph as pg
from passgraph.effects.light2d import Light2D, Wall, Window, light_map, lit, smoothed
from tests.effects.flat_truth import faded, places, share_in_sight
from tests.effects.scenes import Float64, Picture

WINDOW = Window(-8, -6, 8, 6)
SIZE = (80, 60)
LAMP = Light2D((-3.0, -1.0), (1.0, 0.8, 0.5), 12.0, 0.6)
WALLS = (Wall.box(-0.53, -1.47, 0.53, 0.47), Wall.box(3.57, 1.03, 4.03, 4.03), Wall(((-5.03, 2.02), (-2.0, 3.07))))


def rendered(backend: str = "reference", **options: Any) -> Picture:
    given: dict[str, Any] = {"lights": [LAMP], "walls": WALLS, "format": "rgba32f", **options}
    target = light_map(WINDOW, size=SIZE, **given)
    with pg.compile(target, backend=backend) as program:
        return program()["light_map"]


@lru_cache
def sampled_truth() -> Float64:
    return share_in_sight(LAMP, WALLS, SIZE, WINDOW)


def rmse(got: Picture) -> float:
    truth = sampled_truth() * faded(LAMP, places(SIZE, WINDOW))
    return float(np.sqrt(np.mean((got[:, :, 0] - truth) ** 2)))


def test_places_and_pixels_are_each_others_inverse() -> None:
    assert WINDOW.pixels((-8, 6), SIZE) == (0, 0)
    assert WINDOW.pixels((8, -6), SIZE) == SIZE
    assert WINDOW.world(WINDOW.pixels((1.5, -2.5), SIZE), SIZE) == pytest.approx((1.5, -2.5))


def test_light_without_walls_falls_off_with_the_distance_alone() -> None:
    expected = faded(LAMP, places(SIZE, WINDOW))[:, :, None] * LAMP.color
    np.testing.assert_allclose(rendered(walls=())[:, :, :3], expected, atol=2e-6)


def test_lights_add_up_over_the_ambient_light() -> None:
    other = Light2D((4, -3), (0.1, 0.2, 0.9), 5)
    both = rendered(lights=[LAMP, other], ambient=(0.1, 0.2, 0.3))
    apart = rendered()[:, :, :3] + rendered(lights=[other])[:, :, :3]
    np.testing.assert_allclose(both[:, :, :3], apart + np.float32([0.1, 0.2, 0.3]), atol=1e-6)
    assert (both[:, :, 3] == 1.0).all()


@pytest.mark.parametrize("penumbra", ["exact", "none", "rotate", "move"])
def test_it_is_dark_in_the_umbra_and_inside_walls(penumbra: str) -> None:
    picture = rendered(penumbra=penumbra)
    for place in ((1.5, -0.5), (0.0, -0.5), (3.0, -0.5)):
        x, y = WINDOW.pixels(place, SIZE)
        assert picture[int(y), int(x), :3].max() == 0.0


def test_exact_penumbra_is_the_sampled_truth() -> None:
    hard, exact = rmse(rendered(penumbra="none")), rmse(rendered())
    moved = rmse(rendered(penumbra="move", draws=16))
    turned = rmse(rendered(penumbra="rotate", draws=16))
    assert exact < 1e-3
    assert moved < 0.02
    assert exact < moved < min(hard, turned)
    assert (hard, turned) == (pytest.approx(0.056, abs=0.03), pytest.approx(0.06, abs=0.04))


def even_mix(levels: int) -> Picture:
    hard = light_map(WINDOW, [LAMP], WALLS, SIZE, "none", format="rgba32f")
    with pg.compile(smoothed(hard, levels, "rgba32f"), backend="reference", size=SIZE) as program:
        return program()["smoothed"]


def test_choosing_among_halvings_is_nearer_the_truth_than_an_even_mix() -> None:
    hard, even, chosen = rmse(rendered(penumbra="none")), rmse(even_mix(3)), rmse(rendered(penumbra="mixed"))
    assert chosen < 0.6 * even
    assert even < 0.9 * hard


def test_an_even_mix_of_a_constant_map_is_that_map() -> None:
    flat = light_map(WINDOW, [], [], (33, 21), ambient=(0.25, 0.5, 1.0))
    with pg.compile(smoothed(flat, 4, "rgba32f"), backend="reference", size=(33, 21)) as program:
        picture = program()["smoothed"]
    np.testing.assert_allclose(picture, np.broadcast_to(np.float32([0.25, 0.5, 1, 1]), picture.shape), atol=1e-6)


def test_a_penumbra_is_sharp_where_it_begins_and_soft_far_away() -> None:
    """Behind the end of a thin screen the soft edge widens in proportion to the way behind it."""
    lamp = Light2D((-6.0, 0.0), radius=100.0, size=0.5)
    screen = Wall(((-2.0, 0.0), (-2.0, 40.0)))
    size = (160, 120)
    with pg.compile(light_map(WINDOW, [lamp], [screen], size, format="rgba32f"), backend="reference") as program:
        share = program()["light_map"][:, :, 0] / faded(lamp, places(size, WINDOW))
    widths = [np.count_nonzero((share[:, x] > 0.02) & (share[:, x] < 0.98)) for x in (62, 80, 100, 140)]
    behind = [WINDOW.world((x + 0.5, 0), size)[0] + 2.0 for x in (62, 80, 100, 140)]
    assert widths == sorted(widths)
    for width, way in zip(widths, behind, strict=True):
        # both tangents of the lamp through the screen's end
        assert width == pytest.approx(2 * 0.5 * way / 4.0 * 10, rel=0.15, abs=2)


def turned(angle: float, point: tuple[float, float]) -> tuple[float, float]:
    c, s = cos(angle), sin(angle)
    return c * point[0] - s * point[1], s * point[0] + c * point[1]


def turned_scene(angle: float, gap: float) -> tuple[Light2D, Wall]:
    """A lamp as far as ``gap`` before a caster 0.1 wide, the whole turned about the origin."""
    corners = ((-2.0, -0.05), (-1.0, -0.05), (-1.0, 0.05), (-2.0, 0.05))
    lamp = Light2D(turned(angle, (-2.0 - gap, 0.0)), radius=7.0, size=0.0)
    return lamp, Wall(tuple(turned(angle, corner) for corner in corners))


@pytest.mark.parametrize("degrees", [0, 45, 90, 135, 225, 30])
@pytest.mark.parametrize("gap", [1.0, 0.001])
def test_shadows_do_not_depend_on_the_direction(degrees: float, gap: float, backend_name: str) -> None:
    """Also with the lamp at 45° touching a narrow caster: along rays the shadow is where it must be."""
    window, side = Window(-6, -6, 6, 6), 96
    lamp, wall = turned_scene(radians(degrees), gap)
    with pg.compile(light_map(window, [lamp], [wall], (side, side), format="rgba32f"), backend=backend_name) as program:
        picture = program()["light_map"][:, :, 0]
    at = places((side, side), window)
    c, s = cos(radians(-degrees)), sin(radians(-degrees))
    x, y = c * at[:, :, 0] - s * at[:, :, 1], s * at[:, :, 0] + c * at[:, :, 1]
    slope = 0.05 / gap
    shadow = (x > -2.0) & (abs(y) < slope * (x + 2.0 + gap))
    expected = np.where(shadow, 0.0, faded(lamp, at))
    off = abs(picture - expected) > 1e-3
    edge = abs(abs(y) - slope * (x + 2.0 + gap)) < 0.1 * max(slope, 1.0)
    assert not (off & ~edge & (abs(x + 2.0) > 0.1)).any()


def test_no_light_leaks_through_joined_corners(backend_name: str) -> None:
    """A lamp in a closed room of eight crooked walls: outside everything is dark."""
    room = Wall(tuple((3.1 * cos(a) * (1 + 0.2 * sin(3 * a)), 3.1 * sin(a)) for a in np.arange(8) * 0.785398))
    for size, penumbra in ((0.0, "none"), (0.4, "exact")):
        lamp = Light2D((0.37, 0.21), radius=12.0, size=size)
        picture = rendered(backend_name, lights=[lamp], walls=[room], penumbra=penumbra)
        far = np.hypot(*np.moveaxis(places(SIZE, WINDOW), 2, 0)) > 3.9
        assert picture[far][:, :3].max() == 0.0
        assert picture[30, 40, 0] > 0.9


def test_the_map_is_computed_once_and_multiplied_in_each_frame(backend_name: str) -> None:
    target = lit(pg.Input("scene"), light_map(WINDOW, [LAMP], WALLS, SIZE, format="rgba32f"))
    steps: list[str] = []
    rng = np.random.default_rng(5)
    with pg.compile(target, backend=backend_name) as program:
        for _ in range(2):
            scene = rng.random((SIZE[1], SIZE[0], 4), np.float32)
            steps.append("frame")
            program.run(lambda step, _: steps.append(step.name), scene=scene)
        result = program.read()["lit"]
    second = steps[steps.index("frame", 1) + 1 :]
    assert second == ["lit_scene", "lit"]
    expected = scene * rendered()
    np.testing.assert_allclose(result, expected, atol=2e-3)


def test_what_cannot_be_is_refused() -> None:
    with pytest.raises(pg.GraphError, match="penumbra cannot be 'soft'"):
        rendered(penumbra="soft")
    with pytest.raises(pg.GraphError, match="radius must be above 0"):
        Light2D((0, 0), radius=0.0)
    with pytest.raises(pg.GraphError, match="two or more finite corners"):
        Wall(((0.0, 0.0),))
    fence = [Wall(((-1 + i * 0.005, -1.2), (-1 + i * 0.005, -0.8))) for i in range(200)]
    with pytest.raises(pg.GraphError, match="at most 180 are allowed"):
        rendered(walls=fence)
    with pytest.raises(pg.GraphError, match="tile_px must be 4 to 256"):
        rendered(tile_px=2)
