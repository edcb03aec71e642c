"""Runs a graph on several backends and says by how much they differ from the reference, pass by pass.

>>> import numpy as np
>>> import passgraph as pg
>>> halve = pg.kernel(source="def halve(color: Image) -> vec4: return color[0, 0] * 0.5")
>>> report = compare(halve(pg.Input("frame")), ["reference"], frame=np.ones((2, 3, 4), np.float32))
>>> report.within_bounds, report.backends[0].targets[0].max_error
(True, 0.0)
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from passgraph.arguments import function, several
from passgraph.backends.base import Backend
from passgraph.backends.registry import backend_names, open_backend
from passgraph.errors import DeviceMissingError, InputError, PassgraphError
from passgraph.formats import Format
from passgraph.graph.outputs import Outputs, named_outputs
from passgraph.graph.targets import checked_size
from passgraph.plan.data import Plan
from passgraph.verify.oracle.backend import Allowed, outside
from passgraph.verify.oracle.passes import Key, Passes, Picture

#: Share of pixels of a target that may be ambiguous before its verdict says little.
MOST_AMBIGUOUS = 0.05


@dataclass(frozen=True)
class TargetReport:
    """What one pass wrote into one target on one backend, given the reference's pictures to work on.

    Attributes
    ----------
    step, target : names
    format : of the target
    max_error, rmse : against the reference, of all values of all channels
    differing : share of pixels whose values are not the very same
    outside : share of pixels with a value that no conforming backend may have
    ambiguous : share of pixels where rounding may turn a decision, and the outcomes lie apart
    decisions : operations that rounding may turn, and in how many pixels, most first
    worst : (column, row) of the pixel that is farthest outside; where none is, of the largest error
    worst_got, worst_expected, worst_low, worst_high : values of the channel that is worst there, and what is allowed
    median_width : half of all intervals are narrower than this
    accumulated_max, accumulated_rmse : on this backend's own pictures, with errors of earlier passes
    """

    step: str
    target: str
    format: Format
    max_error: float
    rmse: float
    differing: float
    outside: float
    ambiguous: float
    decisions: tuple[tuple[str, int], ...]
    worst: tuple[int, int]
    worst_got: float
    worst_expected: float
    worst_low: float
    worst_high: float
    median_width: float
    accumulated_max: float = 0.0
    accumulated_rmse: float = 0.0

    @property
    def within_bounds(self) -> bool:
        """Whether every value is one that a conforming backend may have."""
        return self.outside == 0.0

    @property
    def decided(self) -> bool:
        """Whether few enough pixels are ambiguous for the verdict to mean something."""
        return self.ambiguous <= MOST_AMBIGUOUS

    def __str__(self) -> str:
        column, row = self.worst
        verdict = "within its bounds" if self.within_bounds else f"outside its bounds at {self.outside:.3%} of pixels"
        return (
            f"pass {self.step}, target {self.target}: {verdict}; worst at column {column}, row {row}: "
            f"{self.worst_got:.9g} where the reference has {self.worst_expected:.9g} and {self.worst_low:.9g} to "
            f"{self.worst_high:.9g} is allowed"
        )


@dataclass(frozen=True)
class BackendReport:
    """One backend: its targets in schedule order, or why there are none."""

    name: str
    targets: tuple[TargetReport, ...] = ()
    missing: str = ""  # the driver or device is not here; what installs it
    failed: str = ""  # it was opened and then raised this

    @property
    def within_bounds(self) -> bool:
        """Whether it ran and every target is within bounds."""
        return bool(self.targets) and not self.failed and self.first_divergence is None

    @property
    def first_divergence(self) -> TargetReport | None:
        """The first target, in schedule order, that is beyond its bound."""
        return next((target for target in self.targets if not target.within_bounds), None)


@dataclass(frozen=True)
class Report:
    """All backends against the reference."""

    backends: tuple[BackendReport, ...]
    plan: Plan

    @property
    def within_bounds(self) -> bool:
        """Whether some backend ran and none diverges or failed; missing ones do not count."""
        ran = [report for report in self.backends if not report.missing]
        return bool(ran) and all(report.within_bounds for report in ran)


def compare(
    outputs: Outputs,
    backends: Iterable[str | Backend] | None = None,
    *,
    size: tuple[int, int] | None = None,
    progress: Callable[[str], None] = lambda _: None,
    **given: Any,
) -> Report:
    """Run a graph on backends and hold every target of every pass against what a conforming backend may compute.

    Each pass of each backend is given the reference's pictures to work on, so that a difference is that pass's
    own; errors that add up are reported beside it.  What is allowed comes from :mod:`passgraph.verify.oracle`.

    Parameters
    ----------
    outputs
        As for :func:`passgraph.compile`.
    backends
        Names or open backends; left out, every one that is installed.
    size
        (width, height) of the output in pixels, as for :func:`passgraph.compile`.
    progress
        Called with what is being done.
    **given
        Inputs and values of the run, by name.

    Raises
    ------
    GraphError, InputError
        As for compiling and running; what a tested backend raises is in its report.
    """
    function(progress, "progress of compare")
    if backends is not None:
        expected = "names of backends, or open ones"
        backends = several(backends, (str, Backend), "backends of compare", expected, InputError)
    passes = Passes(named_outputs(outputs), None if size is None else checked_size(size, "the output"), [given])
    chosen = backends if backends is not None else [n for n in backend_names() if n not in ("reference", "null")]
    return Report(tuple(_judged(passes, backend, progress) for backend in chosen), passes.plan)


def _judged(passes: Passes, chosen: str | Backend, progress: Callable[[str], None]) -> BackendReport:
    """One backend opened, run and measured; what it raises becomes its report."""
    name = chosen if isinstance(chosen, str) else chosen.name
    try:
        backend = open_backend(chosen) if isinstance(chosen, str) else chosen
    except DeviceMissingError as error:
        return BackendReport(name, missing=str(error))
    except PassgraphError as error:
        return BackendReport(name, failed=str(error))
    try:
        progress("reference and bounds")
        expected, allowed = passes.allowed(backend.snaps)
        progress(name)
        try:
            (whole,), (judged,) = passes.written(backend), passes.written(backend, expected)
        except PassgraphError as error:
            return BackendReport(name, failed=str(error))
    finally:
        if isinstance(chosen, str):
            backend.close()
    targets = [_measure(passes.plan, key, judged[key], expected[key], allowed[key], whole[key]) for key in expected]
    return BackendReport(name, tuple(targets))


def distance(picture: Picture, reference: Picture) -> NDArray[np.float64]:
    """How far values lie apart; 0 for the same infinity or two NaN, infinite where only one is."""
    a, b = np.asarray(picture, np.float64), np.asarray(reference, np.float64)
    with np.errstate(invalid="ignore"):
        apart = np.abs(a - b)
    apart = np.where(np.isnan(apart), np.inf, apart)
    return np.where((a == b) | (np.isnan(a) & np.isnan(b)), 0.0, apart)


def _measure(plan: Plan, key: Key, got: Picture, reference: Picture, allowed: Allowed, whole: Picture) -> TargetReport:
    step, resource = plan.steps[key[1]], plan.resources[key[2]]
    apart = distance(got, reference)
    beyond = outside(got, allowed.values)
    score = np.where(beyond, apart, -1.0) if beyond.any() else apart
    row, column, channel = (int(i) for i in np.unravel_index(np.argmax(score), score.shape))
    accumulated = distance(whole, reference)
    return TargetReport(
        step.name,
        resource.name,
        resource.format,
        float(apart.max()),
        _rmse(apart),
        float((apart > 0).any(axis=2).mean()),
        float(beyond.any(axis=2).mean()),
        float(allowed.ambiguous.mean()),
        tuple(allowed.names.most_common()),
        (column, row),
        float(got[row, column, channel]),
        float(reference[row, column, channel]),
        float(allowed.values.lo[row, column, channel]),
        float(allowed.values.hi[row, column, channel]),
        float(np.median(allowed.values.width)),
        float(accumulated.max()),
        _rmse(accumulated),
    )


def _rmse(apart: NDArray[np.float64]) -> float:
    return float(np.sqrt(np.mean(apart * apart)))
