"""Programs that differ in their numbers only: what they have in common, and the numbers by themselves.

Long graphs repeat a kernel with other constants in each pass.  With their numbers apart such kernels are one: lowered
once (lower_cache.py), and compiled once where machine code finds the numbers in memory.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from operator import is_
from typing import TypeAlias

from passgraph.language import scalar as s
from passgraph.language.source import Span

#: Numbers of so many bits, or fewer, have no place of their own.
SHORT_BITS = 6
#: What becomes of an operand, and of where an instruction stands in the text.
Of: TypeAlias = Callable[[s.Operand], s.Operand]
At: TypeAlias = Callable[[Span], Span]


def is_own(value: float) -> bool:
    """Whether others like this kernel may well have another number here.

    Not where it is few bits long: there are rules for 0, 1 and powers of two, and all kernels have them.
    """
    mantissa, _ = math.frexp(value)
    return math.isfinite(value) and not (mantissa * 2**SHORT_BITS).is_integer()


def place_of(x: s.Operand) -> int | None:
    """Which number of a row it is; None for what is not one."""
    value: object = x.value if isinstance(x, s.Lit) else None
    return value.number if isinstance(value, s.Place) else None


def with_literals_apart(program: s.ScalarProgram) -> s.Apart | None:
    """None for what has no such literals."""
    found: dict[float, s.Lit] = {}

    def of(x: s.Operand) -> s.Operand:
        if isinstance(x, s.Lit) and x.type == "float" and is_own(x.value):
            return found.setdefault(float(x.value), s.place(len(found)))
        return x

    made = rewritten(program, of)
    return s.Apart(made, tuple(found)) if found else None


def filled(apart: s.Apart) -> s.ScalarProgram:
    """The program with the numbers in their places."""
    return rewritten(apart.program, filling(apart.literals))


def filling(literals: Sequence[float]) -> Of:
    """Puts numbers in their places."""
    numbers = [s.Lit("float", value) for value in literals]

    def of(x: s.Operand) -> s.Operand:
        number = place_of(x) if isinstance(x, s.Lit) else None
        return x if number is None else numbers[number]

    return of


def rewritten(program: s.ScalarProgram, of: Of) -> s.ScalarProgram:
    """The program of other operands."""
    body = tuple([instruction_of(i, of) for i in program.body])
    return replace(program, body=body, outputs=outputs_of(program, of))


def outputs_of(program: s.ScalarProgram, of: Of) -> tuple[s.Output, ...]:
    """Its outputs of other operands."""
    return tuple(
        s.Output(output.name, tuple(map(of, output.values)), tuple(map(of, output.unrounded)))
        for output in program.outputs
    )


def instruction_of(i: s.Instruction, of: Of, at: At = lambda span: span) -> s.Instruction:
    """An instruction of other operands, elsewhere in the text; itself where nothing of it changes."""
    if isinstance(i, s.Op):
        arguments, span = tuple([of(x) for x in i.arguments]), at(i.span)
        same = all(map(is_, arguments, i.arguments))
        return i if same and span is i.span else s.Op(i.to, i.operation, i.on, arguments, span)
    if isinstance(i, s.Choose):
        then, orelse = of(i.then), of(i.orelse)
        return i if then is i.then and orelse is i.orelse else s.Choose(i.to, i.condition, then, orelse)
    if isinstance(i, s.LoadTexel):
        x, y, span = of(i.x), of(i.y), at(i.span)
        same = x is i.x and y is i.y and span is i.span
        return i if same else replace(i, x=x, y=y, span=span)
    if isinstance(i, (s.Write, s.WriteAt)):
        value = of(i.value)
        return i if value is i.value else replace(i, value=value)
    if isinstance(i, s.If):
        return replace(i, then=_all(i.then, of, at), orelse=_all(i.orelse, of, at))
    return replace(i, body=_all(i.body, of, at)) if isinstance(i, s.For) else i


def _all(body: tuple[s.Instruction, ...], of: Of, at: At) -> tuple[s.Instruction, ...]:
    return tuple([instruction_of(i, of, at) for i in body])
