"""Reads of long arrays, as texels of the pictures that hold them (:mod:`.buffers`)."""

from __future__ import annotations

from typing import cast

from passgraph.language import ir
from passgraph.language import scalar as s
from passgraph.language.buffers import HALF_BITS, WIDTH, WIDTH_BITS, layout_of
from passgraph.language.emitter import Emitter
from passgraph.language.types import Array, held_as


def entry(emitter: Emitter, array: ir.Uniform, image: str, index: s.Operand) -> list[s.Operand]:
    """The components of an array's entry at an index, which is clamped into range; ``image`` is its picture."""
    e, type_ = emitter, cast(Array, array.type)
    layout = layout_of(type_)
    inside = e.op("min", e.op("max", index, s.Lit("int", 0)), s.Lit("int", type_.length - 1))
    first = e.op("mul", inside, s.Lit("int", layout.texels))
    numbers: list[s.Operand] = []
    for k in range(layout.texels):
        place = e.op("add", first, s.Lit("int", k))
        x = e.op("bit_and", place, s.Lit("int", WIDTH - 1))
        y = e.op("shift_right", place, s.Lit("int", WIDTH_BITS))
        texel = e.texel(image, x, y, False, "clamp", layout.channels, array.span)
        numbers += texel[: layout.channels]
    held = held_as(type_)
    if held == "bool":
        return [e.op("not_equal", number, s.Lit("float", 0.0)) for number in numbers]
    if held == "float":
        return numbers
    return [_whole(e, low, high) for low, high in zip(numbers[::2], numbers[1::2], strict=True)]


def _whole(e: Emitter, low: s.Operand, high: s.Operand) -> s.Operand:
    upper = e.op("shift_left", e.op("to_int", high), s.Lit("int", HALF_BITS))
    return e.op("bit_or", e.op("to_int", low), upper)
