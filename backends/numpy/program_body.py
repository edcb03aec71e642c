"""What every translation of a scalar program into LLVM has in common: operands, arithmetic, order."""

# mypy: disable-error-code="no-untyped-call"
from __future__ import annotations

from typing import Any

from llvmlite import ir

from passgraph.backends.numpy.llvm_ops import I32, I64, TYPES, constant, emit_operation
from passgraph.language import scalar as s


class ProgramBody:
    """One program on its way into a builder; memory and control are the subclass's."""

    program: s.ScalarProgram
    builder: Any
    values: dict[int, Any]

    def operand(self, value: s.Operand) -> Any:
        return constant(value) if isinstance(value, s.Lit) else self.values[value.id]

    def block(self, instructions: tuple[s.Instruction, ...]) -> None:
        for instruction in instructions:
            if self.builder.block.is_terminated:
                return
            self.emit(instruction)

    def emit(self, i: s.Instruction) -> None:
        b = self.builder
        if isinstance(i, s.Op):
            self.values[i.to.id] = emit_operation(b, i.operation, i.on, [self.operand(a) for a in i.arguments])
        elif isinstance(i, s.Choose):
            self.values[i.to.id] = b.select(self.operand(i.condition), self.operand(i.then), self.operand(i.orelse))
        elif isinstance(i, s.LoadUniform):
            self.values[i.to.id] = self.load(f"{i.block}s", b.sext(self.operand(i.index), I64), TYPES[i.block])
        else:
            raise AssertionError(i)

    def load(self, name: str, index: Any, kind: Any) -> Any:
        """An entry of a parameter block."""
        raise NotImplementedError

    def table_constant(self, name: str) -> Any:
        """A table's values as one constant."""
        kind, values = next((kind, values) for table, kind, values in self.program.tables if table == name)
        return ir.Constant(ir.ArrayType(TYPES[kind], len(values)), [constant(s.Lit(kind, v)) for v in values])


def counter(loop: s.For) -> tuple[int, int, int]:
    """Start, stop and step of what a loop counts: its index, or its trips where the index would pass 32 bits."""
    return (0, loop.trips, 1) if loop.wraps else (loop.start, loop.stop, loop.step)


def index_of(b: Any, loop: s.For, count: Any) -> Any:
    """The index of a trip; sums and products wrap, and the index itself fits."""
    if not loop.wraps:
        return count
    return b.add(b.mul(count, ir.Constant(I32, loop.step)), ir.Constant(I32, loop.start))
