"""Loops and switches of other languages, for front-ends: conversion to bounded loops and branches."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from passgraph.language import ir
from passgraph.language.meanings import INT_MIN, wrap32
from passgraph.language.source import Span
from passgraph.language.types import BOOL, FLOAT, INT

if TYPE_CHECKING:
    from passgraph.language.function_body import Builder

#: Emits statements into the builder's current block.
Emit: TypeAlias = Callable[[], None]
#: Emits the computation of a condition, and returns it.
Test: TypeAlias = Callable[[], ir.Expr]

#: Most iterations to search for; loops may not make more.
MAX_COUNTED = 1 << 16


def bounded_loop(
    builder: Builder,
    most: int,
    body: Emit,
    span: Span,
    *,
    before: Test | None = None,
    update: Emit | None = None,
    after: Test | None = None,
) -> None:
    """Emit ``for (; before; update) body`` or ``do body while (after)``, with at most ``most`` iterations.

    Parameters
    ----------
    builder
        Gets the loop in its current block.
    most
        Iterations after which the loop ends, without another update or test.
    body
        Emits the body, which may contain ``ir.Break`` and ``ir.Continue``.
    before, after
        The condition before an iteration, and the one for another iteration after it; it is tested after a continue
        too. None: always true.
    update
        Emits the code between two iterations, also after a continue.
    """
    trip = builder.fresh("trip")

    def unless(test: Test) -> None:
        stop = ir.Apply(BOOL, "logical_not", (test(),), span)
        builder.emit(ir.If(stop, (ir.Break(span),), (), span))

    def between() -> None:
        if update is not None:
            update()
        if after is not None:
            unless(after)

    def whole() -> None:
        # At the start of an iteration, so that a continue gets there as well.
        follows = builder.captured(between, span)
        if follows:
            later = ir.Apply(BOOL, "greater", (ir.Local(INT, trip, span), _int_literal(0, span)), span)
            builder.emit(ir.If(later, follows, (), span))
        if before is not None:
            unless(before)
        body()

    statements = builder.captured(whole, span)
    builder.emit(ir.For(trip, _int_literal(0, span), _int_literal(most, span), _int_literal(1, span), statements, span))


def _int_literal(number: int, span: Span) -> ir.Literal:
    return ir.Literal(INT, number, span)


# Iterations of a counter

_COMPARES: dict[str, Callable[[Any, Any], Any]] = {
    "less": np.less, "less_equal": np.less_equal, "greater": np.greater, "greater_equal": np.greater_equal,
    "equal": np.equal, "not_equal": np.not_equal,
}  # fmt: skip
MIRRORED = {"less": "greater", "less_equal": "greater_equal", "greater": "less", "greater_equal": "less_equal"}
_STEPS = {"add": np.add, "sub": np.subtract, "mul": np.multiply, "div": np.divide}


def count_trips(counter: str, first: ir.Expr, condition: ir.Expr, following: ir.Expr) -> int | None:
    """Count the iterations of ``for (counter = first; condition; counter = following)`` with a body that leaves the
    counter.

    The counter is an int or a float; each step adds, subtracts, multiplies by or (for floats) divides by a known
    number; the condition compares it with a known number.  Floats are computed in float32, rounded at every step, as at
    run time.  None for other loops, and for more than :data:`MAX_COUNTED` iterations.

    >>> from passgraph.language.typing_rules import apply
    >>> x, tenth = ir.Local(FLOAT, "x"), ir.Literal(FLOAT, 0.1)
    >>> below = apply("less", [x, ir.Literal(FLOAT, 1.0)], ir.Literal(FLOAT, 0.0).span)
    >>> count_trips("x", ir.Literal(FLOAT, 0.0), below, apply("add", [x, tenth], tenth.span))
    10
    """
    start, compared, stepped = _number(first), _by_number(counter, condition), _by_number(counter, following)
    if start is None or compared is None or stepped is None or first.type not in (INT, FLOAT):
        return None
    (name, bound, bound_first), (step_name, step, step_first) = compared, stepped
    if step_first and step_name not in ("add", "mul"):
        return None
    name = MIRRORED.get(name, name) if bound_first else name
    if name not in _COMPARES or step_name not in _STEPS or (first.type is INT and step_name == "div"):
        return None
    values = _values(first.type is FLOAT, start, _STEPS[step_name], step)
    holds = _COMPARES[name](values, values.dtype.type(bound))
    return None if holds.all() else int(np.argmin(holds))


def _values(is_float: bool, start: float, step: Any, by: float) -> Any:
    """Return the counter's value in each examined trip, and after the last."""
    with np.errstate(all="ignore"):
        if is_float:
            numbers = np.full(MAX_COUNTED + 1, by, np.float32)
            numbers[0] = start
            return step.accumulate(numbers)
        if step is not np.multiply:
            return wrap32(step(np.int64(start), np.arange(MAX_COUNTED + 1) * int(by)))
        values = [int(start)]
        for _ in range(MAX_COUNTED):
            values.append((values[-1] * int(by) - INT_MIN) % 2**32 + INT_MIN)
        return np.array(values)


def _number(expression: ir.Expr) -> float | None:
    if isinstance(expression, ir.Apply) and expression.operation == "neg":
        number = _number(expression.arguments[0])
        return None if number is None else -number
    return expression.value if isinstance(expression, ir.Literal) else None


def _by_number(counter: str, expression: ir.Expr) -> tuple[str, float, bool] | None:
    """Return an operation on the counter and a known number of its type, and True if the number comes first."""
    if not isinstance(expression, ir.Apply) or len(expression.arguments) != 2:
        return None
    numbers = [_number(argument) for argument in expression.arguments]
    for place, number in enumerate(numbers):
        other = expression.arguments[1 - place]
        if number is not None and isinstance(other, ir.Local) and other.name == counter:
            return expression.operation, number, place == 0
    return None


# Switches


@dataclass(frozen=True)
class Section:
    """Statements of a switch with some labels; without a break at their end the next section follows."""

    labels: tuple[int, ...]
    body: tuple[ir.Stmt, ...]
    default: bool = False


def switch(builder: Builder, subject: ir.Expr, sections: Sequence[Section], span: Span) -> None:
    """Emit ``switch (subject) { case 0: …; break; case 1: case 2: …; default: … }`` into the builder's current block.

    Breaks in sections leave the switch; continues go on with the enclosing loop.
    """
    name = builder.fresh("subject")
    builder.emit(ir.Assign(name, subject, span))
    value, all_labels = ir.Local(INT, name, span), [label for section in sections for label in section.labels]

    def any_of(labels: Sequence[int]) -> ir.Expr:
        is_label: ir.Expr = ir.Literal(BOOL, False, span)
        for label in labels:
            equal = ir.Apply(BOOL, "equal", (value, _int_literal(label, span)), span)
            is_label = ir.Apply(BOOL, "logical_or", (is_label, equal), span)
        return is_label

    def matches(section: Section) -> ir.Expr:
        here = any_of(section.labels)
        if not section.default:
            return here
        nowhere = ir.Apply(BOOL, "logical_not", (any_of(all_labels),), span)
        return ir.Apply(BOOL, "logical_or", (here, nowhere), span)

    joined = _joined(sections)
    if all(_is_separate(section, section is joined[-1]) for section in joined):
        rest: tuple[ir.Stmt, ...] = ()
        for section in reversed(joined):
            body = section.body[:-1] if section.body and isinstance(section.body[-1], ir.Break) else section.body
            rest = (ir.If(matches(section), body, rest, span),)
        for statement in rest:
            builder.emit(statement)
    else:
        _fall_through(builder, [(matches(section), section.body) for section in joined], span)


def _joined(sections: Sequence[Section]) -> list[Section]:
    """Merge labels without statements into the next section."""
    joined: list[Section] = []
    waiting = Section((), ())
    for section in sections:
        section = Section(waiting.labels + section.labels, section.body, waiting.default or section.default)
        waiting = Section((), ())
        if section.body:
            joined.append(section)
        else:
            waiting = section
    return joined


def _is_separate(section: Section, last: bool) -> bool:
    """Return True if a section leaves the switch at its end and nowhere else."""
    ends = bool(section.body) and isinstance(section.body[-1], (ir.Break, ir.Continue))
    return (ends or last) and not ir.jumps(section.body[:-1] if ends else section.body, ir.Break)


def _fall_through(builder: Builder, sections: Sequence[tuple[ir.Expr, tuple[ir.Stmt, ...]]], span: Span) -> None:
    """Emit a loop of one iteration, which breaks leave; an entered section continues into the next."""
    entered, goes_on = builder.fresh("entered"), builder.fresh("goes_on")
    for name in (entered, goes_on):
        builder.emit(ir.Assign(name, ir.Literal(BOOL, False, span), span))
    inside = ir.Local(BOOL, entered, span)

    def once() -> None:
        for matches, body in sections:
            builder.emit(ir.Assign(entered, ir.Apply(BOOL, "logical_or", (inside, matches), span), span))
            builder.emit(ir.If(inside, _without_continues(body, goes_on), (), span))

    statements = builder.captured(once, span)
    builder.emit(
        ir.For(
            builder.fresh("once"), _int_literal(0, span), _int_literal(1, span), _int_literal(1, span), statements, span
        )
    )
    if any(_without_continues(body, goes_on) != body for _, body in sections):
        builder.emit(ir.If(ir.Local(BOOL, goes_on, span), (ir.Continue(span),), (), span))


def _without_continues(statements: tuple[ir.Stmt, ...], flag: str) -> tuple[ir.Stmt, ...]:
    """Replace a continue, which refers to the enclosing loop, by a flag and a break."""
    rewritten: list[ir.Stmt] = []
    for s in statements:
        if isinstance(s, ir.Continue):
            rewritten += [ir.Assign(flag, ir.Literal(BOOL, True, s.span), s.span), ir.Break(s.span)]
        elif isinstance(s, ir.If):
            then, orelse = (_without_continues(branch, flag) for branch in (s.then, s.orelse))
            rewritten.append(ir.If(s.condition, then, orelse, s.span))
        else:
            rewritten.append(s)
    return tuple(rewritten)
