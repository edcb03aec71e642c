"""Bodies that differ in their numbers only: one machine code for all, which finds them in memory.

Long graphs repeat a kernel with other constants in each pass, and LLVM would compile each of them.  Numbers in memory
are as quick as those in code, but for the loads with which a body begins.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

from passgraph.language import scalar as s

#: Numbers of a body at most: about as many as there are registers, from which each is spread once for a row.
MAX_LITERALS = 16
#: Numbers of so many bits, or fewer, stay in code.
SHORT_BITS = 6
#: So many bodies of a plan have their numbers in code before others like them share one.
MAX_IN_CODE = 8


@dataclass(frozen=True)
class Apart:
    """A program that has values -1, -2 … for its float literals, and these in order."""

    program: s.ScalarProgram
    literals: tuple[float, ...]


def with_literals_apart(program: s.ScalarProgram) -> Apart | None:
    """None for what is not straight, has no such literals, or too many.

    Numbers that are few bits long stay: 0, 1 and powers of two are what LLVM has rules for, and all kernels have them.
    """
    if not s.is_straight(program):
        return None
    found: dict[float, s.Val] = {}

    def of(x: s.Operand) -> s.Operand:
        if not isinstance(x, s.Lit) or not _is_own(x):
            return x
        return found.setdefault(float(x.value), s.Val("float", -1 - len(found)))

    def apart(operands: Sequence[s.Operand]) -> tuple[s.Operand, ...]:
        return tuple(of(x) for x in operands)

    body: list[s.Instruction] = []
    for i in program.body:
        if isinstance(i, s.Op):
            body.append(replace(i, arguments=apart(i.arguments)))
        elif isinstance(i, s.Choose):
            then, orelse = apart((i.then, i.orelse))
            body.append(replace(i, then=then, orelse=orelse))
        else:
            body.append(i)
    outputs = tuple(replace(o, values=apart(o.values), unrounded=apart(o.unrounded)) for o in program.outputs)
    if not 0 < len(found) <= MAX_LITERALS:
        return None
    return Apart(replace(program, body=tuple(body), outputs=outputs), tuple(found))


def _is_own(x: s.Lit) -> bool:
    """Whether others like this kernel may well have another number here."""
    if x.type != "float" or not math.isfinite(x.value):
        return False
    mantissa, _ = math.frexp(x.value)
    return not (mantissa * 2**SHORT_BITS).is_integer()
