"""Coverage and interpolation of triangles with uncertain corners.

Rounding in the vertex kernel and in the window transform may move a corner slightly.  On backends that snap as in rule
2 of docs/rasterization.md, snapping removes most of that: a corner is on one grid point, or on one of a few.  OpenGL
leaves the grid and its rounding to the driver, and drivers interpolate from unsnapped corners: there a corner may be
anywhere within a grid step.  Edge functions and barycentric weights are bounded over all such corners to first order,
plus the products of two errors.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from passgraph.backends.base import SNAP_PX
from passgraph.backends.reference.rasterizer import FARTHEST, Vertices, clip_triangles, expand
from passgraph.graph.draw_state import DrawState
from passgraph.verify.oracle.interval import Float64, Interval, Lanes, rounded

Ints = NDArray[np.int64]

ULP = 2.0**-23
#: Error of the window transform in ULP in any rounding mode, relative to |x/w| / 2 + 1/2: a quotient (2.5), two
#: products (1 each), a sum (1).
WINDOW_ULP = 5.5
#: Error of interpolation in ULP, relative to the largest corner: a weight (its edge function is exact, its quotient
#: 2.5), 1/w (2.5), the products of both and with the value (1 each), two sums (1 each), the last quotient (2.5), and
#: half a unit of the reference's own rounding: 12.
INTERPOLATION_ULP = 12.0
#: The same at a pixel outside the triangle, where weights may have either sign and any magnitude; g is the sum of their
#: magnitudes.  The error of a sum grows with g, and that of a quotient by such a sum with g again.  In half units: an
#: edge as float32 (1), 1/w (5) and their product (1), twice in their sum (2), are 9 g of the sum; the quotient then has
#: 12 + 9 g (5 of its own), differences of corners and products with them 2 more.  Corners differ by at most twice the
#: largest, so these are whole units: g (14 + 9 g), with 2 g + 1 of the last two sums and half a unit of the reference's
#: own rounding.
ANYWHERE_ULP = (1.5, 16.0, 9.0)
#: Factor of a driver's plane error there: it steps from a fragment by the difference between two.
STEPPED = 3.0
#: Error in ULP of a corner made by clipping, relative to the two weighted terms of its sum, on backends that clip as in
#: rule 1: a distance and the sum of both (0.5 each), the quotient (2.5), the product (0.5) and the sum (0.5); doubled
#: for a second plane.
SHARES_ULP = 9.0
#: The same for a + (b - a) t, which drivers may compute, relative to the largest number of its column: with b - a up to
#: twice as large, a difference and a product (2, since 1 - t of the former is a's) and the sum (1), and 1 for a second
#: plane.  An error of t moves all columns together along the clipped edge, so the edge and what is interpolated from it
#: stay in place.
CLIP_ULP = 4.0
#: Error in units of a plane through three corners, relative to its largest part (:func:`_plane_size`): for a step two
#: differences (1 each), a product (1), their difference (1), the area (two products and a difference, 3) and the
#: quotient (2.5); for the offset to the pixel a product (1) and a sum (1): 11.5.
PLANE_UNITS = 11.5
#: Precision of plane evaluation: drivers use float32, from the corner of the picture on; float64 where rule 5 holds,
#: and then for depths only, as perspective-correct values come from the edges.
DRIVER_UNIT, OWN_UNIT = ULP, 2.0**-52
#: Error in pixels of a corner at an unknown position: far beyond every picture, but products of it are finite.
ANYWHERE_PX = 1e18
#: 1/w values this many times smaller than the largest one of their triangle may be flushed to 0.
FLUSHED = 2.0**-126
#: The same for drivers, which use 1/w unscaled.
LARGEST_W = 2.0**126


@dataclass(frozen=True)
class Corners:
    """Vertices as computed in float64, and the largest error of each number: rows (n, columns) of both."""

    values: Float64
    errors: Float64


@dataclass(frozen=True)
class Triangles:
    """Clipped triangles on the screen, in pixels with row 0 on top; (m, 3) each unless said otherwise."""

    corners: Ints  # rows of ``rows``
    x: Float64
    y: Float64
    off: Float64  # largest error of x and y
    depth: Float64
    depth_off: Float64
    inverse_w: Float64
    inverse_w_off: Float64
    area: Float64  # (m,), twice the signed area, negative where the front is seen
    area_off: Float64
    offset: Interval  # (m,), polygon offset of the depth
    rows: Corners
    snapped: bool
    size: tuple[int, int]  # of the picture

    @property
    def sliver(self) -> Lanes:
        """Return the triangles that may have no area, or either side in front."""
        return np.asarray(~(np.abs(self.area) > self.area_off) & ((self.area != 0) | (self.area_off > 0)))

    def __len__(self) -> int:
        return len(self.area)


def triangles(vertices: Corners, indices: Ints, size: tuple[int, int], state: DrawState, corner_px: float) -> Triangles:
    """Clip, project, and drop triangles that are certainly culled; ``corner_px`` as in `Promises`."""
    snapped = corner_px == 0.0
    rows, corners = _clipped(vertices, indices, snapped)
    values, errors = rows.values, rows.errors
    width, height = size
    w, w_off = values[:, 3], errors[:, 3]
    least_w = np.maximum(np.abs(w) - w_off, 1e-300)
    ratio = values[:, :3] / w[:, None]
    ratio_off = (errors[:, :3] + np.abs(ratio) * w_off[:, None]) / least_w[:, None]
    x, y = (ratio[:, 0] * 0.5 + 0.5) * width, (0.5 - ratio[:, 1] * 0.5) * height
    rounding = WINDOW_ULP * ULP * (np.abs(ratio[:, :2]) * 0.5 + 0.5) * [width, height]
    off = (ratio_off[:, :2] * 0.5 * [width, height] + rounding).max(axis=1)
    off = np.minimum(np.nan_to_num(off, nan=ANYWHERE_PX), ANYWHERE_PX)
    if snapped:
        x, y, off = _snapped(x, y, off)
    else:
        # Drivers may flush a 1/w below the smallest normal float to 0, which leaves no screen position.
        off = np.where(np.abs(w) + w_off > LARGEST_W, ANYWHERE_PX, off + corner_px)
    depth, depth_off = ratio[:, 2] * 0.5 + 0.5, ratio_off[:, 2] * 0.5 + WINDOW_ULP * ULP
    inverse_w, inverse_w_off = 1.0 / w, w_off / (np.abs(w) * least_w) + 2.5 * ULP / np.abs(w)
    at = [a[corners] for a in (x, y, off, depth, depth_off, inverse_w, inverse_w_off)]
    area, area_off = _area(at[0], at[1], at[2])
    surely = np.abs(area) > area_off
    front = area < 0
    is_culled = {"none": np.zeros_like(front), "back": surely & ~front, "front": surely & front}[state.cull]
    is_culled |= (area == 0) & (area_off == 0)
    placed = (w > 0) & (np.abs(values[:, :2]) <= FARTHEST * w[:, None]).all(axis=1)
    drawn_numbers = np.flatnonzero(placed[corners].all(axis=1) & ~is_culled)
    picked = [a[drawn_numbers] for a in at]
    offset = _offset(
        picked[0], picked[1], picked[3], picked[2], picked[4], area[drawn_numbers], area_off[drawn_numbers], state
    )
    return Triangles(
        corners[drawn_numbers], picked[0], picked[1], picked[2], picked[3], picked[4], picked[5], picked[6],
        area[drawn_numbers], area_off[drawn_numbers], offset, rows, snapped, size,
    )  # fmt: skip


def _clipped(vertices: Corners, indices: Ints, snapped: bool) -> tuple[Corners, Ints]:
    """Clip to all planes. Errors of new corners are weighted sums, and the largest numbers of a triangle are kept."""
    columns, count = vertices.values.shape[1], len(vertices.values)
    sizes = np.abs(vertices.values)
    vertex_columns = [vertices.values, vertices.errors, sizes, _largest_near(sizes, indices)]
    both, corners, _ = clip_triangles(Vertices(np.concatenate(vertex_columns, axis=1)), indices)
    values, errors, shares, largest = (both.rows[:, k * columns : (k + 1) * columns] for k in range(4))
    errors = errors.copy()
    lost = SHARES_ULP * ULP * shares + FLUSHED * largest if snapped else CLIP_ULP * ULP * largest
    errors[count:] += lost[count:]
    return Corners(values, errors), corners


def _largest_near(sizes: Float64, indices: Ints) -> Float64:
    """Return, for each vertex and column, the largest number in a drawn triangle with that vertex."""
    finite_sizes = np.where(np.isfinite(sizes), sizes, 0.0)
    drawn = indices[np.isfinite(sizes[indices, :4]).all(axis=(1, 2))]
    for corner in range(3):
        np.maximum.at(finite_sizes, drawn[:, corner], sizes[drawn].max(axis=1))
    return finite_sizes


def _snapped(x: Float64, y: Float64, off: Float64) -> tuple[Float64, Float64, Float64]:
    """Return the middle of the grid points that a corner may be on, and their distance from it."""
    low, high = ([np.rint((v + e) / SNAP_PX) * SNAP_PX for v in (x, y)] for e in (-off, off))
    middle = [0.5 * (a + b) for a, b in zip(low, high, strict=True)]
    reach = [0.5 * (b - a) for a, b in zip(low, high, strict=True)]
    return middle[0], middle[1], np.maximum(*reach)


def _next_corners(values: Float64) -> tuple[Float64, Float64]:
    """Return the next corner of each, and the one after that."""
    return np.roll(values, -1, axis=1), np.roll(values, -2, axis=1)


def _area(x: Float64, y: Float64, off: Float64) -> tuple[Float64, Float64]:
    (x1, x2), (y1, y2) = _next_corners(x), _next_corners(y)
    area = (x[:, 1] - x[:, 0]) * (y[:, 2] - y[:, 0]) - (x[:, 2] - x[:, 0]) * (y[:, 1] - y[:, 0])
    first_order = (off * (np.abs(y1 - y2) + np.abs(x1 - x2))).sum(axis=1)
    return area, first_order + 6.0 * off.max(axis=1, initial=0.0) ** 2


def _offset(
    x: Float64, y: Float64, depth: Float64, off: Float64, depth_off: Float64, area: Float64, area_off: Float64,
    state: DrawState,
) -> Interval:  # fmt: skip
    """Return factor · largest slope + units · 2^(e − 23) (rule 5), over all corners."""
    factor, units = state.polygon_offset
    if (factor, units) == (0.0, 0.0):
        return Interval.point(np.zeros(len(area)))
    least_area = np.maximum(np.abs(area) - area_off, 0.0)
    (x1, x2), (y1, y2) = _next_corners(x), _next_corners(y)
    middle = depth.mean(axis=1, keepdims=True)
    slopes = []
    # Σ depth · side over the area. Subtracting the mean depth does not change it (the sides add up to 0), but keeps the
    # contribution of corner errors small: each side has two of them, each depth its own.
    for side in (y1 - y2, x2 - x1):
        slope = np.abs(((depth - middle) * side).sum(axis=1)) / np.abs(area)
        spread = (np.abs(depth - middle) * 2.0 * off.max(axis=1, keepdims=True)).sum(axis=1)
        spread += (depth_off * np.abs(side)).sum(axis=1) + slope * area_off
        slopes.append((np.maximum(slope - spread / least_area, 0.0), slope + spread / least_area))
    low, high = np.maximum(slopes[0][0], slopes[1][0]), np.maximum(slopes[0][1], slopes[1][1])
    largest = np.abs(depth).max(axis=1)
    units_of = [
        2.0 ** (np.frexp(np.maximum(largest + e, 2.0**-126))[1] - 24.0)
        for e in (-depth_off.max(axis=1), depth_off.max(axis=1))
    ]
    ends = [factor * s + units * u for s in (low, high) for u in units_of]
    # Two products and their sum; the product with the exponent is exact.
    return rounded(np.fmin.reduce(ends), np.fmax.reduce(ends), np.zeros(len(area), np.bool_), 2.0)


@dataclass(frozen=True)
class Fragments:
    """Pixels that a triangle may cover, in the order of submission."""

    triangle: Ints
    x: Ints
    y: Ints
    surely: Lanes
    weights: Float64  # (n, 3) barycentric
    off: Float64  # (n, 3), their largest error
    anywhere: bool = False  # pixels outside the triangles too: weights may have any size and sign

    def __len__(self) -> int:
        return len(self.triangle)

    def take(self, chosen: NDArray[np.generic]) -> Fragments:
        return Fragments(*(getattr(self, n)[chosen] for n in ("triangle", "x", "y", "surely", "weights", "off")))

    def beside(self, axes: str, mesh: Triangles) -> Fragments:
        """Return the fragments at the quad neighbors along these axes, covered or not."""
        x, y = self.x ^ int("x" in axes), self.y ^ int("y" in axes)
        edges, errors = np.empty((3, len(x))), np.empty((3, len(x)))
        corners = _corners(mesh, self.triangle, x, y)
        for k in range(3):
            edges[k], errors[k] = _edge(*corners, k)
        weights, weights_off = _weights(mesh, self.triangle, edges.T, errors.T)
        return Fragments(self.triangle, x, y, self.surely, weights, weights_off, anywhere=True)


def cover(mesh: Triangles, size: tuple[int, int]) -> Iterator[Fragments]:
    """Yield all fragments, in batches."""
    width, height = size
    reach = mesh.off.max(axis=1, initial=0.0)
    first_x, last_x = _pixels(mesh.x, reach, width)
    first_y, last_y = _pixels(mesh.y, reach, height)
    columns = np.maximum(last_x - first_x + 1, 0)
    for owner, place in expand(columns * np.maximum(last_y - first_y + 1, 0)):
        row, column = np.divmod(place, columns[owner])
        yield _inside(mesh, owner, first_x[owner] + column, first_y[owner] + row)


def _pixels(position: Float64, reach: Float64, limit: int) -> tuple[Ints, Ints]:
    low = np.clip(np.ceil(position.min(axis=1) - reach - 0.5), 0, limit)
    high = np.clip(np.floor(position.max(axis=1) + reach - 0.5), -1, limit - 1)
    return low.astype(np.int64), high.astype(np.int64)


def _inside(mesh: Triangles, owner: Ints, column: Ints, row: Ints) -> Fragments:
    right, down, away, off = _corners(mesh, owner, column, row)
    area, sliver = mesh.area[owner], mesh.sliver[owner]
    turn = np.where(area < 0, -1.0, 1.0)
    edges, errors = np.empty((3, len(owner))), np.empty((3, len(owner)))
    surely, perhaps, behind = ~sliver, np.ones(len(owner), np.bool_), sliver.copy()
    for k in range(3):
        a, b = (k + 1) % 3, (k + 2) % 3
        edges[k], errors[k] = _edge(right, down, away, off, k)
        turned = edges[k] * turn
        # Rule 4: a center on an edge is inside only at top and left edges, for the winding with positive area.
        dx, dy = (right[b] - right[a]) * turn, (down[b] - down[a]) * turn
        owned = (dy < 0) | ((dy == 0) & (dx > 0))
        known = (turned == 0) & (off[a] == 0) & (off[b] == 0)
        turned = np.where(known, np.where(owned, 1.0, -1.0), turned)
        surely &= turned > errors[k]
        perhaps &= turned >= -errors[k]
        behind &= -turned >= -errors[k]
    candidates = np.flatnonzero(perhaps | behind)
    weights, weights_off = _weights(mesh, owner[candidates], edges.T[candidates], errors.T[candidates])
    return Fragments(owner[candidates], column[candidates], row[candidates], surely[candidates], weights, weights_off)


def _corners(mesh: Triangles, owner: Ints, column: Ints, row: Ints) -> tuple[Float64, Float64, Float64, Float64]:
    """Return the offsets of a triangle's corners from a pixel's center (right and down), their sums, and their errors:
    (3, n).

    The layout is column by column: most pixels of a box are found outside by the first columns.
    """
    right, down = mesh.x.T[:, owner] - (column + 0.5), mesh.y.T[:, owner] - (row + 0.5)
    return right, down, np.abs(right) + np.abs(down), mesh.off.T[:, owner]


def _edge(right: Float64, down: Float64, away: Float64, off: Float64, k: int) -> tuple[Float64, Float64]:
    """Return the edge function opposite to a corner at pixels, and its largest error."""
    a, b = (k + 1) % 3, (k + 2) % 3
    error = off[a] * away[b] + off[b] * away[a] + 4.0 * off[a] * off[b]
    return right[a] * down[b] - right[b] * down[a], error


def _weights(mesh: Triangles, owner: Ints, edges: Float64, errors: Float64) -> tuple[Float64, Float64]:
    """Return the barycentric weights (n, 3) from edges, and their largest errors."""
    area, area_off = mesh.area[owner], mesh.area_off[owner]
    with np.errstate(all="ignore"):
        weights = edges / area[:, None]
        weights_off = (errors + np.abs(weights) * area_off[:, None]) / (np.abs(area) - area_off)[:, None]
    weights_off[mesh.sliver[owner]] = np.inf
    return weights, weights_off


def depth_of(mesh: Triangles, fragments: Fragments) -> Interval:
    """Return the interpolated, offset and clamped depth; (n,)."""
    at = fragments.triangle
    depth = mesh.depth[at]
    middle = np.einsum("nk,nk->n", fragments.weights, depth)
    off = (
        _spread(fragments.off, depth, middle)
        + _shared(fragments.weights, fragments.off, mesh.depth_off[at])
        + _rounding(fragments, np.abs(fragments.weights).sum(axis=1)) * np.abs(depth).max(axis=1)
        + _plane_off(mesh, mesh.depth, fragments)[at]
    )
    low, high = middle - off + mesh.offset.lo[at], middle + off + mesh.offset.hi[at]
    strange = ~np.isfinite(low + high)
    clamped = rounded(np.clip(low, 0.0, 1.0), np.clip(high, 0.0, 1.0), np.zeros(len(at), np.bool_), 0.5)
    return Interval(np.where(strange, 0.0, clamped.lo), np.where(strange, 1.0, clamped.hi), clamped.nan)


def _spread(weights_off: Float64, corners: Float64, middle: Float64) -> Float64:
    """Return the error of an interpolated value from errors of the weights (their sum is exact)."""
    apart = np.abs(corners - middle[:, None])
    return np.asarray(np.einsum("nk->n", np.where(apart > 0, weights_off * apart, 0.0)))


def _shared(weights: Float64, weights_off: Float64, corners_off: Float64) -> Float64:
    """Return the error of an interpolated value from errors of the corners, each times its weight."""
    shares = np.abs(weights) + weights_off
    return np.asarray(np.einsum("nk->n", np.where(corners_off > 0, shares * corners_off, 0.0)))


def _rounding(fragments: Fragments, size: Float64) -> Float64:
    """Return the rounding error of interpolation, relative to the largest corner; ``size`` (n,) is the sum of all
    weights."""
    if not fragments.anywhere:
        return np.asarray(INTERPOLATION_ULP * ULP)
    return (ANYWHERE_ULP[0] + ANYWHERE_ULP[1] * size + ANYWHERE_ULP[2] * size * size) * ULP


def _plane_off(mesh: Triangles, corners: Float64, fragments: Fragments) -> Float64:
    """Return the rounding error of a plane through a value's corners (m, 3); (m,)."""
    times = STEPPED if fragments.anywhere and not mesh.snapped else 1.0
    return times * PLANE_UNITS * (OWN_UNIT if mesh.snapped else DRIVER_UNIT) * _plane_size(mesh, corners)


def _plane_size(mesh: Triangles, corners: Float64) -> Float64:
    """Return the largest number in a plane's evaluation: a corner's value, or the offset from a corner to the picture's
    corner and back to a pixel, along steps whose parts may be larger than their difference."""
    (x1, x2), (y1, y2) = _next_corners(mesh.x), _next_corners(mesh.y)
    apart = np.abs(corners - corners.mean(axis=1, keepdims=True))
    parts = []
    for place, side, length in zip((mesh.x, mesh.y), (y1 - y2, x2 - x1), mesh.size, strict=True):
        parts.append((apart * np.abs(side)).sum(axis=1) * (np.abs(place).max(axis=1) + length))
    return np.asarray(np.abs(corners).max(axis=1) + (parts[0] + parts[1]) / np.abs(mesh.area))


def varying_of(mesh: Triangles, fragments: Fragments, columns: slice) -> Interval:
    """Return the perspective-correct interpolation of some columns, (n, columns)."""
    at = fragments.triangle
    inverse_w = mesh.inverse_w[at]
    inverse_w_off = mesh.inverse_w_off[at] + FLUSHED * inverse_w.max(axis=1, keepdims=True)
    over_w = fragments.weights * inverse_w
    total = over_w.sum(axis=1)
    weights = over_w / total[:, None]
    total_off = _spread(fragments.off, inverse_w, total) + _shared(fragments.weights, fragments.off, inverse_w_off)
    plane_off = _plane_off(mesh, mesh.inverse_w, fragments)[at]
    size = np.abs(weights).sum(axis=1)
    least_total = np.abs(total) - total_off
    own = fragments.off * np.abs(inverse_w) + np.abs(fragments.weights) * inverse_w_off
    off = (own + np.abs(weights) * total_off[:, None]) / np.where(least_total > 0, least_total, 0.0)[:, None]
    vertices = mesh.rows.values[:, columns][mesh.corners]
    corners = vertices[at]
    corners_off = mesh.rows.errors[:, columns][mesh.corners[at]]
    values = np.einsum("nk,nkc->nc", weights, corners)
    parts: list[Float64] = []
    for c in range(corners.shape[2]):
        spread = _spread(off, corners[:, :, c], values[:, c])
        rounding = _rounding(fragments, size) * np.abs(corners[:, :, c]).max(axis=1)
        parts.append(spread + _shared(weights, off, corners_off[:, :, c]) + rounding)
        if not mesh.snapped:
            # Planes of v/w and 1/w: their rounding error is large near the eye and where planes are steep.
            over_w_off = _plane_off(mesh, vertices[:, :, c] * mesh.inverse_w, fragments)[at]
            planes = over_w_off + np.abs(values[:, c]) * plane_off
            parts[-1] += planes / np.where(least_total > 0, least_total, np.nan)
    error = np.stack(parts, axis=1) if parts else np.zeros_like(values)
    strange = ~np.isfinite(values + error)
    low, high = np.where(strange, -np.inf, values - error), np.where(strange, np.inf, values + error)
    return Interval(low, high, strange)
