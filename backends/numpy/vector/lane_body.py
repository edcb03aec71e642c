"""A scalar program for many pixels at once: one per vector lane, with masks for branches and loops.

LLVM's own vectorizer gives up on loops and branches inside a loop over pixels; this code needs no analysis.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from passgraph.backends.numpy.machine import llvm
from passgraph.backends.numpy.vector.lanes import (
    BOOL,
    F32,
    HELD,
    I8,
    I32,
    I64,
    TYPES,
    Lanes,
    constant,
    emit_operation,
    is_vector,
    zeros,
)
from passgraph.backends.numpy.vector.texels import decoded, element, rounded, scattered
from passgraph.formats import Format
from passgraph.language import scalar as s
from passgraph.language.builtin_name import BuiltinName
from passgraph.language.lowering import lowered
from passgraph.language.lowering.buffers import Buffer, TexelsInBuffers

#: Branches with more instructions than this, or with loops, are skipped if no lane takes them.
MAX_UNCONDITIONAL = 12
LOADS = (s.Load, s.LoadView, s.LoadWindow)


def for_lanes(program: s.ScalarProgram, views: Mapping[tuple[str, str], int] | None = None) -> s.ScalarProgram:
    """Return the program that a `LaneBody` emits; ``views`` number the images whose rows the caller keeps."""
    buffers = {use.name: Buffer() for use in program.images}
    return lowered(program, [TexelsInBuffers(buffers, views=views or {}, windows=True)])


class LaneBody:
    """Emits a program of :func:`for_lanes`.

    ``given`` are the builtins, ``memory`` pointers and sizes by name, ``formats`` the images' formats.
    """

    def __init__(
        self, program: s.ScalarProgram, builder: Lanes, builtins: dict[BuiltinName, Any], memory: dict[str, Any],
        mask: Any, formats: Sequence[Format] = (),
    ) -> None:  # fmt: skip
        self.program, self.builder, self.given, self.memory = program, builder, builtins, memory
        self.formats = formats
        self.numbers = {use.name: i for i, use in enumerate(program.images)}
        self.values: dict[int, Any] = {}
        self.tables: dict[str, Any] = {}
        self.rarely = False  # True in code that seldom runs
        self.slots = {name: self._slot(TYPES[kind]) for name, kind in program.variables}
        self.arrays = {name: self._array(HELD[kind], length) for name, kind, length in program.arrays}
        self.straight = s.is_straight(program)
        self.all, self.mask = mask, None  # active lanes, at first and later
        if not self.straight:
            self.mask = self._slot(BOOL)
            builder.store(mask, self.mask)
        self.breaks: list[Any] = []  # lanes still active in each enclosing loop
        self.masked = False  # True if lanes may be idle here that become active again

    def results(self) -> list[Any]:
        """Emit everything; return the outputs' components."""
        self.block(self.program.body)
        return [self.operand(value) for output in self.program.outputs for value in output.values]

    def rounded(self, output: s.Output, stored: Format) -> list[Any]:
        """Return an output's components as numbers of its format."""
        return [rounded(self.builder, self.operand(value), stored) for value in output.unrounded]

    def operand(self, value: s.Operand) -> Any:
        return constant(value) if isinstance(value, s.Lit) else self.values[value.id]

    def block(self, instructions: tuple[s.Instruction, ...]) -> None:
        for instruction in instructions:
            if self.builder.block.is_terminated:
                return
            if self.straight and self._is_steady(instruction):
                with self.builder.goto_entry_block():
                    self.emit(instruction)
            else:
                self.emit(instruction)

    def _is_steady(self, i: s.Instruction) -> bool:
        """Return True if an instruction of a branchless program is uniform, and so is computed before the pixel
        loop."""
        if isinstance(i, (*LOADS, s.LoadBuiltin)):
            return False
        entry = self.builder.function.entry_basic_block
        return all(
            isinstance(operand, s.Lit) or getattr(self.values[operand.id], "parent", None) is entry
            for operand in s.operands_of(i)
        )

    def _slot(self, kind: Any) -> Any:
        """Return a variable with a value in each lane.  It starts as 0, as idle lanes compute with it too."""
        b = self.builder
        with b.goto_entry_block():
            slot = b.alloca(b.vector(kind))
        b.store(zeros(b.vector(kind)), slot)
        return slot

    def _array(self, kind: Any, length: int) -> Any:
        """Return an array of vectors, zeroed at the start of the function."""
        b = self.builder
        with b.goto_entry_block():
            array = b.alloca(b.vector(kind), llvm.Constant(I64, length))
            clear = b.intrinsic("llvm.memset.p0.i64", llvm.VoidType(), [llvm.PointerType(), I8, I64, BOOL])
            size = llvm.Constant(I64, 4 * b.lanes * length)
            b.plain.call(clear, [array, llvm.Constant(I8, 0), size, llvm.Constant(BOOL, 0)])
        return array

    def _read_slot(self, slot: Any, kind: Any) -> Any:
        return self.builder.load(slot, typ=self.builder.vector(kind))

    def _at_work(self) -> Any:
        return self.all if self.mask is None else self._read_slot(self.mask, BOOL)

    def emit(self, i: s.Instruction) -> None:
        b = self.builder
        if isinstance(i, s.Op):
            self.values[i.to.id] = emit_operation(b, i.operation, i.on, [self.operand(a) for a in i.arguments])
        elif isinstance(i, s.Choose):
            self.values[i.to.id] = b.select(self.operand(i.condition), self.operand(i.then), self.operand(i.orelse))
        elif isinstance(i, s.LoadUniform):
            index = b.sext(self.operand(i.index), I64)
            self.values[i.to.id] = self._entry(self.memory[f"{i.block}s"], index, TYPES[i.block])
        elif isinstance(i, s.Read):
            self.values[i.to.id] = self._read_slot(self.slots[i.variable], TYPES[i.to.type])
        elif isinstance(i, s.Write):
            value, slot = b.spread(self.operand(i.value)), self.slots[i.variable]
            if self.masked:
                before = b.load(slot, typ=value.type)
                value = b.select(self._at_work(), value, before)
            b.store(value, slot)
        elif isinstance(i, s.ReadAt):
            self._read_at(i)
        elif isinstance(i, s.WriteAt):
            self._write_at(i)
        elif isinstance(i, s.LoadBuiltin):
            self.values[i.to.id] = self.given[i.name]
        elif isinstance(i, (s.Break, s.Continue)):
            if isinstance(i, s.Break):
                live = self._read_slot(self.breaks[-1], BOOL)
                b.store(b.and_(live, b.not_(self._at_work())), self.breaks[-1])
            b.store(b.spread(llvm.Constant(BOOL, 0)), self.mask)
        elif isinstance(i, s.LoadTable):
            self.values[i.to.id] = self._table(i)
        elif isinstance(i, s.Load):
            self.load(i)
        elif isinstance(i, s.LoadWindow):
            self._window(i)
        elif isinstance(i, s.LoadView):
            self.view(i)
        elif isinstance(i, s.If):
            self._if(i)
        elif isinstance(i, s.For):
            self._for(i)
        else:
            raise AssertionError(i)

    # Memory: indices and coordinates are clamped in every lane, so that idle lanes may read too.

    def _read_at(self, i: s.ReadAt) -> None:
        b, array, index = self.builder, self.arrays[i.array], self.operand(i.index)
        kind = HELD[i.to.type]
        if is_vector(index):
            loaded = self._entry(array, self._numbers_of_lanes(index), kind)
        else:
            place = b.gep(array, [index], True, source_etype=b.vector(kind))
            loaded = b.load(place, typ=b.vector(kind), align=4)
        self.values[i.to.id] = b.trunc(loaded, BOOL) if i.to.type == "bool" else loaded

    def _write_at(self, i: s.WriteAt) -> None:
        b, array, index = self.builder, self.arrays[i.array], self.operand(i.index)
        value, kind = b.spread(self.operand(i.value)), HELD[i.value.type]
        if i.value.type == "bool":
            value = b.zext(value, kind)
        if is_vector(index):
            b.store_at(array, self._numbers_of_lanes(index), value, kind, self._at_work())
            return
        place = b.gep(array, [index], True, source_etype=b.vector(kind))
        if self.masked:
            value = b.select(self._at_work(), value, b.load(place, typ=value.type, align=4))
        b.plain.store(value, place, align=4)

    def _numbers_of_lanes(self, index: Any) -> Any:
        """Return the address of entry ``index`` of each lane, counted in numbers."""
        b = self.builder
        return b.add(b.mul(index, llvm.Constant(I32, b.lanes)), b.counting(I32))

    def _entry(self, array: Any, index: Any, kind: Any) -> Any:
        if is_vector(index) and kind == F32:
            return scattered(self.builder, array, self.builder.trunc(index, I32), 1, (0,))[0]
        return self.builder.load_at(array, index, kind, steady=True)

    def _table(self, i: s.LoadTable) -> Any:
        b = self.builder
        if i.table not in self.tables:
            kind, values = next((kind, values) for name, kind, values in self.program.tables if name == i.table)
            entries = [constant(s.Lit(kind, value)) for value in values]
            array = llvm.Constant(llvm.ArrayType(TYPES[kind], len(values)), entries)
            self.tables[i.table] = llvm.GlobalVariable(b.module, array)
        return self._entry(self.tables[i.table], self.operand(i.index), TYPES[i.to.type])

    def load(self, i: s.Load) -> None:
        """Load channels of texels anywhere in their picture."""
        channels = [place for place, value in zip(i.places, i.to, strict=True) if value is not None]
        self.keep(i, self._channels(self.numbers[i.image], self.operand(i.index), channels))

    def _window(self, i: s.LoadWindow) -> None:
        """Load all texels of a window: together if it is inside the picture for every active lane, else one by one."""
        b, inside = self.builder, self.operand(i.inside)
        if not is_vector(inside):
            self.block(i.apart)
            self.keep(i, [self.operand(value) for value in i.singly])
            return
        number, first = self.numbers[i.image], self.operand(i.first)
        together, apart, behind = (b.append_basic_block(name) for name in ("together", "apart", "behind"))
        b.cbranch(b.all(b.or_(inside, b.not_(self._at_work()))), together, apart, (1000, 1))
        b.position_at_end(together)
        texels = scattered(b, self.memory[f"im{number}"], first, 1, i.places, self.formats[number])
        b.branch(behind)
        b.position_at_end(apart)
        self.rarely = True
        self.block(i.apart)
        self.rarely = False
        singly = [b.spread(self.operand(value)) for value in i.singly]
        b.branch(behind)
        b.position_at_end(behind)
        either = [b.phi(b.vector(F32)) for _ in i.to]
        for phi, *values in zip(either, texels, singly, strict=True):
            for value, block in zip(values, (together, apart), strict=True):
                phi.add_incoming(value, block)
        self.keep(i, either)

    def _channels(self, number: int, pixel: Any, channels_read: list[int]) -> list[Any]:
        b, picture, channels = self.builder, self.memory[f"im{number}"], self.program.images[number].channels
        format_ = self.formats[number]
        if is_vector(pixel):
            return scattered(b, picture, pixel, channels, channels_read, format_, rarely=self.rarely)
        first, kind = b.mul(b.sext(pixel, I64), llvm.Constant(I64, channels)), element(format_)
        places = [b.add(first, llvm.Constant(I64, channel)) for channel in channels_read]
        return [decoded(b, b.load_at(picture, place, kind, steady=True), format_) for place in places]

    def view(self, i: s.LoadView) -> None:
        """Load texels beside consecutive pixels."""
        raise AssertionError(i)  # only pixel passes keep views

    def keep(self, i: s.Load | s.LoadView | s.LoadWindow, loaded: list[Any]) -> None:
        """Store loaded values as the instruction's results."""
        self.values |= {value.id: number for value, number in zip(s.results_of(i), loaded, strict=True)}

    # Control

    def _if(self, i: s.If) -> None:
        b = self.builder
        condition = self.operand(i.condition)
        # Lanes may be idle behind: they left for the end or next iteration of an enclosing loop.
        leaves = s.breaks((i,), (s.Break, s.Continue))
        if not is_vector(condition) and not leaves:
            self._if_all(condition, i)
            return
        before = self._at_work()
        rest = self._slot(BOOL) if leaves else None
        if rest is not None:
            b.store(b.spread(llvm.Constant(BOOL, 0)), rest)
        was, self.masked = self.masked, True
        for branch_condition, instructions in ((condition, i.then), (b.not_(condition), i.orelse)):
            if not instructions:
                if rest is not None:
                    b.store(b.or_(self._read_slot(rest, BOOL), b.and_(before, branch_condition)), rest)
                continue
            mine = b.and_(before, branch_condition)
            behind = None
            if _long(instructions):
                then, behind = b.append_basic_block("then"), b.append_basic_block("behind")
                b.cbranch(b.any(mine), then, behind)
                b.position_at_end(then)
            b.store(mine, self.mask)
            self.block(instructions)
            if rest is not None:
                b.store(b.or_(self._read_slot(rest, BOOL), self._at_work()), rest)
            if behind is not None:
                b.branch(behind)
                b.position_at_end(behind)
        b.store(before if rest is None else self._read_slot(rest, BOOL), self.mask)
        # After a break or continue its lanes stay idle to the end of the loop's body.
        self.masked = was or leaves

    def _if_all(self, condition: Any, i: s.If) -> None:
        """Emit a branch that all lanes take together."""
        b = self.builder
        then, orelse, behind = (b.append_basic_block(name) for name in ("then", "else", "behind"))
        b.cbranch(condition, then, orelse)
        for block, instructions in ((then, i.then), (orelse, i.orelse)):
            b.position_at_end(block)
            self.block(instructions)
            b.branch(behind)
        b.position_at_end(behind)

    def _for(self, i: s.For) -> None:
        """Emit a loop that all lanes count together; lanes that have left it wait for the rest."""
        b = self.builder
        with b.goto_entry_block():
            slot = b.alloca(I32)
        before, live = self._at_work(), self._slot(BOOL)
        start, stop, step = _counter(i)
        b.store(llvm.Constant(I32, start), slot)
        b.store(before, live)
        check, body, behind = (b.append_basic_block(name) for name in ("check", "body", "behind"))
        b.branch(check)
        b.position_at_end(check)
        count = b.load(slot, typ=I32)
        more = b.icmp_signed("<" if step > 0 else ">", count, llvm.Constant(I32, stop))
        if s.breaks(i.body):
            more = b.and_(more, b.any(self._read_slot(live, BOOL)))
        b.cbranch(more, body, behind)
        b.position_at_end(body)
        b.store(self._read_slot(live, BOOL), self.mask)
        self.values[i.index.id] = _index_of(b, i, count)
        was, self.masked = self.masked, self.masked or s.breaks(i.body)
        self.breaks.append(live)
        self.block(i.body)
        self.breaks.pop()
        self.masked = was
        b.store(b.add(count, llvm.Constant(I32, step)), slot)
        b.branch(check)
        b.position_at_end(behind)
        b.store(before, self.mask)


def _long(body: tuple[s.Instruction, ...]) -> bool:
    listed = list(s.walk(body))
    return len(listed) > MAX_UNCONDITIONAL or any(isinstance(i, (s.For, *LOADS)) for i in listed)


def _counter(loop: s.For) -> tuple[int, int, int]:
    """Return the start, stop and step of a loop's counter: its index, or its iterations if the index would overflow.

    Never 0, 1, 2 …: for such a loop with a multiple of eight iterations LLVM checks for a checksum computation and
    follows operands again at every use (22.1, HashRecognize).  A minimum uses both operands twice, so 24 of them in a
    row take 20 seconds, and each one more doubles that.
    """
    start, stop, step = (0, loop.trips, 1) if loop.wraps else (loop.start, loop.stop, loop.step)
    return (1, stop + 1, 1) if (start, step) == (0, 1) else (start, stop, step)


def _index_of(b: Any, loop: s.For, count: Any) -> Any:
    """Return the index of an iteration; sums and products wrap, and the index itself fits."""
    start, _, step = _counter(loop)
    trips = b.sub(count, llvm.Constant(I32, start))
    if step != loop.step:
        trips = b.mul(trips, llvm.Constant(I32, loop.step))
    return count if (start, step) == (loop.start, loop.step) else b.add(trips, llvm.Constant(I32, loop.start))
