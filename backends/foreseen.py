"""Values of a program that compilers can compute before it runs.

Compilers that assume no NaN fold a product with 0 to 0, so printers hide values that may become a constant 0.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from passgraph.language import scalar as s

#: Operations whose result one constant argument may determine.
_DECIDED = {("bit_and", "int"), ("mul", "int"), ("logical_and", "bool"), ("logical_or", "bool")}
#: Operations whose result is zero only if an operand is zero or tiny.
_KEEP_APART_FROM_ZERO = {"mul", "div", "neg", "abs", "sqrt", "to_float"}


@dataclass(frozen=True)
class Foreseen:
    """Values by id that may become constants (possibly too many), and those among them that are not zero."""

    constants: frozenset[int]
    nonzero: frozenset[int]

    def known(self, operand: s.Operand) -> bool:
        """Return True if a compiler may know the value."""
        return isinstance(operand, s.Lit) or operand.id in self.constants

    def may_be_zero(self, operand: s.Operand) -> bool:
        """Return True if it may become a constant 0."""
        if isinstance(operand, s.Lit):
            return operand.value == 0
        return operand.id in self.constants and operand.id not in self.nonzero


def foreseen_values(program: s.ScalarProgram) -> Foreseen:
    """Return the values of a program that a compiler may compute."""
    search = _Search({name for name, _, values in program.tables if all(v != 0 for v in values)})
    count = -1
    while search.count != count:
        count = search.count
        search.walk(program.body)
    return Foreseen(frozenset(search.found), frozenset(search.nonzero))


class _Search:
    """Iterates to a fixed point: variables carry constants back to the head of a loop."""

    def __init__(self, tables: set[str]) -> None:
        self.tables = tables  # tables without zeros
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
            return self.known(i.condition) and (self.known(i.then) or self.known(i.orelse))
        follows_arguments = [self.known(a) for a in i.arguments]
        return any(follows_arguments) if (i.operation, i.on) in _DECIDED else all(follows_arguments)

    def is_nonzero(self, i: s.Op | s.Choose | s.LoadTable) -> bool:
        if isinstance(i, s.LoadTable):
            return i.table in self.tables
        if isinstance(i, s.Choose) or i.operation not in _KEEP_APART_FROM_ZERO or i.to.type != "float":
            return False
        return all(a.value != 0 if isinstance(a, s.Lit) else a.id in self.nonzero for a in i.arguments)
