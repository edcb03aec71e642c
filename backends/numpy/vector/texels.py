"""Texels of many pixels at once: how formats store them, neighbors in a row, or anywhere in a picture."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial
from typing import Any

import numpy as np

from passgraph.backends.numpy.machine import llvm
from passgraph.backends.numpy.machine.llvm import IRBuilder
from passgraph.backends.numpy.storage import FLOAT
from passgraph.backends.numpy.vector.lanes import F32, I32, I64, Lanes, blank, is_vector, lanes_of
from passgraph.formats import Format, format_spelling

_ELEMENTS = {"u1": llvm.IntType(8), "u2": llvm.IntType(16), "f2": llvm.HalfType(), "f4": F32}
#: Adding it to a small number leaves the nearest integer in the lowest bits, halves rounded to even.
_WHOLE = 1.5 * (1 << 23)


def element(stored: Format) -> Any:
    """Return LLVM's type of one number."""
    return format_spelling(stored, _ELEMENTS, __file__)


def decoded(b: Lanes, raw: Any, stored: Format) -> Any:
    """Convert loaded numbers (of :func:`element`) to float32."""
    if not stored.steps:
        return b.fpext(raw, F32) if stored.bits < 32 else raw
    value = divided(b, b.sitofp(b.zext(raw, I32), F32), stored.steps)
    b.undecoded[value] = raw, stored
    return value


def divided(b: Lanes, integer: Any, steps: int) -> Any:
    """Return an integer up to ``steps`` divided by ``steps``, correctly rounded, in two operations instead of a
    division.

    The reciprocal has two parts: the product with the smaller one, then a fused multiply-add with the larger.  Tests
    compare every number with the division.
    """
    large = np.float32(1 / steps)
    small = np.float32(1 / steps - float(large))
    rest = b.fmul(integer, llvm.Constant(F32, float(small)))
    kind = llvm.FunctionType(F32, [F32, F32, F32])
    fused = b.module.globals.get("llvm.fma.f32") or llvm.Function(b.module, kind, "llvm.fma.f32")
    return b.call(fused, [integer, llvm.Constant(F32, float(large)), rest])


def rounded(b: Lanes, value: Any, stored: Format) -> Any:
    """Return the nearest numbers of :func:`element`, halves to even, as `quantize` and `quantize_half` of the
    prelude."""
    raw, own = b.undecoded.get(value, (None, stored))
    if raw is not None and (own.number, own.steps) == (stored.number, stored.steps):
        return raw
    if stored.steps:
        zero, one = llvm.Constant(F32, 0.0), llvm.Constant(F32, 1.0)
        value = b.select(b.fcmp_ordered("<", zero, value), value, zero)  # NaN becomes 0
        value = b.select(b.fcmp_ordered("<", one, value), one, value)
        moved = b.fadd(b.fmul(value, llvm.Constant(F32, float(stored.steps))), llvm.Constant(F32, _WHOLE))
        return b.trunc(b.bitcast(moved, I32), element(stored))
    return b.fptrunc(value, element(stored)) if stored.bits < 32 else value


def split(b: Lanes, words: Any, stored: Format, places: Sequence[int]) -> list[Any]:
    """Split words that each hold several numbers, the first in the lowest bits."""
    bits = llvm.IntType(stored.bits)
    groups = []
    for place in places:
        moved = words
        if place:
            moved = b.lshr(
                words, llvm.Constant(words.type.element if is_vector(words) else words.type, place * stored.bits)
            )
        number = b.trunc(moved, bits)
        groups.append(number if stored.steps else b.bitcast(number, element(stored)))
    return groups


def in_threes(b: Lanes, channels: int, stored: Format) -> bool:
    """Return True if pixels of three numbers are moved as words of four.

    LLVM would extract every third byte one by one, five times as slow.
    """
    return channels == 3 and stored.steps > 0 and stored.bits in (8, 16) and b.lanes % 4 == 0


def woven(b: Lanes, numbers: Sequence[Any], stored: Format) -> Any:
    """Combine vectors of numbers, one per channel, in memory order: words if a pixel fits into one, else
    interleaved."""
    bits = stored.bits * len(numbers)
    if in_threes(b, len(numbers), stored):
        return _compact(b, _in_words(b, numbers, stored, 4 * stored.bits), stored)
    if len(numbers) == 1 or bits not in (16, 32) or not stored.steps:
        return b.interleaved(list(numbers))
    return _in_words(b, numbers, stored, bits)


def _in_words(b: Lanes, numbers: Sequence[Any], stored: Format, bits: int) -> Any:
    """Pack numbers into words of ``bits`` bits, the first in the lowest."""
    word = llvm.IntType(bits)
    words = None
    for place, number in enumerate(numbers):
        wide = b.zext(number, word)
        part = b.shl(wide, llvm.Constant(word, place * stored.bits)) if place else wide
        words = part if words is None else b.or_(words, part)
    return words


def _compact(b: Lanes, words: Any, stored: Format) -> Any:
    """Remove the unused fourth of words with three numbers: within each 16 bytes, then across them."""
    pixel, count = stored.bits // 8, b.lanes * stored.bits // 8 * 4
    places_kept = [4 * pixel * word + place for word in range(4 // pixel) for place in range(3 * pixel)]
    order = [first + place for first in range(0, count, 16) for place in (*places_kept, *[15] * 4)]
    raw = b.plain.bitcast(words, llvm.VectorType(llvm.IntType(8), count))
    quarters = b.plain.bitcast(
        b.plain.shuffle_vector(raw, blank(raw.type), lanes_of(order)), llvm.VectorType(I32, count // 4)
    )
    filled = [place for place in range(count // 4) if place % 4 != 3]
    packed = b.plain.shuffle_vector(quarters, blank(quarters.type), lanes_of(filled))
    return b.plain.bitcast(packed, llvm.VectorType(element(stored), 3 * b.lanes))


def store(b: Lanes, numbers: Sequence[Any], pointer: Any, stored: Format, mask: Any) -> None:
    """Store consecutive pixels, given a vector per channel; only those in the mask."""
    values = woven(b, numbers, stored)
    masks = b.interleaved([mask] * (values.type.count // b.lanes))
    b.store_masked(values, pointer, masks, stored.bits // 8)


#: Channels of pixels that are loaded as one word, if they fit.
WORDS = (1, 2, 4)
#: Most inlined reads of one function: each takes LLVM about 10 ms.  Further ones are calls, which run up to a quarter
#: longer when they load several numbers.
MAX_INLINED = 48


def neighbours(
    b: Lanes, row: Any, place: Any, channels: int, channels_read: Sequence[int], stored: Format = FLOAT
) -> list[Any]:
    """Return channels of consecutive pixels of a row, the first one ``place`` numbers from its start."""
    count, kind = b.lanes * channels, element(stored)
    pointer = b.gep(row, [place], True, source_etype=kind)
    if stored.steps and channels in WORDS and channels * stored.bits <= 32:
        words = b.load(pointer, typ=b.vector(llvm.IntType(channels * stored.bits)), align=stored.bits // 8)
        return [decoded(b, number, stored) for number in split(b, words, stored, channels_read)]
    if in_threes(b, channels, stored):
        return [decoded(b, number, stored) for number in split(b, _threes(b, pointer, stored), stored, channels_read)]
    loaded = b.load(pointer, typ=llvm.VectorType(kind, count), align=stored.bits // 8)
    return [decoded(b, picked(b, loaded, range(channel, count, channels)), stored) for channel in channels_read]


def _threes(b: Lanes, pointer: Any, stored: Format) -> Any:
    """Load pixels of three numbers as words of four; the highest holds the following number.

    Loads of 16 bytes begin 12 apart, so that moves stay within each.
    """
    byte, bits = llvm.IntType(8), 4 * stored.bits
    loads = [
        b.load(
            b.gep(pointer, [llvm.Constant(I64, first)], True, source_etype=byte), typ=llvm.VectorType(byte, 16), align=1
        )
        for first in range(0, b.lanes * bits // 32 * 3, 12)
    ]
    pixel = stored.bits // 8
    order = [3 * pixel * word + place for word in range(128 // bits) for place in range(4 * pixel)]
    places = [16 * load + place for load in range(len(loads)) for place in order]
    return b.plain.bitcast(picked(b, joined(b, loads), places), b.vector(llvm.IntType(bits)))


def scattered(
    b: Lanes,
    picture: Any,
    pixels: Any,
    channels: int,
    channels_read: Sequence[int],
    stored: Format = FLOAT,
    *,
    rarely: bool = False,
) -> list[Any]:
    """Return channels of the pixels with these indices; channels beyond the last belong to the following pixels.

    It combines scalar loads instead of using gather instructions: those are slower on AMD's cores (Zen 5: three times
    in a 3x3 neighborhood) and no faster on others; and one load gets all channels of a pixel.  ``rarely``: prefer short
    code to fast code.
    """
    module = b.module
    name = f"texels_{stored.number}_{stored.steps}_{channels}_{'_'.join(map(str, channels_read))}{'_rarely' * rarely}"
    # Pointers to pictures, to tables of each length and to arrays differ in type.
    name += "".join(letter if letter.isalnum() else "_" for letter in str(picture.type))
    function = module.globals.get(name)
    if function is None:
        returned = llvm.LiteralStructType([b.vector(F32)] * len(channels_read))
        function = llvm.Function(module, llvm.FunctionType(returned, [picture.type, pixels.type]), name)
        function.linkage = "internal"
        function.attributes.add("noinline" if rarely else "alwaysinline")
        inner = Lanes(IRBuilder(function), b.lanes)
        packed = blank(returned)
        where, which = function.args
        put_together = _floats if stored.number == FLOAT.number else partial(_words, stored)
        for place, value in enumerate(put_together(inner, where, which, channels, channels_read)):
            packed = inner.insert_value(packed, value, place)
        inner.ret(packed)
    b.reads += 1
    loaded = b.plain.call(function, [picture, pixels], attrs=("noinline",) if b.reads > MAX_INLINED else ())
    return [b.extract_value(loaded, place) for place in range(len(channels_read))]


def _fours(channels_read: Sequence[int]) -> Iterator[tuple[int, int, list[int]]]:
    """Yield each group of four numbers that is loaded at once: its first number, its length, and the wanted ones.

    More may be loaded than wanted: pictures are padded behind their last pixel (machine/workers.py).
    """
    for first in range(0, max(channels_read) + 1, 4):
        here = [number for number in channels_read if first <= number < first + 4]
        if here:
            yield (here[0], 1, here) if len(here) == 1 else (first, 2 if max(here) < first + 2 else 4, here)


def _places(b: Lanes, picture: Any, pixels: Any, channels: int, kind: Any, first: int) -> list[Any]:
    """Return the address of number ``first`` of each pixel."""
    pixel = llvm.ArrayType(kind, channels)
    numbers = [b.sext(b.extract_element(pixels, llvm.Constant(I32, lane)), I64) for lane in range(b.lanes)]
    return [b.gep(picture, [n, llvm.Constant(I64, first)], True, source_etype=pixel) for n in numbers]


def _words(
    stored: Format, b: Lanes, picture: Any, pixels: Any, channels: int, channels_read: Sequence[int]
) -> list[Any]:
    """Load numbers of 8 and 16 bits: several in one word per lane."""
    loaded: dict[int, Any] = {}
    for first, count, here in _fours(channels_read):
        places = _places(b, picture, pixels, channels, element(stored), first)
        words = _lane_by_lane(b, places, llvm.IntType(count * stored.bits), stored.bits // 8)
        numbers = split(b, words, stored, [number - first for number in here])
        loaded |= {number: decoded(b, raw, stored) for number, raw in zip(here, numbers, strict=True)}
    return [loaded[number] for number in channels_read]


def _lane_by_lane(b: Lanes, places: Sequence[Any], kind: Any, align: int) -> Any:
    vector = blank(b.vector(kind))
    for lane, place in enumerate(places):
        vector = b.insert_element(vector, b.load(place, typ=kind, align=align), llvm.Constant(I32, lane))
    return vector


def _floats(b: Lanes, picture: Any, pixels: Any, channels: int, channels_read: Sequence[int]) -> list[Any]:
    loaded = {}
    for first, count, here in _fours(channels_read):
        places = _places(b, picture, pixels, channels, F32, first)
        if count == 1:
            loaded[first] = _lane_by_lane(b, places, F32, 4)
            continue
        loads = [b.load(place, typ=llvm.VectorType(F32, count), align=4) for place in places]
        if count == 2:
            words = joined(b, loads)
            columns = [picked(b, words, range(column, 2 * b.lanes, 2)) for column in range(2)]
        else:
            columns = transposed(b, [joined(b, loads[row::4]) for row in range(4)])
        loaded |= {number: columns[number - first] for number in here}
    return [loaded[number] for number in channels_read]


def transposed(b: Lanes, rows: list[Any]) -> list[Any]:
    """Transpose the 4x4 matrices in four vectors; moves stay within groups of four, which is fast."""
    count = rows[0].type.count

    def mixed(x: Any, y: Any, order: Sequence[int]) -> Any:
        places = [(four + place % 4) + (count if place >= 4 else 0) for four in range(0, count, 4) for place in order]
        return b.shuffle_vector(x, y, lanes_of(places))

    low, high = (0, 4, 1, 5), (2, 6, 3, 7)
    first, second = (0, 1, 4, 5), (2, 3, 6, 7)
    pairs = [(mixed(rows[0], rows[1], half), mixed(rows[2], rows[3], half)) for half in (low, high)]
    return [mixed(*pair, part) for pair in pairs for part in (first, second)]


def joined(b: Lanes, parts: list[Any]) -> Any:
    """Concatenate vectors; their number is a power of two."""
    while len(parts) > 1:
        length = 2 * parts[0].type.count
        order = lanes_of(range(length))
        parts = [b.shuffle_vector(x, y, order) for x, y in zip(parts[::2], parts[1::2], strict=True)]
    return parts[0]


def picked(b: Lanes, vector: Any, places: Sequence[int]) -> Any:
    """Shuffle a vector: return its numbers at these places."""
    if list(places) == list(range(vector.type.count)):
        return vector
    return b.shuffle_vector(vector, blank(vector.type), lanes_of(places))
