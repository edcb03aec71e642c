"""Numbers as formats hold them in memory, and the float32 that a kernel computes with: loads decode, stores round."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from passgraph.backends.numpy.machine import ir
from passgraph.backends.numpy.vector.constants import blank, lanes_of
from passgraph.backends.numpy.vector.lanes import Lanes, is_vector
from passgraph.backends.numpy.vector.operations import F32, I32
from passgraph.formats import Format

_ELEMENTS = {"f4": F32, "f2": ir.HalfType()}
#: Added to a number of a few bits, it leaves the nearest whole one in the lowest bits, halves rounded to even.
_WHOLE = 1.5 * (1 << 23)


def element(held: Format) -> Any:
    """LLVM's type of one number."""
    return _ELEMENTS.get(held.number) or ir.IntType(held.bits)


def decoded(b: Lanes, raw: Any, held: Format) -> Any:
    """What loaded numbers (of :func:`element`) stand for."""
    if not held.steps:
        return b.fpext(raw, F32) if held.bits < 32 else raw
    if held.low < 0:
        whole = b.sitofp(b.sext(raw, I32), F32)
        # the lowest number stands for -1 too
        least = ir.Constant(F32, float(-held.steps))
        whole = b.select(b.fcmp_ordered("<", whole, least), least, whole)
    else:
        whole = b.sitofp(b.zext(raw, I32), F32)
    value = divided(b, whole, held.steps)
    if held.low >= 0:  # below 0 two numbers stand for -1
        b.undecoded[value] = raw, held
    return value


def divided(b: Lanes, whole: Any, steps: int) -> Any:
    """A whole number of at most ``steps`` over ``steps``, rounded once, in two operations instead of a division.

    The reciprocal in two parts: the product with the smaller one, then the larger added without rounding between.
    That every number comes out as by division is tested number by number.
    """
    large = np.float32(1 / steps)
    small = np.float32(1 / steps - float(large))
    rest = b.fmul(whole, ir.Constant(F32, float(small)))
    kind = ir.FunctionType(F32, [F32, F32, F32])
    fused = b.module.globals.get("llvm.fma.f32") or ir.Function(b.module, kind, "llvm.fma.f32")
    return b.call(fused, [whole, ir.Constant(F32, float(large)), rest])


def rounded(b: Lanes, value: Any, held: Format) -> Any:
    """The nearest numbers of :func:`element`, halves to even, as `quantize` and `quantize_half` of the prelude give."""
    raw, own = b.undecoded.get(value, (None, held))
    if raw is not None and (own.number, own.steps) == (held.number, held.steps):
        return raw
    if held.steps:
        low, one = ir.Constant(F32, held.low), ir.Constant(F32, 1.0)
        value = b.select(b.fcmp_ordered("<", low, value), value, low)  # NaN becomes the lowest
        value = b.select(b.fcmp_ordered("<", one, value), one, value)
        moved = b.fadd(b.fmul(value, ir.Constant(F32, float(held.steps))), ir.Constant(F32, _WHOLE))
        return b.trunc(b.bitcast(moved, I32), element(held))
    return b.fptrunc(value, element(held)) if held.bits < 32 else value


def split(b: Lanes, words: Any, held: Format, places: Sequence[int]) -> list[Any]:
    """Numbers out of words that each hold several, the first in the lowest bits."""
    bits = ir.IntType(held.bits)
    found = []
    for place in places:
        moved = words
        if place:
            moved = b.lshr(
                words, ir.Constant(words.type.element if is_vector(words) else words.type, place * held.bits)
            )
        number = b.trunc(moved, bits)
        found.append(number if held.steps else b.bitcast(number, element(held)))
    return found


def in_threes(b: Lanes, channels: int, held: Format) -> bool:
    """Whether pixels of three numbers are moved as words with room for four.

    Told to pick every third of many bytes, LLVM takes them one by one: that was five times as slow.
    """
    return channels == 3 and held.steps > 0 and held.bits in (8, 16) and b.lanes % 4 == 0


def woven(b: Lanes, numbers: Sequence[Any], held: Format) -> Any:
    """Vectors of numbers, one a channel, in the order of memory: words where a pixel fits one, else interleaved."""
    bits = held.bits * len(numbers)
    if in_threes(b, len(numbers), held):
        return _closed_up(b, _in_words(b, numbers, held, 4 * held.bits), held)
    if len(numbers) == 1 or bits not in (16, 32) or not held.steps:
        return b.interleaved(list(numbers))
    return _in_words(b, numbers, held, bits)


def _in_words(b: Lanes, numbers: Sequence[Any], held: Format, bits: int) -> Any:
    """Numbers side by side in words of so many bits, the first in the lowest."""
    word = ir.IntType(bits)
    made = None
    for place, number in enumerate(numbers):
        wide = b.zext(number, word)
        part = b.shl(wide, ir.Constant(word, place * held.bits)) if place else wide
        made = part if made is None else b.or_(made, part)
    return made


def _closed_up(b: Lanes, words: Any, held: Format) -> Any:
    """Words of three numbers and a rest as numbers without the rests: within each 16 bytes, then these together."""
    pixel, count = held.bits // 8, b.lanes * held.bits // 8 * 4
    kept = [4 * pixel * word + place for word in range(4 // pixel) for place in range(3 * pixel)]
    order = [first + place for first in range(0, count, 16) for place in (*kept, *[15] * 4)]
    raw = b.plain.bitcast(words, ir.VectorType(ir.IntType(8), count))
    quarters = b.plain.bitcast(
        b.plain.shuffle_vector(raw, blank(raw.type), lanes_of(order)), ir.VectorType(I32, count // 4)
    )
    whole = [place for place in range(count // 4) if place % 4 != 3]
    made = b.plain.shuffle_vector(quarters, blank(quarters.type), lanes_of(whole))
    return b.plain.bitcast(made, ir.VectorType(element(held), 3 * b.lanes))


def store(b: Lanes, numbers: Sequence[Any], pointer: Any, held: Format, mask: Any) -> None:
    """Pixels one behind another, a vector of numbers a channel; only those in the mask."""
    values = woven(b, numbers, held)
    masks = b.interleaved([mask] * (values.type.count // b.lanes))
    b.store_masked(values, pointer, masks, held.bits // 8)
