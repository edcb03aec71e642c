"""Which pixels a triangle covers (rule 4 of docs/rasterisation.md), by exact integer arithmetic.

An edge function is linear along a row, so the covered pixels of a row are one span whose ends follow from
three integer divisions.  Nothing is tested pixel by pixel, and nothing is rounded.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from passgraph.backends.reference.raster_setup import SUBPIXELS, ScreenTriangles

Float64 = NDArray[np.float64]
Ints = NDArray[np.int64]

HALF = SUBPIXELS // 2
#: Rows of triangles, and fragments, handled at once.
BATCH = 1 << 18


@dataclass(frozen=True)
class Fragments:
    """Covered pixel centres in the order of submission."""

    triangle: Ints
    x: Ints
    y: Ints
    weights: Float64  # (n, 3) barycentric

    def __len__(self) -> int:
        return len(self.triangle)

    def beside(self, axes: str, triangles: ScreenTriangles) -> Fragments:
        """Where the pixels' quads have them along these axes, whether or not the triangle covers it."""
        x, y = self.x ^ int("x" in axes), self.y ^ int("y" in axes)
        return Fragments(self.triangle, x, y, _weights(triangles, self.triangle, x, y))

    def __getitem__(self, chosen: NDArray[np.generic] | slice) -> Fragments:
        return Fragments(self.triangle[chosen], self.x[chosen], self.y[chosen], self.weights[chosen])


def cover(triangles: ScreenTriangles, size: tuple[int, int]) -> Iterator[Fragments]:
    """All fragments, in batches of bounded size; one triangle may fall into several."""
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
    """(i, j) for each i and each j below ``lengths[i]``, about BATCH pairs at a time."""
    ends = np.cumsum(lengths)
    first = 0
    while first < len(lengths):
        done = ends[first - 1] if first else 0
        last = max(first + 1, int(np.searchsorted(ends, done + BATCH, side="right")))
        part = lengths[first:last]
        i = np.repeat(np.arange(first, last), part)
        j = np.arange(len(i)) - np.repeat(np.cumsum(part) - part, part)
        if len(i):
            yield i, j
        first = last


def _edge(triangles: ScreenTriangles, owner: Ints, k: int) -> tuple[Ints, Ints, Ints, Ints]:
    """The edge opposite corner k: where it starts, and how far it goes along x and y."""
    a, b = (k + 1) % 3, (k + 2) % 3
    x, y = triangles.x[owner, a], triangles.y[owner, a]
    return x, y, triangles.x[owner, b] - x, triangles.y[owner, b] - y


def _spans(triangles: ScreenTriangles, owner: Ints, row: Ints, width: int) -> tuple[Ints, Ints]:
    """First and last covered column (inclusive) of a row of each triangle; none where last < first."""
    left, right = np.zeros(len(owner), np.int64), np.full(len(owner), width - 1, np.int64)
    centre_y = SUBPIXELS * row + HALF
    for k in range(3):
        x, y, dx, dy = _edge(triangles, owner, k)
        # Inside is >= 0 at column i: start - slope * i >= 0.  Edges that own no centre on them need 1 more.
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
