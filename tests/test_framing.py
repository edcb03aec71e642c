"""Cameras that points fill, held against a linear program and against their own projection."""

from __future__ import annotations

from math import pi, radians, tan

import numpy as np
import pytest
from scipy.optimize import linprog

from passgraph.errors import InputError
from passgraph.scene import Camera, Node, Scene
from passgraph.scene.camera import FRAME_MARGIN
from passgraph.scene.shipped_scene import box
from tests.effects.scenes import scaling

FULL = 1.0 / (1.0 + FRAME_MARGIN)


def cloud(seed, count=40, scale=(1.0, 1.0, 1.0), offset=0.0):
    return np.random.default_rng(seed).normal(size=(count, 3)) * scale + offset


def seen(camera, points, aspect):
    """Places in the picture, -1 to 1, and depths in clip space."""
    matrix = camera.projection_matrix(aspect) @ camera.view_rotation()
    v = np.c_[points - np.array(camera.eye), np.ones(len(points))] @ matrix.T
    return v[:, :3] / v[:, 3:]


@pytest.mark.parametrize("scale", [(1, 1, 1), (2, 5, 2), (9, 0.0, 4), (1e-4, 1e-4, 1e-4), (1e-9,) * 3], ids=str)
@pytest.mark.parametrize(("azimuth", "elevation"), [(0.0, 0.0), (0.6, 0.45), (-2.0, -1.2), (4.0, pi / 2)])
@pytest.mark.parametrize("aspect", [0.4, 16 / 9])
def test_points_fill_the_picture_to_its_margin(scale, azimuth, elevation, aspect):
    points = cloud(3, scale=scale)
    camera = Camera.orbit(points, azimuth, elevation, aspect=aspect)
    low, high = seen(camera, points, aspect)[:, :2].min(axis=0), seen(camera, points, aspect)[:, :2].max(axis=0)
    np.testing.assert_allclose(low, -high, atol=1e-6)
    assert high.max() == pytest.approx(FULL, abs=1e-6)
    assert np.abs(seen(camera, points, aspect)[:, 2]).max() < 1.0


@pytest.mark.parametrize("seed", range(4))
def test_no_eye_is_nearer(seed):
    """Least distance along the view axis with every point within the margin, by a linear program."""
    points, aspect, fov = cloud(seed, scale=(1, 2, 0.7)), 1.5, 0.8
    camera = Camera.orbit(points, 0.7, 0.3, aspect=aspect, vertical_fov_rad=fov)
    local = points @ camera.view_rotation()[:3, :3].T
    rows, limits = [], []
    for axis, tangent in ((0, tan(fov / 2) * FULL * aspect), (1, tan(fov / 2) * FULL)):
        for sign in (1.0, -1.0):
            row = np.zeros((len(points), 3))
            row[:, axis], row[:, 2] = -sign, -tangent
            rows.append(row)
            limits.append(-sign * local[:, axis] - tangent * local[:, 2])
    found = linprog([0, 0, 1], np.concatenate(rows), np.concatenate(limits), bounds=[(None, None)] * 3)
    assert camera.view_rotation()[2, :3] @ camera.eye == pytest.approx(found.fun, abs=1e-7)


@pytest.mark.parametrize("offset", [1e7, -1e7])
def test_far_from_the_origin_the_fit_keeps_seven_digits(offset):
    points = cloud(5, offset=offset)
    places = seen(Camera.orbit(points, 1.0, 0.4), points, 16 / 9)
    assert np.abs(places[:, :2]).max() == pytest.approx(FULL, abs=1e-6)


@pytest.mark.parametrize(
    ("azimuth", "elevation", "place"),
    [(0, 0, (0, 0, 5)), (90, 0, (5, 0, 0)), (180, 0, (0, 0, -5)), (0, 90, (0, 5, 0)), (0, -90, (0, -5, 0))],
)
def test_angles_are_those_of_the_documentation(azimuth, elevation, place):
    camera = Camera.orbit([[-1, -1, -1], [1, 1, 1]], radians(azimuth), radians(elevation), distance=5.0)
    np.testing.assert_allclose(camera.eye, place, atol=1e-12)
    np.testing.assert_allclose(camera.target, (0, 0, 0), atol=1e-12)


def test_a_point_a_line_along_the_view_and_one_triangle_can_be_seen():
    for points in ([[1.0, 2.0, 3.0]], [[0, 0, 0], [0, 0, 9.0]], [[0, 0, 0], [1, 0, 0], [0, 1, 0]]):
        camera = Camera.orbit(points, 0.0, 0.0)
        assert np.abs(seen(camera, np.array(points, float), 16 / 9)).max() <= 1.0


def test_an_eye_amid_the_points_keeps_a_near_plane():
    camera = Camera.orbit(cloud(1), distance=0.1)
    assert 0.0 < camera.near < 0.05 < camera.far


@pytest.mark.parametrize(
    ("given", "text"),
    [
        ({"points": []}, "camera: points: expected shape (n, 3), n at least 1, finite"),
        ({"points": [[0, 0, np.nan]]}, "camera: points: expected shape (n, 3), n at least 1, finite"),
        ({"elevation_rad": 1.6}, "camera: elevation_rad: expected a finite number in [-1.5708, 1.5708], got 1.6"),
        ({"azimuth_rad": np.inf}, "camera: azimuth_rad: expected a finite number"),
        ({"vertical_fov_rad": 0.0}, "camera: vertical_fov_rad: expected a finite number in ]0, 3.13845], got 0"),
        ({"vertical_fov_rad": pi}, "camera: vertical_fov_rad: expected a finite number in ]0, 3.13845], got 3.14159"),
        ({"distance": 0.0}, "camera: distance: expected a finite number in ]0, inf], got 0"),
        ({"distance": 1e-30}, "camera: distance: 1e-30 is lost beside coordinates of 0.5"),
    ],
)
def test_what_cannot_be_seen_is_refused(given, text):
    with pytest.raises(InputError) as caught:
        Camera.orbit(**{"points": [[0, 0, 0], [1, 1, 1]], **given})
    assert str(caught.value).startswith(text)


def test_a_zoom_magnifies_by_its_factor():
    for camera in (Camera((0, 0, 5), (0, 0, 0)), Camera((0, 0, 5), (0, 0, 0), orthographic_height=3.0)):
        point = np.array([[0.1, 0.2, 0.0]])
        np.testing.assert_allclose(seen(camera.zoomed(3.0), point, 1.5)[:, :2], 3.0 * seen(camera, point, 1.5)[:, :2])
    with pytest.raises(InputError, match=r"camera: zoom: 1e-09 makes an angle of view of 3.14"):
        Camera((0, 0, 5), (0, 0, 0)).zoomed(1e-9)


def test_every_view_of_a_turntable_holds_all_and_stands_as_far():
    scene = Scene.shipped()
    points = scene.points()
    middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
    views = scene.turntable(7, 0.2, 0.4)
    reach = [np.abs(seen(camera, points, 16 / 9)).max(axis=0) for camera in views]
    assert np.max(reach) < FULL + 1e-9
    assert np.max([r[:2] for r in reach]) > 0.97 * FULL
    away = [np.linalg.norm(np.subtract(camera.eye, middle)) for camera in views]
    np.testing.assert_allclose(away, away[0], rtol=1e-12)
    turns = [np.arctan2(*np.subtract(camera.eye, middle)[[0, 2]]) for camera in views]
    np.testing.assert_allclose(np.diff(np.unwrap(turns)), 2 * pi / 7)


@pytest.mark.parametrize("size", [(9, 1, 1), (1, 9, 1), (3, 3, 3)], ids=str)
def test_a_turntable_is_filled_by_what_the_model_sweeps(size):
    """A box has a corner at the edge of what it sweeps at some angle; 64 corners a turn stand in for the circle."""
    scene = Scene((Node(box(1.0), transform=scaling(size)),), Camera((0, 0, 5), (0, 0, 0)))
    views = scene.turntable(90, elevation_rad=0.3, aspect=1.0)
    reach = max(np.abs(seen(camera, scene.points(), 1.0)[:, :2]).max() for camera in views)
    assert 0.99 * FULL < reach < FULL + 1e-9


def test_what_stands_on_a_floor_fills_the_picture_and_the_floor_does_not():
    scene = Scene.shipped()
    assert len(scene.points()) == sum(node.mesh.vertex_count for node in scene.nodes[1:])
    camera = scene.seen_from(1.0, 0.3, aspect=1.0).camera
    assert np.abs(seen(camera, scene.points(), 1.0)[:, :2]).max() == pytest.approx(FULL, abs=1e-6)
