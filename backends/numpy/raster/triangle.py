# mypy: disable-error-code="untyped-decorator,call-arg,unreachable"
"""Triangles in tiles: blocks of pixels, edges, and interpolated values."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from passgraph.backends.numpy.machine import llvm
from passgraph.backends.numpy.machine.numba_text import compiled
from passgraph.backends.numpy.raster.entries import (
    DEPTH,
    EDGE1,
    EDGE2,
    FRONT,
    NEARNESS,
    PLANES,
    TO_Y,
    VARYINGS,
    pg_soon,
)
from passgraph.backends.numpy.vector.lanes import F32, F64, I32, Lanes, blank, lanes_of, zeros
from passgraph.backends.numpy.vector.texels import decoded, element, joined, picked, rounded, transposed
from passgraph.formats import Format
from passgraph.language.ir import own_pixel
from passgraph.plan.data import DrawStep


class Blocks:
    """Blocks of ``rows`` rows, 1 or 4.  Lane ``rows * column + row`` has the pixel in that column and row of its block.

    With four rows, four channels of a block are 4x4 matrices that only want transposing.
    """

    def __init__(self, builder: Lanes, rows: int) -> None:
        self.builder, self.rows, self.columns = builder, rows, builder.lanes // rows

    def column(self) -> Any:
        """Of each lane."""
        return self._numbers([lane // self.rows for lane in range(self.builder.lanes)])

    def row(self) -> Any:
        return self._numbers([lane % self.rows for lane in range(self.builder.lanes)])

    def _numbers(self, numbers: list[int]) -> Any:
        return lanes_of(numbers)

    def spread(self, values: Any) -> Any:
        """A vector with one value a row, in each row's lanes."""
        return picked(self.builder, values, [lane % self.rows for lane in range(self.builder.lanes)])

    def load(self, places: Sequence[Any], channels: int, held: Format) -> list[Any]:
        """Each channel of a block, whose rows begin at ``places``."""
        numbers = self.numbers(places, channels, element(held), held.bits // 8)
        return [decoded(self.builder, number, held) for number in numbers]

    def numbers(self, places: Sequence[Any], channels: int, kind: Any, align: int) -> list[Any]:
        """The same as they lie in memory."""
        b, count = self.builder, self.columns * channels
        loads = [b.load(place, typ=llvm.VectorType(kind, count), align=align) for place in places]
        if self.rows == channels == 4:
            return transposed(b, loads)
        order = [
            [lane % self.rows * count + lane // self.rows * channels + channel for lane in range(b.lanes)]
            for channel in range(channels)
        ]
        whole = joined(b, loads)
        return [picked(b, whole, lanes) for lanes in order]

    def store(self, places: Sequence[Any], parts: list[Any], masks: list[Any], held: Format) -> None:
        """Each channel, where its mask says so."""
        numbers = [rounded(self.builder, self.builder.spread(part), held) for part in parts]
        self.store_numbers(places, numbers, masks, held.bits // 8)

    def store_numbers(self, places: Sequence[Any], parts: list[Any], masks: list[Any], align: int) -> None:
        """The same of numbers as they lie in memory."""
        b = self.builder
        bits = [b.sext(mask, I32) for mask in masks]
        for place, values, mask in zip(places, self._by_rows(parts), self._by_rows(bits), strict=True):
            written = b.plain.icmp_signed("<", mask, zeros(mask.type))
            b.store_masked(values, place, written, align)

    def _by_rows(self, parts: list[Any]) -> list[Any]:
        """Rows of a block with channels interleaved."""
        b, channels = self.builder, len(parts)
        if self.rows == channels == 4:
            return transposed(b, parts)
        whole = joined(b, [*parts, *[blank(parts[0].type)] * ((1 << (channels - 1).bit_length()) - channels)])
        return [
            picked(
                b, whole,
                [c * b.lanes + column * self.rows + row for column in range(self.columns) for c in range(channels)],
            )
            for row in range(self.rows)
        ]  # fmt: skip


def plane_rows(step: DrawStep) -> int:
    """Rows of numbers of each triangle: depth, and more where something is interpolated."""
    return VARYINGS + len(step.varyings) if step.varyings else 1


def plane_numbers(step: DrawStep) -> int:
    """Numbers kept of each triangle."""
    return PLANES + 3 * plane_rows(step)


def interpolated(b: Lanes, step: DrawStep, table: Any, slot: Any, x: Any, y: Any, names: list[str]) -> list[Any]:
    """Builtins of the triangle in that place of the table, or of one triangle a lane, at pixels (``x``, ``y``).

    Perspective-correct: the corners, by how near the pixel's centre is to each (rasterisation rule 5).
    """
    pixels: dict[str, _Pixel] = {}
    found = []
    for builtin in names:
        name, axes = own_pixel(builtin)
        if axes not in pixels:
            there = (b.xor(at, llvm.Constant(I32, 1)) if axis in axes else at for axis, at in (("x", x), ("y", y)))
            pixels[axes] = _Pixel(b, step, table, slot, *there)
        found.append(pixels[axes].value(name))
    return found


class _Pixel:
    """A pixel's centre in its triangle, or in the triangle's plane beside it."""

    def __init__(self, b: Lanes, step: DrawStep, table: Any, slot: Any, x: Any, y: Any) -> None:
        self.b, self.step, self.table = b, step, table
        self.base = b.mul(slot, llvm.Constant(I32, plane_numbers(step)))
        self.across = b.sitofp(x, F64)
        self.down = b.fadd(self._entry(TO_Y), b.sitofp(y, F64))
        self.near: list[Any] = []

    def value(self, name: str) -> Any:
        """A builtin that hangs on the triangle."""
        b = self.b
        if name == "front_facing":
            return b.fcmp_ordered("!=", self._entry(FRONT), llvm.Constant(F64, 0.0))
        if name == "fragment_depth":
            z = self._plane(DEPTH)
            z = b.select(b.fcmp_ordered("<", z, llvm.Constant(F64, 0.0)), llvm.Constant(F64, 0.0), z)
            z = b.select(b.fcmp_ordered(">", z, llvm.Constant(F64, 1.0)), llvm.Constant(F64, 1.0), z)
            return b.fptrunc(z, F32)
        self.near = self.near or self._nearness()
        value, *more = self._numbers(VARYINGS + self.step.varyings.index(name.removeprefix("varying.")))
        for part, share in zip(more, self.near, strict=True):
            value = b.fadd(value, b.fmul(part, share))
        return b.fptrunc(value, F32)

    def _nearness(self) -> list[Any]:
        """To the second and the third corner; to all three it is 1."""
        b = self.b
        edges, (area, *more) = (self._plane(EDGE1), self._plane(EDGE2)), self._numbers(NEARNESS)
        parts = [b.fmul(edge, factor) for edge, factor in zip(edges, more, strict=True)]
        # In the triangle nothing is negative: the sum keeps its digits, however near to the eye one corner is.
        total = b.fadd(b.fadd(b.fsub(b.fsub(area, edges[0]), edges[1]), parts[0]), parts[1])
        share = b.fdiv(llvm.Constant(F64, 1.0), total)
        return [b.fmul(part, share) for part in parts]

    def _plane(self, row: int) -> Any:
        b = self.b
        start, step_x, step_y = self._numbers(row)
        return b.fadd(b.fadd(start, b.fmul(step_y, self.down)), b.fmul(step_x, self.across))

    def _numbers(self, row: int) -> list[Any]:
        return [self._entry(PLANES + 3 * row + part) for part in range(3)]

    def _entry(self, place: int) -> Any:
        b = self.b
        return b.load_at(self.table, b.add(self.base, llvm.Constant(I32, place)), F64, steady=False)


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
