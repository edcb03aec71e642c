"""Shadow filters in the map: hard, square and disc, and as wide as the light and the casters' distance ask."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from math import radians, sin
from typing import Any

import numpy as np
import pytest

import passgraph as pg
from passgraph.effects import soft_shadow, soft_shadow_passes
from passgraph.effects.parameters import arguments_from
from passgraph.effects.shadows.shadow_choice import SHADOW_FILTERS, Disc, Evsm4, Msm, Pcf, Vsm
from passgraph.scene.matrices import translation
from tests.agreement import assert_within_bounds
from tests.effects.scenes import Float64, Picture, cube, floor, floor_places, from_above, render, sun

FILTERS = ("hard", "pcf", "disc", "pcss")
MOMENT_FILTERS = ("vsm", "evsm4", "msm")
EVERY = (*FILTERS, *MOMENT_FILTERS)
ABOVE = from_above(6.0)
LIGHTS = {
    "directional": sun(40, 30, radius=0.1),
    "spot": pg.Light.spot((2, 4, 3), (-0.5, -1, -0.8), intensity=22, radius=0.2, cone_outer_rad=0.5),
    "cube": pg.Light.point((0.2, 1.2, 1.0), (1, 0.9, 0.7), 1.5, radius=0.1),
}


def scene(*lights: pg.Light) -> pg.Scene:
    nodes = (floor(), cube(), cube((-1.2, 0, 1.0), 0.6), cube((1.4, 0, 1.2), 0.4))
    return pg.Scene(nodes, pg.Camera((3, 3, 5), (0, 0.4, 0), vertical_fov_rad=0.7), lights)


def shadows_of(
    of: pg.Scene, shadow_filter: str, backend: str = "reference", size: tuple[int, int] = (96, 64), **options: object
) -> Picture:
    settings: dict[str, Any] = {"ambient": 0.0, "map_size": 256, "shadow_filter": shadow_filter, **options}
    passes = soft_shadow_passes(of, **arguments_from(soft_shadow_passes, settings))
    assert passes.shadows is not None
    assert passes.shadows_blurred is passes.shadows
    return render(passes.shadows, size=size, backend=backend)["shadows"]


@pytest.mark.parametrize(("light", "shadow_filter"), [("spot", "pcss"), ("cube", "pcf")])
@pytest.mark.slow
def test_every_filter_agrees_with_the_reference(light: str, shadow_filter: str) -> None:
    """Where maps are looked up in other ways than in the conformance suite, which has every filter under a sun."""
    settings = {"ambient": 0.0, "map_size": 32, "shadow_filter": shadow_filter, "pcf_size": 3, "taps": 4}
    passes = soft_shadow_passes(scene(LIGHTS[light]), **arguments_from(soft_shadow_passes, settings))
    assert passes.shadows is not None
    assert_within_bounds(passes.shadows, (20, 12))


@pytest.mark.sampled
@pytest.mark.parametrize("light", ["directional", "spot"])
@pytest.mark.parametrize(
    "options",
    [
        {"shadow_filter": "pcf", "pcf_size": 1},
        {"shadow_filter": "disc", "softness": 0.0},
        {"shadow_filter": "pcss", "taps": 7},
    ],
    ids=["pcf", "disc", "pcss"],
)
def test_filters_without_width_are_exactly_the_hard_shadow(light: str, options: dict[str, Any]) -> None:
    of = scene(replace(LIGHTS[light], radius=0.0))
    hard = shadows_of(of, "hard", map_size=128)
    assert 0.001 < (hard[:, :, 0] < 0.5).mean() < 0.9
    np.testing.assert_array_equal(shadows_of(of, map_size=128, **options), hard)


def card(height: float) -> pg.Node:
    corners = np.array([[-0.5, 0, 0.5], [0.5, 0, 0.5], [0.5, 0, -0.5], [-0.5, 0, -0.5]])
    mesh = pg.Mesh.make(corners, [[0, 1, 2], [0, 2, 3]])
    return pg.Node(mesh, pg.Material(double_sided=True), translation((0, height, 0)), "card")


def _width(row: Picture, places: Float64) -> float:
    """Distance over which a rising edge goes from 0.1 to 0.9."""
    edges = np.interp([0.1, 0.9], row, places)
    return float(edges[1] - edges[0])


@pytest.mark.sampled
@pytest.mark.parametrize("height", [0.7, 1.0, 1.4])
def test_a_pcss_penumbra_is_as_wide_as_the_light_makes_it(height: float) -> None:
    """A disc of tangent R seen over an edge at distance g: half width R·g, 0.1 to 0.9 within 1.374 of that."""
    tangent = 0.15
    of = pg.Scene((floor(), card(height)), ABOVE, (sun(45.0, radius=tangent),))
    size = (192, 128)
    shadows = shadows_of(of, "pcss", size=size, map_size=512, taps=64)[:, :, 0]
    x, z = floor_places(ABOVE, size)
    column = int(np.argmin(abs(x[0] - height)))
    lower = z[:, column] > 0.0
    expected = 1.374 * tangent * height / sin(radians(45.0))
    assert _width(shadows[lower, column], z[lower, column]) == pytest.approx(expected, rel=0.15)


def test_a_disc_is_as_wide_as_asked_for() -> None:
    """Half width across the light; seen on the floor it is the same along z."""
    of = pg.Scene((floor(), card(1.0)), ABOVE, (sun(45.0),))
    size = (192, 128)
    shadows = shadows_of(of, "disc", size=size, map_size=512, taps=64, softness=0.2)[:, :, 0]
    x, z = floor_places(ABOVE, size)
    column = int(np.argmin(abs(x[0] - 1.0)))
    lower = z[:, column] > 0.0
    assert _width(shadows[lower, column], z[lower, column]) == pytest.approx(1.374 * 0.2, rel=0.1)


def test_the_width_of_a_disc_may_be_a_run_value() -> None:
    softness = pg.Value("softness", default=0.0)
    passes = soft_shadow_passes(scene(LIGHTS["directional"]), filter=Disc(), softness=softness, map_size=64)
    assert passes.shadows is not None
    with pg.compile(passes.shadows, backend="reference", size=(48, 27)) as program:
        hard, soft = program()["shadows"], program(softness=0.2)["shadows"]
    assert len(np.unique(hard)) < len(np.unique(soft))


@pytest.mark.sampled
@pytest.mark.parametrize("shadow_filter", EVERY)
@pytest.mark.parametrize("azimuth", [0.0, 33.0])
@pytest.mark.parametrize("elevation", [1.0, 3.0, 5.0])
def test_a_lit_plane_has_no_acne_at_grazing_light(shadow_filter: str, azimuth: float, elevation: float) -> None:
    light = sun(elevation, azimuth, radius=0.3)
    of = pg.Scene((floor(),), pg.Camera((2, 3, 5), (0, 0, 0)), (light,))
    assert shadows_of(of, shadow_filter, map_size=64, pcf_size=9, softness=0.5).min() == 1.0


@pytest.mark.sampled
@pytest.mark.parametrize("shadow_filter", EVERY)
@pytest.mark.parametrize(
    "light",
    [
        pg.Light.spot((2, 0.5, 1), (-0.5, -0.1, -0.3), intensity=20, cone_outer_rad=1.0, radius=0.3),
        pg.Light.point((1, 8, 2), intensity=40, radius=0.3),
        pg.Light.point((0.5, 0.2, 0.3), intensity=1, radius=0.05),
    ],
    ids=["spot", "point", "point near the floor"],
)
def test_a_lit_plane_has_no_acne_in_perspective_maps(shadow_filter: str, light: pg.Light) -> None:
    of = pg.Scene((floor(),), pg.Camera((2, 3, 5), (0, 0, 0)), (light,))
    assert shadows_of(of, shadow_filter, map_size=64, pcf_size=9, softness=0.3).min() == 1.0


@pytest.mark.parametrize("shadow_filter", EVERY)
def test_the_next_wall_does_not_darken_a_lit_corner(shadow_filter: str) -> None:
    """The wall's texels lie before the floor's plane; they are no casters of it."""
    corners = np.array([[-4, 0, 0], [4, 0, 0], [4, 4, 0], [-4, 4, 0.0]])
    wall = pg.Node(pg.Mesh.make(corners, [[0, 1, 2], [0, 2, 3]]), pg.Material(), translation((0, 0, -1)), "wall")
    light = pg.Light.directional((0.1, -1, -0.9), radius=0.1)
    of = pg.Scene((floor(), wall), pg.Camera((0, 3, 5), (0, 0, -1)), (light,))
    made = shadows_of(of, shadow_filter, map_size=128, pcf_size=7, softness=0.2)
    assert made.min() == 1.0


def test_no_blur_is_planned() -> None:
    for shadow_filter in FILTERS:
        picture = soft_shadow(scene(LIGHTS["directional"]), filter=SHADOW_FILTERS[shadow_filter](), map_size=64)
        with pg.compile(picture, backend="null", size=(64, 36)) as program:
            steps = program.plan.steps
            assert not any("blur" in name for step in steps for name in (step.name, *getattr(step, "fused", ())))
            assert f"no blur: filter={SHADOW_FILTERS[shadow_filter]()}" in program.explain()


@pytest.mark.parametrize(
    ("made", "message"),
    [
        (lambda: Pcf(4), "Pcf: size must be odd, 1 to 15, got 4"),
        (lambda: Disc(0), "Disc: taps must be 1 to 128, got 0"),
        (lambda: Vsm(bleed=1.0), "Vsm: bleed must be 0 to 0.9, got 1.0"),
        (lambda: Evsm4(exponent=43.0), "Evsm4: exponent must be 1 to 42, got 43.0"),
        (lambda: Msm(format="rgba16f"), "Msm: format cannot be 'rgba16f'; it is one of rgba32f, rgba16"),  # type: ignore[arg-type]
    ],
)
def test_settings_out_of_range_are_refused(made: Callable[[], object], message: str) -> None:
    with pytest.raises(pg.GraphError, match=message):
        made()
