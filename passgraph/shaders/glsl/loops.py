"""Loops: a counted one makes the trips that its counter makes, any other as many as it wants up to a bound."""

from __future__ import annotations

import math
from collections.abc import Iterable
from functools import partial
from typing import TYPE_CHECKING

from passgraph.language import ir
from passgraph.language.types import INT, Array, component_count
from passgraph.shaders.glsl import syntax as g
from passgraph.shaders.glsl.builtins import overloads
from passgraph.shaders.glsl.folding import Numbers, folded
from passgraph.shaders.glsl.walk import assigned_names, walked

if TYPE_CHECKING:
    from passgraph.shaders.glsl.body import Body

#: Trips of a loop whose counter is followed from value to value.
MAX_COUNTED = 4096
#: Trips of a loop whose end is not known, if what it does in a trip is short.
MAX_OPEN = 1024
#: Trips of nested loops together, as :mod:`passgraph.language.lower` allows.
_MAX_TOGETHER = 1 << 16
#: Instructions that all trips of a loop may take: an eighth of what a pixel may.
_MAX_WORK = 1 << 21


def emit_loop(body: Body, node: g.Loop) -> None:
    """``for``, ``while`` and ``do``."""
    unit, builder, statements, span = body.unit, body.builder, body.statements, node.span
    body.scopes.append({})
    if node.start is not None:
        statements.start(node.start)
    counted = _counted(body, node)
    # A condition that counts is computed in each trip, and once more where the loop ends.
    counts = bool(assigned_names(node.condition, partial(overloads, unit)))
    around = unit.trips
    # How many trips an open loop makes is decided behind its body; loops within may need as many as itself.
    unit.trips = around * max(1, math.isqrt(_MAX_TOGETHER // around) if counted is None else counted)
    with unit.captured(span) as block:
        if node.condition is not None and not node.late and (counted is None or counts):
            statements.check(node.condition)
        statements.trip(node)
    unit.trips = around
    body.scopes.pop()
    if counted is None:
        trips = _open_trips(block, around)
        unit.note(span, f"the end of this loop is not known here: it makes {trips} trips at most")
    else:
        trips = counted + 1 if counts and not node.late else counted
    zero, count, one = (ir.Literal(INT, i, span) for i in (0, trips, 1))
    builder.emit(ir.For(builder.fresh("trip"), zero, count, one, tuple(block), span))


def _open_trips(block: list[ir.Stmt], around: int) -> int:
    """As many trips as the limits of a kernel leave."""
    trips = min(MAX_OPEN, _MAX_TOGETHER // (around * _trips(block)), _MAX_WORK // (around * _work(block)))
    return max(trips, 1)


def _trips(block: Iterable[ir.Stmt]) -> int:
    """Most trips that loops in a block make, nested ones together."""
    most = 1
    for statement in block:
        if isinstance(statement, ir.If):
            most = max(most, _trips(statement.then), _trips(statement.orelse))
        elif isinstance(statement, ir.For):
            most = max(most, _count(statement) * _trips(statement.body))
    return most


def _count(loop: ir.For) -> int:
    """Trips of a loop; of those of the language's own functions, whose bounds are constants, too."""
    bounds = [folded(bound) for bound in (loop.start, loop.stop, loop.step)]
    start, stop, step = (1 if bound is None else int(bound[0]) for bound in bounds)
    return max(1, len(range(start, stop, step or 1)))


def _work(block: Iterable[ir.Stmt]) -> int:
    """About how many instructions a block takes, every trip of its loops."""
    total = 1
    for statement in block:
        if isinstance(statement, ir.Assign):
            total += _cost(statement.value)
        elif isinstance(statement, ir.If):
            total += _cost(statement.condition) + _work(statement.then) + _work(statement.orelse)
        elif isinstance(statement, ir.For):
            total += _count(statement) * _work(statement.body)
    return total


def _cost(value: ir.Expr) -> int:
    """Scalars that are computed for a value; functions such as ``sin`` take about ten instructions."""
    total = 0
    for part in walked(value):
        if isinstance(part, ir.Apply):
            operands = [part.type, *(argument.type for argument in part.arguments)]
            width = max(component_count(type_) for type_ in operands if not isinstance(type_, Array))
            total += width * (1 if len(part.operation) < 4 else 10)
        elif isinstance(part, (ir.Select, ir.Texel, ir.Insert, ir.Index)):
            total += component_count(part.type)
    return total


def _counted(body: Body, node: g.Loop) -> int | None:
    """How many trips a loop makes, found by following its counters; None where that needs more than constants."""
    if node.condition is None:
        return None
    functions, heads = partial(overloads, body.unit), (node.update, node.condition)
    names = assigned_names(heads, functions)
    if not names or names & assigned_names(node.body, functions) or names & set(body.unit.names):
        return None
    if any(isinstance(one, g.Call) and one.name in body.unit.functions for one in walked(heads)):
        return None  # functions may change variables outside of them
    with body.unit.captured(node.span) as tested:
        condition = body.expressions.condition(node.condition)
    with body.unit.captured(node.span) as updated:
        if node.update is not None:
            body.expressions.evaluate(node.update)
    known = _known_before(body.builder.blocks[-1])
    for trips in range(MAX_COUNTED):
        if trips or not node.late:
            holds = folded(condition, known) if _follow(tested, known) else None
            if holds is None:
                return None
            if not holds[0]:
                return trips
        if not _follow(updated, known):
            return None
    return None


def _known_before(block: list[ir.Stmt]) -> dict[str, Numbers]:
    """What the assignments right before a loop tell of variables."""
    known: dict[str, Numbers] = {}
    begin = len(block)
    while begin and isinstance(block[begin - 1], ir.Assign):
        begin -= 1
    for statement in block[begin:]:
        assert isinstance(statement, ir.Assign)
        value = folded(statement.value, known)
        known.pop(statement.name, None)
        if value is not None:
            known[statement.name] = value
    return known


def _follow(block: list[ir.Stmt], known: dict[str, Numbers]) -> bool:
    """Put what some assignments give into ``known``; false where that is not known."""
    for statement in block:
        value = folded(statement.value, known) if isinstance(statement, ir.Assign) else None
        if value is None:
            return False
        known[statement.name] = value  # type: ignore[union-attr]
    return True
