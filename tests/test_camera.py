"""The camera and its matrices."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from passgraph.errors import InputError
from passgraph.scene import Camera
from passgraph.scene.matrices import corners_of, translation

coordinate = st.floats(-10.0, 10.0)
vector = st.tuples(coordinate, coordinate, coordinate).filter(lambda v: max(map(abs, v)) > 1e-2)


@given(vector, vector, st.floats(0.3, 4.0), st.sampled_from([0.0, 1e6]))
@settings(max_examples=80, deadline=None)
def test_framing_holds_all_corners(direction, size, aspect, offset):
    bounds = np.stack([np.zeros(3), np.abs(size)]) + offset
    camera = Camera.framing(bounds, direction, aspect)
    v = np.c_[corners_of(bounds), np.ones(8)] @ (camera.projection_matrix(aspect) @ camera.view_matrix()).T
    assert np.abs(v[:, :3] / v[:, 3:]).max() < 1.0


def test_framing_of_a_point_works():
    camera = Camera.framing([[5, 5, 5], [5, 5, 5]])
    assert 0.0 < camera.near < camera.far


def test_relative_matrices_agree_with_the_view_matrix():
    camera = Camera((1, 2, 3), (0, 0, 0))
    transform = translation((4, 5, 6))
    assert np.allclose(camera.view_rotation() @ camera.relative(transform), camera.view_matrix() @ transform)


def test_a_far_offset_does_not_shake():
    """The float32 picture of a scene is the same at the origin and at 1e6, to the float64 rounding of 1e6."""
    point = np.array([0.3, 0.7, -0.2, 1.0], np.float32)

    def seen(offset):
        camera = Camera((offset + 1, 2, 3), (offset, 0, 0))
        matrix = camera.projection_matrix(1.5) @ camera.view_rotation() @ camera.relative(translation((offset, 0, 0)))
        return matrix.astype(np.float32) @ point

    assert np.abs(seen(1e6) - seen(0.0)).max() < 1e-6


def test_near_and_far_map_to_the_ends_of_clip_space():
    projection = Camera((0, 0, 5), (0, 0, 0), near=0.5, far=20.0).projection_matrix(1.0)
    for distance, expected in ((0.5, -1.0), (20.0, 1.0)):
        v = projection @ [0, 0, -distance, 1]
        assert v[2] / v[3] == pytest.approx(expected)


@pytest.mark.parametrize(
    ("fields", "text"),
    [
        ({"eye": (0, 0, 0)}, "eye and target are the same point"),
        ({"eye": (np.nan, 0, 0)}, "eye: expected three finite numbers"),
        ({"near": 0.0}, "near: expected a finite number in ]0"),
        ({"near": 2.0, "far": 1.0}, "expected near < far, got near 2 and far 1"),
        ({"up": (0, 0, 3)}, "up .* is parallel to the view direction"),
        ({"up": (0, 0, 0)}, "up: expected a vector that is not zero"),
        ({"vertical_fov_rad": 4.0}, "vertical_fov_rad: expected a finite number"),
        ({"orthographic_height": 0.0}, "orthographic_height: expected a finite number in ]0"),
        ({"orthographic_height": 1.0, "far": np.inf}, "a parallel projection has a finite far plane, got inf"),
        ({"aspect": -1.0}, "aspect: expected a finite number in ]0"),
        ({"shift": (0.0, np.nan)}, "shift: expected two finite numbers"),
    ],
)
def test_bad_fields_are_named(fields, text):
    with pytest.raises(InputError, match=text):
        Camera(**{"eye": (0, 0, 5), "target": (0, 0, 0), **fields})


def test_bad_aspect_is_named():
    with pytest.raises(InputError, match="aspect: expected a finite number"):
        Camera((0, 0, 5), (0, 0, 0)).projection_matrix(0.0)


def test_an_orbit_keeps_the_target_and_the_distance():
    camera = Camera((0, 1, 5), (0, 0, 0))
    turned = camera.orbited(0.4, -0.1, 2.0)
    assert turned.target == camera.target
    azimuths = [np.arctan2(x, z) for x, _, z in (camera.eye, turned.eye)]
    elevations = [np.arcsin(y / np.hypot(np.hypot(x, y), z)) for x, y, z in (camera.eye, turned.eye)]
    assert (azimuths[1] - azimuths[0], elevations[1] - elevations[0]) == pytest.approx((0.4, -0.1))
    assert np.linalg.norm(turned.eye) == pytest.approx(2 * np.linalg.norm(camera.eye))
    assert camera.orbited(0.0, 0.0, 1.0) is camera


@pytest.mark.parametrize(("azimuth", "elevation"), [(2.0, 0.3), (-1.2, 5.0), (0.1, -5.0)])
def test_an_orbit_does_not_roll_a_camera_whose_up_is_tilted(azimuth, elevation):
    """A vertical line through the target stays vertical in the picture."""
    camera = Camera.orbit([[-1, -1, -1], [1, 1, 1]], 0.7, 0.5)
    assert camera.up != (0.0, 1.0, 0.0)
    sideways, upward, _ = camera.orbited(azimuth, elevation).view_rotation()[:3, 1]
    assert abs(sideways) < 1e-9
    assert upward > 0.05


def test_an_orbit_of_a_flat_view_scales_its_height():
    camera = Camera((0, 0, 5), (0, 0, 0), orthographic_height=3.0)
    assert camera.orbited(0.0, 0.0, 2.0).orthographic_height == 6.0
