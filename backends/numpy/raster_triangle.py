"""One triangle in one tile: its planes, its edges, the span of pixels that it covers in a row.

Called by the generated loop over a tile (raster_code.py).  Compiled once for all draws.
"""

# mypy: disable-error-code="untyped-decorator"
from __future__ import annotations

from typing import Any

import numpy as np

from passgraph.backends.numpy.jit import compiled
from passgraph.backends.numpy.llvm_names import DEPTH, INVERSE_W, VARYINGS


def _plane(planes: Any, row: Any, a: Any, b: Any, c: Any, x1: Any, y1: Any, x2: Any, y2: Any, scale: Any) -> None:
    planes[row, 0] = a
    planes[row, 1] = ((b - a) * y2 - (c - a) * y1) * scale
    planes[row, 2] = ((c - a) * x1 - (b - a) * x2) * scale


def _triangle(
    corners: Any, window_x: Any, window_y: Any, depth: Any, inverse_w: Any, varyings: Any, factor: Any, units: Any,
    left: Any, top: Any, planes: Any, edges: Any,
) -> Any:  # fmt: skip
    """Fill ``planes`` and ``edges`` (values at the pixel (left, top), steps along x, steps along y).

    Returns the way from the planes' origin, the first corner, to the centre of pixel (0, 0).
    """
    a, b, c = corners[0], corners[1], corners[2]
    x0, y0 = np.int64(window_x[a]), np.int64(window_y[a])
    x1, y1 = np.int64(window_x[b]) - x0, np.int64(window_y[b]) - y0
    x2, y2 = np.int64(window_x[c]) - x0, np.int64(window_y[c]) - y0
    scale = 256.0 / float(x1 * y2 - x2 * y1)
    plane(planes, DEPTH, depth[a], depth[b], depth[c], x1, y1, x2, y2, scale)
    if factor != 0.0 or units != 0.0:
        deepest = max(abs(depth[a]), abs(depth[b]), abs(depth[c]))
        smallest = 2.0 ** (np.floor(np.log2(deepest)) - 23.0) if deepest > 0.0 else 0.0
        planes[DEPTH, 0] += factor * max(abs(planes[DEPTH, 1]), abs(planes[DEPTH, 2])) + units * smallest
    if varyings.shape[1]:
        plane(planes, INVERSE_W, inverse_w[a], inverse_w[b], inverse_w[c], x1, y1, x2, y2, scale)
    for k in range(varyings.shape[1]):
        va, vb, vc = varyings[a, k] * inverse_w[a], varyings[b, k] * inverse_w[b], varyings[c, k] * inverse_w[c]
        plane(planes, VARYINGS + k, va, vb, vc, x1, y1, x2, y2, scale)
    # Edge a→b, b→c, c→a: positive inside; less one where the edge is neither top nor left (rule 4).
    px, py = left * 256 + 128 - x0, top * 256 + 128 - y0
    edges[0] = x1 * py - y1 * px - (0 if y1 < 0 or (y1 == 0 and x1 > 0) else 1)
    edges[1] = (x2 - x1) * (py - y1) - (y2 - y1) * (px - x1) - (0 if y2 < y1 or (y2 == y1 and x2 > x1) else 1)
    edges[2] = y2 * (px - x2) - x2 * (py - y2) - (0 if y2 > 0 or (y2 == 0 and x2 < 0) else 1)
    edges[3], edges[4], edges[5] = -y1 * 256, -(y2 - y1) * 256, y2 * 256
    edges[6], edges[7], edges[8] = x1 * 256, (x2 - x1) * 256, -x2 * 256
    return 0.5 - x0 / 256.0, 0.5 - y0 / 256.0


def _span(edges: Any, down: Any, left: Any, right: Any) -> Any:
    """First and last covered pixel of the row ``down`` rows below the top; empty where first > last.

    Quotients are taken in float64: an edge value below 2**46 over a step below 2**31 cannot round to the wrong whole.
    """
    first, last = left, right
    for k in range(3):
        value, step = edges[k] + edges[6 + k] * down, edges[3 + k]
        if step > 0:
            if value < 0:
                first = max(first, left + np.int64(np.ceil(-value / step)))
        elif value < 0:
            last = first - 1
        elif step < 0:
            last = min(last, left + np.int64(np.floor(value / -step)))
    return first, last


def _row_values(planes: Any, to_x: Any, to_y: Any, values: Any) -> None:
    """Values of all planes at the start of a row; their steps along x are column 1 of ``planes``."""
    for k in range(len(values)):
        values[k] = planes[k, 0] + planes[k, 1] * to_x + planes[k, 2] * to_y


plane = compiled(_plane)
triangle = compiled(_triangle)
span = compiled(_span)
row_values = compiled(_row_values)
