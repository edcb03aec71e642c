"""From clip coordinates to binned triangles: projection, clipping, snapping, culling, tiles.

The rules are those of docs/rasterisation.md.  Work is cut into chunks of triangles in submission order; a tile's list
is the chunks' lists one after another, so order is kept without locks.
"""

# mypy: disable-error-code="untyped-decorator,arg-type"
from __future__ import annotations

from typing import Any

import numpy as np

from passgraph.backends.numpy.jit import compiled

#: Window coordinates carry 8 bits below the pixel.
SUBPIXEL = 256
#: Side of a tile in pixels: its colour and depth (a few formats) stay in a core's second-level cache.
TILE = 64
#: A triangle cut by six planes has at most nine corners.
MAX_CORNERS = 9
#: Vertices beyond this many half-screens from the centre are clipped, so that fixed point and int64 suffice.
GUARD_BAND = 8.0

REJECTED, DIRECT, CLIPPED = 0, 1, 2


def _project(
    first: Any,
    last: Any,
    clip: Any,
    width: Any,
    height: Any,
    window_x: Any,
    window_y: Any,
    depth: Any,
    inverse_w: Any,
) -> None:
    """Window coordinates of vertices in front of the eye; others are never used unclipped."""
    for v in range(first, last):
        w = clip[v, 3]
        if w > 0:
            window_x[v] = np.int32(min(max(np.rint((clip[v, 0] / w * 0.5 + 0.5) * width * 256.0), -1.0e9), 1.0e9))
            window_y[v] = np.int32(min(max(np.rint((0.5 - clip[v, 1] / w * 0.5) * height * 256.0), -1.0e9), 1.0e9))
            depth[v] = clip[v, 2] / w * 0.5 + 0.5
            inverse_w[v] = 1.0 / w


def _distance(clip: Any, v: Any, plane: Any) -> Any:
    """How far a vertex lies inside a plane: near, far, then the guard band."""
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


def _classify(first: Any, last: Any, triangles: Any, clip: Any, kinds: Any) -> Any:
    """Which triangles are outside, whole, or to be clipped; returns how many of the last two."""
    direct = 0
    clipped = 0
    for t in range(first, last):
        kind = DIRECT
        outside = 63
        for k in range(3):
            v = triangles[t, k]
            x, y, z, w = clip[v, 0], clip[v, 1], clip[v, 2], clip[v, 3]
            # Written so that NaN counts as outside.
            if not (z + w >= 0.0) or not (w - z >= 0.0) or not (w > 0.0):
                kind = CLIPPED
            if not (abs(x) <= 8.0 * w) or not (abs(y) <= 8.0 * w):
                kind = CLIPPED
            mine = 0
            if not (z + w >= 0.0):
                mine |= 1
            if not (w - z >= 0.0):
                mine |= 2
            if x > w:
                mine |= 4
            if x < -w:
                mine |= 8
            if y > w:
                mine |= 16
            if y < -w:
                mine |= 32
            outside &= mine
        if outside != 0:
            kind = REJECTED
        kinds[t] = kind
        if kind == DIRECT:
            direct += 1
        elif kind == CLIPPED:
            clipped += 1
    return direct, clipped


def _lerp(clip: Any, varyings: Any, inside: Any, outside: Any, t: Any, to: Any) -> None:
    for c in range(4):
        clip[to, c] = clip[inside, c] + (clip[outside, c] - clip[inside, c]) * t
    for c in range(varyings.shape[1]):
        varyings[to, c] = varyings[inside, c] + (varyings[outside, c] - varyings[inside, c]) * np.float32(t)


def _clip(t: Any, triangles: Any, clip: Any, varyings: Any, free: Any, corners: Any, cut: Any) -> Any:
    """Cut one triangle; new vertices go to ``free`` on.  Returns (corner count, next free vertex)."""
    count = 3
    for k in range(3):
        corners[k] = triangles[t, k]
    for plane in range(6):
        if plane >= 2:
            beyond = False
            for k in range(count):
                if not (distance(clip, corners[k], plane) >= 0.0):
                    beyond = True
            if not beyond:
                continue
        kept = 0
        for k in range(count):
            here, there = corners[k], corners[(k + 1) % count]
            d_here, d_there = distance(clip, here, plane), distance(clip, there, plane)
            if d_here >= 0.0:
                cut[kept] = here
                kept += 1
                if not (d_there >= 0.0):
                    lerp(clip, varyings, here, there, d_here / (d_here - d_there), free)
                    cut[kept] = free
                    kept += 1
                    free += 1
            elif d_there >= 0.0:
                lerp(clip, varyings, there, here, d_there / (d_there - d_here), free)
                cut[kept] = free
                kept += 1
                free += 1
        count = kept
        for k in range(count):
            corners[k] = cut[k]
        if count < 3:
            return 0, free
    return count, free


def _keep(
    a: Any,
    b: Any,
    c: Any,
    window_x: Any,
    window_y: Any,
    width: Any,
    height: Any,
    cull: Any,
    made: Any,
    at: Any,
) -> Any:
    """Write one triangle if it has area, faces the right way and may touch a pixel centre; wound to positive area."""
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
    made[at, 0] = a
    made[at, 1] = c if area < 0 else b
    made[at, 2] = b if area < 0 else c
    made[at, 3] = 1 if area < 0 else 0
    made[at, 4], made[at, 5], made[at, 6], made[at, 7] = left, top, right, bottom
    return at + 1


def _assemble(
    first: Any, last: Any, triangles: Any, kinds: Any, clip: Any, varyings: Any, free: Any,
    width: Any, height: Any, cull: Any,
    window_x: Any, window_y: Any, depth: Any, inverse_w: Any, made: Any, at: Any,
) -> Any:  # fmt: skip
    """Triangles of one chunk, ready to be drawn, from ``made[at]`` on; returns where they end."""
    corners = np.empty(16, np.int64)
    cut = np.empty(16, np.int64)
    for t in range(first, last):
        if kinds[t] == DIRECT:
            at = keep(
                triangles[t, 0],
                triangles[t, 1],
                triangles[t, 2],
                window_x,
                window_y,
                width,
                height,
                cull,
                made,
                at,
            )
        elif kinds[t] == CLIPPED:
            begin = free
            count, free = clip_triangle(t, triangles, clip, varyings, free, corners, cut)
            project(begin, free, clip, width, height, window_x, window_y, depth, inverse_w)
            good = True
            for k in range(count):
                if not (clip[corners[k], 3] > 0.0):
                    good = False
            if good:
                for k in range(1, count - 1):
                    at = keep(
                        corners[0],
                        corners[k],
                        corners[k + 1],
                        window_x,
                        window_y,
                        width,
                        height,
                        cull,
                        made,
                        at,
                    )
    return at


def _count(first: Any, last: Any, made: Any, tiles_x: Any, counts: Any) -> None:
    """How many triangles of a chunk touch each tile (by bounding box)."""
    for t in range(first, last):
        for ty in range(made[t, 5] >> 6, (made[t, 7] >> 6) + 1):
            for tx in range(made[t, 4] >> 6, (made[t, 6] >> 6) + 1):
                counts[ty * tiles_x + tx] += 1


def _fill(first: Any, last: Any, made: Any, tiles_x: Any, cursor: Any, lists: Any) -> None:
    """The triangles of a chunk into the tiles' lists, in order, from ``cursor[tile]`` on."""
    for t in range(first, last):
        for ty in range(made[t, 5] >> 6, (made[t, 7] >> 6) + 1):
            for tx in range(made[t, 4] >> 6, (made[t, 6] >> 6) + 1):
                tile = ty * tiles_x + tx
                lists[cursor[tile]] = t
                cursor[tile] += 1


distance = compiled(_distance)
lerp = compiled(_lerp)
project = compiled(_project)
classify = compiled(_classify)
clip_triangle = compiled(_clip)
keep = compiled(_keep)
assemble = compiled(_assemble)
count_tiles = compiled(_count)
fill_tiles = compiled(_fill)
