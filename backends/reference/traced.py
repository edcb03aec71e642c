"""One lane of a kernel, line by line: what variables take, which branches are taken, how often loops go round."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import Any, TypeAlias

import numpy as np

from passgraph.backends.reference.domain import Surroundings
from passgraph.backends.reference.interpreter import Interpreter
from passgraph.backends.reference.number_domain import Lanes, NumberDomain, Numbers
from passgraph.backends.reference.stage import BoundStage, Builtins
from passgraph.language import ir
from passgraph.language.library import LIBRARY
from passgraph.language.source import Span

#: Trips of a loop that are kept at its beginning, and as many at its end.
KEPT_TRIPS = 2


@dataclass(frozen=True)
class Taken:
    """A variable takes a value, or a function returns one (``name`` is then empty, or the field of a result)."""

    span: Span
    name: str
    value: Any
    returns: bool = False


@dataclass(frozen=True)
class Branch:
    """An ``if``: whether its condition held."""

    span: Span
    holds: bool


@dataclass
class Loop:
    """A ``for``: how many trips it made; the first and the last :data:`KEPT_TRIPS` of them with their indices."""

    span: Span
    name: str
    count: int = 0
    trips: list[tuple[int, list[Event]]] = field(default_factory=list)


Event: TypeAlias = Taken | Branch | Loop

_VARIABLE = re.compile(r"(\w+)\.\d+((?:\.\w+)*)")
_RESULT = re.compile(r"\w+\.result\.\d+((?:\.\w+)*)")


class Traced(Interpreter[Numbers, Lanes]):
    """The interpreter over one lane, which notes what it does in the words of the source."""

    def __init__(self, program: ir.TypedKernel, domain: NumberDomain, around: Surroundings[Numbers]) -> None:
        super().__init__(program, domain, around)
        self.events: list[Event] = []
        self._open = [self.events]
        self._loops: list[Loop] = []

    def _note(self, event: Event) -> None:
        # What the language itself is written in is no line of the user's.
        if event.span.line and event.span.file != LIBRARY:
            self._open[-1].append(event)

    def _assign(self, statement: ir.Assign, active: Lanes) -> None:
        super()._assign(statement, active)
        value = plain(self.locals[statement.name])
        if found := _VARIABLE.fullmatch(statement.name):
            self._note(Taken(statement.span, found[1] + found[2], value))
        elif found := _RESULT.fullmatch(statement.name):
            self._note(Taken(statement.span, found[1][1:], value, returns=True))

    def _if(self, statement: ir.If, active: Lanes) -> Lanes:
        if not _of_returns(statement.condition):
            self._note(Branch(statement.span, bool(self.value(statement.condition)[0])))
        return super()._if(statement, active)

    def _for(self, statement: ir.For, active: Lanes) -> None:
        found = _VARIABLE.fullmatch(statement.name)
        loop = Loop(statement.span, found[1] if found else statement.name)
        self._note(loop)
        self._loops.append(loop)
        depth = len(self._open)
        super()._for(statement, active)
        del self._open[depth:]
        self._loops.pop()

    def _trip(self, statement: ir.For, index: Numbers) -> None:
        super()._trip(statement, index)
        loop, events = self._loops[-1], list[Event]()
        if loop.count:
            self._open.pop()
        loop.count += 1
        loop.trips.append((int(index[0]), events))
        if len(loop.trips) > 2 * KEPT_TRIPS:
            del loop.trips[KEPT_TRIPS]
        self._open.append(events)


def traced(bound: BoundStage, builtins: Builtins) -> tuple[list[Event], list[Numbers]]:
    """One lane of a stage: what happened in it, and its results."""
    made: list[Traced] = []

    def make(*parts: Any) -> Traced:
        made.append(Traced(*parts))
        return made[0]

    results, _ = bound.run(1, builtins, make)
    return made[0].events, results


def _of_returns(condition: ir.Expr) -> bool:
    """Whether a condition asks if the function has returned already, which no line of the source says."""
    if isinstance(condition, ir.Apply) and condition.operation == "logical_not":
        condition = condition.arguments[0]
    return isinstance(condition, ir.Local) and ".returned." in condition.name


def plain(value: Numbers) -> Any:
    """The value of the only lane: a number, or nested tuples (of a matrix by columns)."""

    def tuples(part: Any) -> Any:
        return tuple(map(tuples, part)) if isinstance(part, list) else part

    return tuples(np.asarray(value[0]).tolist())
