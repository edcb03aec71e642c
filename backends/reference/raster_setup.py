"""Triangles in window coordinates (rules 2, 3 and 5 of docs/rasterisation.md)."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from passgraph.backends.reference.raster_clip import Vertices
from passgraph.graph.draw_state import DrawState

Float64 = NDArray[np.float64]
Ints = NDArray[np.int64]

#: Positions are multiples of 1/256 pixel: 8 bits below the pixel, as GPUs have them.
SUBPIXELS = 256
#: No corner lies farther than this many w from the centre: twice the guard band.
FARTHEST = 16.0
#: The smallest normal float32: depths below it have its exponent.
SMALLEST_NORMAL = 2.0**-126


@dataclass(frozen=True)
class ScreenTriangles:
    """Corners wound so that ``area`` is positive; coordinates in 1/256 pixel, row 0 on top."""

    corners: Ints  # (m, 3) vertex numbers
    x: Ints  # (m, 3)
    y: Ints
    depth: Float64  # (m, 3)
    inverse_w: Float64  # (m, 3)
    area: Ints  # twice the area, in (1/256 pixel)²
    front: NDArray[np.bool_]
    offset: Float64  # what polygon offset adds to the depth
    source: Ints  # which of the triangles that came in each is

    def __len__(self) -> int:
        return len(self.area)


def to_window(vertices: Vertices, triangles: Ints, size: tuple[int, int], state: DrawState) -> ScreenTriangles:
    """Snap, drop what has no area or is culled, and wind all one way."""
    width, height = size
    used = np.unique(triangles)
    place = np.zeros(len(vertices.rows), np.int64)
    place[used] = np.arange(len(used))
    clip = vertices.clip[used]
    w = clip[:, 3]
    window = np.stack([(clip[:, 0] / w * 0.5 + 0.5) * width, (0.5 - clip[:, 1] / w * 0.5) * height], axis=1)
    depth, inverse_w = clip[:, 2] / w * 0.5 + 0.5, 1.0 / w
    # w = 0 passes near and far plane where z = 0 too: such a point has no place on the screen.  Where a triangle
    # runs through the eye but for rounding, nor has a corner that rounding alone puts far beyond the guard band.
    placed = (w > 0) & (np.abs(clip[:, :2]) <= FARTHEST * w[:, None]).all(axis=1)
    placed &= np.isfinite(depth) & np.isfinite(inverse_w)
    snapped = np.rint(np.where(placed[:, None], window, 0.0) * SUBPIXELS).astype(np.int64)
    at = place[triangles]
    x, y = snapped[at, 0], snapped[at, 1]
    area = (x[:, 1] - x[:, 0]) * (y[:, 2] - y[:, 0]) - (x[:, 2] - x[:, 0]) * (y[:, 1] - y[:, 0])
    # Rows grow downward here, so counter-clockwise with y up is negative.
    front = area < 0
    culled = {"none": False, "back": ~front, "front": front}[state.cull]
    kept = np.flatnonzero(placed[at].all(axis=1) & (area != 0) & ~np.asarray(culled))
    order = np.where(front[kept, None], [0, 2, 1], [0, 1, 2])

    def wound(values: NDArray[np.generic]) -> NDArray[np.generic]:
        return np.take_along_axis(values[kept], order, axis=1)

    made = ScreenTriangles(
        wound(triangles), wound(x), wound(y), wound(depth[at]), wound(inverse_w[at]),  # type: ignore[arg-type]
        np.abs(area[kept]), front[kept], np.zeros(len(kept)), kept,
    )  # fmt: skip
    if state.polygon_offset == (0.0, 0.0):
        return made
    return replace(made, offset=_offset(made, state.polygon_offset))


def _offset(triangles: ScreenTriangles, polygon_offset: tuple[float, float]) -> Float64:
    """factor · max(|∂z/∂x|, |∂z/∂y|) + units · 2^(e − 23), e the exponent of the largest depth as float32."""
    factor, units = polygon_offset
    # The barycentric coordinate of a corner changes along x as the opposite edge is high, along y as it is
    # long.
    rise = np.roll(triangles.y, -2, axis=1) - np.roll(triangles.y, -1, axis=1)
    run = np.roll(triangles.x, -2, axis=1) - np.roll(triangles.x, -1, axis=1)
    per_pixel = SUBPIXELS / triangles.area.astype(np.float64)
    slope_x = np.abs((triangles.depth * rise).sum(axis=1)) * per_pixel
    slope_y = np.abs((triangles.depth * run).sum(axis=1)) * per_pixel
    largest = np.maximum(np.abs(triangles.depth).max(axis=1).astype(np.float32), SMALLEST_NORMAL)
    _, exponent = np.frexp(largest.astype(np.float64))
    return np.asarray(factor * np.maximum(slope_x, slope_y) + units * np.exp2(exponent - 1.0 - 23.0))
