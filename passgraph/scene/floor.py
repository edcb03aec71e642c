"""A tiled floor: colours, normal map and height map made at run time, so that nothing large is shipped."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from passgraph.errors import InputError
from passgraph.scene.material import Material, Texture
from passgraph.scene.matrices import Float64, bounds_of, sphere_of, translation
from passgraph.scene.mesh import Mesh
from passgraph.scene.node import Node
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
    """Stone tiles with bevelled edges.

    Parameters
    ----------
    size : width and height of the three textures in texels
    seed : of the tint of the stone

    >>> floor_material(64).normal_texture.decode().shape
    (64, 64, 4)
    """
    if not 16 <= size <= 4096:
        raise InputError(f"floor: size: expected 16 to 4096 texels, got {size}")
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
    name = "floor"
    return Material(
        name,
        (1.0, 1.0, 1.0, 1.0),
        Texture.make(
            _bytes(linear_to_srgb(np.clip(color, 0.0, 1.0)).astype(np.float32)), "srgb", f"{name} base colour"
        ),
        Texture.make(_bytes(0.5 + 0.5 * _normals(height, HEIGHT_SCALE * size)), "linear", f"{name} normal map"),
        Texture.make(_bytes(height), "linear", f"{name} height map"),
        height_scale=HEIGHT_SCALE,
    )


def floor_node(bounds: ArrayLike, tile: float | None = None, name: str = "floor") -> Node:
    """A square floor under a box, three of its diagonals wide.

    Parameters
    ----------
    bounds : (2, 3) world box of what stands on the floor
    tile : width of a tile in scene units; None makes six across the box's diagonal

    >>> floor_node([[0, 1, 0], [1, 2, 1]]).bounds[:, 1].tolist()
    [1.0, 1.0]
    """
    box = bounds_of(bounds, "floor: bounds")
    centre, radius = sphere_of(box)
    width = radius / 3.0 if tile is None else float(tile)
    # whole pairs of tiles to each side, so that a joint passes below the middle
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
    """Periodic smooth noise in [0, 1], (size, size): random phases with a 1/f amplitude."""
    generator = np.random.default_rng(seed)
    frequency = np.fft.fftfreq(size) * size
    radius = np.hypot(*np.meshgrid(frequency, frequency))
    amplitude = np.where(radius > 1.5, 1.0 / np.maximum(radius, 1.0) ** 1.3, 0.0)
    field = np.fft.ifft2(amplitude * np.fft.fft2(generator.standard_normal((size, size)))).real
    low, high = np.percentile(field, [1.0, 99.0])
    return np.asarray(np.clip((field - low) / (high - low), 0.0, 1.0), dtype=np.float64)


def _normals(height: Float64, slope: float) -> Float64:
    """Unit normals of a periodic height field, (h, w, 3), y up; ``slope``: texels that 1 is high."""
    right = (np.roll(height, -1, axis=1) - np.roll(height, 1, axis=1)) * slope / 2.0
    above = (np.roll(height, 1, axis=0) - np.roll(height, -1, axis=0)) * slope / 2.0
    normal = np.stack([-right, -above, np.ones_like(height)], axis=2)
    return np.asarray(normal / np.linalg.norm(normal, axis=2, keepdims=True), dtype=np.float64)
