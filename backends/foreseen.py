"""Values of a program that compilers can compute before it runs, and those that are one of a few constants.

Compilers that assume no NaN fold a product with 0 to 0, so printers hide values that may become a constant 0.  They
also turn the product of x with a choice of 0 or 1 into a choice of 0 or x (Mesa 26.1).
"""

from __future__ import annotations

from collections.abc import Iterable

from passgraph.language import scalar as s
from passgraph.records import dataclass

#: Operations whose result one constant argument may determine.
_DECIDED = {("bit_and", "int"), ("mul", "int"), ("logical_and", "bool"), ("logical_or", "bool")}
#: Operations whose result is zero only if an operand is zero or tiny.
_KEEP_APART_FROM_ZERO = {"mul", "div", "neg", "abs", "sqrt", "to_float"}


@dataclass(frozen=True)
class Foreseen:
    """Values by id that may become constants (possibly too many), choices between such, and which are not zero."""

    constants: frozenset[int]
    choices: frozenset[int]
    nonzero: frozenset[int]

    def known(self, operand: s.Operand) -> bool:
        """Return True if a compiler may know the value."""
        return isinstance(operand, s.Lit) or operand.id in self.constants

    def may_be_zero(self, operand: s.Operand) -> bool:
        """Return True if it may become a constant 0."""
        if isinstance(operand, s.Lit):
            return operand.value == 0
        return operand.id in self.constants and operand.id not in self.nonzero

    def may_choose_zero(self, operand: s.Operand) -> bool:
        """Return True if it may become a choice between 0 and another constant."""
        return isinstance(operand, s.Val) and operand.id in self.choices and operand.id not in self.nonzero


def foreseen_values(program: s.ScalarProgram) -> Foreseen:
    """Return the values of a program that a compiler may compute."""
    constants, choices = _searched(program, choices=False), _searched(program, choices=True)
    found = frozenset(constants.found)
    return Foreseen(found, frozenset(choices.found) - found, frozenset(choices.nonzero))


def _searched(program: s.ScalarProgram, choices: bool) -> _Search:
    search = _Search({name for name, _, values in program.tables if all(v != 0 for v in values)}, choices)
    count = -1
    while search.count != count:
        count = search.count
        search.walk(program.body)
    return search


class _Search:
    """Iterates to a fixed point: variables carry constants back to the head of a loop."""

    def __init__(self, tables: set[str], choices: bool) -> None:
        self.tables = tables  # tables without zeros
        self.choices = choices  # True if values count that are one of two constants, under any condition
        self.found: set[int] = set()
        self.nonzero: set[int] = set()
        self.variables: set[str] = set()

    @property
    def count(self) -> int:
        return len(self.found) + len(self.variables)

    def walk(self, body: Iterable[s.Instruction]) -> None:
        for i in s.walk(body):
            if isinstance(i, s.For):
                self.found.add(i.index.id)
                if 0 not in range(i.start, i.stop, i.step):
                    self.nonzero.add(i.index.id)
            elif isinstance(i, s.Write):
                if self.known(i.value):
                    self.variables.add(i.variable)
            elif isinstance(i, s.Read):
                if i.variable in self.variables:
                    self.found.add(i.to.id)
            elif isinstance(i, (s.Op, s.Choose, s.LoadTable)):
                if self.follows(i):
                    self.found.add(i.to.id)
                if self.is_nonzero(i):
                    self.nonzero.add(i.to.id)

    def known(self, operand: s.Operand) -> bool:
        return isinstance(operand, s.Lit) or operand.id in self.found

    def follows(self, i: s.Op | s.Choose | s.LoadTable) -> bool:
        if isinstance(i, s.LoadTable):
            return self.known(i.index)
        if isinstance(i, s.Choose):
            known = self.known(i.then), self.known(i.orelse)
            return any(known) if self.known(i.condition) else self.choices and all(known)
        if self.choices and i.on == "bool" and i.to.type != "bool":
            return True
        follows_arguments = [self.known(a) for a in i.arguments]
        return any(follows_arguments) if (i.operation, i.on) in _DECIDED else all(follows_arguments)

    def is_nonzero(self, i: s.Op | s.Choose | s.LoadTable) -> bool:
        if isinstance(i, s.LoadTable):
            return i.table in self.tables
        if isinstance(i, s.Choose):
            return all(map(self._is_apart, (i.then, i.orelse)))
        if i.operation not in _KEEP_APART_FROM_ZERO or i.to.type != "float":
            return False
        return all(map(self._is_apart, i.arguments))

    def _is_apart(self, operand: s.Operand) -> bool:
        return operand.value != 0 if isinstance(operand, s.Lit) else operand.id in self.nonzero
