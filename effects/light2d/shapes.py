"""Triangles of a flat world, made on the host: rectangles, and shadows stretched from edges away from a light."""

# mypy: disable-error-code="no-any-return"
# Values of the kernel language are Any to Python's type checkers.
from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

import passgraph as pg
from passgraph import vec2, vec4
from passgraph.effects.light2d.world import Float64, Point

#: Far ends of shadows lie this many times farther from the light than the edge.
FAR = 2.0**20


@dataclass(frozen=True, eq=False)
class Shape:
    """Triangles whose positions are homogeneous: (x, y, w), the place being (x / w, y / w)."""

    positions: NDArray[np.float32]
    triangles: NDArray[np.int32]
    uvs: NDArray[np.float32]
    colors: NDArray[np.float32]


@pg.struct
class Spot:
    """A point of the world on its way to a pixel."""

    position: vec4
    place: vec2
    uv: vec2
    edge: vec4


@pg.vertex
def in_window(vertex: pg.Vertex, clip: vec4) -> Spot:
    """Homogeneous world places to clip space; ``clip`` is `Window.clip`."""
    w = vertex.position.z
    x = vertex.position.x * clip.x + w * clip.z
    y = vertex.position.y * clip.y + w * clip.w
    return Spot(vec4(x, y, 0.0, w), vec2(vertex.position.x, vertex.position.y), vertex.uv, vertex.color)


def quads(corners: Sequence[Sequence[Point]]) -> Shape:
    """Four corners each, in order; texture coordinates run (0, 1), (1, 1), (1, 0), (0, 0) around them."""
    places = np.array(corners, np.float64).reshape(-1, 2)
    count = len(places) // 4
    positions = np.column_stack([places, np.ones(len(places))])
    uvs = np.tile([[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]], (count, 1))
    return _shape(positions, uvs, np.zeros((len(places), 4)))


def shadow_of(edges: Float64, light: Point) -> Shape:
    """What lies behind edges (n, 4) as seen from a light: one quad an edge, without end.

    Neighbouring edges share their corners to the last bit, so no light passes between their quads.  Every
    vertex carries its edge (ax, ay, bx, by) as its color.
    """
    ends = edges.reshape(-1, 2, 2)
    away = ends - np.array(light)
    near = np.concatenate([ends, np.ones((len(ends), 2, 1))], axis=2)
    # light + FAR · (corner - light), divided through by FAR
    far = np.concatenate([away + np.array(light) / FAR, np.full((len(ends), 2, 1), 1.0 / FAR)], axis=2)
    positions = np.stack([near[:, 0], near[:, 1], far[:, 1], far[:, 0]], axis=1).reshape(-1, 3)
    return _shape(positions, np.zeros((len(positions), 2)), np.repeat(edges, 4, axis=0))


def _shape(positions: Float64, uvs: Float64, colors: Float64) -> Shape:
    first = 4 * np.arange(len(positions) // 4, dtype=np.int32)[:, None]
    triangles = (first + np.array([0, 1, 2, 0, 2, 3], np.int32)).reshape(-1, 3)
    return Shape(
        positions.astype(np.float32), triangles.astype(np.int32), uvs.astype(np.float32), colors.astype(np.float32)
    )


def around(center: Point, half: float) -> Shape:
    """An upright square."""
    x, y = center
    return quads([[(x - half, y - half), (x + half, y - half), (x + half, y + half), (x - half, y + half)]])
