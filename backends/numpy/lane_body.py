"""A scalar program for many pixels at once: one in each lane of a vector, branches and loops by masks.

LLVM's own vectoriser gives up on loops and branches inside a loop over pixels; here it need not find anything out.
"""

# mypy: disable-error-code="no-untyped-call"
from __future__ import annotations

from typing import Any

from llvmlite import ir

from passgraph.backends.numpy.lanes import Lanes, border, is_vector
from passgraph.backends.numpy.llvm_body import Body
from passgraph.backends.numpy.llvm_ops import BOOL, F32, I32, TYPES, constant
from passgraph.language import scalar as s

#: Branches with more instructions than this, or with loops, are jumped over where no lane takes them.
MAX_UNCONDITIONAL = 12


class LaneBody(Body):
    """See :class:`Body`; ``given`` are the builtins and ``memory`` the pointers and sizes by their names."""

    def __init__(
        self, program: s.ScalarProgram, builder: Lanes, given: dict[str, Any], memory: dict[str, Any], mask: Any
    ) -> None:
        self.program, self.builder, self.given, self.memory = program, builder, given, memory
        self.numbers = {use.name: i for i, use in enumerate(program.images)}
        self.values: dict[int, Any] = {}
        self.tables: dict[str, Any] = {}
        self.slots = {name: self._slot(TYPES[kind]) for name, kind in program.variables}
        self.mask = self._slot(BOOL)  # lanes at work
        builder.store(mask, self.mask)
        self.breaks: list[Any] = []  # lanes that are still in each loop around
        self.masked = False  # whether some lanes may be idle here that will work again

    def _slot(self, kind: Any) -> Any:
        """A variable with a value in each lane."""
        b = self.builder
        with b.goto_entry_block():
            return b.alloca(b.vector(kind))

    def _read_slot(self, slot: Any, kind: Any) -> Any:
        return self.builder.load(slot, typ=self.builder.vector(kind))

    def _at_work(self) -> Any:
        return self._read_slot(self.mask, BOOL)

    def _emit(self, i: s.Instruction) -> None:
        b = self.builder
        if isinstance(i, s.Read):
            self.values[i.to.id] = self._read_slot(self.slots[i.variable], TYPES[i.to.type])
        elif isinstance(i, s.Write):
            value, slot = b.spread(self.operand(i.value)), self.slots[i.variable]
            if self.masked:
                held = b.load(slot, typ=value.type)
                value = b.select(self._at_work(), value, held)
            b.store(value, slot)
        elif isinstance(i, s.LoadBuiltin):
            self.values[i.to.id] = self.given[i.name]
        elif isinstance(i, (s.Break, s.Continue)):
            if isinstance(i, s.Break):
                live = self._read_slot(self.breaks[-1], BOOL)
                b.store(b.and_(live, b.not_(self._at_work())), self.breaks[-1])
            b.store(b.spread(ir.Constant(BOOL, 0)), self.mask)
        else:
            super()._emit(i)

    # Memory

    def _load(self, name: str, index: Any, type_: Any) -> Any:
        mask = self._at_work() if is_vector(index) else None
        return self.builder.load_at(self.memory[name], index, type_, mask, steady=True)

    def _table(self, i: s.LoadTable) -> Any:
        b = self.builder
        if i.table not in self.tables:
            kind, values = next((kind, values) for name, kind, values in self.program.tables if name == i.table)
            array = ir.Constant(ir.ArrayType(TYPES[kind], len(values)), [constant(s.Lit(kind, v)) for v in values])
            held = ir.GlobalVariable(b.module, array.type, f"table_{i.table}")
            held.linkage, held.global_constant, held.initializer = "internal", True, array
            self.tables[i.table] = held
        index = self.operand(i.index)
        mask = self._at_work() if is_vector(index) else None
        return b.load_at(self.tables[i.table], index, TYPES[i.to.type], mask, steady=True)

    def _texel(self, i: s.LoadTexel) -> None:
        """Coordinates are brought into range in every lane, so idle lanes may read too."""
        number, b = self.numbers[i.image], self.builder
        x, y = self.operand(i.x), self.operand(i.y)
        if i.relative:
            x, y = b.add(self.given["x"], x), b.add(self.given["y"], y)
        width, height = self.memory[f"im{number}_w"], self.memory[f"im{number}_h"]
        inner_x, inner_y = border(b, i.border, x, width), border(b, i.border, y, height)
        channels = self.program.images[number].channels
        at = b.mul(b.add(b.mul(inner_y, width), inner_x), ir.Constant(I32, channels))
        outside = None
        if i.border == "zero":
            outside = b.or_(b.icmp_signed("!=", inner_x, x), b.icmp_signed("!=", inner_y, y))
        for channel, value in enumerate(i.to):
            if value is not None:
                loaded = b.load_at(self.memory[f"im{number}"], b.add(at, ir.Constant(I32, channel)), F32, steady=True)
                self.values[value.id] = loaded if outside is None else b.select(outside, ir.Constant(F32, 0.0), loaded)

    # Control

    def _if(self, i: s.If) -> None:
        b = self.builder
        condition = self.operand(i.condition)
        leaves = _leaves(i.then) or _leaves(i.orelse)
        before = self._at_work()
        rest = self._slot(BOOL) if leaves else None
        if rest is not None:
            b.store(b.spread(ir.Constant(BOOL, 0)), rest)
        was, self.masked = self.masked, True
        for taken, instructions in ((condition, i.then), (b.not_(condition), i.orelse)):
            if not instructions:
                if rest is not None:
                    b.store(b.or_(self._read_slot(rest, BOOL), b.and_(before, taken)), rest)
                continue
            mine = b.and_(before, taken)
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
        # After a break or continue the lanes that took it stay idle to the end of the loop's body.
        self.masked = was or leaves

    def _for(self, i: s.For) -> None:
        """All lanes count together; those that have left wait for the rest."""
        b = self.builder
        with b.goto_entry_block():
            slot = b.alloca(I32)
        before, live = self._at_work(), self._slot(BOOL)
        b.store(ir.Constant(I32, i.start), slot)
        b.store(before, live)
        check, body, behind = (b.append_basic_block(name) for name in ("check", "body", "behind"))
        b.branch(check)
        b.position_at_end(check)
        index = b.load(slot, typ=I32)
        more = b.icmp_signed("<" if i.step > 0 else ">", index, ir.Constant(I32, i.stop))
        if _breaks(i.body):
            more = b.and_(more, b.any(self._read_slot(live, BOOL)))
        b.cbranch(more, body, behind)
        b.position_at_end(body)
        b.store(self._read_slot(live, BOOL), self.mask)
        self.values[i.index.id] = index
        was, self.masked = self.masked, self.masked or _breaks(i.body)
        self.breaks.append(live)
        self.block(i.body)
        self.breaks.pop()
        self.masked = was
        b.store(b.add(index, ir.Constant(I32, i.step)), slot)
        b.branch(check)
        b.position_at_end(behind)
        b.store(before, self.mask)


def _breaks(body: tuple[s.Instruction, ...]) -> bool:
    """Whether some lanes may leave the loop of this body."""
    return any(isinstance(i, s.Break) or (isinstance(i, s.If) and (_breaks(i.then) or _breaks(i.orelse))) for i in body)


def _leaves(body: tuple[s.Instruction, ...]) -> bool:
    """Whether some lanes may be idle behind this body: they left for the end or the next trip of a loop around."""
    return any(
        isinstance(i, (s.Break, s.Continue)) or (isinstance(i, s.If) and (_leaves(i.then) or _leaves(i.orelse)))
        for i in body
    )


def _long(body: tuple[s.Instruction, ...]) -> bool:
    listed = list(s.walk(body))
    return len(listed) > MAX_UNCONDITIONAL or any(isinstance(i, (s.For, s.LoadTexel)) for i in listed)
