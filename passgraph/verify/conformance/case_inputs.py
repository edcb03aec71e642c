"""Inputs of cases: small meshes, a scene with coarse textures, a picture, a depth map and a 2D world."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

import passgraph as pg
from passgraph.scene.matrices import rotation_y, translation
from passgraph.scene.shipped_scene import box
from passgraph.verify.conformance.case import Picture

if TYPE_CHECKING:
    from passgraph.effects.light2d import World2D


@dataclass(frozen=True, eq=False)
class Soup:
    """Triangles; ``positions`` (n, 3), ``triangles`` (m, 3), ``colors`` (n, 4)."""

    positions: NDArray[np.float32]
    triangles: NDArray[np.int32]
    colors: NDArray[np.float32]


def soup(count: int, seed: int, size: float = 0.8, depth: tuple[float, float] = (-0.9, 0.9)) -> Soup:
    """Return random overlapping triangles of both windings."""
    random = np.random.default_rng(seed)
    centres = random.uniform(-1, 1, (count, 1, 2))
    corners = centres + random.uniform(-size, size, (count, 3, 2))
    z = random.uniform(*depth, (count, 3, 1))
    positions = np.concatenate([corners, z], -1).reshape(-1, 3).astype(np.float32)
    colors = random.uniform(0, 1, (count * 3, 4)).astype(np.float32)
    return Soup(positions, np.arange(count * 3, dtype=np.int32).reshape(-1, 3), colors)


def quad(z: float = 0.0, color: tuple[float, ...] = (1, 1, 1, 1), half: float = 1.0) -> Soup:
    """Return two triangles that cover the square from -half to half, counter-clockwise with y up."""
    positions = np.array([[-half, -half, z], [half, -half, z], [half, half, z], [-half, half, z]], np.float32)
    return Soup(positions, np.array([[0, 1, 2], [0, 2, 3]], np.int32), np.tile(np.array(color, np.float32), (4, 1)))


def soup_of(positions: object, triangles: object, colors: object = (1.0, 1.0, 1.0, 1.0)) -> Soup:
    """Build a soup from nested numbers; one color for all corners, or one for each."""
    points = np.asarray(positions, np.float32).reshape(-1, 3)
    corner = np.broadcast_to(np.asarray(colors, np.float32), (len(points), 4)).copy()
    return Soup(points, np.asarray(triangles, np.int32).reshape(-1, 3), corner)


SIZE = (48, 32)


@lru_cache
def scene(light: str = "sun") -> pg.Scene:
    """Return two boxes on a floor of four tiles, under an area light: "sun", "spot", "point" or "two"."""
    sun = pg.Light.directional((0.6, -1.0, 0.35), (1.0, 0.95, 0.87), 0.9, radius=0.06)
    lights = {
        "sun": (sun,),
        "spot": (pg.Light.spot((2, 4, 3), (-0.5, -1, -0.8), intensity=22, radius=0.2, cone_outer_rad=0.5),),
        "point": (pg.Light.point((0.2, 2.4, 1.0), (1, 0.9, 0.7), 4.0, radius=0.1),),
        "two": (sun, pg.Light.directional((-0.5, -1.0, 0.2), (0.3, 0.3, 1.0), 0.5, radius=0.1)),
    }[light]
    nodes = (
        _floor(),
        pg.Node(box(1.0), pg.Material("grey", (0.5, 0.5, 0.5, 1)), translation((0.2, 0, 0)) @ rotation_y(0.4), "box"),
        pg.Node(box(0.5), pg.Material("red", (0.7, 0.2, 0.1, 1)), translation((-1.1, 0, 0.9)), "small box"),
    )
    return pg.Scene(nodes, pg.Camera((1.8, 4.2, 4.2), (0, 0.2, 0), vertical_fov_rad=0.6), lights, "conformance scene")


def _floor() -> pg.Node:
    corners = np.array([[-1, 0, 1], [1, 0, 1], [1, 0, -1], [-1, 0, -1.0]]) * 2.5
    uvs = [[0, 1], [1, 1], [1, 0], [0, 0]]
    up = np.tile([0.0, 1.0, 0.0], (4, 1))
    tiles = np.array([[[200, 180, 150], [120, 130, 140]], [[120, 130, 140], [200, 180, 150]]], np.uint8)
    material = pg.Material("tiles", (1, 1, 1, 1), pg.Texture.make(tiles, "srgb", "tiles"))
    return pg.Node(pg.Mesh.make(corners, [[0, 1, 2], [0, 2, 3]], up, uvs), material, name="floor")


def picture(size: tuple[int, int] = SIZE, seed: int = 0) -> Picture:
    """Return ramps, a bright disc above 1, an edge and noise; the last row has special numbers.

    >>> picture((8, 4)).shape
    (4, 8, 4)
    """
    width, height = size
    y, x = (v + 0.5 for v in np.mgrid[0:height, 0:width].astype(np.float64))
    noise = np.random.default_rng(seed).uniform(0.0, 0.1, (height, width, 3))
    disc = 3.0 * ((x / width - 0.6) ** 2 + (y / height - 0.4) ** 2 < 0.04)
    edge = 0.3 * (x + 0.5 * y > 0.4 * width)
    colours = np.stack([x / width, y / height, 1.0 - x / width], -1) * 0.6 + (disc + edge)[:, :, None] + noise
    special = np.array([0.0, 1.0, 0.5, 0.5 / 255, 254.5 / 255, 1e-6, 100.0, 1000.0])
    colours[-1] = special[np.arange(width) % len(special), None]
    return np.dstack([colours, np.ones_like(x)]).astype(np.float32)


def plausible(size: tuple[int, int] = SIZE, seed: int = 0) -> Picture:
    """Return a plausible picture of a camera or renderer: 0 to 1, highlights up to 10,000, alpha from 0 to 1, and a row
    of zeros.

    >>> float(plausible((8, 4)).max()), plausible((8, 4))[0].any()
    (10000.0, np.False_)
    """
    pixels = picture(size, seed)
    pixels[-1] = np.geomspace(1.0, 1e4, size[0], dtype=np.float32)[:, None]
    pixels[..., 3] = np.linspace(0.0, 1.0, size[0], dtype=np.float32)
    pixels[0] = 0.0
    return pixels


#: Number type of a channel (`Format.number`) → special numbers: zeros, ones, halves, huge and tiny ones.
_SPECIAL = {
    "f4": (0.0, 1.0, 0.5, -1.0, -2.5, 2.0, 1e20, -1e20, 3e38, 1e-20, -1e-20, 1e-37, 8388609.0, -7.0, 4294967296.0),
    "f2": (0.0, 1.0, 0.5, -1.0, -2.5, 2.0, 65504.0, -65504.0, 2.0**-14, -(2.0**-14), 2.0**-24, 2049.0, -7.0),
}
_SPECIAL_STEPS = (0.0, 1.0, 0.5, 1 / 255, 254 / 255, 128 / 255, 1 / 65535)


def with_special(picture: Picture, number: str) -> Picture:
    """Return the picture with special numbers in its lower quarter, next to each other in many combinations.

    The rest stays ordinary, so that passes with a wide footprint also read ordinary numbers.

    >>> with_special(np.full((4, 3, 1), 0.25, np.float32), "u1")[2:, :, 0].tolist()
    [[0.25, 0.25, 0.25], [0.0, 1.0, 0.5]]
    """
    values = np.array(_SPECIAL.get(number, _SPECIAL_STEPS), np.float32)
    height, width, channels = picture.shape
    count = max(height // 4, 1)
    y, x, channel = np.mgrid[0:count, 0:width, 0:channels]
    changed = picture.copy()
    changed[height - count :] = values[(x + y * channel + x * channel // len(values)) % len(values)]
    return changed


def depth() -> Picture:
    """Return a linear depth map: a slope with a step."""
    width, height = SIZE
    y, x = np.mgrid[0:height, 0:width] + 0.5
    slope: Picture = (2.0 + 0.05 * y + 3.0 * (x > 20.25))[:, :, None].astype(np.float32)
    return slope


@lru_cache
def world() -> World2D:
    """Return a room with a pillar and an open wall, lit by a lamp."""
    from passgraph.effects.light2d import Light2D, Wall, Window, World2D

    walls = (Wall.box(2.3, 1.9, 2.9, 2.6), Wall(((0.6, 2.7), (1.6, 3.1)), closed=False))
    lamp = Light2D((1.2, 1.1), (1.0, 0.9, 0.6), radius=4.0, size=0.2)
    return World2D(Window(0.013, 0.021, 6.013, 4.021), walls, (lamp,))
