"""The table of operations: :mod:`.primitives`, :mod:`.functions`, :mod:`.whole_numbers`, :mod:`.vectors`.

A row (:class:`~.operation.Operation`) has all properties of an operation: spelling, types, reference function,
examples, error bound.  The names of the language, documentation, oracle, conformance cases and generated kernels are
derived from it.
To add one, write its row, and its function in :mod:`.prelude` (or, for a primitive, its spelling in each backend).
"""

from __future__ import annotations

import builtins
from functools import cache
from types import BuiltinFunctionType

from passgraph.language import functions, primitives, vectors, whole_numbers  # noqa: F401 (they write the rows)
from passgraph.language.operation import ROWS, Operation

#: Every row by its name, in the order of the table.
OPERATIONS: dict[str, Operation] = {
    row.name: row for kind in ("primitive", "prelude", "expanded") for row in ROWS if row.kind == kind
}
_CALLED = {row.call: row for row in reversed(OPERATIONS.values()) if row.call and not row.converts}
#: Python's functions that are operations.  Engines add more to `builtins`, such as a ``clamp`` of their own.
BUILTINS: dict[object, str] = {
    found: name for name in _CALLED if isinstance(found := getattr(builtins, name, None), BuiltinFunctionType | type)
}
#: Functions called by a name of their own; ``abs``, ``min`` and the like are Python's.
FUNCTIONS: dict[str, Operation] = {name: row for name, row in _CALLED.items() if name not in BUILTINS.values()}


@cache
def called(name: str, operands: int) -> str:
    """Return the row that kernels call by a name with this number of operands; else the first one with that name."""
    rows = [row for row in OPERATIONS.values() if row.call == name]
    return next((row.name for row in rows if len(row.operands) == operands), rows[0].name)


@cache
def signed(sign: str, operands: int) -> tuple[Operation, ...]:
    """Return the rows of an operator, by the types of its operands."""
    return tuple(row for row in OPERATIONS.values() if sign in row.signs and len(row.operands) == operands)


__all__ = ["BUILTINS", "FUNCTIONS", "OPERATIONS", "Operation", "called", "signed"]
