"""Texels of many pixels at once: neighbours in a row, or anywhere in a picture; one vector a channel."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial
from typing import Any

from passgraph.backends.numpy.machine import ir
from passgraph.backends.numpy.machine.builder import IRBuilder
from passgraph.backends.numpy.storage import FLOAT
from passgraph.backends.numpy.vector.constants import blank, lanes_of
from passgraph.backends.numpy.vector.lanes import Lanes
from passgraph.backends.numpy.vector.operations import F32, I32, I64
from passgraph.backends.numpy.vector.stored import decoded, element, in_threes, split
from passgraph.formats import Format

#: Channels of pixels that are one word where they fit.
WORDS = (1, 2, 4)
#: Reads of one function that are inlined: each takes LLVM about 10 ms.  Later ones are calls, which take up to a
#: quarter longer at work where they load several numbers.
MAX_INLINED = 48


def neighbours(b: Lanes, row: Any, place: Any, channels: int, wanted: Sequence[int], held: Format = FLOAT) -> list[Any]:
    """Channels of consecutive pixels of a row, the first of them ``place`` numbers from its start."""
    count, kind = b.lanes * channels, element(held)
    pointer = b.gep(row, [place], True, source_etype=kind)
    if held.steps and channels in WORDS and channels * held.bits <= 32:
        words = b.load(pointer, typ=b.vector(ir.IntType(channels * held.bits)), align=held.bits // 8)
        return [decoded(b, number, held) for number in split(b, words, held, wanted)]
    if in_threes(b, channels, held):
        return [decoded(b, number, held) for number in split(b, _threes(b, pointer, held), held, wanted)]
    loaded = b.load(pointer, typ=ir.VectorType(kind, count), align=held.bits // 8)
    return [decoded(b, picked(b, loaded, range(channel, count, channels)), held) for channel in wanted]


def _threes(b: Lanes, pointer: Any, held: Format) -> Any:
    """Pixels of three numbers as words that have room for four; in the highest is whatever follows.

    Loads of 16 bytes begin 12 apart, so that what goes from one place to another stays within each.
    """
    byte, bits = ir.IntType(8), 4 * held.bits
    loads = [
        b.load(b.gep(pointer, [ir.Constant(I64, first)], True, source_etype=byte), typ=ir.VectorType(byte, 16), align=1)
        for first in range(0, b.lanes * bits // 32 * 3, 12)
    ]
    pixel = held.bits // 8
    order = [3 * pixel * word + place for word in range(128 // bits) for place in range(4 * pixel)]
    places = [16 * load + place for load in range(len(loads)) for place in order]
    return b.plain.bitcast(picked(b, joined(b, loads), places), b.vector(ir.IntType(bits)))


def scattered(
    b: Lanes,
    picture: Any,
    pixels: Any,
    channels: int,
    wanted: Sequence[int],
    held: Format = FLOAT,
    *,
    rarely: bool = False,
) -> list[Any]:
    """Channels of the pixels with these numbers; channels beyond the last are those of the pixels that follow.

    Loads that are put together, not gather instructions: those are slower on AMD's cores (Zen 5: three times in a 3x3
    neighbourhood) and no faster on others; and all channels of a pixel come with one load.  ``rarely``: in little code
    rather than quickly.
    """
    module = b.module
    name = f"texels_{held.number}_{held.steps}_{channels}_{'_'.join(map(str, wanted))}{'_rarely' * rarely}"
    # Pointers to pictures, to tables of each length and to arrays differ in type.
    name += "".join(letter if letter.isalnum() else "_" for letter in str(picture.type))
    function = module.globals.get(name)
    if function is None:
        made = ir.LiteralStructType([b.vector(F32)] * len(wanted))
        function = ir.Function(module, ir.FunctionType(made, [picture.type, pixels.type]), name)
        function.linkage = "internal"
        function.attributes.add("noinline" if rarely else "alwaysinline")
        inner = Lanes(IRBuilder(function), b.lanes)
        packed = blank(made)
        where, which = function.args
        put_together = _floats if held.number == FLOAT.number else partial(_words, held)
        for place, value in enumerate(put_together(inner, where, which, channels, wanted)):
            packed = inner.insert_value(packed, value, place)
        inner.ret(packed)
    b.reads += 1
    found = b.plain.call(function, [picture, pixels], attrs=("noinline",) if b.reads > MAX_INLINED else ())
    return [b.extract_value(found, place) for place in range(len(wanted))]


def _fours(wanted: Sequence[int]) -> Iterator[tuple[int, int, list[int]]]:
    """Of each four that are loaded at once: its first number, how many are loaded, and which of them are wanted.

    More may be loaded than is wanted: pictures have room behind their last pixel (machine/memory.py).
    """
    for first in range(0, max(wanted) + 1, 4):
        here = [number for number in wanted if first <= number < first + 4]
        if here:
            yield (here[0], 1, here) if len(here) == 1 else (first, 2 if max(here) < first + 2 else 4, here)


def _places(b: Lanes, picture: Any, pixels: Any, channels: int, kind: Any, first: int) -> list[Any]:
    """Where number ``first`` of each pixel lies."""
    pixel = ir.ArrayType(kind, channels)
    numbers = [b.sext(b.extract_element(pixels, ir.Constant(I32, lane)), I64) for lane in range(b.lanes)]
    return [b.gep(picture, [n, ir.Constant(I64, first)], True, source_etype=pixel) for n in numbers]


def _words(held: Format, b: Lanes, picture: Any, pixels: Any, channels: int, wanted: Sequence[int]) -> list[Any]:
    """Numbers of 8 and 16 bits: several in one word of each lane."""
    found: dict[int, Any] = {}
    for first, count, here in _fours(wanted):
        places = _places(b, picture, pixels, channels, element(held), first)
        words = _lane_by_lane(b, places, ir.IntType(count * held.bits), held.bits // 8)
        numbers = split(b, words, held, [number - first for number in here])
        found |= {number: decoded(b, raw, held) for number, raw in zip(here, numbers, strict=True)}
    return [found[number] for number in wanted]


def _lane_by_lane(b: Lanes, places: Sequence[Any], kind: Any, align: int) -> Any:
    vector = blank(b.vector(kind))
    for lane, place in enumerate(places):
        vector = b.insert_element(vector, b.load(place, typ=kind, align=align), ir.Constant(I32, lane))
    return vector


def _floats(b: Lanes, picture: Any, pixels: Any, channels: int, wanted: Sequence[int]) -> list[Any]:
    found = {}
    for first, count, here in _fours(wanted):
        places = _places(b, picture, pixels, channels, F32, first)
        if count == 1:
            found[first] = _lane_by_lane(b, places, F32, 4)
            continue
        loads = [b.load(place, typ=ir.VectorType(F32, count), align=4) for place in places]
        if count == 2:
            whole = joined(b, loads)
            columns = [picked(b, whole, range(column, 2 * b.lanes, 2)) for column in range(2)]
        else:
            columns = transposed(b, [joined(b, loads[row::4]) for row in range(4)])
        found |= {number: columns[number - first] for number in here}
    return [found[number] for number in wanted]


def transposed(b: Lanes, rows: list[Any]) -> list[Any]:
    """Four vectors whose fours of numbers are 4x4 matrices, each transposed: what units do without crossing fours."""
    count = rows[0].type.count

    def mixed(x: Any, y: Any, order: Sequence[int]) -> Any:
        places = [(four + place % 4) + (count if place >= 4 else 0) for four in range(0, count, 4) for place in order]
        return b.shuffle_vector(x, y, lanes_of(places))

    low, high = (0, 4, 1, 5), (2, 6, 3, 7)
    first, second = (0, 1, 4, 5), (2, 3, 6, 7)
    pairs = [(mixed(rows[0], rows[1], half), mixed(rows[2], rows[3], half)) for half in (low, high)]
    return [mixed(*pair, part) for pair in pairs for part in (first, second)]


def joined(b: Lanes, parts: list[Any]) -> Any:
    """Vectors one behind another; as many as a power of two."""
    while len(parts) > 1:
        length = 2 * parts[0].type.count
        order = lanes_of(range(length))
        parts = [b.shuffle_vector(x, y, order) for x, y in zip(parts[::2], parts[1::2], strict=True)]
    return parts[0]


def picked(b: Lanes, vector: Any, places: Sequence[int]) -> Any:
    """Those numbers of a vector."""
    if list(places) == list(range(vector.type.count)):
        return vector
    return b.shuffle_vector(vector, blank(vector.type), lanes_of(places))
