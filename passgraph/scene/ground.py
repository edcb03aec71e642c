"""Floors: detect if a scene has one, and add a plain one to scenes without."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from passgraph.errors import InputError
from passgraph.kept_arrays import kept
from passgraph.scene.camera import Camera
from passgraph.scene.materials import Material, Node, Texture
from passgraph.scene.matrices import Float64, bounds_of, sphere_of, transform_points, translation
from passgraph.scene.meshes import Mesh
from passgraph.srgb import linear_to_srgb

# The texture shows 2 x 2 tiles, so that a checker repeats.
TILES = 2
# Warm stone, linear; chosen to be bright enough for a shadow to read and close enough not to distract.
LIGHT_TILE = (0.56, 0.50, 0.42)
DARK_TILE = (0.35, 0.30, 0.25)
GROUT = (0.17, 0.15, 0.13)
# Half width of the joint between tiles, and of the bevel beside it, as fractions of a tile.
_JOINT, _BEVEL = 0.014, 0.03
# Depth of the joints in texture units; the normal map is derived from the same depth.
HEIGHT_SCALE = 0.008


@lru_cache(maxsize=4)
def floor_material(size: int = 512, seed: int = 7) -> Material:
    """Return the material of stone tiles with beveled edges.

    Parameters
    ----------
    size : width and height of the three textures in texels
    seed : seed of the stone's tint

    >>> floor_material(64).normal_texture.decode().shape
    (64, 64, 4)
    """
    if not 16 <= size <= 4096:
        raise InputError(f"floor: size: expected 16 to 4096 texels, got {size}")
    color, normal, height = _tile_pictures(size, seed)
    name = "floor"
    return Material(
        name,
        (1.0, 1.0, 1.0, 1.0),
        Texture.make(color, "srgb", f"{name} base colour"),
        Texture.make(normal, "linear", f"{name} normal map"),
        Texture.make(height, "linear", f"{name} height map"),
        height_scale=HEIGHT_SCALE,
    )


@kept
def _tile_pictures(size: int, seed: int) -> tuple[NDArray[np.uint8], ...]:
    """Return the base color, the normal map and the height map of stone tiles."""
    axis = (np.arange(size) + 0.5) / size * TILES
    tile_x, tile_y = np.meshgrid(np.floor(axis), np.floor(axis))
    edge = np.minimum(axis % 1.0, 1.0 - axis % 1.0)
    distance = np.minimum(*np.meshgrid(edge, edge))
    ramp = np.clip((distance - _JOINT) / _BEVEL, 0.0, 1.0)
    stone = _noise(size, seed)
    height = ramp * ramp * (3.0 - 2.0 * ramp) * 0.9 + 0.1 * stone * ramp
    is_dark = ((tile_x + tile_y) % 2 == 1)[:, :, None]
    color = np.where(is_dark, DARK_TILE, LIGHT_TILE) * (0.88 + 0.24 * stone)[:, :, None]
    color = np.where((distance < _JOINT)[:, :, None], GROUT, color)
    encoded = linear_to_srgb(np.clip(color, 0.0, 1.0)).astype(np.float32)
    return _bytes(encoded), _bytes(0.5 + 0.5 * _normals(height, HEIGHT_SCALE * size)), _bytes(height)


def floor_node(bounds: ArrayLike, tile: float | None = None, name: str = "floor") -> Node:
    """Return a square floor under a box, three of its diagonals wide.

    Parameters
    ----------
    bounds : (2, 3) world box of the objects on the floor
    tile : width of a tile in scene units; None for a sixth of the box's diagonal

    >>> floor_node([[0, 1, 0], [1, 2, 1]]).bounds[:, 1].tolist()
    [1.0, 1.0]
    """
    box = bounds_of(bounds, "floor: bounds")
    centre, radius = sphere_of(box)
    width = radius / 3.0 if tile is None else float(tile)
    # whole pairs of tiles to each side, so that a joint is below the middle
    pairs = max(1, round(3.0 * radius / (TILES * width)))
    half = pairs * TILES * width
    place = np.array([centre[0], box[0, 1], centre[2]])
    corners = np.array([[-1, 0, 1], [1, 0, 1], [1, 0, -1], [-1, 0, -1]]) * half
    uvs = np.array([[0, 1], [1, 1], [1, 0], [0, 0]]) * (2.0 * pairs)
    mesh = Mesh.make(corners, np.array([[0, 1, 2], [0, 2, 3]]), np.tile([0.0, 1.0, 0.0], (4, 1)), uvs, name=name)
    return Node(mesh, floor_material(), translation(place), name)


def _bytes(values: NDArray[np.floating]) -> NDArray[np.uint8]:
    return np.asarray(np.rint(np.clip(values, 0.0, 1.0) * 255.0), dtype=np.uint8)


def _noise(size: int, seed: int) -> Float64:
    """Return periodic smooth noise in [0, 1], (size, size): random phases with a 1/f amplitude."""
    generator = np.random.default_rng(seed)
    frequency = np.fft.fftfreq(size) * size
    radius = np.hypot(*np.meshgrid(frequency, frequency))
    amplitude = np.where(radius > 1.5, 1.0 / np.maximum(radius, 1.0) ** 1.3, 0.0)
    field = np.fft.ifft2(amplitude * np.fft.fft2(generator.standard_normal((size, size)))).real
    low, high = np.percentile(field, [1.0, 99.0])
    return np.asarray(np.clip((field - low) / (high - low), 0.0, 1.0), dtype=np.float64)


def _normals(height: Float64, slope: float) -> Float64:
    """Return unit normals of a periodic height field, (h, w, 3), y up; ``slope`` is the height of 1 in texels."""
    right = (np.roll(height, -1, axis=1) - np.roll(height, 1, axis=1)) * slope / 2.0
    above = (np.roll(height, 1, axis=0) - np.roll(height, -1, axis=0)) * slope / 2.0
    normal = np.stack([-right, -above, np.ones_like(height)], axis=2)
    return np.asarray(normal / np.linalg.norm(normal, axis=2, keepdims=True), dtype=np.float64)


#: A floor covers this share of the scene's width times its depth (a round one 0.785), in CELLS² cells ...
COVERED, CELLS = 0.7, 32
#: ... and lies in the lowest part of its height, or is a sheet (terrain) no higher than this share of its width.
LOWEST, SHEET = 0.2, 0.25
#: A sheet no higher than this share of its width is flat: a floor, whichever of its sides is outside.
FLAT = 1e-6
#: Extent of the ground from the middle, in radii of the scene or distances of the eye; its edge is the horizon.
REACH = 100.0
#: Distance of the ground below the lowest vertex, in radii of the scene, so that faces there hide it.
BELOW = 1e-4
#: Gray stone, linear: bright enough for a shadow to read, darker than most skies.
GROUND = (0.42, 0.40, 0.38, 1.0)
#: The near plane, as a share of the distance of the nearest visible ground; and at least, of the far plane.
NEAR_SLACK, NEAR_OF_FAR = 0.9, 1e-4


def bounds_of_nodes(nodes: Sequence[Node]) -> Float64:
    """Return the world box around nodes, (2, 3): minimum, maximum."""
    boxes = np.stack([node.bounds for node in nodes])
    return np.stack([boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)])


def floors_of(nodes: Sequence[Node]) -> tuple[Node, ...]:
    """Return the nodes that are floors: they cover the scene from above, and everything else stands on them.

    >>> from passgraph.scene import Scene
    >>> [node.name for node in floors_of(Scene.shipped().nodes)]
    ['floor']
    """
    low, high = bounds_of_nodes(nodes)
    return tuple(node for node in nodes if _is_floor(node, low, high))


def has_floor(nodes: Sequence[Node]) -> bool:
    """Return True if a scene has a surface below that receives shadows: a node, or the lowest part of nodes.

    >>> from passgraph.scene import Scene
    >>> has_floor(Scene.shipped().nodes)
    True
    """
    low, high = bounds_of_nodes(nodes)
    if floors_of(nodes):
        return True
    return _covered([_low_and_up(node, low, high) for node in nodes], low, high) >= COVERED


def standing_points(nodes: Sequence[Node], floors: Sequence[Node]) -> Float64:
    """Return all vertices in the world, (n, 3) float64, without floors that other nodes stand on."""
    standing = [node for node in nodes if node not in floors] or nodes
    return np.concatenate([transform_points(node.transform, node.mesh.positions) for node in standing])


def _is_floor(node: Node, low: Float64, high: Float64) -> bool:
    """Return True for a node in the lowest part that covers the scene from above, or for a sheet that does, such as
    terrain."""
    node_low, node_high = node.bounds
    wide, tall = float(max(node_high[0] - node_low[0], node_high[2] - node_low[2])), float(node_high[1] - node_low[1])
    if _footprint(node_low, node_high) < COVERED * _footprint(low, high) or _footprint(low, high) == 0.0:
        return False
    if tall <= FLAT * wide:
        return bool(node_low[1] - low[1] <= max(LOWEST * (high[1] - low[1]), FLAT * wide))
    if node_high[1] - low[1] <= LOWEST * (high[1] - low[1]):
        return _covered([_low_and_up(node, low, high)], low, high) >= COVERED
    # closed bodies have equal areas facing up and down, a sheet only one of them
    corners, areas = _seen_from_above(node)
    if tall > SHEET * wide or float(areas.sum()) < COVERED * _footprint(low, high):
        return False
    return _covered([corners[areas > 0.0]], low, high) >= COVERED


def _footprint(low: Float64, high: Float64) -> float:
    return float((high[0] - low[0]) * (high[2] - low[2]))


def _low_and_up(node: Node, low: Float64, high: Float64) -> Float64:
    """Return the triangles of a node that face up in the lowest part of the scene, (m, 3, 3)."""
    corners, areas = _seen_from_above(node)
    is_low = corners[:, :, 1].max(axis=1) - low[1] <= LOWEST * (high[1] - low[1])
    return np.asarray(corners[(areas > 0.0) & is_low], dtype=np.float64)


def _seen_from_above(node: Node) -> tuple[Float64, Float64]:
    """Return the triangles of a node in the world, (m, 3, 3), and their areas seen from above, negative from below."""
    corners = transform_points(node.transform, node.mesh.positions)[node.mesh.triangles]
    areas = _area(corners)
    return corners, -areas if node.flips_winding else areas


def _area(corners: Float64) -> Float64:
    a, b = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    return np.asarray(0.5 * (a[:, 2] * b[:, 0] - a[:, 0] * b[:, 2]), dtype=np.float64)


def _covered(parts: Sequence[Float64], low: Float64, high: Float64) -> float:
    """Return the share of a scene's rectangle, seen from above, that triangles (m, 3, 3) cover, counted in cells."""
    size = high - low
    if _footprint(low, high) == 0.0:
        return 0.0
    corners = np.concatenate(parts)
    places = (corners[:, :, ::2] - low[::2]) / size[::2] * CELLS
    areas = np.abs(_area(corners)) / _footprint(low, high) * CELLS * CELLS
    # a triangle smaller than a cell covers the cell of its middle, a larger one the cells whose middles it contains
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


def lacks_ground(nodes: Sequence[Node], ground: bool | None) -> bool:
    """Return ``ground``, or if it is None, True for a scene without a floor."""
    return not has_floor(nodes) if ground is None else ground


def with_ground(nodes: Sequence[Node], camera: Camera) -> tuple[tuple[Node, ...], Camera]:
    """Return nodes with a plain floor under their lowest vertex, up to the horizon of a camera, and the camera.

    The camera's near and far planes are moved to hold the visible part of the floor.

    >>> node = Node(Mesh.make([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]))
    >>> nodes, _ = with_ground([node], Camera.framing(node.bounds))
    >>> [node.name for node in nodes]
    ['node', 'floor']
    """
    bounds = bounds_of_nodes(nodes)
    centre, radius = sphere_of(bounds)
    away = float(np.linalg.norm(np.subtract(camera.eye, centre)))
    half = REACH * max(radius, away)
    place = np.array([centre[0], bounds[0, 1] - BELOW * radius, centre[2]])
    corners = np.array([[-1, 0, 1], [1, 0, 1], [1, 0, -1], [-1, 0, -1]]) * half
    mesh = Mesh.make(corners, np.array([[0, 1, 2], [0, 2, 3]]), np.tile([0.0, 1.0, 0.0], (4, 1)), name="floor")
    floor = Node(mesh, Material("floor", GROUND), translation(place), "floor")
    return (*nodes, floor), seeing_floors(camera, [floor])


def seeing_floors(camera: Camera, floors: Sequence[Node]) -> Camera:
    """Return the camera with near and far planes that hold the visible part of level floors."""
    for floor in floors:
        camera = _seeing(camera, floor.bounds)
    return camera


def _seeing(camera: Camera, ground: Float64) -> Camera:
    eye, height = np.array(camera.eye), camera.eye[1] - float(ground[1, 1])
    right, up, back = camera.view_rotation()[:3, :3]
    far = max(camera.far, float(np.linalg.norm(np.abs(ground - eye).max(axis=0))))
    near = camera.near
    # an aspect ratio of 4 is assumed; the corners of wider pictures matter little for upright cameras
    (x, y), middle = camera.window(4.0).half, camera.window(4.0).middle
    for across, upward in ((-x, -y), (x, -y), (-x, y), (x, y)):
        offset = (middle[0] + across) * right + (middle[1] + upward) * up
        start, fall = (height + offset[1], back[1]) if camera.orthographic else (height, back[1] - offset[1])
        if start > 0.0 and fall > 0.0:
            near = min(near, max(NEAR_SLACK * start / float(fall), NEAR_OF_FAR * far))
    return replace(camera, near=near, far=far)
