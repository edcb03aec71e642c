"""Loops and switches of other languages, put together from bounded ones, against the same loops in Python."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import pytest
from evaluate import Evaluator

from passgraph.language import ir
from passgraph.language.function_body import Builder
from passgraph.language.looping import Section, bounded_loop, count_trips, switch
from passgraph.language.lower import lower
from passgraph.language.source import NOWHERE
from passgraph.language.types import BOOL, FLOAT, INT
from passgraph.language.typing_rules import apply

COUNT = 24
X = ir.Builtin(INT, "x")


def whole(number: int) -> ir.Literal:
    return ir.Literal(INT, number)


def of(name: str) -> ir.Expr:
    return ir.Local(INT, name)


def op(name: str, one: ir.Expr, other: ir.Expr) -> ir.Expr:
    return apply(name, [one, other], NOWHERE)


class Text(Builder):
    """A kernel of ints ``i`` and ``t`` that begin with 0."""

    def __init__(self) -> None:
        super().__init__("pixel")
        self.set("i", whole(0))
        self.set("t", whole(0))

    def set(self, name: str, value: ir.Expr) -> None:
        self.emit(ir.Assign(name, value))

    def add(self, name: str, value: ir.Expr) -> None:
        self.set(name, op("add", of(name), value))

    def when(self, condition: ir.Expr, *statements: ir.Stmt) -> None:
        self.emit(ir.If(condition, statements, ()))

    def results(self) -> list[list[int]]:
        """``i`` and ``t`` at the end, for each ``x`` from 0 on."""
        made = tuple(ir.Result(n, FLOAT, apply("to_float", [of(n)], NOWHERE)) for n in ("i", "t"))
        program = lower(ir.TypedKernel("k", "pixel", (), tuple(self.blocks[0]), made))
        found = Evaluator(program, COUNT, None, x=np.arange(COUNT)).outputs()
        return [[int(i), int(t)] for i, t in zip(found[0][0], found[1][0], strict=True)]


def looped(most: int, test_first: bool) -> list[list[int]]:
    text = Text()

    def body() -> None:
        text.when(op("equal", op("int_mod", of("i"), whole(3)), whole(1)), ir.Continue())
        text.when(op("greater", of("t"), whole(20)), ir.Break())
        text.add("t", of("i"))
        if not test_first:
            text.add("i", whole(1))

    def test() -> ir.Expr:
        if not test_first:
            text.add("i", whole(1))
        return op("less", of("i"), X)

    if test_first:
        bounded_loop(text, most, body, NOWHERE, before=test, update=lambda: text.add("i", whole(1)))
    else:
        bounded_loop(text, most, body, NOWHERE, after=test)
    return text.results()


def test_a_for_loop_updates_and_tests_after_a_continue() -> None:
    expected = []
    for x in range(COUNT):
        i = t = 0
        while i < x:
            if i % 3 != 1:
                if t > 20:
                    break
                t += i
            i += 1
        expected.append([i, t])
    assert looped(40, test_first=True) == expected


def test_a_do_loop_tests_behind_the_first_trip_and_after_a_continue() -> None:
    expected = []
    for x in range(COUNT):
        i = t = 0
        while True:
            if i % 3 != 1:
                if t > 20:
                    break
                t, i = t + i, i + 1
            i += 1
            if not i < x:
                break
        expected.append([i, t])
    assert looped(40, test_first=False) == expected


def test_a_loop_ends_behind_its_last_trip() -> None:
    text = Text()
    bounded_loop(
        text, 5, lambda: text.add("t", X), NOWHERE, before=lambda: ir.Literal(BOOL, True),
        update=lambda: text.add("i", whole(1)),
    )  # fmt: skip
    assert text.results() == [[4, 5 * x] for x in range(COUNT)]


INTS: Sequence[tuple[int, str, int, str, int]] = (
    (0, "less", 10, "add", 1), (0, "less", 10, "add", 3), (10, "greater_equal", 0, "sub", 2), (0, "less", 0, "add", 1),
    (1, "less", 1000, "mul", 2), (2**31 - 3, "greater", 0, "add", 1), (0, "not_equal", 65_536, "add", 1),
    (5, "equal", 5, "add", 1), (-(2**31), "less_equal", -(2**31) + 9, "add", 4), (1, "not_equal", 0, "mul", -65_536),
)  # fmt: skip
FLOATS: Sequence[tuple[float, str, float, str, float]] = (
    (0.0, "less", 1.0, "add", 0.1), (0.0, "less", 1.0, "add", 0.01), (1.0, "greater", 0.001, "mul", 0.9),
    (0.0, "less_equal", 6.2831853, "add", 0.19634954), (3.0, "greater", -3.0, "sub", 0.7),
    (9.0, "greater", 0.1, "div", 3.0),
    (0.0, "less", 30.0, "add", 0.001), (1.0, "less", float("inf"), "mul", 4.0), (0.0, "less", float("nan"), "add", 1.0),
    (16_777_210.0, "less", 16_777_215.5, "add", 1.0),
)  # fmt: skip
PYTHON: dict[str, Callable[..., object]] = {
    "less": lambda a, b: a < b, "less_equal": lambda a, b: a <= b, "greater": lambda a, b: a > b,
    "greater_equal": lambda a, b: a >= b, "equal": lambda a, b: a == b, "not_equal": lambda a, b: a != b,
    "add": lambda a, b: a + b, "sub": lambda a, b: a - b, "mul": lambda a, b: a * b, "div": lambda a, b: a / b,
}  # fmt: skip


@pytest.mark.parametrize(("first", "compare", "bound", "step", "by"), [*INTS, *FLOATS])
def test_trips_are_those_that_the_counter_makes(first: float, compare: str, bound: float, step: str, by: float) -> None:
    type_ = INT if isinstance(first, int) else FLOAT
    kind = np.int32 if type_ is INT else np.float32
    held, trips, expected = kind(first), 0, None
    with np.errstate(all="ignore"):
        while PYTHON[compare](held, kind(bound)) and trips <= 65_536:
            held, trips = kind(PYTHON[step](held, kind(by))), trips + 1
    expected = trips if trips <= 65_536 else None
    counter, bound_, by_ = ir.Local(type_, "i"), ir.Literal(type_, bound), ir.Literal(type_, by)
    condition, following = op(compare, counter, bound_), ir.Apply(type_, step, (counter, by_))
    assert count_trips("i", ir.Literal(type_, first), condition, following) == expected


def test_what_is_no_progression_has_no_count() -> None:
    i, n, one = of("i"), of("n"), whole(1)
    up, below = op("add", i, one), op("less", i, whole(9))
    assert count_trips("i", whole(0), op("greater", whole(9), i), up) == 9
    assert count_trips("i", whole(0), below, op("sub", i, apply("neg", [one], NOWHERE))) == 9
    assert count_trips("i", n, below, up) is None
    assert count_trips("i", whole(0), op("less", i, n), up) is None
    assert count_trips("i", whole(0), below, op("add", n, one)) is None
    assert count_trips("i", whole(0), below, op("sub", one, i)) is None
    assert count_trips("i", whole(0), below, op("sub", i, one)) is None  # as far as it wraps
    assert count_trips("i", whole(0), below, op("bit_or", i, one)) is None


def adds(number: int) -> ir.Stmt:
    return ir.Assign("t", op("add", op("mul", of("t"), whole(10)), whole(number)))


def switched(*sections: Section) -> list[int]:
    """``t`` where ``x`` is switched on in a loop of two trips; a trip that goes on adds nothing to ``i``."""
    text = Text()

    def body() -> None:
        switch(text, X, sections, NOWHERE)
        text.add("i", whole(1))

    bounded_loop(text, 2, body, NOWHERE)
    return [100 * t + i for i, t in text.results()[:6]]


def test_a_switch_takes_the_section_of_its_label() -> None:
    stop = ir.Break()
    found = switched(
        Section((1,), (adds(1), stop)), Section((2,), ()), Section((4,), (adds(2), stop)), Section((), (adds(3),), True)
    )
    assert found == [3302, 1102, 2202, 3302, 2202, 3302]


def test_sections_without_a_break_fall_through() -> None:
    stop = ir.Break()
    early = ir.If(op("equal", of("t"), whole(0)), (stop,), ())
    found = switched(
        Section((1,), (adds(1),)), Section((), (adds(2), early, ir.If(op("equal", X, whole(5)), (stop,), ())), True),
        Section((3,), (adds(3), stop)), Section((4,), (adds(4),)),
    )  # fmt: skip
    assert found == [232302, 12312302, 232302, 3302, 4402, 2202]


def test_a_continue_in_a_switch_means_the_loop_around() -> None:
    goes_on = ir.Continue()
    assert switched(Section((1,), (adds(1), goes_on)), Section((2,), (adds(2),)))[:3] == [2, 1100, 2202]
    fallen = switched(Section((1,), (adds(1),)), Section((2,), (adds(2), goes_on)), Section((3,), (adds(3),)))
    assert fallen[:4] == [2, 121200, 2200, 3302]
