"""Cameras from the matrices of engines."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import passgraph as pg
from passgraph.errors import InputError
from passgraph.scene.matrices import orthographic, perspective
from passgraph.scene.projection import Projection

VIEW = pg.Camera((3, 2, 5), (0, 1, 0)).view_matrix()
SHIFTED = perspective(0.6, 0.4, 0.5, 80.0, (0.1, -0.05))


def _places(camera, aspect, points):
    """Where points of the world lie in the picture, from -1 to 1."""
    clip = np.c_[points, np.ones(len(points))] @ (camera.projection_matrix(aspect) @ camera.view_matrix()).T
    return clip[:, :2] / clip[:, 3:]


@given(
    st.tuples(*[st.floats(-50, 50)] * 3),
    st.floats(0.05, 2.9),
    st.tuples(st.floats(-0.9, 0.9), st.floats(-0.9, 0.9)),
    st.floats(0.2, 5.0),
    st.one_of(st.none(), st.floats(0.1, 40.0)),
    st.sampled_from([np.float64, np.float32]),
)
@settings(max_examples=150, deadline=None)
def test_a_camera_comes_back_from_its_matrices(eye, fov, shift, aspect, height, kind):
    target = np.add(eye, (0.3, -0.2, 1.0))
    given_camera = pg.Camera(eye, tuple(target), (0, 1, 0), fov, 0.5, 300.0, height, shift)
    view, projection = given_camera.view_matrix().astype(kind), given_camera.projection_matrix(aspect).astype(kind)
    found = pg.Camera.from_matrices(view, projection)
    points = target + np.random.default_rng(1).uniform(-0.4, 0.4, (20, 3))
    rounding = 1e-9 if kind is np.float64 else 2e-3
    # the matrices' own aspect counts, whatever the picture's
    assert np.allclose(_places(found, 7.0, points), _places(given_camera, aspect, points), rtol=rounding, atol=rounding)
    assert (found.near, found.far) == pytest.approx((0.5, 300.0), rel=10 * rounding)
    assert found.orthographic == (height is not None)


def test_an_infinite_far_plane_is_found():
    for dtype in (np.float32, np.float64):
        assert pg.Camera.from_matrices(VIEW, perspective(1, 1, 0.5, np.inf).astype(dtype)).far == np.inf


def test_a_far_plane_pushed_in_by_an_engine_is_infinite():
    """E. Lengyel's matrix keeps what is cleared behind what is infinitely far, by 2.4e-7."""
    matrix = perspective(1, 1, 0.5, np.inf)
    matrix[2, 2:] = 2.4e-7 - 1.0, (2.4e-7 - 2.0) * 0.5
    assert Projection.from_matrix(matrix).far == np.inf


def test_reversed_depth_from_0_to_1_is_recognised():
    """As engines that call glClipControl have it: -1 to 1 cannot be meant."""
    near, far = 0.1, 50.0
    matrix = perspective(1, 1, 1, 2)
    matrix[2, 2:] = near / (far - near), near * far / (far - near)
    read = Projection.from_matrix(matrix)
    assert (read.reversed_z, read.near, read.far) == (True, pytest.approx(near), pytest.approx(far))
    matrix[2, 2:] = 0.0, near
    assert (Projection.from_matrix(matrix).near, Projection.from_matrix(matrix).far) == (near, np.inf)


def test_depth_from_0_to_1_is_as_it_is_said():
    near, far = 0.1, 50.0
    matrix = perspective(1, 1, 1, 2)
    matrix[2, 2:] = -far / (far - near), -near * far / (far - near)
    read = Projection.from_matrix(matrix, zero_to_one=True)
    assert (read.near, read.far) == (pytest.approx(near), pytest.approx(far))


def test_y_down_is_the_same_picture():
    down = np.diag([1.0, -1.0, 1.0, 1.0]) @ SHIFTED
    assert Projection.from_matrix(down) == Projection.from_matrix(SHIFTED)


def test_any_factor_is_the_same_projection():
    for matrix in (SHIFTED, orthographic(3, 2, 0.5, 9)):
        assert Projection.from_matrix(-2.5 * matrix).half == pytest.approx(Projection.from_matrix(matrix).half)


def test_parallel_views_that_begin_behind_the_eye_see_the_same():
    view, projection = VIEW, orthographic(3.0, 2.0, -10.0, 20.0, (0.5, 0.0))
    camera, holds = pg.Camera.from_matrices(view, projection), pg.HardwareDepth.of_projection(projection)
    assert camera.near > 0.0 and (holds.near, holds.far) == (camera.near, camera.far)
    points = np.random.default_rng(0).uniform(-2, 2, (9, 3))
    expected = np.c_[points, np.ones(9)] @ (projection @ view).T
    seen = np.c_[points, np.ones(9)] @ (camera.projection_matrix(9.0) @ camera.view_matrix()).T
    assert np.allclose(seen, expected, atol=1e-9)
    # what the engine's buffer holds is a distance from the camera's eye
    distance = (points - camera.eye) @ camera.forward
    assert np.allclose(holds.distance(0.5 + 0.5 * expected[:, 2]), distance, atol=1e-9)


@pytest.mark.parametrize("near", [0.0, -1e-6])
def test_parallel_views_that_begin_at_the_eye_keep_its_distances(near):
    """As three.js and others have it by default: nothing lies behind, so that nothing has to be put back."""
    projection = orthographic(3.0, 2.0, near, 20.0)
    camera, holds = pg.Camera.from_matrices(VIEW, projection), pg.HardwareDepth.of_projection(projection)
    assert np.allclose(camera.eye, (3, 2, 5), atol=1e-9)
    written = projection @ (0.0, 0.0, -7.0, 1.0)
    assert holds.distance(0.5 + 0.5 * written[2]) == pytest.approx(7.0, abs=1e-4)
    assert holds.back == 0.0


def test_distances_of_views_that_begin_behind_the_eye_can_be_the_engine_s():
    projection = orthographic(3.0, 2.0, -10.0, 20.0)
    holds = pg.HardwareDepth.of_projection(projection)
    distances = np.array([-9.0, 0.5, 19.0])
    written = -distances * projection[2, 2] + projection[2, 3]
    assert np.allclose(holds.distance(0.5 + 0.5 * written) - holds.back, distances)


@pytest.mark.parametrize(
    ("matrix", "text"),
    [
        (np.eye(3), r"expected a \(4, 4\) matrix, got shape \(3, 3\)"),
        (np.full((4, 4), np.nan), "holds NaN"),
        (np.zeros((4, 4)), "expected the last row 0 0 -1 0"),
        (SHIFTED.T, "it looks transposed"),
        (SHIFTED * [[1], [1], [1], [-1]], "a left-handed camera"),
        (SHIFTED + np.eye(4)[[1, 0, 2, 3]] * [[0.1], [0], [0], [0]], "sheared or its near plane is oblique"),
        (np.diag([-1.0, 1, 1, 1]) @ SHIFTED, "the picture is mirrored"),
        (SHIFTED * [[1], [1], [0], [1]], "no near and far planes"),
        ("x", "projection: expected a"),
    ],
)
def test_what_is_no_projection_is_named(matrix, text):
    with pytest.raises(InputError, match=text):
        Projection.from_matrix(matrix)


@pytest.mark.parametrize(
    ("matrix", "text"),
    [
        (np.diag([2.0, 2, 2, 1]), "axes of lengths"),
        (np.diag([1.0, 1, -1, 1]), "the matrix mirrors"),
        (SHIFTED, "expected an affine matrix"),
    ],
)
def test_what_is_no_view_is_named(matrix, text):
    with pytest.raises(InputError, match=text):
        pg.Camera.from_matrices(matrix, SHIFTED)
