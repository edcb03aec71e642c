"""Long arrays: of a kernel and of its parameters, read from memory entry by entry."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, TypeGuard, cast

import numpy as np
from numpy.typing import NDArray

from passgraph.language import ir
from passgraph.language import scalar as s
from passgraph.language.emitter import Emitter
from passgraph.language.source import Span, fail
from passgraph.language.types import (
    MAX_ARRAY_LENGTH,
    Array,
    Matrix,
    Type,
    component_count,
    element_of,
    held_as,
    is_plain,
    plain_parts,
)
from passgraph.language.uniform_layout import components, in_order

#: Arrays of at most so many numbers are values.
MAX_VALUES = 64
#: Numbers that all arrays in memory of one kernel may hold: Array[mat4, 1024].  A vector of pixels has a megabyte then.
MAX_NUMBERS = 16_384


@dataclass(frozen=True)
class Memory:
    """One array: ``length`` entries of ``width`` numbers, and one more for what is written out of range."""

    name: str
    kind: str
    length: int
    width: int


class Arrays:
    """The arrays in memory of one kernel, by the names of its variables."""

    def __init__(self, emitter: Emitter, program: ir.TypedKernel) -> None:
        self.emitter = emitter
        self.wanted = _indexed(program)
        self.made: dict[str, Memory] = {}
        self.numbers = 0

    def __contains__(self, name: str) -> bool:
        return name in self.wanted

    def _memory(self, name: str, span: Span) -> Memory:
        if name not in self.made:
            type_ = self.wanted[name]
            width, kind = component_count(type_.element), held_as(type_)
            self.numbers += type_.length * width
            if self.numbers > MAX_NUMBERS:
                fail(
                    span,
                    f"the arrays of this kernel that are read or written at computed indices hold {self.numbers} "
                    f"numbers or more together; at most {MAX_NUMBERS} are allowed",
                )
            array = self.emitter.array(kind, (type_.length + 1) * width)
            self.made[name] = Memory(array, kind, type_.length, width)
        return self.made[name]

    def values(self, name: str) -> list[s.Operand]:
        """All numbers that an array holds now."""
        memory = self.made[name]
        return [
            self.emitter.read_at(memory.name, s.Lit("int", number)) for number in range(memory.length * memory.width)
        ]

    def entry(self, name: str, index: s.Operand) -> list[s.Operand]:
        """The entry at an index, which is clamped into range."""
        e, memory = self.emitter, self.made[name]
        clamped = e.op("min", e.op("max", index, s.Lit("int", 0)), s.Lit("int", memory.length - 1))
        return [e.read_at(memory.name, place) for place in self._places(memory, clamped)]

    def store(self, name: str, index: s.Operand, entry: list[s.Operand]) -> None:
        """An entry takes a value; out of range the entry after the last one does, which nobody reads."""
        e, memory = self.emitter, self.made[name]
        inside = e.op(
            "logical_and",
            e.op("greater_equal", index, s.Lit("int", 0)),
            e.op("less", index, s.Lit("int", memory.length)),
        )
        where = e.choose(inside, index, s.Lit("int", memory.length))
        for place, value in zip(self._places(memory, where), entry, strict=True):
            e.push(s.WriteAt(memory.name, place, value))

    def fill(self, name: str, values: list[s.Operand], span: Span) -> None:
        """All entries take these values; in a loop where they are alike."""
        e, memory = self.emitter, self._memory(name, span)
        entry = values[: memory.width]
        if values == entry * memory.length:
            with _Counting(e, memory.length) as index:
                for place, value in zip(self._places(memory, index), entry, strict=True):
                    e.push(s.WriteAt(memory.name, place, value))
            return
        for number, value in enumerate(values):
            e.push(s.WriteAt(memory.name, s.Lit("int", number), value))

    def copy(self, name: str, source: str, span: Span) -> None:
        e, memory, held = self.emitter, self._memory(name, span), self.made[source]
        with _Counting(e, memory.length * memory.width) as index:
            e.push(s.WriteAt(memory.name, index, e.read_at(held.name, index)))

    def _places(self, memory: Memory, index: s.Operand) -> list[s.Operand]:
        e = self.emitter
        first = e.op("mul", index, s.Lit("int", memory.width))
        return [e.op("add", first, s.Lit("int", number)) for number in range(memory.width)]


class _Counting:
    """A loop around what is emitted inside."""

    def __init__(self, emitter: Emitter, count: int) -> None:
        self.emitter, self.count = emitter, count

    def __enter__(self) -> s.Val:
        self.index = self.emitter.fresh("int")
        self.emitter.begin()
        return self.index

    def __exit__(self, *_: object) -> None:
        body = self.emitter.end()
        self.emitter.push(s.For(self.index, 0, self.count, 1, tuple(body)))


def _indexed(program: ir.TypedKernel) -> dict[str, Array]:
    """Variables that hold long arrays, and that an index which is no written number reaches."""
    found: dict[str, Array] = {}
    if not any(_is_long(assigned.value.type) for assigned in ir.assignments(program.body)):
        return found
    for part in ir.expressions(*program.body, *(result.value for result in program.results)):
        if isinstance(part, (ir.Index, ir.Insert)) and not isinstance(part.index, ir.Literal):
            array = part.value
            if isinstance(array, ir.Local) and _is_long(array.type):
                found[array.name] = array.type
    return found


def _is_long(type_: Type) -> TypeGuard[Array]:
    return isinstance(type_, Array) and component_count(type_) > MAX_VALUES


#: Bytes that a long array may take.
MAX_BUFFER_BYTES = 1 << 28
#: Texels of a row: as many as every device takes along a side, and a power of two, so that places need no division.
WIDTH_BITS = 11
WIDTH = 1 << WIDTH_BITS
#: A whole number's bits in each of its two numbers.
HALF_BITS = 16
#: What components are as NumPy has them.
_NUMBERS: dict[str, type[np.generic]] = {
    "float": np.float32, "int": np.int32, "uint": np.uint32, "bool": np.bool_
}  # fmt: skip


def is_buffer(type_: Type) -> bool:
    """Whether a value of a parameter, or a plain part of it, is such an array."""
    return isinstance(type_, Array) and is_plain(type_) and type_.length > MAX_ARRAY_LENGTH


def buffers_in(type_: Type, name: str) -> Iterator[tuple[str, Array]]:
    """The long arrays in a type, by dotted names."""
    for path, part in plain_parts(type_, name):
        if is_buffer(part):
            yield path, cast(Array, part)


@dataclass(frozen=True, slots=True)
class Layout:
    """How an array lies in its picture: ``texels`` for each entry, and width and height."""

    channels: int
    texels: int
    size: tuple[int, int]


def layout_of(type_: Array) -> Layout:
    """The layout of an array.

    >>> from passgraph.language.types import INT, VEC3
    >>> layout_of(Array(VEC3, 5000)), layout_of(Array(INT, 1500)).channels
    (Layout(channels=3, texels=1, size=(2048, 3)), 2)
    """
    entry = cast(Type, type_.element)
    count = component_count(entry)
    if held_as(type_) == "int":
        count *= 2
        channels = 4 if count % 4 == 0 else 2
    else:
        channels = entry.rows if isinstance(entry, Matrix) else count
    texels = count // channels
    total = type_.length * texels
    width = min(total, WIDTH)
    return Layout(channels, texels, (width, -(-total // width)))


def check_sizes(parameters: tuple[ir.Parameter, ...]) -> None:
    """Refuse arrays that take too much memory."""
    for parameter in parameters:
        for name, type_ in buffers_in(parameter.type, parameter.name):
            layout = layout_of(type_)
            bytes_ = 4 * layout.channels * layout.texels * type_.length
            if bytes_ > MAX_BUFFER_BYTES:
                fail(
                    parameter.span,
                    f"{name} of type {type_} takes {bytes_ / 2**20:.0f} MiB; an array may take "
                    f"{MAX_BUFFER_BYTES >> 20} MiB",
                )


def check_local(type_: Type, what: str, span: Span) -> None:
    """Refuse a variable or a result that would hold a long array."""
    for _, long in buffers_in(type_, ""):
        fail(span, f"{what} would hold {long}; more than {MAX_ARRAY_LENGTH} elements are a parameter, read by index")


def check_reads(parameters: tuple[ir.Parameter, ...], *roots: ir.Stmt | ir.Expr) -> None:
    """Refuse whatever takes a long array as one value: it is there entry by entry."""
    long = any(True for parameter in parameters for _ in buffers_in(parameter.type, parameter.name))
    pending: list[ir.Stmt | ir.Expr] = list(roots) if long else []
    while pending:
        node = pending.pop()
        for part in ir.parts_of(node):
            indexed = isinstance(node, ir.Index) and part is node.value
            if isinstance(part, ir.Uniform) and is_buffer(part.type) and not indexed:
                fail(
                    node.span,
                    f"{part.name} has {cast(Array, part.type).length} entries, which are read by index; an array of "
                    f"more than {MAX_ARRAY_LENGTH} is not copied, assigned to or compared",
                )
            pending.append(part)


# Values of the host


def checked_numbers(value: object, type_: Array, name: str) -> NDArray[Any]:
    """A host value in component order, flat: as it is where it holds such numbers, else as float64.

    Raises
    ------
    InputError
        When shape, kind or range do not fit, naming the parameter.
    """
    flat = in_order(value, type_) if isinstance(value, np.ndarray) and value.dtype == number_of(type_) else None
    return components(value, type_, name) if flat is None else flat


def number_of(type_: Array) -> type[np.generic]:
    """What a component is as NumPy has it."""
    return _NUMBERS[element_of(type_).name]


def as_held(flat: NDArray[Any], type_: Array) -> NDArray[Any]:
    """What :func:`checked_numbers` gives, of that type: uints are the ints with their bits before."""
    kind = number_of(type_)
    return flat.astype(np.int64).astype(kind) if held_as(type_) == "int" else flat.astype(kind)


def picture_of(value: object, type_: Array, name: str) -> NDArray[np.float32]:
    """The picture, (height, width, channels), that holds an array; it may be the value's own memory."""
    layout, flat = layout_of(type_), checked_numbers(value, type_, name)
    if held_as(type_) == "int":
        bits = flat.astype(np.int64, copy=False)
        halves = np.empty((len(bits), 2), np.float32)
        halves[:, 0], halves[:, 1] = bits & (1 << HALF_BITS) - 1, bits >> HALF_BITS & (1 << HALF_BITS) - 1
        flat = halves.reshape(-1)
    width, height = layout.size
    room = width * height * layout.channels
    if len(flat) < room:
        padded = np.zeros(room, np.float32)
        with np.errstate(over="ignore"):  # what rounds to infinity was refused
            padded[: len(flat)] = flat
        flat = padded
    return np.ascontiguousarray(flat, np.float32).reshape(height, width, layout.channels)


def numbers_in(picture: NDArray[np.float32], type_: Array) -> NDArray[Any]:
    """The components that such a picture holds: float32, int32 (of uints too) or bool."""
    layout = layout_of(type_)
    flat = picture.reshape(-1)[: type_.length * layout.texels * layout.channels]
    if held_as(type_) != "int":
        return flat if held_as(type_) == "float" else flat != 0.0
    halves = flat.reshape(-1, 2).astype(np.uint32)
    return (halves[:, 0] | halves[:, 1] << HALF_BITS).view(np.int32)


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
