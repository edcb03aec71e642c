"""Loops: a counted one makes the trips that its counter makes, any other as many as it wants up to a bound."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import replace
from typing import TYPE_CHECKING

from passgraph.language import ir
from passgraph.language.folding import folded
from passgraph.language.looping import bounded_loop
from passgraph.language.operations import OPERATIONS
from passgraph.language.source import fail
from passgraph.language.types import component_count
from passgraph.shaders.glsl import syntax as g
from passgraph.shaders.glsl.counting import Count, counted
from passgraph.shaders.glsl.stepping import with_step

if TYPE_CHECKING:
    from passgraph.shaders.glsl.body import Body
    from passgraph.shaders.glsl.unit import Unit

#: Trips of a loop whose end is not known, if what it does in a trip is short.
MAX_OPEN = 1024
#: Fewer trips than these are refused: what so nested a loop draws would be wrong.
MIN_OPEN = 16
#: Trips of nested loops together, as :mod:`passgraph.language.lower` allows.
_MAX_TOGETHER = 1 << 16
#: Instructions that all open loops of a shader may take together, half of what a pixel may; each gets a quarter of what
#: those before it left, since how many follow is not known.
_MAX_WORK = 1 << 23
_SHARE = 4


def emit_loop(body: Body, node: g.Loop) -> None:
    """``for``, ``while`` and ``do``."""
    unit, builder, span = body.unit, body.builder, node.span
    body.scopes.append({})
    if node.start is not None:
        body.statements.start(node.start)
    count, around, outer = _counted(body, node), unit.trips, unit.counters
    if count is not None and not count.exact and count.trips > min(MAX_OPEN, _MAX_TOGETHER // around):
        count = None
    # How many trips an open loop makes is decided behind its body; loops within may need as many as itself.
    unit.trips = around * max(1, math.isqrt(_MAX_TOGETHER // around) if count is None else count.trips)
    told, undecided = unit.told, unit.undecided
    unit.told, unit.undecided = (told, undecided + 1) if count is None else (told * max(1, count.trips), undecided)
    unit.counters = outer if count is None else {**outer, **count.within}
    body.heads.add(len(body.scopes))
    block = body.statements.inside(node, [node.body])
    body.heads.remove(len(body.scopes))
    unit.trips, unit.counters, unit.told, unit.undecided = around, outer, told, undecided

    def test() -> ir.Expr:
        assert node.condition is not None
        return body.expressions.condition(node.condition)

    def update() -> None:
        assert node.update is not None
        body.expressions.effect(node.update)

    if count is None:
        most = _open_trips(body.unit, block)
        if most < MIN_OPEN:
            left = f"the end of this loop is not known here, and too few trips ({most}) are left for it"
            fail(span, f"{left}; give it and the loops around it ends that constants tell")
        unit.note(span, f"the end of this loop is not known here: it makes {most} trips at most")
    else:
        # To the end, where the counter is read by what follows.
        most = count.trips + (node.update is not None and not isinstance(node.start, g.Declaration))
    tested = node.condition is not None and (count is None or not count.exact or most > count.trips)
    bounded_loop(
        builder,
        most,
        lambda: builder.blocks[-1].extend(block),
        span,
        before=test if tested and not node.late else None,
        update=None if node.update is None else update,
        after=test if tested and node.late else None,
    )
    body.scopes.pop()


def _counted(body: Body, node: g.Loop) -> Count | None:
    """How many trips a loop makes by the step in its head, or else by one in its block."""
    if node.update is not None:
        return counted(body, node)
    counts = (counted(body, stepped) for stepped in with_step(node))
    count = next((count for count in counts if count is not None), None)
    # Behind the step the counter is elsewhere.
    return None if count is None else replace(count, within={})


def _open_trips(unit: Unit, block: tuple[ir.Stmt, ...]) -> int:
    """As many trips as the limits of a kernel leave; open loops around have as many."""
    work = _work(block)
    room = (_MAX_WORK - unit.work) // _SHARE
    together = min(_MAX_TOGETHER // (unit.told * _trips(block)), room // (unit.told * work))
    trips = max(1, min(MAX_OPEN, math.floor(math.pow(together, 1 / (1 + unit.undecided)))))
    if unit.trips == 1:  # loops within others are part of what these do
        unit.work += trips * work
    return trips


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
    for part in ir.expressions(value):
        if isinstance(part, ir.Apply):
            operands = [part.type, *(argument.type for argument in part.arguments)]
            each = 1 if OPERATIONS[part.operation].kind == "primitive" else 10
            total += each * max(map(component_count, operands))
        elif isinstance(part, (ir.Select, ir.Texel, ir.Insert, ir.Index)):
            total += component_count(part.type)
    return total
