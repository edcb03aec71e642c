"""One triangle in one tile: its numbers (layout.py), its edges, the span of pixels that it covers in a row.

Called by the loops over a tile (tiles.py, order.py).  Compiled once for all draws.
"""

# mypy: disable-error-code="untyped-decorator,call-arg,unreachable"
from __future__ import annotations

from typing import Any

import numpy as np

from passgraph.backends.numpy.machine.jit import compiled
from passgraph.backends.numpy.raster.call import pg_soon
from passgraph.backends.numpy.raster.layout import DEPTH, EDGE1, EDGE2, FRONT, NEARNESS, PLANES, TO_Y, VARYINGS

#: Triangles between the one that is fetched and the one that is drawn.
AHEAD = 4


def _soon(
    n: Any, end: Any, lists: Any, made: Any, window_x: Any, window_y: Any, depth: Any, inverse_w: Any, varyings: Any,
    every: Any,
) -> None:  # fmt: skip
    """Fetch into the cache what triangles a few behind ``lists[n]`` need: corners' places and depths; ``every``: all.

    A tile's triangles lie all over memory, and waiting for them would take longer than all else.
    """
    if n + 2 * AHEAD < end:
        pg_soon(made, np.int64(lists[np.uint64(n + 2 * AHEAD)]))
        t = np.uint64(lists[np.uint64(n + AHEAD)])
        for k in range(3):
            v = np.int64(made[t, np.uint64(k)])
            pg_soon(window_x, v)
            pg_soon(window_y, v)
            pg_soon(depth, v)
            if every:
                pg_soon(inverse_w, v)
                pg_soon(varyings, v)


def _window(ax: Any, ay: Any, bx: Any, by: Any, cx: Any, cy: Any) -> Any:
    """The first corner, and the others from there."""
    x0, y0 = np.int64(ax), np.int64(ay)
    return x0, y0, np.int64(bx) - x0, np.int64(by) - y0, np.int64(cx) - x0, np.int64(cy) - y0


def _plane(a: Any, b: Any, c: Any, x1: Any, y1: Any, x2: Any, y2: Any, scale: Any) -> Any:
    """The value at the first corner, and its steps along x and y."""
    return a, ((b - a) * y2 - (c - a) * y1) * scale, ((c - a) * x1 - (b - a) * x2) * scale


def _depth_plane(
    a: Any, b: Any, c: Any, x1: Any, y1: Any, x2: Any, y2: Any, scale: Any, factor: Any, units: Any
) -> Any:
    """With the polygon offset."""
    start, step_x, step_y = plane(a, b, c, x1, y1, x2, y2, scale)
    if factor != 0.0 or units != 0.0:
        deepest = max(abs(a), abs(b), abs(c))
        smallest = 2.0 ** (np.floor(np.log2(deepest)) - 23.0) if deepest > 0.0 else 0.0
        start += factor * max(abs(step_x), abs(step_y)) + units * smallest
    return start, step_x, step_y


def _numbered(
    t: Any, slot: Any, made: Any, window_x: Any, window_y: Any, depth: Any, inverse_w: Any, varyings: Any, factor: Any,
    units: Any, rows: Any, table: Any,
) -> None:  # fmt: skip
    """Put a triangle's numbers, so many rows, into their place in ``table``."""
    a, b, c = np.uint64(made[t, 0]), np.uint64(made[t, 1]), np.uint64(made[t, 2])
    x0, y0, x1, y1, x2, y2 = window(window_x[a], window_y[a], window_x[b], window_y[b], window_x[c], window_y[c])
    area = float(x1 * y2 - x2 * y1)
    to_x = 0.5 - x0 / 256.0
    at = np.uint64(np.int64(slot) * (PLANES + 3 * rows))
    table[at + np.uint64(TO_Y)] = 0.5 - y0 / 256.0
    table[at + np.uint64(FRONT)] = made[t, 3]
    at += np.uint64(PLANES)
    start, step_x, step_y = depth_plane(depth[a], depth[b], depth[c], x1, y1, x2, y2, 256.0 / area, factor, units)
    put(table, at, DEPTH, start + step_x * to_x, step_x, step_y)
    if rows > 1:
        put(table, at, EDGE1, 0.0 + 256.0 * y2 * to_x, 256.0 * y2, -256.0 * x2)
        put(table, at, EDGE2, 0.0 + -256.0 * y1 * to_x, -256.0 * y1, 256.0 * x1)
        put(table, at, NEARNESS, area, inverse_w[b] / inverse_w[a], inverse_w[c] / inverse_w[a])
        for k in range(varyings.shape[1]):
            first = float(varyings[a, k])
            put(table, at, VARYINGS + k, first, varyings[b, k] - first, varyings[c, k] - first)


def _put(table: Any, at: Any, row: Any, first: Any, second: Any, third: Any) -> None:
    place = at + np.uint64(3 * row)
    table[place], table[place + np.uint64(1)], table[place + np.uint64(2)] = first, second, third


def _narrowed(first: Any, last: Any, value: Any, step: Any, left: Any) -> Any:
    """What of first … last one edge leaves; ``value`` is the edge's at ``left``.

    Quotients are taken in float64: an edge value below 2**46 over a step below 2**31 cannot round to the wrong whole.
    """
    if step > 0:
        if value < 0:
            first = max(first, left + np.int64(np.ceil(-value / step)))
    elif value < 0:
        last = first - 1
    elif step < 0:
        last = min(last, left + np.int64(np.floor(value / -step)))
    return first, last


def _span(e0: Any, e1: Any, e2: Any, step0: Any, step1: Any, step2: Any, left: Any, right: Any) -> Any:
    """First and last covered pixel of a row, given the edges there; empty where first > last."""
    first, last = narrowed(left, right, e0, step0, left)
    first, last = narrowed(first, last, e1, step1, left)
    return narrowed(first, last, e2, step2, left)


def _visible(
    ids: Any, slots: Any, lists: Any, begin: Any, end: Any, made: Any, window_x: Any, window_y: Any, depth: Any,
    inverse_w: Any, varyings: Any, factor: Any, units: Any, rows: Any, table: Any,
) -> None:  # fmt: skip
    """Number the triangles that ``ids`` shows, put those numbers in their place, and their planes into ``table``."""
    for n in range(end - begin):
        slots[n] = -1
    number = 0
    for k in range(len(ids)):
        n = ids[k]
        if n < 0:
            continue
        slot = slots[n]
        if slot < 0:
            slot = number
            slots[n] = slot
            number += 1
            t = np.uint64(lists[np.uint64(begin + n)])
            numbered(t, slot, made, window_x, window_y, depth, inverse_w, varyings, factor, units, rows, table)
        ids[k] = slot


soon = compiled(_soon)
window = compiled(_window)
plane = compiled(_plane)
depth_plane = compiled(_depth_plane)
put = compiled(_put)
narrowed = compiled(_narrowed)
span = compiled(_span)
numbered = compiled(_numbered)
visible = compiled(_visible)
