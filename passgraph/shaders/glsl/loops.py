"""Loops: a counted one makes the trips that its counter makes, any other as many as it wants up to a bound."""

from __future__ import annotations

from typing import TYPE_CHECKING

from passgraph.language import ir
from passgraph.language.types import INT
from passgraph.shaders.glsl import syntax as g
from passgraph.shaders.glsl.folding import Numbers, folded
from passgraph.shaders.glsl.walk import assigned_names, walked

if TYPE_CHECKING:
    from passgraph.shaders.glsl.body import Body

#: Trips of a loop whose counter is followed from value to value.
MAX_COUNTED = 4096
#: Trips of a loop whose end is not known.
MAX_OPEN = 1024
#: Trips of nested loops together.
_MAX_TOGETHER = 1 << 16


def emit_loop(body: Body, node: g.Loop) -> None:
    """``for``, ``while`` and ``do``."""
    unit, builder, statements, span = body.unit, body.builder, body.statements, node.span
    body.scopes.append({})
    if node.start is not None:
        statements.start(node.start)
    counted = _counted(body, node)
    trips = counted
    if trips is None:
        trips = max(1, min(MAX_OPEN, _MAX_TOGETHER // unit.trips))
        unit.note(span, f"the end of this loop is not known here: it makes {trips} trips at most")
    outer, unit.trips = unit.trips, unit.trips * max(trips, 1)
    with unit.captured(span) as block:
        if counted is None and node.condition is not None and not node.late:
            statements.check(node.condition)
        statements.trip(node)
    unit.trips = outer
    body.scopes.pop()
    zero, count, one = (ir.Literal(INT, i, span) for i in (0, trips, 1))
    builder.emit(ir.For(builder.fresh("trip"), zero, count, one, tuple(block), span))


def _counted(body: Body, node: g.Loop) -> int | None:
    """How many trips a loop makes, found by following its counter; None where that needs more than constants."""
    if node.condition is None or node.update is None or node.late:
        return None
    names = assigned_names(node.update, body.unit.functions)
    if len(names) != 1 or names & assigned_names(node.body, body.unit.functions):
        return None
    if names & set(body.unit.names) or any(isinstance(n, g.Call) for n in walked(node.update)):
        return None  # functions may change it
    with body.unit.captured(node.span) as stray:
        condition = body.expressions.condition(node.condition)
    with body.unit.captured(node.span) as update:
        body.expressions.evaluate(node.update)
    if stray:
        return None
    known = _start(body, update)
    if known is None:
        return None
    for trips in range(MAX_COUNTED):
        holds = folded(condition, known)
        if holds is None:
            return None
        if not holds[0]:
            return trips
        for statement in update:
            value = folded(statement.value, known) if isinstance(statement, ir.Assign) else None
            if value is None:
                return None
            known[statement.name] = value  # type: ignore[union-attr]
    return None


def _start(body: Body, update: list[ir.Stmt]) -> dict[str, Numbers] | None:
    """The counter's first value: what the last statement before the loop gave it."""
    before = body.builder.blocks[-1]
    last = before[-1] if before else None
    if not isinstance(last, ir.Assign) or all(getattr(s, "name", "") != last.name for s in update):
        return None
    value = folded(last.value)
    return None if value is None else {last.name: value}
