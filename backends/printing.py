"""Prints a scalar program in a language that looks like C; a subclass says how its language differs.

A subclass sets ``target`` (its column of the operations table), implements the hooks below, and assembles a
whole source: :meth:`Printer.line` and :meth:`Printer.block` for the body, then :meth:`Printer.front` for what
stands before it (:meth:`Printer.called` tells which helper functions the body needs).  Every generated line
remembers the kernel line that it came from, so that a compiler's message can point there (:class:`Listing`).
"""

from __future__ import annotations

import math
import struct
from abc import ABC, abstractmethod
from collections.abc import Iterable
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from passgraph.language import scalar as s
from passgraph.language.operations import OPERATIONS
from passgraph.language.source import NOWHERE, Span

INT_MIN = -(2**31)
#: INT_MIN has no literal: 2147483648 does not fit before the sign is taken.
INT_MIN_TEXT = "(-2147483647 - 1)"
#: The smallest normal float32; compilers may flush literals below it.
SMALLEST_NORMAL = 2.0**-126

#: Integer functions that GLSL and OpenCL C spell alike.  No step overflows, and ``%`` never sees a negative
#: operand (undefined in GLSL 3.30).
FLOOR_DIVIDE = f"""
int pg_floor_divide(int a, int b)
{{
    if (b == 0) {{ return 0; }}
    if (b == -1) {{ return a == {INT_MIN_TEXT} ? a : -a; }}
    int q = a / b;
    int r = a - q * b;
    return r != 0 && (r < 0) != (b < 0) ? q - 1 : q;
}}
"""
INT_MOD = """
int pg_int_mod(int a, int b)
{
    if (b == 0 || b == -1) { return 0; }
    int r = a - (a / b) * b;
    return r != 0 && (r < 0) != (b < 0) ? r + b : r;
}
"""


@dataclass(frozen=True)
class Listing:
    """Generated source, and for each line the kernel line behind it."""

    text: str
    spans: tuple[Span, ...]

    def span_at(self, line: int) -> Span:
        """The kernel span behind a generated line, counted from 1 as compilers count."""
        return self.spans[min(max(line, 1), len(self.spans)) - 1] if self.spans else NOWHERE


class Printer(ABC):
    """One program on its way to text.  Values are named ``v1``, ``v2`` …, variables ``m0``, ``m1`` …"""

    #: Column of the operations table: ``"glsl"`` or ``"opencl"``.
    target: ClassVar[str]
    types: ClassVar[dict[str, str]] = {"bool": "bool", "int": "int", "float": "float"}
    #: After a float literal: ``"f"`` where a literal would otherwise be double.
    float_suffix: ClassVar[str] = ""
    #: Before the type of a float value, such as ``"precise "``.
    float_qualifier: ClassVar[str] = ""

    def __init__(self, program: s.ScalarProgram) -> None:
        self.program = program
        self.files = {span.file for span in program.sources}
        self.here = program.sources[0] if program.sources else NOWHERE
        self.names: dict[int, str] = {}  # value id → expression without side effects
        self.lines: list[str] = []
        self.spans: list[Span] = []
        self.depth = 0

    # Hooks

    @abstractmethod
    def float_from_bits(self, bits: int) -> str:
        """The float with these bits (a signed 32-bit int): infinities, NaN and denormals have no literal."""

    @abstractmethod
    def uniform(self, block: str, index: str | int) -> str:
        """Entry ``index`` (an int where it is known) of the block ``"float"`` or ``"int"``."""

    @abstractmethod
    def builtin(self, name: str) -> str:
        """The expression of a builtin such as ``pixel.0`` or ``size.IMAGE.1``."""

    @abstractmethod
    def texel(self, load: s.LoadTexel) -> None:
        """Print one texel load and :meth:`name` (or :meth:`value`) its results."""

    def table(self, name: str, index: str) -> str:
        return f"{name}[{index}]"

    def operation(self, op: s.Op, arguments: list[str]) -> str:
        """The expression of an operation; arguments are names or literals, cheap to repeat."""
        return OPERATIONS[op.operation].spell(op.on, self.target).format(*arguments)

    # Text

    def line(self, text: str = "", span: Span | None = None) -> None:
        """One or more lines of source, indented."""
        for part in text.split("\n"):
            self.lines.append("    " * self.depth + part if part else "")
            self.spans.append(span or self.here)

    def listing(self) -> Listing:
        return Listing("\n".join(self.lines) + "\n", tuple(self.spans))

    def front(self, text: str) -> None:
        """Put text before everything printed so far."""
        lines = text.strip("\n").split("\n")
        self.lines[:0] = lines
        self.spans[:0] = [self.program.sources[0] if self.program.sources else NOWHERE] * len(lines)

    def called(self, functions: dict[str, str]) -> str:
        """Those of ``functions`` (name → text) that the text so far calls, in their order.

        A later one may call an earlier one.
        """
        text = "\n".join(self.lines)
        needed: list[str] = []
        for name in reversed(functions):
            if f"{name}(" in text:
                needed.append(functions[name].strip("\n"))
                text += functions[name]
        return "\n".join(reversed(needed))

    # Operands

    def operand(self, operand: s.Operand) -> str:
        return self.literal(operand) if isinstance(operand, s.Lit) else self.names[operand.id]

    def literal(self, literal: s.Lit) -> str:
        if literal.type == "bool":
            return "true" if literal.value else "false"
        if literal.type == "int":
            return self.int_literal(int(literal.value))
        return self.float_literal(float(literal.value))

    def int_literal(self, value: int) -> str:
        if value == INT_MIN:
            return INT_MIN_TEXT
        return f"({value})" if value < 0 else str(value)

    def float_literal(self, value: float) -> str:
        """All digits of the nearest float32, so that no compiler has anything left to round."""
        with np.errstate(over="ignore", under="ignore"):
            exact = float(np.float32(value))
        negative_zero = exact == 0 and math.copysign(1, exact) < 0
        if not math.isfinite(exact) or 0 < abs(exact) < SMALLEST_NORMAL or negative_zero:
            return self.float_from_bits(struct.unpack("<i", struct.pack("<f", exact))[0])
        text = f"{exact!r}{self.float_suffix}"
        return f"({text})" if exact < 0 else text

    # Values

    def name(self, value: s.Val, expression: str) -> None:
        """Let ``expression`` stand for a value: it must stay valid and cheap wherever the value is used."""
        self.names[value.id] = expression

    def value(self, value: s.Val, expression: str, span: Span | None = None) -> None:
        """Declare a value and compute it here."""
        self.names[value.id] = f"v{value.id}"
        self.line(f"{self.declared(value.type)} v{value.id} = {expression};", span)

    def declared(self, type_: str) -> str:
        return (self.float_qualifier if type_ == "float" else "") + self.types[type_]

    def variables(self) -> None:
        """Declare what branches and loops hand on; the zero is never read."""
        zeros = {"bool": "false", "int": "0", "float": "0.0" + self.float_suffix}
        for name, type_ in self.program.variables:
            self.line(f"{self.declared(type_)} {name} = {zeros[type_]};")
        for name, type_, length in self.program.arrays:
            self.line(f"{self.declared(type_)} {name}[{length}];")

    # Instructions

    def block(self, body: Iterable[s.Instruction]) -> None:
        for instruction in body:
            self.instruction(instruction)

    def instruction(self, i: s.Instruction) -> None:
        if isinstance(i, s.Op):
            self.move(i.span)
            self.value(i.to, self.operation(i, [self.operand(a) for a in i.arguments]))
        elif isinstance(i, s.Choose):
            condition, then, orelse = (self.operand(a) for a in (i.condition, i.then, i.orelse))
            self.value(i.to, f"({condition} ? {then} : {orelse})")
        elif isinstance(i, s.LoadUniform):
            if isinstance(i.index, s.Lit):
                self.name(i.to, self.uniform(i.block, int(i.index.value)))
            else:
                self.value(i.to, self.uniform(i.block, self.operand(i.index)))
        elif isinstance(i, s.LoadTable):
            self.value(i.to, self.table(i.table, self.operand(i.index)))
        elif isinstance(i, s.LoadBuiltin):
            self.name(i.to, self.builtin(i.name))
        elif isinstance(i, s.LoadTexel):
            self.move(i.span)
            self.texel(i)
        elif isinstance(i, s.Read):
            self.value(i.to, i.variable)
        elif isinstance(i, s.Write):
            self.line(f"{i.variable} = {self.operand(i.value)};")
        elif isinstance(i, s.ReadAt):
            self.value(i.to, f"{i.array}[{self.operand(i.index)}]")
        elif isinstance(i, s.WriteAt):
            self.line(f"{i.array}[{self.operand(i.index)}] = {self.operand(i.value)};")
        elif isinstance(i, s.If):
            self.branch(i)
        elif isinstance(i, s.For):
            self.loop(i)
        else:
            self.line("break;" if isinstance(i, s.Break) else "continue;")

    def branch(self, i: s.If) -> None:
        self.line(f"if ({self.operand(i.condition)}) {{")
        self.indented(i.then)
        if i.orelse:
            self.line("} else {")
            self.indented(i.orelse)
        self.line("}")

    def loop(self, i: s.For) -> None:
        index = f"v{i.index.id}"
        self.name(i.index, index)
        if i.wraps:
            self._counted_loop(i, index)
            return
        start, stop, step = (self.int_literal(n) for n in (i.start, i.stop, i.step))
        compare = "<" if i.step > 0 else ">"
        self.line(f"for (int {index} = {start}; {index} {compare} {stop}; {index} += {step}) {{")
        self.indented(i.body)
        self.line("}")

    def _counted_loop(self, i: s.For, index: str) -> None:
        """Trips are counted where the index would leave 32 bits behind the last one."""
        trip, step = s.Lit("int", i.trips), s.Lit("int", i.step)
        add, multiply = (OPERATIONS[name].spell("int", self.target) for name in ("add", "mul"))
        moved = multiply.format(f"{index}t", self.literal(step))
        self.line(f"for (int {index}t = 0; {index}t < {self.literal(trip)}; ++{index}t) {{")
        self.depth += 1
        self.line(f"int {index} = {add.format(self.int_literal(i.start), moved)};")
        self.depth -= 1
        self.indented(i.body)
        self.line("}")

    def indented(self, body: Iterable[s.Instruction]) -> None:
        self.depth += 1
        self.block(body)
        self.depth -= 1

    def move(self, span: Span) -> None:
        """Following lines come from this span; the prelude's belong to the kernel line that calls it."""
        if span.file in self.files:
            self.here = span
