# mypy: disable-error-code="untyped-decorator,arg-type,call-arg,var-annotated,unreachable"
"""Rasterize binned triangles into tiles, in order or a tile at once."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from passgraph.backends.base import Block, clear_colour, quantised
from passgraph.backends.numpy.machine.native import Code
from passgraph.backends.numpy.machine.numba_text import compiled
from passgraph.backends.numpy.machine.shipped import NumbaCode
from passgraph.backends.numpy.machine.workers import Workers
from passgraph.backends.numpy.raster import entries
from passgraph.backends.numpy.raster.entries import (
    EQUAL,
    GREATER,
    LESS,
    NOWHERE,
    SPAN_ROWS,
    TILE,
    pg_merge,
    pg_shade,
    pg_take,
)
from passgraph.backends.numpy.raster.fragments import context_names, merge_code, shade_code
from passgraph.backends.numpy.raster.setup import edge
from passgraph.backends.numpy.raster.triangle import (
    depth_plane,
    numbered,
    plane_numbers,
    plane_rows,
    soon,
    span,
    visible,
    window,
)
from passgraph.cached import cached_property
from passgraph.plan.data import DrawStep

if TYPE_CHECKING:
    from passgraph.backends.numpy.storage import Storage


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


#: Triangles as setup.py makes them, and their vertices: window x and y, depth, 1/w, varyings.
Triangles: TypeAlias = "tuple[NDArray[Any], ...]"
#: Pixels of a tile.
PIXELS = TILE * TILE


def clear_values(storage: Storage, clear: tuple[float, ...] | None) -> NDArray[np.float32]:
    """What a draw clears each channel to, as the target stores it; zeros where it does not clear."""
    channels = storage.format.channels
    if clear is None:
        return np.zeros(channels, np.float32)
    return quantised(np.array(clear_colour(clear, channels, storage.format.srgb)), storage.format)


class Painter:
    """What both ways share: tiles that threads take in turns, and where the kernel's code finds things."""

    def __init__(self, step: DrawStep, workers: Workers, code: NumbaCode, kernel: Code | None) -> None:
        self.step, self.workers, self.kernel = step, workers, kernel
        self.calls = [code.call() for _ in range(workers.count)]
        self.width, self.height = step.size
        self.tiles_x = -(-self.width // TILE)
        self.context = np.zeros(len(context_names(step)), np.int64)
        self.counter = np.zeros(1, np.int64)
        self.nothing = np.zeros(1, np.float32)
        self.offset = tuple(float(part) for part in step.state.polygon_offset)
        self.depth_clear = float("nan") if step.depth is None or step.depth_clear is None else float(step.depth_clear)
        self.clears = any(clear is not None for clear in step.clears)
        self.clears_any = step.depth_clear is not None or self.clears
        self.every = np.arange(self.tiles_x * -(-self.height // TILE), dtype=np.int64)
        self.scratch = [self.thread_scratch() for _ in range(workers.count)]

    @cached_property
    def shade(self) -> int:
        """Where the kernel's code is."""
        return 0 if self.kernel is None else self.kernel.address

    def thread_scratch(self) -> list[Any]:
        """What the call takes of one thread's alone."""
        raise NotImplementedError

    def __call__(
        self, outputs: Sequence[Storage], depth: Storage | None, images: Sequence[Storage], block: Block,
        triangles: Triangles, offsets: NDArray[np.int64], lists: NDArray[np.int32],
    ) -> None:  # fmt: skip
        counts = np.diff(offsets)
        busy = self.every if self.clears_any else np.flatnonzero(counts)
        self.make_room(int(counts.max(initial=0)))
        colours = self.nothing
        if self.clears:
            colours = np.concatenate(
                [clear_values(o, clear) for o, clear in zip(outputs, self.step.clears, strict=True)]
            )
        depths = self.nothing if depth is None else depth.numbers.reshape(-1)
        stencil = self.nothing if depth is None or depth.stencil is None else depth.stencil
        # The context holds bare addresses: what they lead to must live until the threads are done.
        arrays = [block.floats, block.ints, colours, depths, stencil]
        self._fill(arrays, images, outputs)
        self.counter[0] = 0
        given = (
            self.counter, len(busy), busy, self.tiles_x, offsets, lists, *triangles, *self.offset,
            self.width, self.height,
        )  # fmt: skip
        self.workers.together(
            lambda thread: self.tiles(thread, given, None if depth is None else depths),
            min(self.workers.count, len(busy)),
        )
        del arrays

    def make_room(self, longest: int) -> None:
        """For so many triangles in one tile."""

    def _fill(self, arrays: Sequence[NDArray[Any]], images: Sequence[Storage], outputs: Sequence[Storage]) -> None:
        addresses = [array.ctypes.data for array in arrays]
        pictures = [part for image in images for part in image.anywhere]
        targets = [part for output in outputs for part in (output.address, output.pitch)]
        self.context[:] = [*addresses, self.width, self.height, *pictures, *targets]

    def tiles(self, thread: int, given: tuple[Any, ...], depths: NDArray[np.float32] | None) -> None:
        raise NotImplementedError


class Deferred(Painter):
    """The triangle that each pixel of a tile shows, then the kernel once for each pixel."""

    def __init__(self, step: DrawStep, workers: Workers) -> None:
        # Without a depth buffer every fragment passes.
        has_depth = step.depth is not None
        test = entries.TESTS[step.state.depth_compare if has_depth else "always"]
        self.test = (int(has_depth), test, int(has_depth and step.state.depth_write))
        self.no_depth = [np.zeros(PIXELS, np.float32) for _ in range(workers.count)]
        super().__init__(step, workers, entries.tiles, None if step.fragment is None else shade_code(step))

    def thread_scratch(self) -> list[Any]:
        """Each pixel's triangle, numbers of visible triangles, rows of numbers of each, their planes."""
        table = np.empty(PIXELS * plane_numbers(self.step) if self.kernel is not None else 1, np.float64)
        return [np.empty(PIXELS, np.int32), np.empty(0, np.int32), plane_rows(self.step), table]

    def make_room(self, longest: int) -> None:
        for scratch in self.scratch:
            if len(scratch[1]) < longest:
                scratch[1] = np.empty(longest, np.int32)

    def tiles(self, thread: int, given: tuple[Any, ...], depths: NDArray[np.float32] | None) -> None:
        self.calls[thread].bound(
            *given, self.no_depth[thread] if depths is None else depths, *self.test, self.depth_clear,
            *self.scratch[thread], self.shade, self.context,
        )()  # fmt: skip


class Ordered(Painter):
    """Triangle by triangle: tests, kernel and blending of each before the next."""

    def __init__(self, step: DrawStep, workers: Workers) -> None:
        super().__init__(step, workers, entries.in_order, merge_code(step))

    def thread_scratch(self) -> list[Any]:
        """Spans of one triangle, and its planes."""
        return [
            np.empty(2 * entries.SPAN_ROWS, np.int32),
            plane_rows(self.step),
            np.empty(plane_numbers(self.step), np.float64),
        ]

    def tiles(self, thread: int, given: tuple[Any, ...], depths: NDArray[np.float32] | None) -> None:
        self.calls[thread].bound(
            *given, self.nothing if depths is None else depths, self.depth_clear, int(self.clears),
            *self.scratch[thread], self.shade, self.context,
        )()  # fmt: skip
