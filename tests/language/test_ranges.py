"""Bounds of ints hold for whatever comes in: a footprint beyond its bounds would leave memory."""

from __future__ import annotations

import random

import numpy as np
import pytest
from evaluate import Evaluator

from passgraph.language import scalar as s
from passgraph.language.emitter import Emitter
from passgraph.language.types import FLOAT, INT

INTS = (
    0,
    1,
    -1,
    2,
    3,
    -5,
    7,
    31,
    32,
    63,
    64,
    255,
    65_535,
    -65_536,
    2**30,
    2**31 - 1,
    2**31 - 2,
    -(2**31),
    -(2**31) + 1,
)
FLOATS = (0.0, -0.0, 0.5, -0.75, 1.0, 3.0, -7.5, 1e-40, 16_777_217.0, 2147483520.0, -2147483648.0, 3e9, 3.4e38, -3.4e38,
          np.inf, -np.inf, np.nan)  # fmt: skip
OF_INTS = ("add", "sub", "mul", "min", "max", "floor_divide", "int_mod", "bit_and", "bit_or", "bit_xor", "shift_left",
           "shift_right")  # fmt: skip
OF_FLOATS = ("add", "sub", "mul", "min", "max")
SLOTS = {"int": s.UniformSlot("int", INT, "int", 0, 4), "float": s.UniformSlot("float", FLOAT, "float", 0, 4)}
ALONE = {"int": ("neg", "abs"), "float": ("neg", "abs", "floor", "ceil", "trunc", "round")}


class Drawn:
    """Operations drawn by a seed on parameters that hold anything."""

    def __init__(self, seed: int) -> None:
        self.random, self.emitter = random.Random(seed), Emitter()
        self.values: dict[str, list[s.Operand]] = {
            kind: [self.emitter.uniform(slot, s.Lit("int", i)) for i in range(4)] for kind, slot in SLOTS.items()
        }
        index = self.emitter.fresh("int")
        self.emitter.ranges[index.id] = (-3, 12)
        self.index = index
        self.emitter.begin()
        self.values["int"].append(index)
        for _ in range(24):
            self.grow()

    def operand(self, kind: str) -> s.Operand:
        if self.random.random() < 0.4:
            return s.Lit(kind, self.random.choice(INTS if kind == "int" else tuple(map(float, FLOATS))))
        return self.random.choice(self.values[kind])

    def grow(self) -> None:
        e, kind = self.emitter, self.random.choice(("int", "int", "float"))
        one, other = self.operand(kind), self.operand(kind)
        form = self.random.choice(("two", "two", "two", "one", "choice", "cast"))
        if form == "two":
            made = e.op(self.random.choice(OF_INTS if kind == "int" else OF_FLOATS), one, other)
        elif form == "one":
            made = e.op(self.random.choice(ALONE[kind]), one)
        elif form == "choice":
            made = e.choose(e.op("less", one, other), self.operand(kind), self.operand(kind))
        else:
            kind = "float" if kind == "int" else "int"
            made = e.op("to_int" if kind == "int" else "to_float", one)
        self.values[kind].append(made)

    def program(self) -> s.ScalarProgram:
        body = (*self.emitter.blocks[0], s.For(self.index, -3, 13, 1, tuple(self.emitter.blocks[1])))
        return s.ScalarProgram("k", "pixel", body, (), None, (), tuple(SLOTS.values()), (), (), ())


class Watching(Evaluator):
    """Holds every value of every trip against its bounds."""

    def __init__(self, drawn: Drawn, **blocks: np.ndarray) -> None:
        self.drawn = drawn
        super().__init__(drawn.program(), 1, None, **blocks)

    def put(self, to: s.Val, value: np.ndarray) -> None:
        super().put(to, value)
        found, bounds = float(self.values[to.id][0]), self.drawn.emitter.bounds.range_of(to)
        if np.isnan(found):
            assert bounds.nan, (to, self.drawn.emitter.made.get(to.id))
        else:
            assert bounds.low <= found <= bounds.high, (to, found, bounds, self.drawn.emitter.made.get(to.id))


@pytest.mark.sampled
@pytest.mark.parametrize("seed", range(60))
def test_every_value_lies_within_its_bounds(seed: int) -> None:
    drawn = Drawn(seed)
    for _ in range(6):
        Watching(
            drawn,
            int=np.array([drawn.random.choice(INTS) for _ in range(4)], np.int32),
            float=np.array([drawn.random.choice(FLOATS) for _ in range(4)], np.float32),
        )


@pytest.mark.parametrize("seed", range(60))
def test_ints_lie_no_farther_apart_than_is_said(seed: int) -> None:
    """Sums of a place and small numbers: what they have in common falls out of their difference."""
    r, e = random.Random(seed), Emitter()
    places = [e.uniform(SLOTS["int"], s.Lit("int", i)) for i in range(3)]

    def near(place: s.Operand) -> s.Operand:
        made = place
        for _ in range(r.randint(0, 4)):
            other = e.op("max", e.op("min", r.choice(places), s.Lit("int", r.choice((3, 9)))), s.Lit("int", -2))
            by = r.choice((s.Lit("int", r.choice((1, -1, 4, 100, -7))), other))
            made = e.op(r.choice(("add", "sub", "add", "min", "max", "mul")), made, by)
        return made

    pairs = [(near(places[0]), near(places[r.choice((0, 0, 0, 1))])) for _ in range(6)]
    program = s.ScalarProgram("k", "pixel", tuple(e.blocks[0]), (), None, (), (SLOTS["int"],), (), (), ())
    for _ in range(8):
        held = Evaluator(program, 1, None, int=np.array([r.choice(INTS) for _ in range(4)], np.int32))
        for high, low in pairs:
            assert int(held.get(high)[0]) - int(held.get(low)[0]) <= e.bounds.apart(high, low)


def test_bounds_say_as_much_as_they_can() -> None:
    """Otherwise loops are refused that end."""
    e = Emitter()
    n, x = (e.uniform(SLOTS[kind], s.Lit("int", 0)) for kind in ("int", "float"))

    def lit(value: float) -> s.Lit:
        return s.Lit("int" if isinstance(value, int) else "float", value)

    def clamped(value: s.Operand, low: float, high: float) -> s.Operand:
        return e.op("min", e.op("max", value, lit(low)), lit(high))

    assert e.range_of(clamped(n, 2, 9)) == (2, 9)
    assert e.range_of(e.op("bit_and", n, lit(63))) == (0, 63)
    assert e.range_of(e.op("int_mod", n, lit(10))) == (0, 9)
    assert e.range_of(e.op("shift_right", n, lit(24))) == (-128, 127)
    assert e.range_of(e.op("to_int", clamped(x, 1.5, 8.0))) == (0, 8)  # NaN gives 0
    assert e.range_of(e.op("to_int", e.op("mul", clamped(x, 0.0, 1.0), lit(8.5)))) == (0, 8)
    assert e.range_of(e.op("min", n, lit(9))) is None
    assert e.bounds.range_of(e.op("min", n, lit(9))).high == 9
    assert e.bounds.apart(e.op("add", n, lit(8)), n) == 8
    assert e.bounds.apart(e.op("min", e.op("add", n, lit(8)), e.op("neg", n)), e.op("max", n, lit(0))) == 8
    assert e.bounds.apart(e.op("sub", n, lit(8)), n) > 2**31  # where it wraps
