"""Find the causes of wide bounds: uncertain decisions of a kernel, and operations where NaN or infinity may first
arise.

This takes time, so the oracle does it for one step at a time, on request
(:meth:`passgraph.verify.oracle.pass_bounds.Passes.watched`).
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from passgraph.backends.reference.interpreter import Interpreter, Surroundings
from passgraph.language import ir
from passgraph.language.source import NOWHERE, Span
from passgraph.plan.data import Step
from passgraph.verify.oracle.decisions import Track
from passgraph.verify.oracle.domain import IntervalDomain
from passgraph.verify.oracle.interval import Bounded, Interval, Lanes

Ints = NDArray[np.int64]


@dataclass(frozen=True)
class Cause:
    """An operation at a place in a kernel's text.

    >>> str(Cause("sqrt", Span("own.py", 7, 4, 8, "y = sqrt(x)")))
    'sqrt (own.py:7)'
    """

    operation: str
    span: Span = NOWHERE

    def __str__(self) -> str:
        return self.operation if self.span.line == 0 else f"{self.operation} ({self.span.file}:{self.span.line})"


@dataclass(eq=False)
class Watch:
    """Observations of one step, along the first path of each pixel.

    Attributes
    ----------
    decisions : operations with an uncertain decision, and in how many pixels (of a draw: fragments)
    opened : operations whose result may be NaN or infinite although no argument is, with their pixels, numbered row by
        row; in the order in which the kernel computes them
    imprecise : operations whose result is as uncertain as its size although no argument is, and in how many pixels
    """

    step: Step
    decisions: Counter[Cause] = field(default_factory=Counter)
    opened: dict[Cause, list[Ints]] = field(default_factory=dict)
    imprecise: Counter[Cause] = field(default_factory=Counter)

    def opened_at(self, pixel: int) -> tuple[Cause, ...]:
        return tuple(cause for cause, parts in self.opened.items() if any((part == pixel).any() for part in parts))


class WatchedInterpreter(Interpreter[Bounded, Lanes]):
    """Records the bounds of each operation; ``pixels`` maps the stage's lanes to pixels."""

    domain: IntervalDomain

    def __init__(
        self, program: ir.TypedKernel, domain: IntervalDomain, around: Surroundings[Bounded], watch: Watch, pixels: Ints
    ) -> None:
        super().__init__(program, domain, around)
        self.watch, self.pixels = watch, pixels

    @property
    def track(self) -> Track:
        return self.domain.track

    def value(self, expression: ir.Expr) -> Bounded:
        if not isinstance(expression, ir.Apply):
            return super().value(expression)
        arguments = [self.value(argument) for argument in expression.arguments]
        names, doubt = self.track.names.copy(), _vague_count(self.track)
        result = self.domain.apply(expression.operation, arguments)
        for name, count in (self.track.names - names).items():
            self.watch.decisions[Cause(name, expression.span)] += count
        wider = _vague_count(self.track) - doubt
        if wider:
            self.watch.decisions[Cause(expression.operation, expression.span)] += wider
        cause = Cause(expression.operation, expression.span)
        if len(opened := self._fresh(_special, arguments, result)):
            self.watch.opened.setdefault(cause, []).append(self.pixels[self.track.lanes[opened]])
        if count := len(self._fresh(_imprecise, arguments, result)):
            self.watch.imprecise[cause] += count
        return result

    def _fresh(
        self, marked: Callable[[Interval], Lanes], arguments: Sequence[Bounded], result: Bounded
    ) -> NDArray[np.intp]:
        """Return the active lanes whose result is marked although no argument is."""
        if not isinstance(result, Interval):
            return np.zeros(0, np.intp)
        fresh = marked(result)
        for argument in arguments:
            if isinstance(argument, Interval):
                fresh = fresh & ~marked(argument)
        return np.flatnonzero(np.broadcast_to(fresh, self.track.lanes.shape) & self.track.active)


def _imprecise(a: Interval) -> Lanes:
    """Return the lanes with a component that is wider than a quarter of its size."""
    with np.errstate(all="ignore"):
        wide = a.hi - a.lo > 0.25 * np.fmax(np.abs(a.lo), np.abs(a.hi))
    return np.asarray(wide.reshape(len(a), -1).any(axis=1))


def _vague_count(track: Track) -> int:
    """Return the number of lanes that met a jump with too many ways to try."""
    return int((track.wide | track.vague | track.lost).sum())


def _special(a: Interval) -> Lanes:
    """Return the lanes with a component that may be NaN or infinite."""
    special = a.nan | np.isnan(a.lo) | np.isinf(a.lo) | np.isinf(a.hi)
    return np.asarray(special.reshape(len(a), -1).any(axis=1))
