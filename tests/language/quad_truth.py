"""What derivatives mean, step by step: four pixels of a quad walk through a kernel beside each other.

Written apart from ``passgraph/language/quad_derivatives.py``, which moves the same into kernels: here states are
copied and every pixel walks, forward, whether anything needs it or not.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from passgraph.backends.reference.interpreter import Interpreter, NumberDomain
from passgraph.backends.reference.stage import BoundStage, Builtins, _Lanes, constant
from passgraph.language import ir
from passgraph.language.builtin_name import WHOLE_PIXEL
from passgraph.language.function_body import Builder

BIT = {"x": 1, "y": 2}
Mask = NDArray[np.bool_]
#: Of each pixel of the quad that walks, by how it lies to the one that leads at the top, its variables.
States = dict[int, dict[str, Any]]


@contextmanager
def walking() -> Iterator[None]:
    """Kernels defined inside keep their derivatives as they were parsed, and the reference walks through them."""
    derivatives: dict[str, str] = {}

    def body(builder: Builder) -> tuple[ir.Stmt, ...]:
        if builder.stage == "pixel":
            derivatives.update(builder.derivatives)
        return tuple(builder.blocks[0])

    def run(stage: BoundStage, count: int, builtins: Builtins) -> tuple[list[NDArray[Any]], None]:
        return Walk(stage, derivatives, builtins).results(), None

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Builder, "body", body)
        patch.setattr(BoundStage, "run", run)
        yield


class Walk:
    """One run of a kernel over all pixels of a picture."""

    def __init__(self, stage: BoundStage, derivatives: Mapping[str, str], builtins: Builtins) -> None:
        self.program, self.derivatives, self.domain = stage.program, derivatives, NumberDomain()
        x, y = builtins[WHOLE_PIXEL]().T
        self.odd = {"x": x % 2 == 1, "y": y % 2 == 1}
        self.count = len(x)
        self.pixels: list[Interpreter[Any, Any]] = []
        for pixel in range(4):
            place = np.stack([x ^ (pixel & 1), y ^ (pixel >> 1)], axis=1)
            around = _Lanes(stage, {**builtins, WHOLE_PIXEL: constant(place)})
            self.pixels.append(Interpreter(self.program, self.domain, around))

    def results(self) -> list[NDArray[Any]]:
        states: States = {pixel: {} for pixel in range(4)}
        with np.errstate(all="ignore"):
            self.block(self.program.body, states, 0, np.ones(self.count, bool), [])
            shape = (self.count, 4)
            return [np.broadcast_to(self.value(result.value, 0, states), shape) for result in self.program.results]

    def value(self, expression: ir.Expr, pixel: int, states: States) -> Any:
        self.pixels[pixel].locals = states[pixel]
        return self.pixels[pixel].value(expression)

    def block(
        self, statements: Iterable[ir.Stmt], states: States, leader: int, active: Mask, broken: list[Mask]
    ) -> Mask:
        """Walk in the active lanes as the leader goes; gives those that reach the end."""
        for statement in statements:
            if isinstance(statement, ir.Assign):
                self.assign(statement, states, active)
            elif isinstance(statement, (ir.Break, ir.Continue)):
                if isinstance(statement, ir.Break):
                    broken[-1] |= active
                return np.zeros_like(active)
            elif isinstance(statement, ir.If) and jumps(statement):
                active = self.branch(statement, states, leader, active, broken)
            else:
                found = {}
                for pixel in states:
                    others = states if self.holds(statement) else {pixel: states[pixel]}
                    inner = {other: dict(state) for other, state in others.items()}
                    if isinstance(statement, ir.If):
                        self.branch(statement, inner, pixel, active, broken)
                    else:
                        self.loop(statement, inner, pixel, active)
                    found[pixel] = inner[pixel]
                states.update(found)
        return active

    def assign(self, statement: ir.Assign, states: States, active: Mask) -> None:
        axis = self.derivatives.get(statement.name)
        made = {}
        for pixel in states:
            if axis is None:
                made[pixel] = self.value(statement.value, pixel, states)
            elif pixel | BIT[axis] in states and pixel & ~BIT[axis] in states:
                pair = (pixel & ~BIT[axis], pixel | BIT[axis])
                here, there = (self.value(statement.value, other, states) for other in pair)
                odd = self.odd[axis].reshape(-1, *[1] * (np.ndim(here) - 1))
                made[pixel] = np.where(odd, here - there, there - here)
        for pixel, value in made.items():
            old = states[pixel].get(statement.name)
            states[pixel][statement.name] = value if old is None else self.domain.merge(active, value, old)

    def branch(self, statement: ir.If, states: States, leader: int, active: Mask, broken: list[Mask]) -> Mask:
        condition = np.broadcast_to(self.value(statement.condition, leader, states), active.shape)
        # One after the other, each in its lanes: what the other assigns there stays out of them.
        then = self.block(statement.then, states, leader, active & condition, broken)
        return then | self.block(statement.orelse, states, leader, active & ~condition, broken)

    def loop(self, statement: ir.For, states: States, leader: int, active: Mask) -> None:
        bounds = (statement.start, statement.stop, statement.step)
        for index, over in self.domain.trips(*(self.value(bound, leader, states) for bound in bounds)):
            active = active & ~over
            for state in states.values():
                state[statement.name] = index
            broken = [np.zeros_like(active)]
            self.block(statement.body, states, leader, active, broken)
            active = active & ~broken[0]

    def holds(self, statement: ir.Stmt) -> bool:
        if isinstance(statement, ir.Assign):
            return statement.name in self.derivatives
        return any(map(self.holds, inside(statement)))


def inside(statement: ir.Stmt) -> tuple[ir.Stmt, ...]:
    if isinstance(statement, ir.If):
        return (*statement.then, *statement.orelse)
    return statement.body if isinstance(statement, ir.For) else ()


def jumps(statement: ir.Stmt) -> bool:
    """Whether a jump leads out of it."""
    if isinstance(statement, (ir.Break, ir.Continue)):
        return True
    return isinstance(statement, ir.If) and any(map(jumps, inside(statement)))
