"""Lower loops: count the trips of loops with a counter, and bound all others."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, TypeAlias

from passgraph.errors import KernelLengthError
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
    from passgraph.glsl.glsl_body import Body
    from passgraph.glsl.unit import Unit


#: Most candidate steps of a loop's counter, since each is checked against the whole block.
MOST_STEPS = 4


def with_step(node: g.Loop) -> Iterator[g.Loop]:
    """Yield ``for (; c; i++) { … }`` for each step ``i++`` in ``while (c) { … i++; … }``, or in ``do``.

    Such a loop makes as many trips if the rest of the block does not change the counter. Steps are excluded if the trip
    may end before them, if they depend on variables of the block, or if the condition does not read the counter. At
    most the first `MOST_STEPS` are tried.
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
    """Return True if a statement may ``continue`` the loop around it."""
    if isinstance(statement, g.Jump):
        return statement.kind == "continue"
    if isinstance(statement, g.Block):
        return any(map(_continues, statement.statements))
    if isinstance(statement, g.If):
        return any(_continues(one) for one in (statement.then, statement.orelse) if one is not None)
    cases = statement.cases if isinstance(statement, g.Switch) else ()
    return any(_continues(one) for case in cases for one in case.statements)


#: A component of a variable, by its name in the typed representation.
Component: TypeAlias = tuple[str, int]
#: Relative rounding of a float32 sum; a step smaller than that may not change the counter.
_LOST = 2.0**-23
#: Most statements before a loop that are searched for the values of its variables.
_LOOKED_BACK = 64


@dataclass(frozen=True)
class Count:
    """The trip count of a loop, an upper bound unless ``exact``; ``within`` is the counter's range in the body."""

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
        # The first trip of ``do`` has no test; if the test holds before it, the count is that of a ``while``.
        if exact is not None:
            return Count(exact, True, {}) if exact > 0 else None
        return None if bounded is None else Count(bounded.trips + 1, False, {})
    if exact is not None:
        return Count(exact, True, bounded.within if bounded else {})
    return bounded


def _fixed(body: Body, node: g.Loop) -> frozenset[str]:
    """Return the variables in a loop's condition that it does not change, by their names in the representation."""
    changed = assigned_names(node, partial(overloads, body.unit)) | set(body.unit.names)
    names = {one.name for one in walked(node.condition) if isinstance(one, g.Name)} - changed
    slots = [body.find(name) for name in names]
    return frozenset(slot.variable.name for slot in slots if isinstance(slot, Slot))


def _exactly(before: Sequence[ir.Stmt], condition: ir.Expr, updates: Sequence[ir.Stmt]) -> int | None:
    """Return the exact trip count for a counter that is a plain variable, if everything is constant."""
    first, following = before[-1] if before else None, updates[0] if len(updates) == 1 else None
    if not isinstance(first, ir.Assign) or not isinstance(following, ir.Assign) or first.name != following.name:
        return None
    return count_trips(first.name, constant(first.value), _settled(condition), _settled(following.value))


def _settled(value: ir.Expr) -> ir.Expr:
    """Return an operation with known operands replaced by their values."""
    if not isinstance(value, ir.Apply):
        return value
    return replace(value, arguments=tuple(map(constant, value.arguments)))


# By ranges


@dataclass(frozen=True)
class _Amount:
    """The range of a number; relative to the counter if it ``follows``."""

    range: Range
    follows: bool = False


_UNKNOWN = _Amount(ANY_FLOAT)


class _Amounts:
    """Ranges of components of expressions, from those of some variables; ``counter`` is the loop's counter."""

    def __init__(self, ranges: Mapping[Component, Range], counter: Component | None = None) -> None:
        self.known, self.counter = ranges, counter
        self.amounts: dict[str, list[_Amount]] = {}

    def run(self, statements: Sequence[ir.Stmt]) -> bool:
        """Apply assignments; return False if there are other statements."""
        for statement in statements:
            if not isinstance(statement, ir.Assign):
                return False
            self.amounts[statement.name] = self.amounts_in(statement.value)
        return True

    def come_to(self, statements: Sequence[ir.Stmt]) -> None:
        """Apply assignments; variables assigned in branches and loops become unknown."""
        for statement in statements:
            if isinstance(statement, ir.Assign):
                self.amounts[statement.name] = self.amounts_in(statement.value)
            else:
                self.amounts |= {one.name: [] for one in ir.assignments((statement,))}

    def amounts_in(self, value: ir.Expr) -> list[_Amount]:
        if isinstance(value.type, (Array, Matrix)) or element_of(value.type) is UINT:
            return [_UNKNOWN]
        count = component_count(value.type)
        if isinstance(value, ir.Literal):
            number = float(value.value)
            return [_Amount(of_number(number) if value.type is FLOAT else Range(number, number))]
        if isinstance(value, ir.Local):
            return self.amounts.get(value.name) or [self._component((value.name, i)) for i in range(count)]
        if isinstance(value, ir.Swizzle):
            amounts = self.amounts_in(value.value)
            return [amounts[i] for i in value.components]
        if isinstance(value, ir.Index) and isinstance(value.index, ir.Literal) and isinstance(value.value.type, Vector):
            return [self.amounts_in(value.value)[int(value.index.value)]]
        if isinstance(value, ir.Construct):
            return [amount for part in value.arguments for amount in self.amounts_in(part)]
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
        operands = [self.amounts_in(argument) for argument in value.arguments]
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
    # A sum of the counter and a number still follows the counter.
    a, b = ranges if len(ranges) == 2 else (ANY_FLOAT, ANY_FLOAT)
    if operation == "add" and not (parts[0].follows and parts[1].follows):
        return _following(a.low + b.low, a.high + b.high, a.nan or b.nan, of_floats)
    if operation == "sub" and not parts[1].follows:
        return _following(a.low - b.high, a.high - b.low, a.nan or b.nan, of_floats)
    return _UNKNOWN


def _following(low: float, high: float, nan: bool, of_floats: bool) -> _Amount:
    """Return a range relative to the counter, widened by the rounding of a float sum.

    The trip count accounts for the counter itself.
    """
    lost = _LOST * max(abs(low), abs(high)) if of_floats else 0.0
    return _Amount(Range(low - lost, high + lost, nan), follows=True)


def _bounded(
    ranges: Mapping[Component, Range],
    before: Sequence[ir.Stmt],
    tests: Sequence[ir.Stmt],
    updates: Sequence[ir.Stmt],
    fixed: frozenset[str],
) -> Count | None:
    """Return the most trips for a counter that grows, or shrinks, while the condition bounds it above, or below."""
    start = _Amounts(ranges)
    start.come_to(before[-_LOOKED_BACK:])
    for update in updates:
        if not isinstance(update, ir.Assign) or update.name not in start.amounts:
            continue
        for i, first in enumerate(start.amounts[update.name]):
            counter = (update.name, i)
            after, tested = _Amounts(ranges, counter), _Amounts(ranges, counter)
            tested.amounts |= {name: known_amounts for name, known_amounts in start.amounts.items() if name in fixed}
            if not after.run(updates) or not tested.run(tests[:-1]) or len(after.amounts[update.name]) <= i:
                continue
            step, last = after.amounts[update.name][i], tests[-1]
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
    """Yield the bounds of a condition: True for an upper bound, its farthest value, and the most distance of the
    compared expression from the counter."""
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
    (left,), (right,) = map(amounts.amounts_in, condition.arguments)
    operation = condition.operation
    if right.follows and not left.follows:
        left, right, operation = right, left, MIRRORED[operation]
    if left.follows and not right.follows:
        grows = operation.startswith("less")
        end = right.range.high - left.range.low if grows else right.range.low - left.range.high
        yield grows, end, max(abs(left.range.low), abs(left.range.high))


def _trips_between(first: Range, end: float, aside: float, step: _Amount, grows: bool, is_int: bool) -> int | None:
    """Return the most steps from a counter's start to an end; the compared expression is at most ``aside`` from it."""
    if not step.follows or first.nan or step.range.nan:
        return None
    by = step.range if grows else Range(-step.range.high, -step.range.low)
    way = end - first.low if grows else first.high - end
    least, farthest = by.low, max(abs(end), abs(first.low), abs(first.high))
    if is_int:
        if farthest + by.high + aside > INT_MAX:  # the counter would wrap around
            return None
    else:
        least -= _LOST * farthest
        way += _LOST * farthest
    if not (math.isfinite(way) and least > 0):
        return None
    trips = max(0, math.floor(way / least * (1 + _LOST)) + 1)
    return trips if trips <= MAX_COUNTED else None


#: Most trips of a loop with an unknown trip count, if its body is short.
MAX_OPEN = 1024
#: Least trips of such a loop; fewer, in nested loops, are an error, since the picture would be wrong.
MIN_OPEN = 16
#: Most trips of nested loops together, as in :mod:`passgraph.language.lower`.
_MAX_TOGETHER = 1 << 16
#: Most instructions of all loops of a shader with unknown trip counts, half of a pixel's limit. Each gets a quarter of
#: the rest, since the number of later ones is unknown.
_MAX_WORK = 1 << 23
_SHARE = 4


def emit_loop(body: Body, node: g.Loop) -> None:
    """Lower ``for``, ``while`` and ``do``."""
    unit, builder, span = body.unit, body.builder, node.span
    body.scopes.append({})
    if node.start is not None:
        body.statements.plain(node.start)
    count, around, outer = _counted(body, node), unit.trips, unit.counters
    if count is not None and not count.exact and count.trips > min(MAX_OPEN, _MAX_TOGETHER // around):
        count = None
    # An open loop's limit is set after its body is lowered; loops inside may need as many trips as the loop itself.
    unit.trips = around * max(1, math.isqrt(_MAX_TOGETHER // around) if count is None else count.trips)
    outer_trips, undecided = unit.known_trips, unit.undecided
    unit.known_trips, unit.undecided = (
        (outer_trips, undecided + 1) if count is None else (outer_trips * max(1, count.trips), undecided)
    )
    unit.counters = outer if count is None else {**outer, **count.within}
    body.heads.add(len(body.scopes))
    block = body.statements.inside(node, [node.body])
    body.heads.remove(len(body.scopes))
    unit.trips, unit.counters, unit.known_trips, unit.undecided = around, outer, outer_trips, undecided

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
            fail(span, f"{left}; give it and the loops around it ends that constants tell", KernelLengthError)
        unit.note(span, f"the end of this loop is not known here: it makes {most} trips at most")
    else:
        # One more, up to the end value, if the counter is visible after the loop.
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
    # After the step the counter is outside of its range.
    return None if count is None else replace(count, within={})


def _open_trips(unit: Unit, block: tuple[ir.Stmt, ...]) -> int:
    """Return the most trips that the kernel's limits leave; open outer loops have as many."""
    work = _work(block)
    work_left = (_MAX_WORK - unit.work) // _SHARE
    together = min(_MAX_TOGETHER // (unit.known_trips * _trips(block)), work_left // (unit.known_trips * work))
    trips = max(1, min(MAX_OPEN, math.floor(math.pow(together, 1 / (1 + unit.undecided)))))
    if unit.trips == 1:  # nested loops are counted in the outer one
        unit.work += trips * work
    return trips


def _trips(block: Iterable[ir.Stmt]) -> int:
    """Return the most trips of loops in a block, with nested ones multiplied."""
    most = 1
    for statement in block:
        if isinstance(statement, ir.If):
            most = max(most, _trips(statement.then), _trips(statement.orelse))
        elif isinstance(statement, ir.For):
            most = max(most, _count(statement) * _trips(statement.body))
    return most


def _count(loop: ir.For) -> int:
    """Return the trip count of a loop, also of the library's, whose bounds are constants."""
    bounds = [folded(bound) for bound in (loop.start, loop.stop, loop.step)]
    start, stop, step = (1 if bound is None else int(bound[0]) for bound in bounds)
    return max(1, len(range(start, stop, step or 1)))


def _work(block: Iterable[ir.Stmt]) -> int:
    """Estimate the instructions of a block, with all trips of its loops."""
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
    """Estimate the instructions of a value: one a scalar, about ten for functions such as ``sin``."""
    total = 0
    for part in ir.expressions(value):
        if isinstance(part, ir.Apply):
            operands = [part.type, *(argument.type for argument in part.arguments)]
            each = 1 if OPERATIONS[part.operation].kind == "primitive" else 10
            total += each * max(map(component_count, operands))
        elif isinstance(part, (ir.Select, ir.Texel, ir.Insert, ir.Index)):
            total += component_count(part.type)
    return total
