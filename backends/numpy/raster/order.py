"""Tiles of draws whose fragments depend on those below them: triangle by triangle, in order (merge.py).

Compiled once for all draws; entries.py is how it is called.
"""

# mypy: disable-error-code="untyped-decorator,arg-type,call-arg,var-annotated,unreachable"
from __future__ import annotations

from typing import Any

import numpy as np

from passgraph.backends.numpy.machine.jit import compiled
from passgraph.backends.numpy.raster.call import pg_merge, pg_take
from passgraph.backends.numpy.raster.entries import NOWHERE, SPAN_ROWS
from passgraph.backends.numpy.raster.layout import TILE
from passgraph.backends.numpy.raster.setup import edge
from passgraph.backends.numpy.raster.tiles import NARROW
from passgraph.backends.numpy.raster.triangle import numbered, soon, span, window


def _in_order(
    counter: Any, count: Any, busy: Any, tiles_x: Any, offsets: Any, lists: Any,
    made: Any, wx: Any, wy: Any, wz: Any, iw: Any, vary: Any, factor: Any, units: Any, width: Any, height: Any,
    depth: Any, depth_clear: Any, clears: Any, spans: Any, rows: Any, table: Any, merge: Any, context: Any,
) -> None:  # fmt: skip
    """Take tiles by a shared counter until none is left.

    ``depth_clear`` is what depth is cleared to, or NaN; ``clears`` whether some target is.
    """
    while True:
        piece = pg_take(counter)
        if piece >= count:
            break
        tile = busy[piece]
        x_low, y_low = tile % tiles_x * TILE, tile // tiles_x * TILE
        x_end, y_end = min(width, x_low + TILE), min(height, y_low + TILE)
        if depth_clear == depth_clear:
            for y in range(y_low, y_end):
                for x in range(x_low, x_end):
                    depth[np.uint64(y * width + x)] = np.float32(depth_clear)
        if clears != 0:
            pg_merge(merge, context, spans, table, x_low, y_low, y_end - 1, 1)
        stop = offsets[tile + 1]
        for n in range(offsets[tile], stop):
            soon(n, stop, lists, made, wx, wy, wz, iw, vary, True)
            # Whole numbers without a sign: others may count from the end, which costs a choice at every index.
            t = np.uint64(lists[np.uint64(n)])
            a, b, c = np.uint64(made[t, 0]), np.uint64(made[t, 1]), np.uint64(made[t, 2])
            x0, y0, x1, y1, x2, y2 = window(wx[a], wy[a], wx[b], wy[b], wx[c], wy[c])
            left, top = max(np.int64(made[t, 4]), x_low), max(np.int64(made[t, 5]), y_low)
            right, bottom = min(np.int64(made[t, 6]), x_end - 1), min(np.int64(made[t, 7]), y_end - 1)
            px, py = left * 256 + 128 - x0, top * 256 + 128 - y0
            e0, e1, e2 = edge(0, 0, x1, y1, px, py), edge(x1, y1, x2, y2, px, py), edge(x2, y2, 0, 0, px, py)
            across0, across1, across2 = -y1 * 256, -(y2 - y1) * 256, y2 * 256
            seen = False
            for row in range(bottom + 1 - top):
                first, last = np.int64(NOWHERE), np.int64(-1)
                if right - left < NARROW:
                    i0, i1, i2 = e0, e1, e2
                    for x in range(left, right + 1):
                        if (i0 | i1 | i2) >= 0:
                            first, last = min(first, x), x
                        i0, i1, i2 = i0 + across0, i1 + across1, i2 + across2
                else:
                    begin, end = span(e0, e1, e2, across0, across1, across2, left, right)
                    if begin <= end:
                        first, last = begin, end
                seen |= last >= 0
                spans[np.uint64(row)], spans[np.uint64(SPAN_ROWS + row)] = first, last
                e0, e1, e2 = e0 + x1 * 256, e1 + (x2 - x1) * 256, e2 - x2 * 256
            if seen:
                for row in range(bottom + 1 - top, bottom + 4 - top):
                    spans[np.uint64(row)], spans[np.uint64(SPAN_ROWS + row)] = NOWHERE, -1
                numbered(t, 0, made, wx, wy, wz, iw, vary, factor, units, rows, table)
                pg_merge(merge, context, spans, table, x_low, top, bottom, 0)


in_order = compiled(_in_order)
