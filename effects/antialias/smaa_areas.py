"""The area table of SMAA: the part of a pixel beyond the line that an edge of pixels approximates.

Source: J. Jimenez, J. I. Echevarria, T. Sousa, D. Gutierrez, "SMAA: Enhanced Subpixel Morphological Antialiasing",
2012, and their script that makes its texture.
"""

from __future__ import annotations

from functools import lru_cache
from math import copysign, modf, sqrt

import numpy as np
from numpy.typing import NDArray

Float64 = NDArray[np.float64]
Ints = NDArray[np.int64]
Point = tuple[float, float]
Pair = tuple[float, float]

#: Distances along rows and columns are stored as square roots, up to this; diagonal ones unchanged.
STRAIGHT, DIAGONAL = 16, 20
#: U-shaped patterns shorter than this, px, are smoothed more.
SMOOTH_PX = 32.0
#: Samples along each side of a pixel, counted on one side of a diagonal.
SAMPLES = 30
NOTHING: Pair = (0.0, 0.0)
#: Crossings at an end: none, below, above, both; three for above and one for below in the order of the table.
BELOW, ABOVE = 1, 3


@lru_cache(maxsize=1)
def areas() -> NDArray[np.uint8]:
    """Return the fractions of a pixel that take the color across the edge, and of the pixel across it: (80, 160, 2), 0
    to 255.

    The left half is for edges along rows, at (16 a + root of the distance to the left, 16 b + to the right) with
    crossings a and b at its ends: 1 below, 3 above, 4 both. The right half is for diagonals, at (20 a + distance, 20 b
    + distance): 1 for an edge on one side of the end, 2 on the other, 3 on both.

    >>> areas().shape, areas()[16 * 3, 16 * 1].tolist()
    ((80, 160, 2), [32, 32])
    """
    table = np.zeros((5 * STRAIGHT, 10 * STRAIGHT, 2))
    for first in (0, BELOW, ABOVE, BELOW + ABOVE):
        for last in (0, BELOW, ABOVE, BELOW + ABOVE):
            for left in range(STRAIGHT):
                for right in range(STRAIGHT):
                    place = STRAIGHT * last + right, STRAIGHT * first + left
                    table[place] = straight_area(first, last, left * left, right * right)
    for first in range(4):
        for last in range(4):
            rows, columns = slice(DIAGONAL * last, DIAGONAL * (last + 1)), DIAGONAL * first
            table[rows, 80 + columns : 80 + columns + DIAGONAL] = diagonal_areas(first, last)
    rounded = np.rint(table * 255.0).astype(np.uint8)
    rounded.setflags(write=False)
    return rounded


def straight_area(first: int, last: int, left: int, right: int) -> Pair:
    """Return the areas of a pixel with distances to the left and right end of the edge, and crossings at both ends."""
    length = left + right + 1.0
    middle, end = (0.5 * length, 0.0), length
    # a line begins or ends half a pixel above or below the edge, at the crossing
    height = {BELOW: 0.5, ABOVE: -0.5}
    if first in height and last in height:
        if first != last:
            return area_beside((0.0, height[first]), (end, height[last]), left)
        parts = (area_beside((0.0, height[first]), middle, left), area_beside(middle, (end, height[last]), left))
        (a, b), (c, d) = (smoothed(part, length) for part in parts)
        return a + c, b + d
    if first == last or {first, last} == {0, BELOW + ABOVE}:
        return NOTHING
    if first == 0 or last == 0:
        is_near = right <= left if first == 0 else left <= right
        if not is_near:
            return NOTHING
        return (
            area_beside(middle, (end, height[last]), left)
            if first == 0
            else area_beside((0.0, height[first]), middle, left)
        )
    # one end is crossed both ways: the line continues to the side opposite to the other end
    if first in height:
        return area_beside((0.0, height[first]), (end, -height[first]), left)
    return area_beside((0.0, -height[last]), (end, height[last]), left)


def smoothed(area: Pair, length: float) -> Pair:
    """Smooth short bumps more."""
    share = min(length / SMOOTH_PX, 1.0)
    a, b = (0.5 * sqrt(2.0 * one) * (1.0 - share) + one * share for one in area)
    return a, b


def area_beside(begin: Point, end: Point, x: int) -> Pair:
    """Return the area between a line and y = 0 in the pixel from x to x + 1: above, where y is negative, and below."""
    slope = (end[1] - begin[1]) / (end[0] - begin[0])
    y1, y2 = (begin[1] + slope * (x + k - begin[0]) for k in (0.0, 1.0))
    if not (begin[0] <= x < end[0] or begin[0] < x + 1 <= end[0]):
        return NOTHING
    if copysign(1.0, y1) == copysign(1.0, y2) or abs(y1) < 1e-4 or abs(y2) < 1e-4:
        area = 0.5 * (y1 + y2)
        return (-area, 0.0) if area < 0.0 else (0.0, area)
    zero = begin[0] - begin[1] / slope
    part = modf(zero)[0]
    a1 = 0.5 * y1 * part if zero > begin[0] else 0.0
    a2 = 0.5 * y2 * (1.0 - part) if zero < end[0] else 0.0
    larger = a1 if abs(a1) > abs(a2) else -a2
    return (abs(a1), abs(a2)) if larger < 0.0 else (abs(a2), abs(a1))


#: Crossings at both ends of a diagonal → the lines to average, each from (x, y) to (length + x, length + y).
_LINES = {
    (0, 0): ((1, 1, 1, 1), (1, 0, 1, 0)), (1, 0): ((1, 0, 0, 0), (1, 0, 1, 0)), (0, 2): ((0, 0, 1, 0), (1, 0, 1, 0)),
    (1, 2): ((1, 0, 1, 0),), (2, 0): ((1, 1, 0, 0), (1, 1, 1, 0)), (3, 0): ((1, 1, 0, 0), (1, 0, 1, 0)),
    (2, 2): ((1, 1, 1, 0),), (3, 2): ((1, 1, 1, 0), (1, 0, 1, 0)), (0, 1): ((0, 0, 1, 1), (1, 0, 1, 1)),
    (1, 1): ((1, 0, 1, 1),), (0, 3): ((0, 0, 1, 1), (1, 0, 1, 0)), (1, 3): ((1, 0, 1, 1), (1, 0, 1, 0)),
    (2, 1): ((1, 1, 1, 1),), (3, 1): ((1, 1, 1, 1), (1, 0, 1, 1)), (2, 3): ((1, 1, 1, 1), (1, 1, 1, 0)),
    (3, 3): ((1, 1, 1, 1), (1, 0, 1, 0)),
}  # fmt: skip


def diagonal_areas(first: int, last: int) -> Float64:
    """Return the areas for each distance to one end (columns) and to the other (rows): (20, 20, 2)."""
    left, right = np.arange(DIAGONAL)[None, :], np.arange(DIAGONAL)[:, None]
    length = left + right + 1
    lines = [
        np.stack([1.0 - share_beyond(line, length, left, 0), share_beyond(line, length, left, 1)], axis=-1)
        for line in _LINES[first, last]
    ]
    return np.asarray(np.mean(lines, axis=0))


def share_beyond(line: tuple[int, int, int, int], length: Ints, left: Ints, down: int) -> Float64:
    """Return the fraction of the pixel at (1 + left, down + left) to the right of a line, by sampling."""
    x1, y1 = float(line[0]), float(line[1])
    x2, y2 = line[2] + length, line[3] + length
    at = np.arange(SAMPLES) / (SAMPLES - 1.0)
    across = (1.0 + left)[..., None, None] + at
    below = (float(down) + left)[..., None, None] + at[:, None]
    along_y, along_x = (y2 - y1)[..., None, None], (x1 - x2)[..., None, None]
    middle_x, middle_y = 0.5 * (x1 + x2)[..., None, None], 0.5 * (y1 + y2)[..., None, None]
    is_beyond = along_y * (across - middle_x) + along_x * (below - middle_y) > 0.0
    is_point = (x2 == x1) & (y2 == y1)
    return np.asarray(np.where(is_point, 1.0, is_beyond.mean(axis=(-2, -1))))
