# mypy: disable-error-code="untyped-decorator"
# mypy: disable-error-code="untyped-decorator,call-arg,unreachable"
# mypy: disable-error-code="untyped-decorator,arg-type,call-arg,var-annotated,unreachable"
"""Rasterize binned triangles into tiles, in order or a tile at once (written for numba)."""

from __future__ import annotations

from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from passgraph.backends.numpy.machine.numba_text import compiled
from passgraph.backends.numpy.raster.layout import (
    DEPTH,
    EDGE1,
    EDGE2,
    EQUAL,
    FRONT,
    GREATER,
    LESS,
    NEARNESS,
    NOWHERE,
    PLANES,
    SPAN_ROWS,
    TILE,
    TO_Y,
    VARYINGS,
)
from passgraph.backends.numpy.raster.setup import edge

_I64 = ir.IntType(64)


@intrinsic
def pg_take(typing_context: Any, counter: Any) -> Any:
    """Return the next number of a counter shared by threads: an array of one int64, which it increments."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        array = context.make_array(signature.args[0])(context, builder, arguments[0])
        return builder.atomic_rmw("add", array.data, ir.Constant(_I64, 1), "monotonic")

    return types.int64(counter), generate


@intrinsic
def pg_soon(typing_context: Any, array: Any, row: Any) -> Any:
    """Prefetch an entry, or a row, of an array into the cache."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        kind = signature.args[0]
        array = context.make_array(kind)(context, builder, arguments[0])
        step = builder.extract_value(array.strides, 0)
        start = builder.ptrtoint(array.data, _I64)
        place = builder.inttoptr(builder.add(start, builder.mul(arguments[1], step)), ir.PointerType())
        name, number = "llvm.prefetch.p0", ir.IntType(32)
        declared = ir.FunctionType(ir.VoidType(), [ir.PointerType(), number, number, number])
        fetch = builder.module.globals.get(name) or ir.Function(builder.module, declared, name)
        builder.call(fetch, [place, ir.Constant(number, 0), ir.Constant(number, 3), ir.Constant(number, 1)])
        return context.get_dummy_value()

    return types.void(array, types.int64), generate


def _call(target: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    """Call the function at the first address with the other arguments, arrays by their addresses."""
    given = []
    for kind, value in zip(signature.args[1:], arguments[1:], strict=True):
        array = isinstance(kind, types.Array)
        given.append(target.make_array(kind)(target, builder, value).data if array else value)
    function = ir.FunctionType(ir.VoidType(), [value.type for value in given])
    builder.call(builder.inttoptr(arguments[0], function.as_pointer()), given)
    return target.get_dummy_value()


@intrinsic
def pg_shade(
    typing_context: Any, address: Any, context: Any, ids: Any, planes: Any, left: Any, top: Any, rows: Any
) -> Any:
    """Write one tile's pixels (`shade_code` of fragments.py)."""
    return types.void(types.int64, context, ids, planes, types.int64, types.int64, types.int64), _call


@intrinsic
def pg_merge(
    typing_context: Any, address: Any, context: Any, spans: Any, triangle: Any, left: Any, top: Any, bottom: Any,
    clear: Any,
) -> Any:  # fmt: skip
    """Write one triangle's pixels in a tile (merge.py)."""
    return types.void(types.int64, context, spans, triangle, *[types.int64] * 4), _call


#: Distance in triangles between prefetch and drawing.
AHEAD = 4


def _soon(
    n: Any, end: Any, lists: Any, triangles: Any, window_x: Any, window_y: Any, depth: Any, inverse_w: Any,
    varyings: Any, every: Any,
) -> None:  # fmt: skip
    """Prefetch what triangles a few behind ``lists[n]`` need: corners' positions and depths; with ``every`` all of it.

    A tile's triangles are scattered in memory; without prefetching, waiting for them would dominate.
    """
    if n + 2 * AHEAD < end:
        pg_soon(triangles, np.int64(lists[np.uint64(n + 2 * AHEAD)]))
        t = np.uint64(lists[np.uint64(n + AHEAD)])
        for k in range(3):
            v = np.int64(triangles[t, np.uint64(k)])
            pg_soon(window_x, v)
            pg_soon(window_y, v)
            pg_soon(depth, v)
            if every:
                pg_soon(inverse_w, v)
                pg_soon(varyings, v)


def _window(ax: Any, ay: Any, bx: Any, by: Any, cx: Any, cy: Any) -> Any:
    """Return the first corner, and the others relative to it."""
    x0, y0 = np.int64(ax), np.int64(ay)
    return x0, y0, np.int64(bx) - x0, np.int64(by) - y0, np.int64(cx) - x0, np.int64(cy) - y0


def _plane(a: Any, b: Any, c: Any, x1: Any, y1: Any, x2: Any, y2: Any, scale: Any) -> Any:
    """Return the value at the first corner, and its steps along x and y."""
    return a, ((b - a) * y2 - (c - a) * y1) * scale, ((c - a) * x1 - (b - a) * x2) * scale


def _depth_plane(
    a: Any, b: Any, c: Any, x1: Any, y1: Any, x2: Any, y2: Any, scale: Any, factor: Any, units: Any
) -> Any:
    """Return the plane of a triangle's depth, polygon offset included."""
    start, step_x, step_y = plane(a, b, c, x1, y1, x2, y2, scale)
    if factor != 0.0 or units != 0.0:
        deepest = max(abs(a), abs(b), abs(c))
        smallest = 2.0 ** (np.floor(np.log2(deepest)) - 23.0) if deepest > 0.0 else 0.0
        start += factor * max(abs(step_x), abs(step_y)) + units * smallest
    return start, step_x, step_y


def _numbered(
    t: Any, slot: Any, triangles: Any, window_x: Any, window_y: Any, depth: Any, inverse_w: Any, varyings: Any,
    factor: Any, units: Any, rows: Any, table: Any,
) -> None:  # fmt: skip
    """Write the rows of a triangle's numbers to their place in ``table``."""
    a, b, c = np.uint64(triangles[t, 0]), np.uint64(triangles[t, 1]), np.uint64(triangles[t, 2])
    x0, y0, x1, y1, x2, y2 = window(window_x[a], window_y[a], window_x[b], window_y[b], window_x[c], window_y[c])
    area = float(x1 * y2 - x2 * y1)
    to_x = 0.5 - x0 / 256.0
    at = np.uint64(np.int64(slot) * (PLANES + 3 * rows))
    table[at + np.uint64(TO_Y)] = 0.5 - y0 / 256.0
    table[at + np.uint64(FRONT)] = triangles[t, 3]
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
    """Return the part of first … last that lies inside one edge; ``value`` is the edge function at ``left``.

    Quotients are computed in float64: an edge value below 2**46 over a step below 2**31 cannot round to the wrong
    integer.
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
    """Return the first and last covered pixel of a row, given the edges there; empty if first > last."""
    first, last = narrowed(left, right, e0, step0, left)
    first, last = narrowed(first, last, e1, step1, left)
    return narrowed(first, last, e2, step2, left)


def _visible(
    ids: Any, slots: Any, lists: Any, begin: Any, end: Any, triangles: Any, window_x: Any, window_y: Any, depth: Any,
    inverse_w: Any, varyings: Any, factor: Any, units: Any, rows: Any, table: Any,
) -> None:  # fmt: skip
    """Number the triangles that ``ids`` shows, write the numbers to their places, and the planes into ``table``."""
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
            numbered(t, slot, triangles, window_x, window_y, depth, inverse_w, varyings, factor, units, rows, table)
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


#: Most columns of a triangle that is tested pixel by pixel: finding its spans would take longer.
NARROW = 8


def _tiles(
    counter: Any, count: Any, busy: Any, tiles_x: Any, offsets: Any, lists: Any,
    triangles: Any, wx: Any, wy: Any, wz: Any, iw: Any, vary: Any, factor: Any, units: Any, width: Any, height: Any,
    depth: Any, has_depth: Any, test: Any, write: Any, clear: Any,
    ids: Any, slots: Any, rows: Any, table: Any, shade: Any, context: Any,
) -> None:  # fmt: skip
    """Draw tiles, taken by a shared counter.

    Without a depth buffer ``depth`` is one tile's.  ``clear`` is the clear value of depth, or NaN.
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
            # Indices instead of views of rows: a view counts references, which would make threads contend.
            soon(n, end, lists, triangles, wx, wy, wz, iw, vary, False)
            # Unsigned ints: signed ones may count from the end, which costs a branch at every index.
            t = np.uint64(lists[np.uint64(n)])
            a, b, c = np.uint64(triangles[t, 0]), np.uint64(triangles[t, 1]), np.uint64(triangles[t, 2])
            x0, y0, x1, y1, x2, y2 = window(wx[a], wy[a], wx[b], wy[b], wx[c], wy[c])
            scale = 256.0 / float(x1 * y2 - x2 * y1)
            z_start, z_step, z_down = depth_plane(wz[a], wz[b], wz[c], x1, y1, x2, y2, scale, factor, units)
            to_y = 0.5 - y0 / 256.0
            z_start += z_step * (0.5 - x0 / 256.0)
            left, top = max(np.int64(triangles[t, 4]), x_low), max(np.int64(triangles[t, 5]), y_low)
            right, bottom = min(np.int64(triangles[t, 6]), x_end - 1), min(np.int64(triangles[t, 7]), y_end - 1)
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
                            stored = depth[np.uint64(row + x)]
                            if (less and z < stored) or (equal and z == stored) or (greater and z > stored):
                                ids[np.uint64(place + x)] = n - begin
                                if writes:
                                    depth[np.uint64(row + x)] = z
                        i0, i1, i2 = i0 + across0, i1 + across1, i2 + across2
                else:
                    first, last = span(e0, e1, e2, across0, across1, across2, left, right)
                    for x in range(first, last + 1):
                        z = np.float32(min(max(z_row + z_step * float(x), 0.0), 1.0))
                        stored, shown = depth[np.uint64(row + x)], ids[np.uint64(place + x)]
                        passes = (less & (z < stored)) | (equal & (z == stored)) | (greater & (z > stored))
                        # An unconditional store, of the old value if need be, lets LLVM vectorize; a tile belongs to
                        # one thread.
                        ids[np.uint64(place + x)] = n - begin if passes else shown
                        depth[np.uint64(row + x)] = z if passes & writes else stored
                e0, e1, e2 = e0 + x1 * 256, e1 + (x2 - x1) * 256, e2 - x2 * 256
        if shade != 0:
            visible(ids, slots, lists, begin, end, triangles, wx, wy, wz, iw, vary, factor, units, rows, table)
            pg_shade(shade, context, ids, table, x_low, y_low, y_end - y_low)


tiles = compiled(_tiles)


def _in_order(
    counter: Any, count: Any, busy: Any, tiles_x: Any, offsets: Any, lists: Any,
    triangles: Any, wx: Any, wy: Any, wz: Any, iw: Any, vary: Any, factor: Any, units: Any, width: Any, height: Any,
    depth: Any, depth_clear: Any, clears: Any, spans: Any, rows: Any, table: Any, merge: Any, context: Any,
) -> None:  # fmt: skip
    """Draw tiles, taken by a shared counter.

    ``depth_clear`` is the clear value of depth, or NaN; ``clears`` is true if some target is cleared.
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
            soon(n, stop, lists, triangles, wx, wy, wz, iw, vary, True)
            # Unsigned ints: signed ones may count from the end, which costs a branch at every index.
            t = np.uint64(lists[np.uint64(n)])
            a, b, c = np.uint64(triangles[t, 0]), np.uint64(triangles[t, 1]), np.uint64(triangles[t, 2])
            x0, y0, x1, y1, x2, y2 = window(wx[a], wy[a], wx[b], wy[b], wx[c], wy[c])
            left, top = max(np.int64(triangles[t, 4]), x_low), max(np.int64(triangles[t, 5]), y_low)
            right, bottom = min(np.int64(triangles[t, 6]), x_end - 1), min(np.int64(triangles[t, 7]), y_end - 1)
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
                numbered(t, 0, triangles, wx, wy, wz, iw, vary, factor, units, rows, table)
                pg_merge(merge, context, spans, table, x_low, top, bottom, 0)


in_order = compiled(_in_order)
