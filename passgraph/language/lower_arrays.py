"""Lower long arrays: local ones become memory, parameters become texels of a picture."""

from __future__ import annotations

from typing import TypeGuard, cast

from passgraph.language import ir
from passgraph.language import scalar as s
from passgraph.language.emitter import Emitter
from passgraph.language.long_arrays import HALF_BITS, WIDTH, WIDTH_BITS, layout_of
from passgraph.language.source import Span, fail
from passgraph.language.types import Array, Type, component_count, held_as
from passgraph.records import dataclass

#: Longest arrays that are values, in numbers.
MAX_VALUES = 64


#: Most numbers of all arrays in memory of one kernel: Array[mat4, 1024].  A vector of pixels then needs a megabyte.
MAX_NUMBERS = 16_384


@dataclass(frozen=True)
class Memory:
    """One array: ``length`` entries of ``width`` numbers, and one extra entry for writes out of range."""

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
        """Return all current numbers of an array."""
        memory = self.made[name]
        return [
            self.emitter.read_at(memory.name, s.Lit("int", number)) for number in range(memory.length * memory.width)
        ]

    def entry(self, name: str, index: s.Operand) -> list[s.Operand]:
        """Return the entry at an index, which is clamped into range."""
        e, memory = self.emitter, self.made[name]
        return [e.read_at(memory.name, place) for place in self._places(memory, self._clamped(memory, index))]

    def store(self, name: str, index: s.Operand, entry: list[s.Operand]) -> None:
        """Assign to an entry; writes out of range go to the extra entry, which is never read."""
        e, memory = self.emitter, self.made[name]
        clamped = self._clamped(memory, index)
        where = e.choose(e.op("equal", clamped, index), clamped, s.Lit("int", memory.length))
        for place, value in zip(self._places(memory, where), entry, strict=True):
            e.write_at(memory.name, place, value)

    def fill(self, name: str, values: list[s.Operand], span: Span) -> None:
        """Assign to all entries; in a loop if the values are equal."""
        e, memory = self.emitter, self._memory(name, span)
        entry = values[: memory.width]
        if values == entry * memory.length:
            with _Counting(e, memory.length) as index:
                for place, value in zip(self._places(memory, index), entry, strict=True):
                    e.write_at(memory.name, place, value)
            return
        for number, value in enumerate(values):
            e.write_at(memory.name, s.Lit("int", number), value)

    def copy(self, name: str, source: str, span: Span) -> None:
        e, memory, source_memory = self.emitter, self._memory(name, span), self.made[source]
        with _Counting(e, memory.length * memory.width) as index:
            e.write_at(memory.name, index, e.read_at(source_memory.name, index))

    def _clamped(self, memory: Memory, index: s.Operand) -> s.Operand:
        highest = s.Lit("int", memory.length - 1)
        return self.emitter.op("min", self.emitter.op("max", index, s.Lit("int", 0)), highest)

    def _places(self, memory: Memory, index: s.Operand) -> list[s.Operand]:
        e = self.emitter
        first = e.op("mul", index, s.Lit("int", memory.width))
        return [e.op("add", first, s.Lit("int", number)) for number in range(memory.width)]


class _Counting:
    """Emits a loop around the code emitted inside."""

    def __init__(self, emitter: Emitter, count: int) -> None:
        self.emitter, self.count = emitter, count

    def __enter__(self) -> s.Val:
        self.index = self.emitter.fresh("int")
        self.emitter.ranges[self.index.id] = (0, self.count - 1)
        self.emitter.begin()
        return self.index

    def __exit__(self, *_: object) -> None:
        body = self.emitter.end()
        self.emitter.push(s.For(self.index, 0, self.count, 1, tuple(body)))


def _indexed(program: ir.TypedKernel) -> dict[str, Array]:
    """Return the variables with long arrays that are accessed by an index other than a literal."""
    arrays: dict[str, Array] = {}
    if not any(_is_long(assigned.value.type) for assigned in ir.assignments(program.body)):
        return arrays
    for part in ir.expressions(*program.body, *(result.value for result in program.results)):
        if isinstance(part, (ir.Index, ir.Insert)) and not isinstance(part.index, ir.Literal):
            array = part.value
            if isinstance(array, ir.Local) and _is_long(array.type):
                arrays[array.name] = array.type
    return arrays


def _is_long(type_: Type) -> TypeGuard[Array]:
    return isinstance(type_, Array) and component_count(type_) > MAX_VALUES


def entry(emitter: Emitter, array: ir.Uniform, image: str, index: s.Operand) -> list[s.Operand]:
    """Return the components of an array's entry at an index, which is clamped; ``image`` is its picture."""
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
    stored_type = held_as(type_)
    if stored_type == "bool":
        return [e.op("not_equal", number, s.Lit("float", 0.0)) for number in numbers]
    if stored_type == "float":
        return numbers
    return [_from_halves(e, low, high) for low, high in zip(numbers[::2], numbers[1::2], strict=True)]


def _from_halves(e: Emitter, low: s.Operand, high: s.Operand) -> s.Operand:
    upper = e.op("shift_left", e.op("to_int", high), s.Lit("int", HALF_BITS))
    return e.op("bit_or", e.op("to_int", low), upper)
