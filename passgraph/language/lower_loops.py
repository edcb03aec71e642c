"""Lower loops: short ones are unrolled, others stay.

A loop with bounds from data becomes one with the most iterations that they allow (:mod:`.value_ranges`), which exits
when the actual number of iterations is reached.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from passgraph.language import ir
from passgraph.language import scalar as s
from passgraph.language.facts import Facts
from passgraph.language.meanings import INT_MAX
from passgraph.language.source import fail
from passgraph.records import dataclass

if TYPE_CHECKING:
    from passgraph.language.lower import Lowering

#: A loop is unrolled up to this many iterations …
MAX_UNROLLED_TRIPS = 64
#: … as long as its copies have fewer instructions than this.  Longer ones run no faster than loops and compile more
#: slowly (a soft shadow whose penumbrae took 10,000: 2.8 against 2.3 s on llvmpipe, its frame 0.85 of the time).
MAX_UNROLLED_INSTRUCTIONS = 1_500
#: Most instructions from all unrolled loops of a program, including those inside loops that stay.  A program whose
#: loops became 5,000 took numpy 8.4 s to compile and PoCL 7.2; with 3,000 it takes 2.2 and 4.7, and runs as fast.
MAX_UNROLLED_TOGETHER = 3_000
#: Most iterations of loops, nested ones multiplied; longer ones would hang a driver.
MAX_TRIPS = 1 << 16
#: If a kernel is compiled for the size of its target, a small target may make more: up to this many per pixel, which
#: visit every texel of 3840x2160 …
MAX_LONE_TRIPS = 1 << 23
#: … and all its pixels together up to this many: 16 pixels of them.
MAX_TARGET_TRIPS = 1 << 27
#: Most instructions of one pixel, over all iterations of loops; proportionally more where more iterations are allowed.
MAX_WORK = 1 << 24
INSTRUCTIONS_A_LONE_TRIP = 32
#: Larger limits on iterations count as unknown.
ANY_NUMBER = 1 << 30


def most_trips(program: ir.TypedKernel, facts: Facts) -> int:
    """Return the most iterations that nested loops of one pixel can make together.

    The number of fragments of a draw is unknown in advance, as is the target of a kernel not compiled for its size.
    """
    if program.stage != "pixel" or facts.size is None:
        return MAX_TRIPS
    width, height = facts.size
    return max(MAX_TRIPS, min(MAX_LONE_TRIPS, MAX_TARGET_TRIPS // (width * height)))


def most_work(program: ir.TypedKernel, facts: Facts) -> int:
    """Return the most instructions that one pixel can take."""
    return max(MAX_WORK, INSTRUCTIONS_A_LONE_TRIP * most_trips(program, facts))


@dataclass(frozen=True)
class Trips:
    """A loop with bounds from data: its most iterations, its iteration count, and its index."""

    most: int
    value: s.Operand
    start: s.Operand
    step: s.Operand
    reach: tuple[float, float]


class Loops:
    """The loops of one kernel being lowered."""

    def __init__(self, lowering: Lowering) -> None:
        self.lowering, self.emitter = lowering, lowering.emitter
        self.around: list[dict[tuple[str, int], str]] = []  # variables of the enclosing loops, innermost last
        self.trips = 1  # iterations of the enclosing loops together
        self.most = most_trips(lowering.program, lowering.facts)

    def lower(self, statement: ir.For) -> None:
        bounds = [self.lowering.value(b)[0] for b in (statement.start, statement.stop, statement.step)]
        start, stop, step = bounds
        if isinstance(step, s.Lit) and step.value == 0:
            fail(statement.span, "the step of range() is 0")
        if all(isinstance(b, s.Lit) for b in bounds):
            trips = range(*(int(b.value) for b in bounds if isinstance(b, s.Lit)))
            self._check(statement, len(trips), "makes")
            if trips and not self._unroll(statement, trips):
                self._loop(statement, trips, None)
        else:
            counted = self._count(statement, start, stop, step)
            if counted.most:
                self._loop(statement, range(counted.most), counted)

    def _check(self, statement: ir.For, trips: int, makes: str) -> None:
        if trips * self.trips > self.most:
            around = "" if self.trips == 1 else f" inside loops of {self.trips}"
            fail(
                statement.span,
                f"this loop {makes} {trips} trips{around}; at most {self.most} are allowed together",
            )

    # Unrolled loops

    def _unroll(self, statement: ir.For, trips: range) -> bool:
        """Unroll the loop; give up if all copies together are, or after the first would be, too long."""
        e, shared, lowering = self.emitter, self.lowering.shared, self.lowering
        if not e.simplify or len(trips) > MAX_UNROLLED_TRIPS or ir.jumps(statement.body):
            return False
        before, length, ids = dict(lowering.locals), len(e.blocks[-1]), e.ids
        known_values, unrolled, grown = dict(e.known[-1]), shared.unrolled, 0
        self.trips *= len(trips)
        for count, i in enumerate(trips, 1):
            lowering.locals[statement.name] = [s.Lit("int", i)]
            start = len(e.blocks[-1])
            lowering.block(statement.body)
            grown += s.count(e.blocks[-1][start:])
            expected = grown * len(trips) if count == 1 else grown
            if expected > min(MAX_UNROLLED_INSTRUCTIONS, MAX_UNROLLED_TOGETHER - unrolled):
                lowering.locals, e.known[-1], shared.unrolled = before, known_values, unrolled
                e.back_to(ids)
                del e.blocks[-1][length:]
                self.trips //= len(trips)
                return False
        shared.unrolled = unrolled + grown  # nested loops, which have counted themselves, once
        self.trips //= len(trips)
        return True

    # Loops that stay

    def _loop(self, statement: ir.For, counted: range, trips: Trips | None) -> None:
        """Emit a loop over ``counted``; with ``trips`` it counts those, and exits when they are done."""
        e, lowering = self.emitter, self.lowering
        carried = self._carry(statement)
        count = e.fresh("int")
        e.ranges[count.id] = (min(counted[0], counted[-1]), max(counted[0], counted[-1]))
        e.begin()
        outer = dict(lowering.locals)
        lowering.locals[statement.name] = [count if trips is None else self._index(count, trips)]
        for (name, i), variable in carried.items():
            lowering.locals[name] = list(lowering.locals[name])
            lowering.locals[name][i] = e.read(variable)
        self.around.append(carried)
        self.trips *= len(counted)
        lowering.block(statement.body)
        self.trips //= len(counted)
        self.around.pop()
        if not leaves(e.blocks[-1]):
            for (name, i), variable in carried.items():
                e.push(s.Write(variable, lowering.locals[name][i]))
        body = e.end()
        e.push(s.For(count, counted.start, counted.stop, counted.step, tuple(body)))
        lowering.locals = outer
        for (name, i), variable in carried.items():
            lowering.locals[name] = list(lowering.locals[name])
            lowering.locals[name][i] = e.read(variable)

    def _carry(self, statement: ir.For) -> dict[tuple[str, int], str]:
        """Return a variable for each number carried from one iteration to the next."""
        carried: dict[tuple[str, int], str] = {}
        for name in names_assigned(statement.body):
            for i, value in enumerate(self.lowering.locals.get(name, [])):
                carried[name, i] = self.emitter.variable(value.type)
                self.emitter.push(s.Write(carried[name, i], value))
        return carried

    # Bounds from data

    def _count(self, statement: ir.For, start: s.Operand, stop: s.Operand, step: s.Operand) -> Trips:
        """Return the most iterations of a loop, and the value of its iteration count."""
        e, zero = self.emitter, s.Lit("int", 0)
        least, most = e.bounds.range_of(step)[:2]
        rise = max(0.0, e.trip_bounds.apart(stop, start)) if most >= 1 else 0.0
        fall = max(0.0, e.trip_bounds.apart(start, stop)) if least <= -1 else 0.0
        trips = int(max(math.ceil(rise / max(least, 1)), math.ceil(fall / max(-most, 1))))
        if trips > ANY_NUMBER:
            fail(
                statement.span,
                f"this loop may make any number of iterations: {self._unlimited(start, stop, rise > ANY_NUMBER)}; a "
                "bound that is not known when the graph is compiled needs a limit that is; or write a constant bound "
                "and a break",
            )
        self._check(statement, trips, "may make")
        # The distance of the ends, from which iterations are counted, must not overflow.
        if max(rise, fall) > INT_MAX:
            fail(statement.span, f"the ends of this loop may be more than {INT_MAX} apart; limit them with clamp()")
        value: s.Operand = zero
        if rise:
            value = self._trips(start, stop, step)
            if least <= 0:
                value = e.choose(e.op("greater", step, zero), value, zero)
        if fall:
            back = e.op("neg", e.op("max", step, s.Lit("int", -INT_MAX)))
            value = e.choose(e.op("less", step, zero), self._trips(stop, start, back), value)
        return Trips(trips, value, start, step, self._reach(start, stop, bool(rise), bool(fall)))

    def _unlimited(self, start: s.Operand, stop: s.Operand, rises: bool) -> str:
        """Say which ends of a loop are unlimited, and how to limit them."""
        low, high = ("start", "stop") if rises else ("stop", "start")
        bounds = {"start": self.emitter.bounds.range_of(start), "stop": self.emitter.bounds.range_of(stop)}
        ends = []
        if bounds[low].low < -ANY_NUMBER:
            ends.append(f"its {low} has no lower limit, as max({low}, 0) has")
        if bounds[high].high > ANY_NUMBER:
            ends.append(f"its {high} has no upper limit, as min({high}, 64) has")
        return " and ".join(ends) or "its ends may be any distance apart"

    def _trips(self, low: s.Operand, high: s.Operand, step: s.Operand) -> s.Operand:
        """Return the iterations of a positive step from one end up to the other; 0 if they are in the wrong order.

        In the right order nothing wraps: their distance fits an int.
        """
        e, one = self.emitter, s.Lit("int", 1)
        between = e.op("sub", high, low)
        if not (isinstance(step, s.Lit) and step.value == 1):
            between = e.op("add", e.op("floor_divide", e.op("sub", between, one), step), one)
        return e.choose(e.op("less", low, high), between, s.Lit("int", 0))

    def _reach(self, start: s.Operand, stop: s.Operand, rises: bool, falls: bool) -> tuple[float, float]:
        """Return the range of the index; ``stop`` is excluded."""
        first, end = self.emitter.bounds.range_of(start), self.emitter.bounds.range_of(stop)
        low = min([first.low] * rises + [end.low + 1] * falls, default=0)
        return low, max([end.high - 1] * rises + [first.high] * falls, default=0)

    def _index(self, count: s.Operand, trips: Trips) -> s.Operand:
        """Return the index of an iteration, after the exit from the loop.

        It is clamped to its range in every lane, including idle ones: footprints depend on it.
        """
        e = self.emitter
        e.push(s.If(e.op("greater_equal", count, trips.value), (s.Break(),), ()))
        index = e.op("add", trips.start, e.op("mul", count, trips.step))
        low, high = trips.reach
        index_range = e.bounds.range_of(index)
        if index_range.high > high:
            index = e.op("min", index, s.Lit("int", int(high)))
        if index_range.low < low:
            index = e.op("max", index, s.Lit("int", int(low)))
        return index


def names_assigned(statements: tuple[ir.Stmt, ...]) -> list[str]:
    """Return each name once, in an order independent of the names."""
    return list(dict.fromkeys(assigned.name for assigned in ir.assignments(statements)))


def leaves(block: list[s.Instruction] | tuple[s.Instruction, ...]) -> bool:
    """Return True if nothing after this block runs: it ends in a jump, or in branches that both do."""
    if not block:
        return False
    last = block[-1]
    if isinstance(last, s.If):
        return leaves(last.then) and leaves(last.orelse)
    return isinstance(last, (s.Break, s.Continue))
