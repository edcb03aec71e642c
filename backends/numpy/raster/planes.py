"""Interpolated values of a triangle's pixels: blocks in vectors, and planes through the triangle's corners."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from passgraph.backends.numpy.machine import llvm
from passgraph.backends.numpy.raster.layout import DEPTH, EDGE1, EDGE2, FRONT, NEARNESS, PLANES, TO_Y, VARYINGS
from passgraph.backends.numpy.vector.lanes import F32, F64, I32, Lanes, blank, lanes_of, zeros
from passgraph.backends.numpy.vector.texels import decoded, element, joined, picked, rounded, transposed
from passgraph.formats import Format
from passgraph.language.builtin_name import BuiltinName
from passgraph.plan.data import DrawStep


class Blocks:
    """Blocks of ``rows`` rows, 1 or 4.  Lane ``rows * column + row`` has the pixel in that column and row of its block.

    With four rows, the four channels of a block are 4x4 matrices to transpose.
    """

    def __init__(self, builder: Lanes, rows: int) -> None:
        self.builder, self.rows, self.columns = builder, rows, builder.lanes // rows

    def column(self) -> Any:
        """Return the column of each lane."""
        return self._numbers([lane // self.rows for lane in range(self.builder.lanes)])

    def row(self) -> Any:
        return self._numbers([lane % self.rows for lane in range(self.builder.lanes)])

    def _numbers(self, numbers: list[int]) -> Any:
        return lanes_of(numbers)

    def spread(self, values: Any) -> Any:
        """Return a vector with one value per row, repeated in each row's lanes."""
        return picked(self.builder, values, [lane % self.rows for lane in range(self.builder.lanes)])

    def load(self, places: Sequence[Any], channels: int, stored: Format) -> list[Any]:
        """Load each channel of a block whose rows begin at ``places``."""
        numbers = self.numbers(places, channels, element(stored), stored.bits // 8)
        return [decoded(self.builder, number, stored) for number in numbers]

    def numbers(self, places: Sequence[Any], channels: int, kind: Any, align: int) -> list[Any]:
        """Load the same as stored numbers."""
        b, count = self.builder, self.columns * channels
        loads = [b.load(place, typ=llvm.VectorType(kind, count), align=align) for place in places]
        if self.rows == channels == 4:
            return transposed(b, loads)
        order = [
            [lane % self.rows * count + lane // self.rows * channels + channel for lane in range(b.lanes)]
            for channel in range(channels)
        ]
        block = joined(b, loads)
        return [picked(b, block, lanes) for lanes in order]

    def store(self, places: Sequence[Any], parts: list[Any], masks: list[Any], stored: Format) -> None:
        """Store each channel where its mask is set."""
        numbers = [rounded(self.builder, self.builder.spread(part), stored) for part in parts]
        self.store_numbers(places, numbers, masks, stored.bits // 8)

    def store_numbers(self, places: Sequence[Any], parts: list[Any], masks: list[Any], align: int) -> None:
        """Store numbers unconverted."""
        b = self.builder
        bits = [b.sext(mask, I32) for mask in masks]
        for place, values, mask in zip(places, self._by_rows(parts), self._by_rows(bits), strict=True):
            written = b.plain.icmp_signed("<", mask, zeros(mask.type))
            b.store_masked(values, place, written, align)

    def _by_rows(self, parts: list[Any]) -> list[Any]:
        """Return the rows of a block with interleaved channels."""
        b, channels = self.builder, len(parts)
        if self.rows == channels == 4:
            return transposed(b, parts)
        block = joined(b, [*parts, *[blank(parts[0].type)] * ((1 << (channels - 1).bit_length()) - channels)])
        return [
            picked(
                b,
                block,
                [c * b.lanes + column * self.rows + row for column in range(self.columns) for c in range(channels)],
            )
            for row in range(self.rows)
        ]


def plane_rows(step: DrawStep) -> int:
    """Return the rows of numbers of each triangle: depth, and more if values are interpolated."""
    return VARYINGS + len(step.varyings) if step.varyings else 1


def plane_numbers(step: DrawStep) -> int:
    """Return the numbers stored for each triangle."""
    return PLANES + 3 * plane_rows(step)


def interpolated(
    b: Lanes, step: DrawStep, table: Any, slot: Any, x: Any, y: Any, names: list[BuiltinName]
) -> list[Any]:
    """Return builtins of the triangle at a table index, or of one triangle per lane, at pixels (``x``, ``y``).

    Perspective-correct: the corners are weighted by the position of the pixel's center (rasterization rule 5).
    """
    pixels: dict[str, _Pixel] = {}
    values = []
    for name in names:
        if name.axes not in pixels:
            there = (b.xor(at, llvm.Constant(I32, 1)) if axis in name.axes else at for axis, at in (("x", x), ("y", y)))
            pixels[name.axes] = _Pixel(b, step, table, slot, *there)
        values.append(pixels[name.axes].value(name))
    return values


class _Pixel:
    """A pixel's center in its triangle, or in the triangle's plane outside of it."""

    def __init__(self, b: Lanes, step: DrawStep, table: Any, slot: Any, x: Any, y: Any) -> None:
        self.b, self.step, self.table = b, step, table
        self.base = b.mul(slot, llvm.Constant(I32, plane_numbers(step)))
        self.across = b.sitofp(x, F64)
        self.down = b.fadd(self._entry(TO_Y), b.sitofp(y, F64))
        self.near: list[Any] = []

    def value(self, name: BuiltinName) -> Any:
        """Return a builtin that depends on the triangle."""
        b = self.b
        if name.kind == "front_facing":
            return b.fcmp_ordered("!=", self._entry(FRONT), llvm.Constant(F64, 0.0))
        if name.kind == "fragment_depth":
            z = self._plane(DEPTH)
            z = b.select(b.fcmp_ordered("<", z, llvm.Constant(F64, 0.0)), llvm.Constant(F64, 0.0), z)
            z = b.select(b.fcmp_ordered(">", z, llvm.Constant(F64, 1.0)), llvm.Constant(F64, 1.0), z)
            return b.fptrunc(z, F32)
        self.near = self.near or self._nearness()
        value, *more = self._numbers(VARYINGS + self.step.varyings.index(name.at("")))
        for part, share in zip(more, self.near, strict=True):
            value = b.fadd(value, b.fmul(part, share))
        return b.fptrunc(value, F32)

    def _nearness(self) -> list[Any]:
        """Return the weights of the second and the third corner; all three add up to 1."""
        b = self.b
        edges, (area, *more) = (self._plane(EDGE1), self._plane(EDGE2)), self._numbers(NEARNESS)
        parts = [b.fmul(edge, factor) for edge, factor in zip(edges, more, strict=True)]
        # Inside the triangle no term is negative: the sum keeps its precision, however near to the eye one corner is.
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
