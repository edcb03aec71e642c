"""Floors: whether a scene has one, and a plain one for scenes that have none."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from passgraph.scene.camera import Camera
from passgraph.scene.material import Material
from passgraph.scene.matrices import Float64, sphere_of, transform_points, translation
from passgraph.scene.mesh import Mesh
from passgraph.scene.node import Node

if TYPE_CHECKING:
    from passgraph.scene.scene import Scene

#: A floor covers this share of the scene's width times its depth (a round one 0.785), in CELLS² cells ...
COVERED, CELLS = 0.7, 32
#: ... and lies in the lowest part of its height, or is a sheet (terrain) no higher than this share of its width.
LOWEST, SHEET = 0.2, 0.25
#: A sheet no higher than this share of its width is flat: a floor, whichever of its sides is outside.
FLAT = 1e-6
#: The ground reaches so many radii of the scene, or distances of the eye, from the middle: its edge is the horizon.
REACH = 100.0
#: It lies under the lowest vertex by this share of the scene's radius, so that a face there hides it.
BELOW = 1e-4
#: Grey stone, linear: bright enough for a shadow to read, darker than most skies.
GROUND = (0.42, 0.40, 0.38, 1.0)
#: Of the near plane, before the nearest ground that is seen; and the least share of the far plane that it may be.
NEAR_SLACK, NEAR_OF_FAR = 0.9, 1e-4


def floors_of(scene: Scene) -> tuple[Node, ...]:
    """The nodes that are floors: wide, seen from above, with all else on them.

    >>> from passgraph.scene import Scene
    >>> [node.name for node in floors_of(Scene.shipped())]
    ['floor']
    """
    low, high = scene.bounds()
    return tuple(node for node in scene.nodes if _is_floor(node, low, high))


def has_floor(scene: Scene) -> bool:
    """Whether something under the scene shows its shadows: a node, or the lowest part of several or of one.

    >>> from passgraph.scene import Scene
    >>> has_floor(Scene.shipped())
    True
    """
    low, high = scene.bounds()
    if floors_of(scene):
        return True
    return _covered([_low_and_up(node, low, high) for node in scene.nodes], low, high) >= COVERED


def _is_floor(node: Node, low: Float64, high: Float64) -> bool:
    """What lies in the lowest part and covers the scene from above; or a sheet that does, such as terrain."""
    node_low, node_high = node.bounds
    wide, tall = float(max(node_high[0] - node_low[0], node_high[2] - node_low[2])), float(node_high[1] - node_low[1])
    if _footprint(node_low, node_high) < COVERED * _footprint(low, high) or _footprint(low, high) == 0.0:
        return False
    if tall <= FLAT * wide:
        return bool(node_low[1] - low[1] <= max(LOWEST * (high[1] - low[1]), FLAT * wide))
    if node_high[1] - low[1] <= LOWEST * (high[1] - low[1]):
        return _covered([_low_and_up(node, low, high)], low, high) >= COVERED
    # closed bodies have as much that looks up as down, a sheet has only the one
    corners, areas = _seen_from_above(node)
    if tall > SHEET * wide or float(areas.sum()) < COVERED * _footprint(low, high):
        return False
    return _covered([corners[areas > 0.0]], low, high) >= COVERED


def _footprint(low: Float64, high: Float64) -> float:
    return float((high[0] - low[0]) * (high[2] - low[2]))


def _low_and_up(node: Node, low: Float64, high: Float64) -> Float64:
    """The triangles of a node that look up in the lowest part of the scene, (m, 3, 3)."""
    corners, areas = _seen_from_above(node)
    is_low = corners[:, :, 1].max(axis=1) - low[1] <= LOWEST * (high[1] - low[1])
    return np.asarray(corners[(areas > 0.0) & is_low], dtype=np.float64)


def _seen_from_above(node: Node) -> tuple[Float64, Float64]:
    """The triangles of a node in the world, (m, 3, 3), and their areas seen from above, negative from below."""
    corners = transform_points(node.transform, node.mesh.positions)[node.mesh.triangles]
    areas = _area(corners)
    return corners, -areas if node.flips_winding else areas


def _area(corners: Float64) -> Float64:
    a, b = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    return np.asarray(0.5 * (a[:, 2] * b[:, 0] - a[:, 0] * b[:, 2]), dtype=np.float64)


def _covered(parts: Sequence[Float64], low: Float64, high: Float64) -> float:
    """The share of a scene's rectangle, seen from above, that triangles (m, 3, 3) cover: in cells, each but once."""
    size = high - low
    if _footprint(low, high) == 0.0:
        return 0.0
    corners = np.concatenate(parts)
    places = (corners[:, :, ::2] - low[::2]) / size[::2] * CELLS
    areas = np.abs(_area(corners)) / _footprint(low, high) * CELLS * CELLS
    # what is smaller than a cell counts where its middle is, what is larger where it holds a cell's middle
    at = np.clip(places.mean(axis=1).astype(np.int64), 0, CELLS - 1)
    is_small = areas < 1.0
    share = np.zeros((CELLS, CELLS))
    np.add.at(share, tuple(at[is_small].T), areas[is_small])
    middles = np.stack(np.meshgrid(np.arange(CELLS), np.arange(CELLS), indexing="ij"), axis=-1) + 0.5
    for triangle in places[~is_small]:
        edges = np.roll(triangle, -1, axis=0) - triangle
        away = middles[:, :, None] - triangle
        side = edges[:, 0] * away[..., 1] - edges[:, 1] * away[..., 0]
        share[(side >= 0.0).all(axis=2) | (side <= 0.0).all(axis=2)] = 1.0
    return float(np.minimum(share, 1.0).mean())


def lacks_ground(scene: Scene, wanted: bool | None) -> bool:
    """Whether a floor is to be laid: what is wanted, or where nothing is said (None), under what has none."""
    return not has_floor(scene) if wanted is None else wanted


def with_ground(scene: Scene) -> Scene:
    """The scene with a plain floor under its lowest vertex, as far as its camera sees to the horizon.

    The near and far planes of the camera are moved to hold what it sees of the floor.

    >>> from passgraph.scene import Scene
    >>> node = Node(Mesh.make([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]))
    >>> bare = Scene((node,), Camera.framing(node.bounds))
    >>> [node.name for node in with_ground(bare).nodes]
    ['node', 'floor']
    """
    centre, radius = sphere_of(scene.bounds())
    away = float(np.linalg.norm(np.subtract(scene.camera.eye, centre)))
    half = REACH * max(radius, away)
    place = np.array([centre[0], scene.bounds()[0, 1] - BELOW * radius, centre[2]])
    corners = np.array([[-1, 0, 1], [1, 0, 1], [1, 0, -1], [-1, 0, -1]]) * half
    mesh = Mesh.make(corners, np.array([[0, 1, 2], [0, 2, 3]]), np.tile([0.0, 1.0, 0.0], (4, 1)), name="floor")
    floor = Node(mesh, Material("floor", GROUND), translation(place), "floor")
    return scene.with_(nodes=(*scene.nodes, floor), camera=seeing_ground(scene.camera, floor.bounds))


def seeing_ground(camera: Camera, ground: Float64) -> Camera:
    """The camera with near and far planes that hold what it sees of a level floor with these bounds."""
    eye, height = np.array(camera.eye), camera.eye[1] - float(ground[1, 1])
    right, up, back = camera.view_rotation()[:3, :3]
    far = max(camera.far, float(np.linalg.norm(np.abs(ground - eye).max(axis=0))))
    near = camera.near
    # no picture is wider than four times its height where its corners could matter: cameras stand upright
    (x, y), middle = camera.window(4.0).half, camera.window(4.0).middle
    for across, upward in ((-x, -y), (x, -y), (-x, y), (x, y)):
        offset = (middle[0] + across) * right + (middle[1] + upward) * up
        start, fall = (height + offset[1], back[1]) if camera.orthographic else (height, back[1] - offset[1])
        if start > 0.0 and fall > 0.0:
            near = min(near, max(NEAR_SLACK * start / float(fall), NEAR_OF_FAR * far))
    return replace(camera, near=near, far=far)
