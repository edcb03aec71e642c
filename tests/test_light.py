"""Lights and the frusta of their shadow maps."""

from __future__ import annotations

from math import pi, radians

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from passgraph.errors import InputError
from passgraph.scene import Light
from passgraph.scene.lights import exposed
from passgraph.scene.matrices import corners_of

BOX = np.array([[-1.0, 0.0, -2.0], [3.0, 2.5, 1.0]])
coordinate = st.floats(-5.0, 5.0)
vector = st.tuples(coordinate, coordinate, coordinate).filter(lambda v: max(map(abs, v)) > 1e-3)


def clip(view, projection, points):
    v = np.c_[points, np.ones(len(points))] @ (projection @ view).T
    return v[:, :3] / v[:, 3:], v[:, 3]


@given(vector, st.sampled_from([0.0, 1e6]))
@settings(max_examples=60, deadline=None)
def test_directional_frustum_contains_the_box_from_any_direction(direction, offset):
    bounds = BOX + offset
    view, projection = Light.directional(direction).frustum(bounds)
    ndc, _ = clip(view, projection, corners_of(bounds))
    assert np.abs(ndc).max() < 1.0
    assert np.allclose(view[:3, :3] @ view[:3, :3].T, np.eye(3), atol=1e-12)


@given(vector)
@settings(max_examples=60, deadline=None)
def test_fitted_frustum_contains_the_box_or_is_none(position):
    light = Light.point(tuple(3.0 * c for c in position))
    fitted = light.fitted_frustum(BOX)
    if fitted is not None:
        ndc, w = clip(*fitted, corners_of(BOX))
        assert w.min() > 0.0
        assert np.abs(ndc).max() < 1.0


@given(vector)
@settings(max_examples=60, deadline=None)
def test_every_corner_is_in_one_cube_face(position):
    light = Light.point(position)
    projection = light.cube_projection(BOX)
    seen = np.zeros(8, bool)
    for view in light.cube_views():
        ndc, w = clip(view, projection, corners_of(BOX) + 1e-9)
        depth = w / max(np.abs(corners_of(BOX) - np.array(position)).max(), 1e-9)
        seen |= (np.abs(ndc[:, :2]).max(axis=1) <= 1.0 + 1e-6) & (w > 0) & ((np.abs(ndc[:, 2]) <= 1) | (depth < 1e-2))
    assert seen.all()


def test_cube_views_follow_the_opengl_faces():
    forward = [-view[2, :3] for view in Light.point((1, 2, 3)).cube_views()]
    assert np.array_equal(forward, [[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]])


@pytest.mark.parametrize("outer", [0.1, pi / 4, radians(89.5), pi / 2])
@pytest.mark.parametrize("place", [(0.0, 6.0, 0.0), (0.5, 1.0, 0.0), (0.0, -9.0, 0.0)])
def test_spot_frustum_is_finite_and_holds_what_the_cone_holds(outer, place):
    view, projection = Light.spot(place, (0, -1, 0), cone_outer_rad=outer).frustum(BOX)
    assert np.isfinite(projection).all()
    points = corners_of(BOX)
    away = points - place
    angle = np.arctan2(np.hypot(away[:, 0], away[:, 2]), -away[:, 1])
    lit = (angle < min(outer, radians(80.0))) & (-away[:, 1] > 0.1)
    ndc, _ = clip(view, projection, points)
    assert np.abs(ndc[lit]).max(initial=0.0) < 1.0


def test_a_box_of_no_size_gives_a_usable_frustum():
    point = np.array([[1e6, 0.0, 0.0]] * 2)
    for light in (
        Light.directional((0, -1, 0)),
        Light.spot((1e6, 2, 0), (0, -1, 0)),
        Light.point((1e6, 2, 0)),
    ):
        ndc, _ = clip(*light.frustum(point), point)
        assert np.abs(ndc).max() < 1.0


def test_a_point_light_inside_the_box_asks_for_cube_views():
    with pytest.raises(InputError, match=r"light 'lamp': .*more than 150 degrees.*cube_views"):
        Light.point((0, 1, 0), name="lamp").view_matrix(BOX)


def test_directional_has_no_cube_views():
    with pytest.raises(InputError, match="cube_views is for point and spot"):
        Light.directional((0, -1, 0)).cube_views()


@pytest.mark.parametrize(
    ("fields", "text"),
    [
        ({"kind": "area"}, "kind: expected 'directional'"),
        ({"direction": (0, 0, 0)}, "direction: expected a vector that is not zero"),
        ({"position": (0, float("nan"), 0)}, "position: expected three finite numbers"),
        ({"color": (1, -1, 0)}, "color: expected linear RGB of 0 or more"),
        ({"intensity": -1}, "intensity: expected a finite number"),
        ({"radius": float("inf")}, "radius: expected a finite number"),
        ({"radius": "big"}, r"radius: expected a finite number in \[0, inf\], got 'big'"),
        ({"cone_outer_rad": 0.0}, "cone_outer_rad: expected a finite number"),
        ({"cone_inner_rad": 1.5}, "cone_inner_rad: expected a finite number"),
    ],
)
def test_bad_fields_are_named(fields, text):
    with pytest.raises(InputError, match=text):
        Light(**{"kind": "spot", **fields})


def test_bad_bounds_are_named():
    with pytest.raises(InputError, match=r"light 'light': bounds: expected shape \(2, 3\)"):
        Light.directional((0, -1, 0)).frustum([1, 2, 3])


@pytest.mark.parametrize("kind", ["directional", "point", "spot"])
def test_a_light_goes_round_a_centre_by_angles_and_keeps_its_distance(kind):
    light = {
        "directional": Light.directional((-1, -2, 0.5)),
        "point": Light.point((5, 2, 3), intensity=4.0),
        "spot": Light.spot((5, 2, 3), (0, -1, 0)),
    }[kind]
    centre = np.array([1.0, 2.0, 3.0])
    made = light.around(centre, np.pi / 2, np.pi / 6)
    toward = -np.array(made.direction) if kind == "directional" else (np.array(made.position) - centre) / 4.0
    np.testing.assert_allclose(toward, (np.sqrt(0.75), 0.5, 0.0), atol=1e-12)
    if kind == "spot":
        np.testing.assert_allclose(made.direction, -toward, atol=1e-12)
    assert (made.color, made.intensity, made.radius) == (light.color, light.intensity, light.radius)
    kept = made.around(centre)
    np.testing.assert_allclose((kept.position, kept.direction), (made.position, made.direction), atol=1e-12)


def test_a_light_in_the_centre_is_turned_nowhere():
    with pytest.raises(InputError, match=r"light 'light': lies in the centre \[0.0, 0.0, 0.0\]"):
        Light.point((0, 0, 0)).around((0, 0, 0), 1.0)


def test_lights_are_exposed_together():
    lights = [Light.directional((0, -1, 0), intensity=3.0), Light.point((0, 4, 0), intensity=16.0)]
    made = exposed(lights, np.array([[-1.0, -1, -1], [1, 1, 1]]))
    assert [light.intensity for light in made] == [0.75, 4.0]
    assert [light.intensity for light in exposed(lights[1:], np.array([[-1.0, -1, -1], [1, 1, 1]]))] == [16.0]
