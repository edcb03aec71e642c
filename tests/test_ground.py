"""Which scenes have a floor, and the ground under those that have none."""

from __future__ import annotations

import numpy as np
import pytest

from passgraph.scene import Camera, Mesh, Node, Scene, merge
from passgraph.scene.ground import BELOW, floors_of
from passgraph.scene.matrices import sphere_of, translation
from passgraph.scene.shipped_scene import ball, box, cylinder
from tests.effects.scenes import scaling


def quad(normal_up=True):
    order = [[0, 1, 2], [0, 2, 3]] if normal_up else [[2, 1, 0], [3, 2, 0]]
    return Mesh.make([[-1, 0, 1], [1, 0, 1], [1, 0, -1], [-1, 0, -1]], order)


def placed(mesh, at=(0.0, 0.0, 0.0), size=(1.0, 1.0, 1.0), name="node"):
    return Node(mesh, transform=translation(at) @ scaling(size), name=name)


def scene(*nodes):
    return Scene(nodes, Camera((0, 2, 9), (0, 0, 0)))


def hills(steep):
    axis = np.linspace(-1, 1, 20)
    x, z = np.meshgrid(axis, axis)
    index = np.arange(400).reshape(20, 20)
    a, b, c, d = index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]
    faces = np.concatenate([np.stack([a, d, c], -1), np.stack([a, c, b], -1)]).reshape(-1, 3)
    return Mesh.make(np.stack([x, steep * np.cos(3 * x) * np.sin(4 * z), z], -1).reshape(-1, 3), faces)


CUBE = placed(box(1.0), name="cube")
FLOOR = placed(quad(), size=(5, 1, 5), name="floor")
MIRRORED = np.diag([-5.0, 1.0, 5.0, 1.0])
SLAB = placed(box(1.0), (0, -0.1, 0), (6, 0.1, 6), "slab")
WHEELS = [placed(ball(0.3), (x, 0.3, z)) for x in (-1.5, 1.5) for z in (-0.8, 0.8)]

SCENES = {
    "a cube": ([CUBE], []),
    "a ball": ([placed(ball(1.0))], []),
    "a tower": ([placed(cylinder(1.0, 40.0))], []),
    "a plate, thick": ([placed(box(1.0), size=(50, 1, 30))], []),
    "two things apart": ([CUBE, placed(box(1.0), (9, 0, 9))], []),
    "a truck with a low bed": (
        [placed(box(1.0), (0, 0.5, 0), (4, 0.2, 2)), placed(box(1.0), (1, 0.7, 0)), *WHEELS],
        [],
    ),
    "a wall": ([Node(Mesh.make([[0, 0, 0], [1, 0, 0], [1, 1, 0]], [[0, 1, 2]]))], []),
    "a cube on a floor": ([CUBE, FLOOR], ["floor"]),
    "a cube on a floor that is mirrored": ([CUBE, Node(quad(False), transform=MIRRORED, name="floor")], ["floor"]),
    "a cube on a slab": ([CUBE, SLAB], ["slab"]),
    "a cube under a ceiling": ([CUBE, placed(quad(), (0, 3, 0), (5, 1, 5))], []),
    "only a floor": ([FLOOR], ["floor"]),
    "a floor upside down": ([placed(quad(False), name="floor")], ["floor"]),
    "a cube on hills": ([CUBE, placed(hills(0.1), size=(5, 5, 5), name="hills")], ["hills"]),
    "mountains": ([placed(hills(2.0))], []),
    "a floor for a corner": ([CUBE, placed(quad(), (4, 0, 4)), placed(box(1.0), (-4, 0, -4))], []),
}


@pytest.mark.parametrize("name", SCENES)
def test_what_is_a_floor(name):
    nodes, floors = SCENES[name]
    made = scene(*nodes)
    assert [node.name for node in floors_of(made.nodes)] == floors
    assert made.has_floor() == bool(floors)


def test_a_floor_that_is_part_of_a_mesh_counts():
    """And one that covers a part of the scene several times counts once."""
    one = merge([(CUBE.mesh, CUBE.transform), (FLOOR.mesh, FLOOR.transform)])
    assert scene(Node(one)).has_floor()
    patch, far = translation((-3, 0, 0)) @ scaling((2, 1, 5)), placed(box(1.0), (4.5, 0, 0))
    for layer in (FLOOR.mesh, hills(0.0)):
        assert not scene(Node(merge([(CUBE.mesh, CUBE.transform), *[(layer, patch)] * 5])), far).has_floor()


@pytest.mark.parametrize("at", [(0, 0, 0), (1e7, -3e6, 1e7)])
def test_the_ground_lies_under_the_lowest_vertex(at):
    bare = scene(placed(ball(1.0), at)).seen_from()
    made = bare.with_ground()
    radius = sphere_of(bare.bounds())[1]
    (low, high) = made.nodes[-1].bounds[:, 1]
    assert low == high
    assert 0.5 * BELOW * radius < bare.bounds()[0, 1] - high < 2.0 * BELOW * radius


@pytest.mark.parametrize("elevation", [0.0, 0.02, 0.3, 0.8, 1.5, np.pi / 2])
@pytest.mark.parametrize("fov", [0.1, 0.7, 2.0])
def test_the_camera_sees_the_ground_from_the_picture_s_edge_to_the_horizon(elevation, fov):
    """Rays through the picture, cut with the plane: none ends before near or behind far, or past the edge."""
    made = scene(CUBE).seen_from(0.4, elevation, vertical_fov_rad=fov).with_ground()
    camera, floor = made.camera, made.nodes[-1].bounds
    assert camera.near / camera.far > 1e-5
    right, up, back = camera.view_rotation()[:3, :3]
    half = np.array(camera.window(16 / 9).half)
    height = camera.eye[1] - floor[0, 1]
    seen = 0
    for x, y in [*np.random.default_rng(1).uniform(-1, 1, (200, 2)).tolist(), [-1, -1], [1, -1]]:
        ray = half[0] * x * right + half[1] * y * up - back
        if ray[1] < 0.0:
            depth = height / -ray[1]
            hit = camera.eye + depth * ray
            assert camera.near < depth
            if (np.abs(hit - floor.mean(axis=0)) <= 0.5 * (floor[1] - floor[0]) + 1e-9).all():
                seen += 1
                assert depth < camera.far
            else:  # beyond the edge, which is a pixel or so from the horizon
                assert -ray[1] / np.linalg.norm(ray) < 0.05
    assert seen > 0 or elevation < 0.1


def test_lights_and_cameras_stay_with_a_ground():
    bare = scene(CUBE).with_(lights=Scene.shipped().lights)
    made = bare.with_ground()
    assert made.lights == bare.lights
    assert (made.camera.eye, made.camera.target) == (bare.camera.eye, bare.camera.target)
