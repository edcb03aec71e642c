"""Instructions under construction for a pass: new values, and integer arithmetic with known numbers folded."""

from __future__ import annotations

import operator
from collections.abc import Callable
from dataclasses import replace

from passgraph.language import scalar as s
from passgraph.language.borders import BORDERS, border_program, computed, nearer, period_program
from passgraph.language.builtin_name import BuiltinName
from passgraph.language.lowering.rows import signature

_FOLDED: dict[str, Callable[..., int]] = {
    "add": operator.add, "sub": operator.sub, "mul": operator.mul, "neg": operator.neg, "min": min, "max": max,
    "int_mod": operator.mod,
}  # fmt: skip
_NEUTRAL = {"add": 0, "sub": 0, "mul": 1}


def number(value: int) -> s.Lit:
    return s.Lit("int", int(value))


class Builder:
    """Adds values and builtins to a program; :meth:`taken` returns the instructions made since the last call."""

    def __init__(self, program: s.ScalarProgram) -> None:
        self.program = program
        self.builtins = dict(program.builtins)
        self.made: list[s.Instruction] = []
        indices = (i.index.id for i in s.walk(program.body) if isinstance(i, s.For))
        results = (value.id for i in s.walk(program.body) for value in s.results_of(i))
        self.last = max(max(indices, default=0), max(results, default=0))

    def fresh(self, type_: str) -> s.Val:
        self.last += 1
        return s.Val(type_, self.last)

    def add(self, instruction: s.Instruction) -> None:
        self.made.append(instruction)

    def taken(self) -> list[s.Instruction]:
        made, self.made = self.made, []
        return made

    def builtin(self, name: BuiltinName, type_: str = "int") -> s.Val:
        to = self.fresh(self.builtins.setdefault(name, type_))
        self.add(s.LoadBuiltin(to, name))
        return to

    def op(self, name: str, on: str, *arguments: s.Operand, to: s.Val | None = None) -> s.Operand:
        """Add an operation of lowered programs, or return its result if that is known."""
        if on in (s.INDEX, s.LONG) and to is None:
            known = [a.value for a in arguments if isinstance(a, s.Lit)]
            if name in _FOLDED and len(known) == len(arguments):
                return number(_FOLDED[name](*known))
            if isinstance(arguments[-1], s.Lit) and arguments[-1].value == _NEUTRAL.get(name):
                return arguments[0]
        if to is None:
            found = signature(name, on)
            to = self.fresh(found[1] if found else on)
        self.add(s.Op(to, name, on, arguments))
        return to

    def index(self, name: str, *arguments: s.Operand) -> s.Operand:
        return self.op(name, s.INDEX, *arguments)

    def coordinate(self, name: str, *arguments: s.Operand) -> s.Operand:
        return self.op(name, s.COORDINATE, *arguments)

    # Border rules

    def bordered(self, rule: str, place: s.Operand, size: s.Operand) -> s.Operand:
        """Return the texel of an axis that a rule finds at a place."""
        return self._ints(border_program(rule), {"i": place, "size": size})

    def near(self, rule: str, offset: s.Operand, size: s.Operand) -> s.Operand:
        """Reduce an offset, any int, to one at which the rule finds the same texel, and whose sum with an index inside
        is an int."""
        if isinstance(offset, s.Lit) and isinstance(size, s.Lit):
            return number(int(nearer(rule, int(offset.value), int(size.value))))
        if BORDERS[rule].period:
            period = self.period(rule, size)
            return self.index("sub", self.index("int_mod", offset, period), period)
        far = self.index("add", size, size)
        return self.index("min", self.index("max", offset, self.index("neg", far)), far)

    def period(self, rule: str, size: s.Operand) -> s.Operand:
        return self._ints(period_program(rule), {"size": size})

    def _ints(self, program: s.ScalarProgram, inputs: dict[str, s.Operand]) -> s.Operand:
        """Add the operations of an int program without branches."""
        found: s.Operand = computed(program, inputs, self.index, number)
        return found

    def finished(self, body: tuple[s.Instruction, ...]) -> s.ScalarProgram:
        """Return the program with another body, and the builtins that this one reads."""
        read = {i.name for i in s.walk(body) if isinstance(i, s.LoadBuiltin)}
        builtins = tuple((name, type_) for name, type_ in self.builtins.items() if name in read)
        return replace(self.program, body=body, builtins=builtins)
