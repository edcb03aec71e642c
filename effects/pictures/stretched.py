"""Flat shapes with homogeneous corners, and pictures stretched over targets with fixed-function blending."""

# mypy: disable-error-code="no-any-return"
# Values of the kernel language are Any to Python's type checkers.
from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

import passgraph as pg
from passgraph.language import Image, Vertex, vec2, vec4

Point = tuple[float, float]
Float64 = NDArray[np.float64]
#: The whole picture in clip space: its corners, and the scale and offset from there to clip space.
_CORNERS: tuple[Point, ...] = ((-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0))
WHOLE_CLIP = (1.0, 1.0, 0.0, 0.0)


@dataclass(frozen=True, eq=False)
class Shape:
    """Triangles with homogeneous positions (x, y, w), for the point (x / w, y / w)."""

    positions: NDArray[np.float32]
    triangles: NDArray[np.int32]
    uvs: NDArray[np.float32]
    colors: NDArray[np.float32]


@pg.struct
class Spot:
    """A point of the world, as passed to the fragment kernel."""

    position: vec4
    place: vec2
    uv: vec2
    edge: vec4


@pg.vertex
def in_window(vertex: Vertex, clip: vec4) -> Spot:
    """Transform homogeneous world positions to clip space; ``clip`` is (scale x, scale y, offset x, offset y)."""
    w = vertex.position.z
    x = vertex.position.x * clip.x + w * clip.z
    y = vertex.position.y * clip.y + w * clip.w
    return Spot(vec4(x, y, 0.0, w), vec2(vertex.position.x, vertex.position.y), vertex.uv, vertex.color)


def quads(corners: Sequence[Sequence[Point]]) -> Shape:
    """Return quads of four corners in order; texture coordinates run (0, 1), (1, 1), (1, 0), (0, 0) around them."""
    places = np.array(corners, np.float64).reshape(-1, 2)
    count = len(places) // 4
    positions = np.column_stack([places, np.ones(len(places))])
    uvs = np.tile([[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]], (count, 1))
    return shape_of(positions, uvs, np.zeros((len(places), 4)))


def shape_of(positions: Float64, uvs: Float64, colors: Float64) -> Shape:
    """Return two triangles for every four corners."""
    first = 4 * np.arange(len(positions) // 4, dtype=np.int32)[:, None]
    triangles = (first + np.array([0, 1, 2, 0, 2, 3], np.int32)).reshape(-1, 3)
    return Shape(
        positions.astype(np.float32), triangles.astype(np.int32), uvs.astype(np.float32), colors.astype(np.float32)
    )


@pg.fragment
def black(spot: Spot) -> vec4:
    """Return black: full shadow."""
    return vec4(0.0, 0.0, 0.0, 0.0)


@pg.fragment
def copied(spot: Spot, picture: Image, factor: float = 1.0) -> vec4:
    """Return a picture stretched over the quad, times a factor."""
    return picture.sample(spot.uv) * factor


def full_quad() -> Shape:
    """Return a quad over the whole picture."""
    return quads([_CORNERS])


def drawn(
    picture: pg.Target,
    into: pg.Target | pg.TargetSpec,
    name: str,
    factor: float = 1.0,
    blend: str | pg.Blend | None = None,
) -> pg.Target:
    """Draw a picture stretched over a target."""
    values: dict[str, object] = {"clip": WHOLE_CLIP, "picture": picture, "factor": factor}
    stretched: pg.Target = pg.draw(
        full_quad(), vertex=in_window, fragment=copied, into=into, name=name, values=values, blend=blend
    )
    return stretched
