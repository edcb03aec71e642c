"""What a driver's compiler may come to know before a shader runs.

Compilers fold ``0 / x`` and ``0 * x`` to 0, which loses the NaN of a zero or infinite x, and take ``x / 0`` for
anything (llvmpipe does, ``precise`` or not).  They see zeros that the source does not show: loops are unrolled, so that
their indices, what tables hold at them and what variables begin with become constants.
"""

from __future__ import annotations

from collections.abc import Iterable

from passgraph.language import scalar as s

#: Operations that one known argument may decide.
_DECIDED = {("bit_and", "int"), ("mul", "int"), ("logical_and", "bool"), ("logical_or", "bool")}


def foreseen_values(program: s.ScalarProgram) -> frozenset[int]:
    """Values by id that may turn into constants; more may be named than do."""
    found: set[int] = set()
    variables: set[str] = set()
    while True:
        before = len(found) + len(variables)
        _walk(program.body, found, variables)
        if len(found) + len(variables) == before:
            return frozenset(found)


def _walk(body: Iterable[s.Instruction], found: set[int], variables: set[str]) -> None:
    for i in s.walk(body):
        if isinstance(i, s.For):
            found.add(i.index.id)
        elif isinstance(i, s.Write) and _is_foreseen(i.value, found):
            variables.add(i.variable)
        elif (isinstance(i, s.Read) and i.variable in variables) or (
            isinstance(i, (s.Op, s.Choose, s.LoadTable)) and _follows(i, found)
        ):
            found.add(i.to.id)


def _is_foreseen(operand: s.Operand, found: set[int]) -> bool:
    return isinstance(operand, s.Lit) or operand.id in found


def _follows(i: s.Op | s.Choose | s.LoadTable, found: set[int]) -> bool:
    if isinstance(i, s.LoadTable):
        return _is_foreseen(i.index, found)
    if isinstance(i, s.Choose):
        return _is_foreseen(i.condition, found) and (_is_foreseen(i.then, found) or _is_foreseen(i.orelse, found))
    known = [_is_foreseen(a, found) for a in i.arguments]
    return any(known) if (i.operation, i.on) in _DECIDED else all(known)
