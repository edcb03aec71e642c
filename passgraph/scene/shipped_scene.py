"""The shipped scene, with shadow casters that touch the floor, and tall, thin and round ones."""

from __future__ import annotations

from math import cos, pi, sin

import numpy as np

from passgraph.scene.camera import Camera, NamedCamera
from passgraph.scene.ground import floor_node
from passgraph.scene.lights import Light
from passgraph.scene.materials import Material, Node
from passgraph.scene.matrices import Float64, rotation_y, translation
from passgraph.scene.meshes import Mesh
from passgraph.scene.scene_parts import SceneParts
from passgraph.scene.teapot import teapot_mesh

# Linear base colors: a glazed blue-green pot, two warm props, one pale pillar.
TEAL = (0.045, 0.26, 0.29, 1.0)
TERRACOTTA = (0.60, 0.20, 0.09, 1.0)
OCHRE = (0.72, 0.43, 0.10, 1.0)
CHALK = (0.78, 0.75, 0.69, 1.0)


def shipped_scene(segments: int = 16) -> SceneParts:
    """Return the Utah teapot, a pillar, a box and a ball on a tiled floor, under one light with an extent.

    Parameters
    ----------
    segments : segments along each side of a teapot patch

    >>> [node.name for node in shipped_scene(4).nodes]
    ['floor', 'teapot', 'pillar', 'box', 'ball']
    """
    floor = floor_node([[-5.0, 0.0, -5.0], [5.0, 3.2, 5.0]], tile=1.25)
    nodes = (
        floor,
        Node(teapot_mesh(segments), Material("glaze", TEAL), rotation_y(0.35), "teapot"),
        Node(cylinder(0.16, 4.2), Material("chalk", CHALK), translation((-3.5, 0.0, 2.2)), "pillar"),
        Node(box(1.1), Material("terracotta", TERRACOTTA), translation((2.6, 0, -2.6)) @ rotation_y(0.5), "box"),
        Node(ball(0.55), Material("ochre", OCHRE), translation((2.5, 0.55, 2.3)), "ball"),
    )
    camera = Camera((3.2, 6.6, 10.6), (0.2, 0.75, 0.1), vertical_fov_rad=0.57, near=1.0, far=60.0)
    light = Light.directional((0.78, -1.0, 0.0), (1.0, 0.95, 0.87), 0.9, radius=0.06, name="key light")
    return SceneParts(nodes, camera, (light,), "shipped scene", cameras=(NamedCamera("three-quarter", camera),))


def box(size: float) -> Mesh:
    """Return a cube that stands on y = 0, with flat sides.

    >>> box(2.0).bounds.tolist()
    [[-1.0, 0.0, -1.0], [1.0, 2.0, 1.0]]
    """
    square = np.array([[-1, -1, 1], [1, -1, 1], [1, 1, 1], [-1, 1, 1]], dtype=np.float64)
    turns = [np.roll(np.eye(3), k, axis=0) * s for k in range(3) for s in (1.0, -1.0)]
    points, normals, faces = [], [], []
    for index, turn in enumerate(turns):
        points.append(square @ turn.T)
        normals.append(np.tile(turn @ np.array([0.0, 0.0, 1.0]), (4, 1)))
        order = np.array([[0, 1, 2], [0, 2, 3]])
        # three of the six transforms mirror
        faces.append((order if np.linalg.det(turn) > 0.0 else order[:, ::-1]) + 4 * index)
    places = (np.concatenate(points) + np.array([0.0, 1.0, 0.0])) * (0.5 * size)
    return Mesh.make(places, np.concatenate(faces), np.concatenate(normals), name="box")


def cylinder(radius: float, height: float, sides: int = 48) -> Mesh:
    """Return a closed upright cylinder that stands on y = 0; smooth around, sharp at the rims.

    >>> cylinder(1.0, 2.0).bounds[:, 1].tolist()
    [0.0, 2.0]
    """
    profile = [
        ((0, 0), (0, -1)),
        ((1, 0), (0, -1)),
        ((1, 0), (1, 0)),
        ((1, 1), (1, 0)),
        ((1, 1), (0, 1)),
        ((0, 1), (0, 1)),
    ]
    rows = np.array([[radius * r, height * y, nr, ny] for (r, y), (nr, ny) in profile], dtype=np.float64)
    return _turned(rows, sides, "cylinder")


def ball(radius: float, rings: int = 32) -> Mesh:
    """Return a sphere around the origin.

    >>> ball(1.0).bounds[:, 1].tolist()
    [-1.0, 1.0]
    """
    angles = [-pi / 2 + pi * k / rings for k in range(rings + 1)]
    rows = np.array([[radius * cos(a), radius * sin(a), cos(a), sin(a)] for a in angles])
    rows[[0, -1], 0] = 0.0
    return _turned(rows, 2 * rings, "ball")


def _turned(rows: Float64, sides: int, name: str) -> Mesh:
    """Return a surface of revolution about y from rows of radius, y and normal (radial, y), bottom to top."""
    angle = 2.0 * pi * np.arange(sides) / sides
    around = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    count = len(rows)
    points = np.zeros((count, sides, 3))
    normals = np.zeros((count, sides, 3))
    for target, (radial, upward) in ((points, (0, 1)), (normals, (2, 3))):
        target[:, :, 0] = rows[:, radial, None] * around[:, 0]
        target[:, :, 2] = -rows[:, radial, None] * around[:, 1]
        target[:, :, 1] = rows[:, upward, None]
    index = np.arange(count * sides).reshape(count, sides)
    here, following = index, np.roll(index, -1, axis=1)
    lower = np.stack([here[:-1], following[:-1], following[1:]], axis=2).reshape(-1, 3)
    upper = np.stack([here[:-1], following[1:], here[1:]], axis=2).reshape(-1, 3)
    faces = np.concatenate([lower, upper])
    places = points.reshape(-1, 3)
    a, b, c = places[faces].transpose(1, 0, 2)
    # rings of radius zero and rings repeated for a crease give triangles without area
    keep = np.linalg.norm(np.cross(b - a, c - a), axis=1) > 1e-12
    return Mesh.make(places, faces[keep], normals.reshape(-1, 3), name=name)
