"""LLVM text of the bodies of pixel passes: a kernel over part of a row, in vectors of pixels.

The code around them (code.py) finds the start and the ends of rows, and passes them in a `Frame` (buffer_layout.py).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from passgraph.backends.numpy.machine import llvm
from passgraph.backends.numpy.machine.llvm import IRBuilder
from passgraph.backends.numpy.pixels.buffer_layout import Frame, StageLayout, View
from passgraph.backends.numpy.vector.lane_body import LaneBody
from passgraph.backends.numpy.vector.lanes import BOOL, I32, I64, Lanes
from passgraph.backends.numpy.vector.texels import decoded, element, neighbours, woven
from passgraph.language import scalar as s
from passgraph.language.builtin_name import OUTPUT_SIZE, PIXEL, BuiltinName, size_names

POINTER = llvm.PointerType()
#: Parameters: a frame, the number of the (first) row, and the first and last number in the row.
BODY = llvm.FunctionType(llvm.VoidType(), [POINTER, I64, I64, I64])


def number(value: int) -> Any:
    return llvm.Constant(I64, value)


def times(b: Lanes, value: Any, count: int) -> Any:
    return value if count == 1 else b.mul(value, number(count))


def body_text(stage: StageLayout, name: str) -> str:
    """Return a module with the function :data:`BODY` of a stage."""
    module = llvm.Module(name)
    function = llvm.Function(module, BODY, name)
    if s.is_straight(stage.program) and all(use.pointwise for use in stage.program.images):
        function.attributes.add(llvm.POINTS)
    # The frame is constant while the function runs.
    function.args[0].add_attribute("noalias")
    b = Lanes(IRBuilder(function), stage.lanes)
    Stretch(b, stage, function.args[0]).emit(*function.args[1:])
    b.ret_void()
    return str(module)


class Entries(dict[str, Any]):
    """A frame's entries by name, each loaded at the start of the function on first use; sizes as int32."""

    def __init__(self, b: Lanes, frame: Frame, address: Any) -> None:
        super().__init__()
        self.b, self.frame, self.address = b, frame, address
        self._rows: dict[int, Any] = {}

    def __missing__(self, name: str) -> Any:
        place = self.frame.places[name]
        if name in ("floats", "ints") or name.endswith(tuple("0123456789")):
            entry = self.row(place)
        else:
            with self.b.goto_entry_block():
                entry = self.b.trunc(self._load(place, I64), I32)
        self[name] = entry
        return entry

    def row(self, place: int) -> Any:
        """Return the address in an entry."""
        if place not in self._rows:
            with self.b.goto_entry_block():
                self._rows[place] = self._load(place, POINTER)
        return self._rows[place]

    def row_at(self, place: Any) -> Any:
        """Return the address in an entry with a computed index."""
        return self.b.load(self.b.gep(self.address, [place], True, source_etype=I64), typ=POINTER)

    def _load(self, place: int, kind: Any) -> Any:
        return self.b.load(self.b.gep(self.address, [number(place)], True, source_etype=I64), typ=kind)


class Stretch:
    """Emits the loop along a row."""

    def __init__(self, b: Lanes, stage: StageLayout, frame: Any) -> None:
        self.b, self.stage, self.program = b, stage, stage.lowered
        self.entries = Entries(b, stage.frame, frame)

    def emit(self, y: Any, begin: Any, last: Any) -> None:
        """Emit the pixels from number ``begin`` of the row to ``last``: at least one loop iteration.

        Numbers are pixels, or channels where all channels are computed alike.  The last iteration ends with the row, so
        no iteration stores in part: numbers that overlap with the iteration before get the same values.
        """
        b, stage = self.b, self.stage
        final = b.sub(last, number(stage.turn))
        entry, turn, behind = b.block, b.append_basic_block("turn"), b.append_basic_block("behind")
        b.position_at_end(turn)
        first = b.phi(I64)
        results = [
            stored
            for row in range(stage.rows)
            for vector in range(stage.vectors)
            for at in [b.add(first, number(vector * b.lanes)) if vector else first]
            for stored in self._stored(row, at, self._body(self, y, row, at).stored())
        ]
        for values, pointer, align in results:
            b.plain.store(values, pointer, align=align)
        after = b.add(first, number(stage.turn))
        after = b.select(b.icmp_signed("<", after, final), after, final)
        b.cbranch(b.icmp_signed("<", first, final), turn, behind)
        first.add_incoming(begin, entry)
        first.add_incoming(after, b.block)
        b.position_at_end(entry)
        b.branch(turn)
        b.position_at_end(behind)

    @property
    def _body(self) -> type[PixelBody]:
        return Choosing if self.stage.selects else PixelBody

    def _stored(self, row: int, at: Any, values: Sequence[Any]) -> Iterator[tuple[Any, Any, int]]:
        """Yield, for each target, a vector of results in memory order, its address and its alignment."""
        b, stage, begin = self.b, self.stage, 0
        for slot, count in enumerate(stage.counts):
            stored = stage.outputs[slot]
            target = self.entries.row(stage.frame.target(slot, row))
            pointer = b.gep(target, [times(b, at, count)], True, source_etype=element(stored))
            parts = [b.spread(value) for value in values[begin : begin + count]]
            begin += count
            yield woven(b, parts, stored), pointer, stored.bits // 8


class PixelBody(LaneBody):
    """The kernel on consecutive pixels of a row, or consecutive numbers if channels are computed alike."""

    def __init__(self, place: Stretch, y: Any, row: int, at: Any) -> None:
        b, stage, entries = place.b, place.stage, place.entries
        self.place, self.row, self.at = place, row, at
        names = dict(zip(OUTPUT_SIZE, ("width", "height"), strict=True))
        for image, use in enumerate(stage.program.images):
            for name, entry in zip((*size_names(use.name), BuiltinName("pitch", use.name)), "whp", strict=True):
                names[name] = f"im{image}_{entry}"
        read = {name for name, _ in place.program.builtins}
        given = {name: entries[entry] for name, entry in names.items() if name in read}
        if read.intersection(PIXEL):
            given[PIXEL[0]] = b.add(b.trunc(at, I32), b.counting(I32))
            given[PIXEL[1]] = b.add(b.trunc(y, I32), llvm.Constant(I32, row))
        super().__init__(place.program, b, given, entries, b.spread(llvm.Constant(BOOL, 1)), stage.images)

    def stored(self) -> list[Any]:
        """Emit everything; return the outputs' stored numbers."""
        self.block(self.program.body)
        b, stage = self.builder, self.place.stage
        numbers_of_outputs = []
        for output, meant, output_format in zip(self.program.outputs, stage.formats, stage.outputs, strict=True):
            numbers = self.rounded(output, meant)
            numbers_of_outputs += (
                numbers if output_format is meant else [decoded(b, b.spread(number), meant) for number in numbers]
            )
        return numbers_of_outputs

    def view(self, i: s.LoadView) -> None:
        b, stage, entries, at = self.builder, self.place.stage, self.place.entries, i.view
        view, unit = stage.views[at], stage.alike
        if isinstance(i.y, s.Lit):
            row = entries.row(stage.frame.view(at, view.up + self.row + int(i.y.value)))
        else:
            row = entries.row_at(
                b.add(b.sext(self.operand(i.y), I64), number(stage.frame.view(at, view.up + self.row)))
            )
        channels = [channel for channel, value in enumerate(i.to) if value is not None]
        self.keep(i, self.loaded(row, self._column_at_offset(i.x, unit), view, channels))

    def _column_at_offset(self, x: s.Operand, unit: int) -> Any:
        """Return the index of the pixel, or number, at a column offset."""
        b = self.builder
        if isinstance(x, s.Lit):
            return b.add(self.at, number(int(x.value) * unit)) if x.value else self.at
        away = b.sext(self.operand(x), I64)
        return b.add(self.at, times(b, away, unit))

    def loaded(self, row: Any, first: Any, view: View, channels: Sequence[int]) -> list[Any]:
        """Return channels of the pixels from number ``first`` of a row on, or the numbers themselves."""
        if self.place.stage.alike > 1:
            return neighbours(self.builder, row, first, 1, (0,), view.read) * len(channels)
        place = times(self.builder, first, view.channels)
        return neighbours(self.builder, row, place, view.channels, channels, view.read)


class Choosing(PixelBody):
    """The kernel on consecutive stored numbers: unsigned ones, among which it only selects."""

    def stored(self) -> list[Any]:
        self.block(self.program.body)
        return [self.operand(value) for value in self.program.outputs[0].values]

    def emit(self, i: s.Instruction) -> None:
        if not isinstance(i, s.Op):
            super().emit(i)
            return
        x, y = (self.operand(part) for part in i.arguments)
        b, sign = self.builder, "<" if i.operation == "min" else ">"
        self.values[i.to.id] = b.select(b.icmp_unsigned(sign, x, y), x, y)

    def loaded(self, row: Any, first: Any, view: View, wanted: Sequence[int]) -> list[Any]:
        b, kind = self.builder, element(view.stored)
        pointer = b.gep(row, [first], True, source_etype=kind)
        return [b.load(pointer, typ=b.vector(kind), align=view.stored.bits // 8)] * len(wanted)
