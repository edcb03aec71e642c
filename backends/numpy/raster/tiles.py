"""Tiles of draws that are shaded a tile at once: which triangle each pixel shows, then the kernel (shade.py).

Compiled once for all draws; entries.py is how it is called.
"""

# mypy: disable-error-code="untyped-decorator,arg-type,call-arg,var-annotated,unreachable"
from __future__ import annotations

from typing import Any

import numpy as np

from passgraph.backends.numpy.machine.jit import compiled
from passgraph.backends.numpy.raster.call import pg_shade, pg_take
from passgraph.backends.numpy.raster.entries import EQUAL, GREATER, LESS
from passgraph.backends.numpy.raster.layout import TILE
from passgraph.backends.numpy.raster.setup import edge
from passgraph.backends.numpy.raster.triangle import depth_plane, soon, span, visible, window

#: Columns of a triangle that is tested pixel by pixel: its spans would take longer to find.
NARROW = 8


def _tiles(
    counter: Any, count: Any, busy: Any, tiles_x: Any, offsets: Any, lists: Any,
    made: Any, wx: Any, wy: Any, wz: Any, iw: Any, vary: Any, factor: Any, units: Any, width: Any, height: Any,
    depth: Any, has_depth: Any, test: Any, write: Any, clear: Any,
    ids: Any, slots: Any, rows: Any, table: Any, shade: Any, context: Any,
) -> None:  # fmt: skip
    """Take tiles by a shared counter until none is left.

    Without a depth buffer ``depth`` is one tile's.  ``clear`` is what depth is cleared to, or NaN.
    """
    less, equal, greater = (test & LESS) != 0, (test & EQUAL) != 0, (test & GREATER) != 0
    writes = write != 0
    while True:
        piece = pg_take(counter)
        if piece >= count:
            break
        tile = busy[piece]
        x_low, y_low = tile % tiles_x * TILE, tile // tiles_x * TILE
        x_end, y_end = min(width, x_low + TILE), min(height, y_low + TILE)
        pitch, origin = (width, np.int64(0)) if has_depth != 0 else (TILE, y_low * TILE + x_low)
        if clear == clear:
            for y in range(y_low, y_end):
                for x in range(x_low, x_end):
                    depth[np.uint64(y * pitch + x - origin)] = np.float32(clear)
        ids[:] = -1
        begin, end = offsets[tile], offsets[tile + 1]
        for n in range(begin, end):
            # Numbers instead of views of rows: a view counts references, and threads would meet there every time.
            soon(n, end, lists, made, wx, wy, wz, iw, vary, False)
            # Whole numbers without a sign: others may count from the end, which costs a choice at every index.
            t = np.uint64(lists[np.uint64(n)])
            a, b, c = np.uint64(made[t, 0]), np.uint64(made[t, 1]), np.uint64(made[t, 2])
            x0, y0, x1, y1, x2, y2 = window(wx[a], wy[a], wx[b], wy[b], wx[c], wy[c])
            scale = 256.0 / float(x1 * y2 - x2 * y1)
            z_start, z_step, z_down = depth_plane(wz[a], wz[b], wz[c], x1, y1, x2, y2, scale, factor, units)
            to_y = 0.5 - y0 / 256.0
            z_start += z_step * (0.5 - x0 / 256.0)
            left, top = max(np.int64(made[t, 4]), x_low), max(np.int64(made[t, 5]), y_low)
            right, bottom = min(np.int64(made[t, 6]), x_end - 1), min(np.int64(made[t, 7]), y_end - 1)
            px, py = left * 256 + 128 - x0, top * 256 + 128 - y0
            e0, e1, e2 = edge(0, 0, x1, y1, px, py), edge(x1, y1, x2, y2, px, py), edge(x2, y2, 0, 0, px, py)
            across0, across1, across2 = -y1 * 256, -(y2 - y1) * 256, y2 * 256
            for y in range(top, bottom + 1):
                z_row, row, place = z_start + z_down * (to_y + y), y * pitch - origin, (y - y_low) * TILE - x_low
                if right - left < NARROW:
                    i0, i1, i2 = e0, e1, e2
                    for x in range(left, right + 1):
                        if (i0 | i1 | i2) >= 0:
                            z = np.float32(min(max(z_row + z_step * float(x), 0.0), 1.0))
                            held = depth[np.uint64(row + x)]
                            if (less and z < held) or (equal and z == held) or (greater and z > held):
                                ids[np.uint64(place + x)] = n - begin
                                if writes:
                                    depth[np.uint64(row + x)] = z
                        i0, i1, i2 = i0 + across0, i1 + across1, i2 + across2
                else:
                    first, last = span(e0, e1, e2, across0, across1, across2, left, right)
                    for x in range(first, last + 1):
                        z = np.float32(min(max(z_row + z_step * float(x), 0.0), 1.0))
                        held, shown = depth[np.uint64(row + x)], ids[np.uint64(place + x)]
                        passes = (less & (z < held)) | (equal & (z == held)) | (greater & (z > held))
                        # Storing always, what was there if need be, lets LLVM vectorise; a tile is one thread's.
                        ids[np.uint64(place + x)] = n - begin if passes else shown
                        depth[np.uint64(row + x)] = z if passes & writes else held
                e0, e1, e2 = e0 + x1 * 256, e1 + (x2 - x1) * 256, e2 - x2 * 256
        if shade != 0:
            visible(ids, slots, lists, begin, end, made, wx, wy, wz, iw, vary, factor, units, rows, table)
            pg_shade(shade, context, ids, table, x_low, y_low, y_end - y_low)


tiles = compiled(_tiles)
