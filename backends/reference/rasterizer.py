"""The exact rasterizer (docs/rasterization.md, rules 1 to 5): clipping, setup and coverage in integers."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from passgraph.graph.draw_state import DrawState

Float64 = NDArray[np.float64]
Ints = NDArray[np.int64]

#: Guard band: |x| and |y| may reach this many times w before a triangle is clipped at the sides.
GUARD_BAND = 8.0
#: Planes: near, far, and the four sides of the guard band.
PLANES = 6
#: Polygons clipped at once; each has up to 9 corners.
POLYGONS_AT_ONCE = 1 << 14


@dataclass(frozen=True)
class Vertices:
    """Results of the vertex kernel: rows of clip position (4) and varyings side by side."""

    rows: Float64

    @property
    def clip(self) -> Float64:
        return self.rows[:, :4]


def distances(clip: Float64) -> Float64:
    """Return the signed distance of each position (…, 4) to each of the six planes (…, 6)."""
    x, y, z, w = (clip[..., i] for i in range(4))
    wide = GUARD_BAND * w
    return np.stack([z + w, w - z, wide + x, wide - x, wide + y, wide - y], axis=-1)


def clip_triangles(vertices: Vertices, triangles: Ints) -> tuple[Vertices, Ints, Ints]:
    """Clip triangles (m, 3) to all planes, in submission order; also return the source of each.

    Corners made by clipping are appended to the vertices.  A triangle with a position that is not finite is dropped.
    """
    finite = np.asarray(np.isfinite(vertices.clip).all(axis=1))
    inside = (distances(vertices.clip) >= 0) & finite[:, None]
    corners: NDArray[np.bool_] = inside[triangles]
    is_inside = corners.all(axis=(1, 2))
    reachable = np.asarray(corners.any(axis=1)).all(axis=1) & np.asarray(finite[triangles]).all(axis=1)
    cut = np.flatnonzero(reachable & ~is_inside)
    inside_numbers = np.flatnonzero(is_inside)
    rows, parts, sources = [vertices.rows], [triangles[inside_numbers]], [inside_numbers]
    count = len(vertices.rows)
    for first in range(0, len(cut), POLYGONS_AT_ONCE):
        batch = cut[first : first + POLYGONS_AT_ONCE]
        polygons, sizes = _clip_polygons(vertices.rows[triangles[batch]])
        fans, owners = _fans(sizes, polygons.shape[1])
        rows.append(polygons.reshape(-1, polygons.shape[2]))
        parts.append(fans + count)
        sources.append(batch[owners])
        count += len(rows[-1])
    owner = np.concatenate(sources)
    order = np.argsort(owner, kind="stable")
    return Vertices(np.concatenate(rows)), np.concatenate(parts)[order], owner[order]


def _clip_polygons(polygons: Float64) -> tuple[Float64, Ints]:
    """Clip (k, 3, row) triangles to (k, 9, row) polygons; also return their numbers of corners."""
    sizes = np.full(len(polygons), 3)
    for plane in range(PLANES):
        polygons, sizes = _clip_at(polygons, sizes, distances(polygons[..., :4])[..., plane])
    return polygons, sizes


def _clip_at(polygons: Float64, sizes: Ints, distance: Float64) -> tuple[Float64, Ints]:
    """Clip by Sutherland and Hodgman (1974): corners inside stay, each crossing edge adds one.

    The inside corners are contiguous, so at most two edges cross and a polygon grows by one corner.
    """
    count, width, row = polygons.shape
    place = np.arange(width)
    following = (place + 1) % np.maximum(sizes, 1)[:, None]
    inside = _inside(distance, sizes)
    crossing = (place < sizes[:, None]) & (inside != np.take_along_axis(inside, following, axis=1))
    emitted = inside.astype(np.int64) + crossing
    target = np.cumsum(emitted, axis=1) - emitted
    clipped = np.zeros((count, width + 1, row))
    k, i = np.nonzero(inside)
    clipped[k, target[k, i]] = polygons[k, i]
    k, i = np.nonzero(crossing)
    j = following[k, i]
    leaving = inside[k, i]
    a, b = np.where(leaving, i, j), np.where(leaving, j, i)  # from the inside corner to the outside one
    apart = distance[k, a] - distance[k, b]
    share, rest = -distance[k, b] / apart, distance[k, a] / apart
    crossings = polygons[k, a] * share[:, None] + polygons[k, b] * rest[:, None]
    clipped[k, target[k, i] + inside[k, i]] = crossings
    return clipped, emitted.sum(axis=1)


def _inside(distance: Float64, sizes: Ints) -> NDArray[np.bool_]:
    """Return the inside corners that are contiguous around the deepest one.

    For a convex polygon these are all.  Rounding may put others inside; they are on the plane up to rounding.
    """
    place, number = np.arange(distance.shape[1]), np.maximum(sizes, 1)[:, None]
    real = place < sizes[:, None]
    deepest = np.argmax(np.where(real, distance, -np.inf), axis=1)[:, None]
    inside = real & (distance >= 0)
    runs = []
    for step in (1, -1):
        onward = np.take_along_axis(inside, (deepest + step * place) % number, axis=1)
        reached = np.logical_and.accumulate(onward, axis=1)
        runs.append(np.take_along_axis(reached, step * (place - deepest) % number, axis=1))
    return np.asarray(real & (runs[0] | runs[1]))


def _fans(sizes: Ints, width: int) -> tuple[Ints, Ints]:
    """Split polygons into triangles (0, i, i + 1), as rows of the corner table; also return the polygon of each."""
    owners, i = np.nonzero(np.arange(1, width - 1) < (sizes - 1)[:, None])
    base = owners * width
    return np.stack([base, base + i + 1, base + i + 2], axis=1), owners


#: Positions are multiples of 1/256 pixel: 8 fractional bits, as on GPUs.
SUBPIXELS = 256
#: Corners farther than this many w from the center are dropped: twice the guard band.
FARTHEST = 16.0
#: The smallest normal float32; smaller depths use its exponent.
SMALLEST_NORMAL = 2.0**-126


@dataclass(frozen=True)
class ScreenTriangles:
    """Screen triangles wound so that ``area`` is positive; coordinates in 1/256 pixel, row 0 on top."""

    corners: Ints  # (m, 3) vertex numbers
    x: Ints  # (m, 3)
    y: Ints
    depth: Float64  # (m, 3)
    inverse_w: Float64  # (m, 3)
    area: Ints  # twice the area, in (1/256 pixel)²
    front: NDArray[np.bool_]
    offset: Float64  # the depth added by the polygon offset
    source: Ints  # the input triangle of each

    def __len__(self) -> int:
        return len(self.area)


def to_window(vertices: Vertices, triangles: Ints, size: tuple[int, int], state: DrawState) -> ScreenTriangles:
    """Snap to the grid, drop triangles without area or culled, and wind all one way."""
    width, height = size
    used = np.unique(triangles)
    place = np.zeros(len(vertices.rows), np.int64)
    place[used] = np.arange(len(used))
    clip = vertices.clip[used]
    w = clip[:, 3]
    window = np.stack([(clip[:, 0] / w * 0.5 + 0.5) * width, (0.5 - clip[:, 1] / w * 0.5) * height], axis=1)
    depth, inverse_w = clip[:, 2] / w * 0.5 + 0.5, 1.0 / w
    # w = 0 passes the near and the far plane if z = 0 too: such a point has no screen position.  Nor has a corner that
    # rounding alone puts far beyond the guard band, when a triangle nearly contains the eye.
    placed = (w > 0) & (np.abs(clip[:, :2]) <= FARTHEST * w[:, None]).all(axis=1)
    placed &= np.isfinite(depth) & np.isfinite(inverse_w)
    snapped = np.rint(np.where(placed[:, None], window, 0.0) * SUBPIXELS).astype(np.int64)
    at = place[triangles]
    x, y = snapped[at, 0], snapped[at, 1]
    area = (x[:, 1] - x[:, 0]) * (y[:, 2] - y[:, 0]) - (x[:, 2] - x[:, 0]) * (y[:, 1] - y[:, 0])
    # Rows grow downward here, so counter-clockwise with y up is negative.
    front = area < 0
    culled = {"none": False, "back": ~front, "front": front}[state.cull]
    visible = np.flatnonzero(placed[at].all(axis=1) & (area != 0) & ~np.asarray(culled))
    order = np.where(front[visible, None], [0, 2, 1], [0, 1, 2])

    def wound(values: NDArray[np.generic]) -> NDArray[np.generic]:
        return np.take_along_axis(values[visible], order, axis=1)

    on_screen = ScreenTriangles(
        wound(triangles), wound(x), wound(y), wound(depth[at]), wound(inverse_w[at]),  # type: ignore[arg-type]
        np.abs(area[visible]), front[visible], np.zeros(len(visible)), visible,
    )  # fmt: skip
    if state.polygon_offset == (0.0, 0.0):
        return on_screen
    return replace(on_screen, offset=_offset(on_screen, state.polygon_offset))


def _offset(triangles: ScreenTriangles, polygon_offset: tuple[float, float]) -> Float64:
    """Return factor · max(|∂z/∂x|, |∂z/∂y|) + units · 2^(e − 23), e the exponent of the largest depth as float32."""
    factor, units = polygon_offset
    # The barycentric coordinate of a corner changes along x with the height of the opposite edge, along y with its
    # width.
    rise = np.roll(triangles.y, -2, axis=1) - np.roll(triangles.y, -1, axis=1)
    run = np.roll(triangles.x, -2, axis=1) - np.roll(triangles.x, -1, axis=1)
    per_pixel = SUBPIXELS / triangles.area.astype(np.float64)
    slope_x = np.abs((triangles.depth * rise).sum(axis=1)) * per_pixel
    slope_y = np.abs((triangles.depth * run).sum(axis=1)) * per_pixel
    largest = np.maximum(np.abs(triangles.depth).max(axis=1).astype(np.float32), SMALLEST_NORMAL)
    _, exponent = np.frexp(largest.astype(np.float64))
    return np.asarray(factor * np.maximum(slope_x, slope_y) + units * np.exp2(exponent - 1.0 - 23.0))


HALF = SUBPIXELS // 2
#: Rows of triangles, and fragments, processed at once.
ROWS_AT_ONCE = 1 << 18


@dataclass(frozen=True)
class Fragments:
    """Covered pixel centers in submission order."""

    triangle: Ints
    x: Ints
    y: Ints
    weights: Float64  # (n, 3) barycentric

    def __len__(self) -> int:
        return len(self.triangle)

    def beside(self, axes: str, triangles: ScreenTriangles) -> Fragments:
        """Return the fragments at the quad neighbors along these axes, covered or not."""
        x, y = self.x ^ int("x" in axes), self.y ^ int("y" in axes)
        return Fragments(self.triangle, x, y, _weights(triangles, self.triangle, x, y))

    def __getitem__(self, chosen: NDArray[np.generic] | slice) -> Fragments:
        return Fragments(self.triangle[chosen], self.x[chosen], self.y[chosen], self.weights[chosen])


def cover(triangles: ScreenTriangles, size: tuple[int, int]) -> Iterator[Fragments]:
    """Yield all fragments, in batches of bounded size; a triangle may be split."""
    width, height = size
    top = np.maximum(-((HALF - triangles.y.min(axis=1)) // SUBPIXELS), 0)
    bottom = np.minimum((triangles.y.max(axis=1) - HALF) // SUBPIXELS, height - 1)
    for owner, step in expand(np.maximum(bottom - top + 1, 0)):
        row = top[owner] + step
        left, right = _spans(triangles, owner, row, width)
        for span, step_x in expand(np.maximum(right - left + 1, 0)):
            triangle, x, y = owner[span], left[span] + step_x, row[span]
            yield Fragments(triangle, x, y, _weights(triangles, triangle, x, y))


def expand(lengths: Ints) -> Iterator[tuple[Ints, Ints]]:
    """Yield (i, j) for each i and each j below ``lengths[i]``, about BATCH pairs at a time."""
    ends = np.cumsum(lengths)
    first = 0
    while first < len(lengths):
        rows_done = ends[first - 1] if first else 0
        last = max(first + 1, int(np.searchsorted(ends, rows_done + ROWS_AT_ONCE, side="right")))
        part = lengths[first:last]
        i = np.repeat(np.arange(first, last), part)
        j = np.arange(len(i)) - np.repeat(np.cumsum(part) - part, part)
        if len(i):
            yield i, j
        first = last


def _edge(triangles: ScreenTriangles, owner: Ints, k: int) -> tuple[Ints, Ints, Ints, Ints]:
    """Return the edge opposite corner k: its start, and its extent along x and y."""
    a, b = (k + 1) % 3, (k + 2) % 3
    x, y = triangles.x[owner, a], triangles.y[owner, a]
    return x, y, triangles.x[owner, b] - x, triangles.y[owner, b] - y


def _spans(triangles: ScreenTriangles, owner: Ints, row: Ints, width: int) -> tuple[Ints, Ints]:
    """Return the first and last covered column (inclusive) of a row of each triangle; none if last < first."""
    left, right = np.zeros(len(owner), np.int64), np.full(len(owner), width - 1, np.int64)
    centre_y = SUBPIXELS * row + HALF
    for k in range(3):
        x, y, dx, dy = _edge(triangles, owner, k)
        # Inside means >= 0 at column i: start - slope * i >= 0.  Edges that do not own centers on them need 1 more.
        owns_centre = (dy < 0) | ((dy == 0) & (dx > 0))
        start = dx * (centre_y - y) - dy * (HALF - x) - np.where(owns_centre, 0, 1)
        slope = dy * SUBPIXELS
        bound = start // np.where(slope == 0, 1, slope)
        right = np.where(slope > 0, np.minimum(right, bound), right)
        # start >= slope * i with a negative slope: i >= start / slope, rounded up.
        rounded_up = -((-start) // np.where(slope == 0, 1, slope))
        left = np.where(slope < 0, np.maximum(left, rounded_up), left)
        right = np.where((slope == 0) & (start < 0), -1, right)
    return left, right


def _weights(triangles: ScreenTriangles, triangle: Ints, column: Ints, row: Ints) -> Float64:
    weights = np.empty((len(triangle), 3))
    area = triangles.area[triangle]
    for k in range(3):
        x, y, dx, dy = _edge(triangles, triangle, k)
        weights[:, k] = (dx * (SUBPIXELS * row + HALF - y) - dy * (SUBPIXELS * column + HALF - x)) / area
    return weights
