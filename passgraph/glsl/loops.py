"""Loops: how many trips a counter makes, and bounded loops for all others."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, TypeAlias

from passgraph.glsl import syntax as g
from passgraph.glsl.builtins import overloads
from passgraph.glsl.unit import Slot
from passgraph.glsl.walk import assigned_names, assigned_parts, overlap, walked
from passgraph.language import ir
from passgraph.language.looping import MAX_COUNTED, MIRRORED, bounded_loop, count_trips
from passgraph.language.meanings import INT_MAX
from passgraph.language.operations import OPERATIONS
from passgraph.language.source import fail
from passgraph.language.types import BOOL, FLOAT, INT, UINT, Array, Matrix, Vector, component_count, element_of
from passgraph.language.value_ranges import ANY_FLOAT, TRUTH, Range, of_number, of_operation
from passgraph.language.values import constant, folded

if TYPE_CHECKING:
    from passgraph.glsl.body import Body
    from passgraph.glsl.unit import Unit


#: Steps of one loop that may be its counter's: each is looked at beside the whole block.
MOST_STEPS = 4


def with_step(node: g.Loop) -> Iterator[g.Loop]:
    """``for (; c; i++) { … }`` for each step ``i++`` of ``while (c) { … i++; … }``, or of ``do``: loops that make as
    many trips, if the rest of the block leaves the counter alone.

    A step is none where a trip may be over before it, where it hangs on variables of the block, or where the condition
    does not ask for what it changes.  Of more than `MOST_STEPS` the first are looked at.
    """
    if node.update is not None or not isinstance(node.body, g.Block):
        return
    read_names, own, left = _names(node.condition), set[str](), MOST_STEPS
    statements = node.body.statements
    for i, statement in enumerate(statements):
        if not left or _continues(statement):
            return
        if isinstance(statement, g.Declaration):
            own |= {variable.name for variable in statement.variables}
        if not isinstance(statement, g.Evaluate) or not isinstance(statement.value, (g.Assignment, g.Step)):
            continue
        if own.isdisjoint(_names(statement)) and not read_names.isdisjoint(_names(statement.value.target)):
            left -= 1
            rest = replace(node.body, statements=(*statements[:i], *statements[i + 1 :]))
            yield replace(node, update=statement.value, body=rest)


def _names(node: object) -> frozenset[str]:
    return frozenset(one.name for one in walked(node) if isinstance(one, g.Name))


def _continues(statement: g.Statement) -> bool:
    """Return True if a statement may continue its enclosing loop."""
    if isinstance(statement, g.Jump):
        return statement.kind == "continue"
    if isinstance(statement, g.Block):
        return any(map(_continues, statement.statements))
    if isinstance(statement, g.If):
        return any(_continues(one) for one in (statement.then, statement.orelse) if one is not None)
    cases = statement.cases if isinstance(statement, g.Switch) else ()
    return any(_continues(one) for case in cases for one in case.statements)


#: A component of a variable, by the name that it has in the representation.
Component: TypeAlias = tuple[str, int]
#: What a sum of float32 may lose, of its larger part: a step that is smaller than that may be no step.
_LOST = 2.0**-23
#: Statements before a loop that are looked at for what its variables hold.
_LOOKED_BACK = 64


@dataclass(frozen=True)
class Count:
    """Trips of a loop, where they are not ``exact`` the most; ``within``: what its counter is between in its body."""

    trips: int
    exact: bool
    within: Mapping[Component, Range]


def counted(body: Body, node: g.Loop) -> Count | None:
    """Return the trip count of a loop; None if it depends on more than constants and outer counters."""
    if node.condition is None or node.update is None:
        return None
    functions = partial(overloads, body.unit)
    changed = assigned_parts(node.update, functions)
    if overlap(changed, assigned_parts(node.body, functions)) or {name for name, _ in changed} & set(body.unit.names):
        return None
    if any(isinstance(one, g.Call) and one.name in body.unit.functions for one in walked(node.update)):
        return None  # functions may change variables outside of them
    if assigned_parts(node.condition, functions):
        return None
    before = body.builder.blocks[-1]
    tests, condition = body.unit.captured(partial(body.expressions.condition, node.condition), node.span)
    updates, _ = body.unit.captured(partial(body.expressions.effect, node.update), node.span)
    exact = None if tests else _exactly(before, condition, updates)
    bounded = _bounded(body.unit.counters, before, (*tests, ir.Assign("", condition)), updates, _fixed(body, node))
    if node.late:
        # The first trip is not tested; if it were made all the same, the others are those of a tested loop.
        if exact is not None:
            return Count(exact, True, {}) if exact > 0 else None
        return None if bounded is None else Count(bounded.trips + 1, False, {})
    if exact is not None:
        return Count(exact, True, bounded.within if bounded else {})
    return bounded


def _fixed(body: Body, node: g.Loop) -> frozenset[str]:
    """Variables in a loop's condition that the loop leaves alone, by their names in the representation."""
    changed = assigned_names(node, partial(overloads, body.unit)) | set(body.unit.names)
    names = {one.name for one in walked(node.condition) if isinstance(one, g.Name)} - changed
    slots = [body.find(name) for name in names]
    return frozenset(slot.variable.name for slot in slots if isinstance(slot, Slot))


def _exactly(before: Sequence[ir.Stmt], condition: ir.Expr, updates: Sequence[ir.Stmt]) -> int | None:
    """Trips by a counter that is a variable alone, if everything is constant."""
    first, following = before[-1] if before else None, updates[0] if len(updates) == 1 else None
    if not isinstance(first, ir.Assign) or not isinstance(following, ir.Assign) or first.name != following.name:
        return None
    return count_trips(first.name, constant(first.value), _settled(condition), _settled(following.value))


def _settled(value: ir.Expr) -> ir.Expr:
    """An operation whose operands are written out where they are known."""
    if not isinstance(value, ir.Apply):
        return value
    return replace(value, arguments=tuple(map(constant, value.arguments)))


# By ranges


@dataclass(frozen=True)
class _Amount:
    """The range of a number; if it ``follows``, relative to the counter."""

    range: Range
    follows: bool = False


_UNKNOWN = _Amount(ANY_FLOAT)


class _Amounts:
    """Components of expressions, from what those of some variables lie between; ``counter`` is what others follow."""

    def __init__(self, ranges: Mapping[Component, Range], counter: Component | None = None) -> None:
        self.known, self.counter = ranges, counter
        self.held: dict[str, list[_Amount]] = {}

    def run(self, statements: Sequence[ir.Stmt]) -> bool:
        """Obey assignments; false where something else is among them."""
        for statement in statements:
            if not isinstance(statement, ir.Assign):
                return False
            self.held[statement.name] = self.of(statement.value)
        return True

    def come_to(self, statements: Sequence[ir.Stmt]) -> None:
        """Obey assignments; of what branches and loops assign nothing is known behind them."""
        for statement in statements:
            if isinstance(statement, ir.Assign):
                self.held[statement.name] = self.of(statement.value)
            else:
                self.held |= {one.name: [] for one in ir.assignments((statement,))}

    def of(self, value: ir.Expr) -> list[_Amount]:
        if isinstance(value.type, (Array, Matrix)) or element_of(value.type) is UINT:
            return [_UNKNOWN]
        count = component_count(value.type)
        if isinstance(value, ir.Literal):
            number = float(value.value)
            return [_Amount(of_number(number) if value.type is FLOAT else Range(number, number))]
        if isinstance(value, ir.Local):
            return self.held.get(value.name) or [self._component((value.name, i)) for i in range(count)]
        if isinstance(value, ir.Swizzle):
            amounts = self.of(value.value)
            return [amounts[i] for i in value.components]
        if isinstance(value, ir.Index) and isinstance(value.index, ir.Literal) and isinstance(value.value.type, Vector):
            return [self.of(value.value)[int(value.index.value)]]
        if isinstance(value, ir.Construct):
            return [amount for part in value.arguments for amount in self.of(part)]
        if isinstance(value, ir.Apply):
            return self._applied(value, count)
        return [_Amount(TRUTH) if element_of(value.type) is BOOL else _UNKNOWN] * count

    def _component(self, one: Component) -> _Amount:
        if one == self.counter:
            return _Amount(Range(0.0, 0.0), follows=True)
        return _Amount(self.known[one]) if one in self.known else _UNKNOWN

    def _applied(self, value: ir.Apply, count: int) -> list[_Amount]:
        if element_of(value.type) is BOOL:
            return [_Amount(TRUTH)] * count
        operands = [self.of(argument) for argument in value.arguments]
        if any(len(operand) not in (1, count) for operand in operands):
            return [_UNKNOWN] * count
        of_floats = element_of(value.arguments[0].type) is FLOAT
        columns = [[operand[i % len(operand)] for operand in operands] for i in range(count)]
        return [_combined(value.operation, of_floats, column) for column in columns]


def _combined(operation: str, of_floats: bool, parts: Sequence[_Amount]) -> _Amount:
    ranges = [part.range for part in parts]
    if not any(part.follows for part in parts):
        range_ = of_operation(operation, of_floats, ranges)
        return _UNKNOWN if range_ is None else _Amount(range_)
    # What follows the counter still does where a number is added.
    a, b = ranges if len(ranges) == 2 else (ANY_FLOAT, ANY_FLOAT)
    if operation == "add" and not (parts[0].follows and parts[1].follows):
        return _following(a.low + b.low, a.high + b.high, a.nan or b.nan, of_floats)
    if operation == "sub" and not parts[1].follows:
        return _following(a.low - b.high, a.high - b.low, a.nan or b.nan, of_floats)
    return _UNKNOWN


def _following(low: float, high: float, nan: bool, of_floats: bool) -> _Amount:
    """Return a range relative to the counter, widened by the rounding of a float sum. The loop's count accounts for the
    counter itself."""
    lost = _LOST * max(abs(low), abs(high)) if of_floats else 0.0
    return _Amount(Range(low - lost, high + lost, nan), follows=True)


def _bounded(
    ranges: Mapping[Component, Range],
    before: Sequence[ir.Stmt],
    tests: Sequence[ir.Stmt],
    updates: Sequence[ir.Stmt],
    fixed: frozenset[str],
) -> Count | None:
    """The most trips by a counter that steps grow, or shrink, and that the condition holds below, or above, a bound."""
    start = _Amounts(ranges)
    start.come_to(before[-_LOOKED_BACK:])
    for update in updates:
        if not isinstance(update, ir.Assign) or update.name not in start.held:
            continue
        for i, first in enumerate(start.held[update.name]):
            counter = (update.name, i)
            after, tested = _Amounts(ranges, counter), _Amounts(ranges, counter)
            tested.held |= {name: known_amounts for name, known_amounts in start.held.items() if name in fixed}
            if not after.run(updates) or not tested.run(tests[:-1]) or len(after.held[update.name]) <= i:
                continue
            step, last = after.held[update.name][i], tests[-1]
            assert isinstance(last, ir.Assign)
            is_int = element_of(update.value.type) is INT
            for grows, end, aside in _ends(last.value, tested):
                trips = _trips_between(first.range, end, aside, step, grows, is_int)
                if trips is not None:
                    within = (
                        Range(first.range.low, max(first.range.low, end))
                        if grows
                        else Range(min(first.range.high, end), first.range.high)
                    )
                    return Count(trips, False, {counter: within})
    return None


def _ends(condition: ir.Expr, amounts: _Amounts) -> Iterator[tuple[bool, float, float]]:
    """Numbers beyond which a condition does not hold: whether it holds below, the farthest, and how far from the
    counter at most lies what is compared."""
    if not isinstance(condition, ir.Apply):
        return
    if condition.operation == "logical_and":
        for side in condition.arguments:
            yield from _ends(side, amounts)
        return
    if condition.operation not in MIRRORED or component_count(condition.arguments[0].type) != 1:
        return
    if element_of(condition.arguments[0].type) is UINT:
        return
    (left,), (right,) = map(amounts.of, condition.arguments)
    operation = condition.operation
    if right.follows and not left.follows:
        left, right, operation = right, left, MIRRORED[operation]
    if left.follows and not right.follows:
        grows = operation.startswith("less")
        end = right.range.high - left.range.low if grows else right.range.low - left.range.high
        yield grows, end, max(abs(left.range.low), abs(left.range.high))


def _trips_between(first: Range, end: float, aside: float, step: _Amount, grows: bool, is_int: bool) -> int | None:
    """The most steps from where a counter may begin to an end, where what lies ``aside`` of it is compared."""
    if not step.follows or first.nan or step.range.nan:
        return None
    by = step.range if grows else Range(-step.range.high, -step.range.low)
    way = end - first.low if grows else first.high - end
    least, farthest = by.low, max(abs(end), abs(first.low), abs(first.high))
    if is_int:
        if farthest + by.high + aside > INT_MAX:  # begun anew at the other end of all ints
            return None
    else:
        least -= _LOST * farthest
        way += _LOST * farthest
    if not (math.isfinite(way) and least > 0):
        return None
    trips = max(0, math.floor(way / least * (1 + _LOST)) + 1)
    return trips if trips <= MAX_COUNTED else None


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
    outer_trips, undecided = unit.told, unit.undecided
    unit.told, unit.undecided = (
        (outer_trips, undecided + 1) if count is None else (outer_trips * max(1, count.trips), undecided)
    )
    unit.counters = outer if count is None else {**outer, **count.within}
    body.heads.add(len(body.scopes))
    block = body.statements.inside(node, [node.body])
    body.heads.remove(len(body.scopes))
    unit.trips, unit.counters, unit.told, unit.undecided = around, outer, outer_trips, undecided

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
    """Return the trip count from the step in the loop's head, or else from one in its block."""
    if node.update is not None:
        return counted(body, node)
    counts = (counted(body, stepped) for stepped in with_step(node))
    count = next((count for count in counts if count is not None), None)
    # Behind the step the counter is elsewhere.
    return None if count is None else replace(count, within={})


def _open_trips(unit: Unit, block: tuple[ir.Stmt, ...]) -> int:
    """Return the most trips that the kernel's limits leave; open outer loops have as many."""
    work = _work(block)
    work_left = (_MAX_WORK - unit.work) // _SHARE
    together = min(_MAX_TOGETHER // (unit.told * _trips(block)), work_left // (unit.told * work))
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
