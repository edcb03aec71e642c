"""Pictures in blocks of pixels: a vector holds a few columns of one row, or of four."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from passgraph.backends.numpy.machine import ir
from passgraph.backends.numpy.vector.constants import blank, lanes_of, zeros
from passgraph.backends.numpy.vector.lanes import Lanes
from passgraph.backends.numpy.vector.operations import I32
from passgraph.backends.numpy.vector.stored import decoded, element, rounded
from passgraph.backends.numpy.vector.texels import joined, picked, transposed
from passgraph.formats import Format


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
        loads = [b.load(place, typ=ir.VectorType(kind, count), align=align) for place in places]
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
