"""One triangle in one tile: its numbers (llvm_names.py), its edges, the span of pixels that it covers in a row.

Called by the generated loop over a tile (raster_code.py).  Compiled once for all draws.
"""

# mypy: disable-error-code="untyped-decorator"
from __future__ import annotations

from typing import Any

import numpy as np

from passgraph.backends.numpy.jit import compiled
from passgraph.backends.numpy.llvm_names import DEPTH, EDGE1, EDGE2, FRONT, NEARNESS, PLANES, TO_Y, VARYINGS
from passgraph.backends.numpy.raster_setup import edge


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


def _triangle(
    t: Any, made: Any, window_x: Any, window_y: Any, depth: Any, inverse_w: Any, varyings: Any, factor: Any, units: Any,
    planes: Any,
) -> Any:  # fmt: skip
    """Fill ``planes``, as many as it has rows; returns the way from their origin, the first corner, to the centre of
    pixel (0, 0).
    """
    a, b, c = made[t, 0], made[t, 1], made[t, 2]
    x0, y0, x1, y1, x2, y2 = window(window_x[a], window_y[a], window_x[b], window_y[b], window_x[c], window_y[c])
    area = float(x1 * y2 - x2 * y1)
    scale = 256.0 / area
    planes[DEPTH, 0], planes[DEPTH, 1], planes[DEPTH, 2] = depth_plane(
        depth[a], depth[b], depth[c], x1, y1, x2, y2, scale, factor, units
    )
    if len(planes) > 1:
        planes[EDGE1, 0], planes[EDGE1, 1], planes[EDGE1, 2] = 0.0, 256.0 * y2, -256.0 * x2
        planes[EDGE2, 0], planes[EDGE2, 1], planes[EDGE2, 2] = 0.0, -256.0 * y1, 256.0 * x1
        planes[NEARNESS, 0] = area
        planes[NEARNESS, 1], planes[NEARNESS, 2] = inverse_w[b] / inverse_w[a], inverse_w[c] / inverse_w[a]
        for k in range(varyings.shape[1]):
            row, first = VARYINGS + k, float(varyings[a, k])
            planes[row, 0], planes[row, 1], planes[row, 2] = first, varyings[b, k] - first, varyings[c, k] - first
    return 0.5 - x0 / 256.0, 0.5 - y0 / 256.0


def _edges(t: Any, made: Any, window_x: Any, window_y: Any, left: Any, top: Any, edges: Any) -> None:
    """Of the edges a→b, b→c, c→a: values at the pixel (left, top), steps along x, steps along y."""
    a, b, c = made[t, 0], made[t, 1], made[t, 2]
    x0, y0, x1, y1, x2, y2 = window(window_x[a], window_y[a], window_x[b], window_y[b], window_x[c], window_y[c])
    px, py = left * 256 + 128 - x0, top * 256 + 128 - y0
    edges[0] = edge(0, 0, x1, y1, px, py)
    edges[1] = edge(x1, y1, x2, y2, px, py)
    edges[2] = edge(x2, y2, 0, 0, px, py)
    edges[3], edges[4], edges[5] = -y1 * 256, -(y2 - y1) * 256, y2 * 256
    edges[6], edges[7], edges[8] = x1 * 256, (x2 - x1) * 256, -x2 * 256


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


def _row_values(planes: Any, to_x: Any, to_y: Any, values: Any) -> None:
    """Values of the planes at the start of a row; their steps along x are column 1 of ``planes``."""
    for k in range(len(values)):
        values[k] = planes[k, 0] + planes[k, 1] * to_x + planes[k, 2] * to_y


def _visible(
    ids: Any, slots: Any, lists: Any, begin: Any, end: Any, made: Any, window_x: Any, window_y: Any, depth: Any,
    inverse_w: Any, varyings: Any, factor: Any, units: Any, planes: Any, table: Any,
) -> None:  # fmt: skip
    """Number the triangles that ``ids`` shows, put those numbers in their place, and their planes into ``table``."""
    rows = len(planes)
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
            t = lists[begin + n]
            to_x, to_y = triangle(t, made, window_x, window_y, depth, inverse_w, varyings, factor, units, planes)
            base = np.int64(slot) * (PLANES + 3 * rows)
            table[base + TO_Y] = to_y
            table[base + FRONT] = made[t, 3]
            for row in range(rows):
                at = base + PLANES + 3 * row
                table[at] = planes[row, 0] + (planes[row, 1] * to_x if row < NEARNESS else 0.0)
                table[at + 1] = planes[row, 1]
                table[at + 2] = planes[row, 2]
        ids[k] = slot


window = compiled(_window)
plane = compiled(_plane)
depth_plane = compiled(_depth_plane)
triangle = compiled(_triangle)
edges_at = compiled(_edges)
narrowed = compiled(_narrowed)
span = compiled(_span)
row_values = compiled(_row_values)
visible = compiled(_visible)
