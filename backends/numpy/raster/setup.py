"""Triangle setup: projection, clipping, snapping, culling and binning into tiles.

The rules are in docs/rasterization.md.  Work is divided into chunks of triangles in submission order; a tile's list is
the concatenation of the chunks' lists, so order is kept without locks.  Written for numba; entries.py calls the
functions.
"""

# mypy: disable-error-code="untyped-decorator,arg-type"
from __future__ import annotations

from typing import Any

import numpy as np

from passgraph.backends.numpy.machine.numba_text import compiled
from passgraph.backends.numpy.raster.layout import CORNER_LISTS, MAX_CORNERS, NEW_VERTICES, TILE

#: Corners farther from the center than this many half-screens are not drawn: twice the guard band.
FARTHEST = 16.0

REJECTED, DIRECT, CLIPPED = 0, 1, 2
#: Bits of a vertex's code: outside near, far and the four sides; beyond the guard band or behind the eye; not finite.
SIDES, BEYOND, NOT_FINITE = 63, 64, 128
#: A triangle with any of these is clipped.
CLIPPING = 1 | 2 | BEYOND


def _project(
    first: Any, last: Any, clip: Any, width: Any, height: Any,
    window_x: Any, window_y: Any, depth: Any, inverse_w: Any, codes: Any,
) -> None:  # fmt: skip
    """Compute the clip codes of vertices, and window coordinates of those in front of the eye: others are never used
    unclipped."""
    for v in range(first, last):
        x, y, z, w = clip[v, 0], clip[v, 1], clip[v, 2], clip[v, 3]
        # Written so that NaN counts as outside.
        code = (0 if z + w >= 0.0 else 1) | (0 if w - z >= 0.0 else 2)
        code |= (4 if x > w else 0) | (8 if x < -w else 0) | (16 if y > w else 0) | (32 if y < -w else 0)
        if not (w > 0.0 and abs(x) <= 8.0 * w and abs(y) <= 8.0 * w):
            code |= BEYOND
        if not (abs(x) < np.inf and abs(y) < np.inf and abs(z) < np.inf and abs(w) < np.inf):
            code |= NOT_FINITE
        codes[v] = code
        if w > 0:
            # Window coordinates have 8 fractional bits.
            window_x[v] = np.int32(min(max(np.rint((x / w * 0.5 + 0.5) * width * 256.0), -1.0e9), 1.0e9))
            window_y[v] = np.int32(min(max(np.rint((0.5 - y / w * 0.5) * height * 256.0), -1.0e9), 1.0e9))
            depth[v] = z / w * 0.5 + 0.5
            inverse_w[v] = 1.0 / w


def _distance(clip: Any, v: Any, plane: Any) -> Any:
    """Return the signed distance of a vertex to a plane: near, far, then the guard band."""
    x, y, z, w = clip[v, 0], clip[v, 1], clip[v, 2], clip[v, 3]
    if plane == 0:
        return z + w
    if plane == 1:
        return w - z
    if plane == 2:
        return 8.0 * w - x
    if plane == 3:
        return 8.0 * w + x
    if plane == 4:
        return 8.0 * w - y
    return 8.0 * w + y


def _classify(first: Any, last: Any, chunk: Any, triangles: Any, codes: Any, kinds: Any, counts: Any) -> None:
    """Classify triangles as outside, inside or to be clipped; count the last two in ``counts[chunk]``."""
    direct = 0
    clipped = 0
    for t in range(first, last):
        a, b, c = codes[triangles[t, 0]], codes[triangles[t, 1]], codes[triangles[t, 2]]
        if a & b & c & SIDES or (a | b | c) & NOT_FINITE:
            kinds[t] = REJECTED
        elif (a | b | c) & CLIPPING:
            kinds[t] = CLIPPED
            clipped += 1
        else:
            kinds[t] = DIRECT
            direct += 1
    counts[chunk, 0], counts[chunk, 1] = direct, clipped


def _between(clip: Any, varyings: Any, inside: Any, outside: Any, d_inside: Any, d_outside: Any, to: Any) -> None:
    """Return the vertex where an edge crosses a plane: both ends weighted, so that a huge end does not swamp the
    other."""
    apart = d_inside - d_outside
    share, rest = -d_outside / apart, d_inside / apart
    for c in range(4):
        clip[to, c] = clip[inside, c] * share + clip[outside, c] * rest
    share32, rest32 = np.float32(share), np.float32(rest)
    for c in range(varyings.shape[1]):
        varyings[to, c] = varyings[inside, c] * share32 + varyings[outside, c] * rest32


def _run_inside(count: Any, clip: Any, corners: Any, row: Any, plane: Any) -> Any:
    """Return the bits of the corners inside a plane that are contiguous around the deepest one.

    For a convex polygon these are all; rounding may put others inside, but with those more than two edges would be cut.
    """
    deepest, most = 0, distance(clip, corners[row, 0], plane)
    for k in range(1, count):
        d = distance(clip, corners[row, k], plane)
        if d > most:
            deepest, most = k, d
    if not (most >= 0.0):
        return 0
    run = 1 << deepest
    for way in (1, count - 1):
        k = (deepest + way) % count
        while k != deepest and distance(clip, corners[row, k], plane) >= 0.0:
            run |= 1 << k
            k = (k + way) % count
    return run


def _clip(t: Any, triangles: Any, clip: Any, varyings: Any, free: Any, corners: Any, row: Any) -> Any:
    """Clip one triangle into ``corners[row]``, with ``corners[row + 1]`` as scratch; new vertices are stored from
    ``free`` on, at most ``NEW_VERTICES``.  Return (corner count, next free vertex)."""
    count, cut, end = 3, row + 1, free + NEW_VERTICES
    for k in range(3):
        corners[row, k] = triangles[t, k]
    for plane in range(6):
        run = run_inside(count, clip, corners, row, plane)
        if run == (1 << count) - 1:
            continue
        if run == 0 or count >= MAX_CORNERS or free + 2 > end:  # one run leaves space for one more corner
            return 0, free
        kept = 0
        for k in range(count):
            following = (k + 1) % count
            here, there = corners[row, k], corners[row, following]
            stays, follows = run >> k & 1, run >> following & 1
            if stays:
                corners[cut, kept] = here
                kept += 1
            if stays != follows:
                d_here, d_there = distance(clip, here, plane), distance(clip, there, plane)
                if stays:
                    between(clip, varyings, here, there, d_here, d_there, free)
                else:
                    between(clip, varyings, there, here, d_there, d_here, free)
                corners[cut, kept] = free
                kept += 1
                free += 1
        count = kept
        for k in range(count):
            corners[row, k] = corners[cut, k]
        if count < 3:
            return 0, free
    return count, free


def _placed(v: Any, clip: Any) -> Any:
    """Return True if a corner has a valid screen position: not at the eye, nor moved far off by rounding alone."""
    farthest = FARTHEST * clip[v, 3]
    return farthest > 0.0 and abs(clip[v, 0]) <= farthest and abs(clip[v, 1]) <= farthest


def _holds(x0: Any, y0: Any, x1: Any, y1: Any, x2: Any, y2: Any, px: Any, py: Any) -> Any:
    """Return True if a triangle of positive area covers a point (rule 4)."""
    return edge(x0, y0, x1, y1, px, py) >= 0 and edge(x1, y1, x2, y2, px, py) >= 0 and edge(x2, y2, x0, y0, px, py) >= 0


def _edge(x0: Any, y0: Any, x1: Any, y1: Any, px: Any, py: Any) -> Any:
    """Return the edge function: positive inside, less one where the edge is neither top nor left."""
    dx, dy = x1 - x0, y1 - y0
    return dx * (py - y0) - dy * (px - x0) - (0 if dy < 0 or (dy == 0 and dx > 0) else 1)


def _keep(
    a: Any,
    b: Any,
    c: Any,
    window_x: Any,
    window_y: Any,
    width: Any,
    height: Any,
    cull: Any,
    ready: Any,
    at: Any,
) -> Any:
    """Write one triangle if it has area, faces the right way and may touch a pixel center; wound to positive area."""
    x0, y0 = np.int64(window_x[a]), np.int64(window_y[a])
    x1, y1 = np.int64(window_x[b]), np.int64(window_y[b])
    x2, y2 = np.int64(window_x[c]), np.int64(window_y[c])
    area = (x1 - x0) * (y2 - y0) - (x2 - x0) * (y1 - y0)
    # Rows run downward, so a negative area is counter-clockwise as seen with y up: a front face.
    if area == 0 or (area < 0 and cull == 2) or (area > 0 and cull == 1):
        return at
    left, right = (min(x0, x1, x2) + 127) >> 8, (max(x0, x1, x2) - 128) >> 8
    top, bottom = (min(y0, y1, y2) + 127) >> 8, (max(y0, y1, y2) - 128) >> 8
    left, top = max(left, 0), max(top, 0)
    right, bottom = min(right, width - 1), min(bottom, height - 1)
    if left > right or top > bottom:
        return at
    if left == right and top == bottom:
        # Most triangles of dense meshes: one center in the bounding box, which the triangle itself may miss.
        if area < 0:
            x1, y1, x2, y2 = x2, y2, x1, y1
        if not holds(x0, y0, x1, y1, x2, y2, left * 256 + 128, top * 256 + 128):
            return at
    ready[at, 0] = a
    ready[at, 1] = c if area < 0 else b
    ready[at, 2] = b if area < 0 else c
    ready[at, 3] = 1 if area < 0 else 0
    ready[at, 4], ready[at, 5], ready[at, 6], ready[at, 7] = left, top, right, bottom
    return at + 1


def _assemble(
    first: Any, last: Any, chunk: Any, free: Any, at: Any, triangles: Any, kinds: Any, codes: Any, clip: Any,
    varyings: Any, width: Any, height: Any, cull: Any,
    window_x: Any, window_y: Any, depth: Any, inverse_w: Any, ready: Any, corners: Any,
) -> Any:  # fmt: skip
    """Prepare the triangles of one chunk for drawing, stored from ``ready[at]`` on; return their end."""
    row = CORNER_LISTS * chunk
    for t in range(first, last):
        if kinds[t] == DIRECT:
            a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
            at = keep(a, b, c, window_x, window_y, width, height, cull, ready, at)
        elif kinds[t] == CLIPPED:
            begin = free
            count, free = clip_triangle(t, triangles, clip, varyings, free, corners, row)
            project(begin, free, clip, width, height, window_x, window_y, depth, inverse_w, codes)
            for k in range(1, count - 1):
                a, b, c = corners[row, 0], corners[row, k], corners[row, k + 1]
                if placed(a, clip) and placed(b, clip) and placed(c, clip):
                    at = keep(a, b, c, window_x, window_y, width, height, cull, ready, at)
    return at


def _count(first: Any, last: Any, chunk: Any, ready: Any, tiles_x: Any, counts: Any) -> None:
    """Count the triangles of a chunk that touch each tile (by bounding box)."""
    for t in range(first, last):
        for ty in range(ready[t, 5] // TILE, ready[t, 7] // TILE + 1):
            for tx in range(ready[t, 4] // TILE, ready[t, 6] // TILE + 1):
                counts[chunk, ty * tiles_x + tx] += 1


def _fill(first: Any, last: Any, chunk: Any, ready: Any, tiles_x: Any, cursors: Any, lists: Any) -> None:
    """Append the triangles of a chunk to the tiles' lists, in order, from ``cursors[chunk, tile]`` on."""
    for t in range(first, last):
        for ty in range(ready[t, 5] // TILE, ready[t, 7] // TILE + 1):
            for tx in range(ready[t, 4] // TILE, ready[t, 6] // TILE + 1):
                tile = ty * tiles_x + tx
                lists[cursors[chunk, tile]] = t
                cursors[chunk, tile] += 1


distance = compiled(_distance)
between = compiled(_between)
run_inside = compiled(_run_inside)
placed = compiled(_placed)
project = compiled(_project)
classify = compiled(_classify)
clip_triangle = compiled(_clip)
edge = compiled(_edge)
holds = compiled(_holds)
keep = compiled(_keep)
assemble = compiled(_assemble)
count_tiles = compiled(_count)
fill_tiles = compiled(_fill)
