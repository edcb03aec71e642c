"""Run a graph on several backends and measure, pass by pass, how far each differs from the reference.

>>> import numpy as np
>>> import passgraph as pg
>>> halve = pg.kernel(source="def halve(color: Image) -> vec4: return color[0, 0] * 0.5")
>>> report = compare(halve(pg.Input("frame")), ["reference"], frame=np.ones((2, 3, 4), np.float32))
>>> report.within_bounds, report.backends[0].targets[0].max_error
(True, 0.0)
>>> report.passed, report.bit_for_bit  # `Report.difference` says where not
(True, True)
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from passgraph.arguments import function, one_of, real, several
from passgraph.backends.base import Backend, Promises
from passgraph.backends.registry import compared_backends, open_backend
from passgraph.errors import DeviceMissingError, InputError, PassgraphError
from passgraph.graph.targets import Outputs, checked_size, named_outputs
from passgraph.language.native import MATH, Math
from passgraph.plan.data import Plan
from passgraph.verify.kinds import first_other_kind, other_kinds
from passgraph.verify.oracle.allowed import Allowed
from passgraph.verify.oracle.interval import Interval
from passgraph.verify.oracle.pass_bounds import Key, Passes, Picture
from passgraph.verify.oracle.time_limit import TimeLimit
from passgraph.verify.oracle.watch import Cause, Watch
from passgraph.verify.report import (
    MOST_AMBIGUOUS,
    MOST_UNPROMISED,
    BackendReport,
    Difference,
    Report,
    TargetReport,
    other_bits,
)

__all__ = ["MOST_AMBIGUOUS", "BackendReport", "Difference", "Report", "TargetReport", "compare", "compared", "distance"]


def compare(
    outputs: Outputs,
    backends: Iterable[str | Backend] | None = None,
    *,
    size: tuple[int, int] | None = None,
    math: Math = "exact",
    progress: Callable[[str], None] = lambda _: None,
    most_ambiguous: float = MOST_AMBIGUOUS,
    most_seconds: float | None = None,
    **inputs: Any,
) -> Report:
    """Run a graph on backends and compare every target of every pass with the bounds of a conforming backend.

    Each pass of each backend reads the reference's pictures, so a difference belongs to that pass; accumulated errors
    are reported separately.  The bounds come from :mod:`passgraph.verify.oracle`.

    Parameters
    ----------
    outputs
        As for :func:`passgraph.compile`.
    backends
        Names or open backends; default: every installed one.
    size
        (width, height) of the output in pixels, as for :func:`passgraph.compile`.
    math
        ``"native"``: backends call their device's own functions; bounds follow from its specification.
    progress
        Called with a description of the current work, and how much of a pass's bounds has been computed.
    most_ambiguous
        Largest share of a target's pixels, 0 to 1, that may be ambiguous; with more there is no verdict.
    most_seconds
        Time limit for computing bounds, all passes together, less the reference's own run time; a target with pixels
        beyond it is undecided.  The reference always runs to its end.  None: no limit; the time grows with the pixels,
        and with the outcomes of their kernels' decisions.
    **given
        Inputs and values of the run, by name.

    Raises
    ------
    GraphError, InputError
        As for compiling and running; errors of a tested backend are in its report instead.
    """
    function(progress, "progress of compare")
    if backends is not None:
        expected = "names of backends, or open ones"
        backends = several(backends, (str, Backend), "backends of compare", expected, InputError)
    most_ambiguous = real(most_ambiguous, "most_ambiguous of compare", 0.0, 1.0, error=InputError)
    if most_seconds is not None:
        most_seconds = real(most_seconds, "most_seconds of compare", 0.0, error=InputError)
    bounded = None if size is None else checked_size(size, "the output")
    limit = TimeLimit(most_seconds, lambda name, done, count: progress(f"bounds of {name}: {done / count:.0%}"))
    typed = cast("Math", one_of(math, "math of compare", MATH, InputError))
    passes = Passes(named_outputs(outputs), bounded, [inputs], limit, math=typed)
    chosen = backends if backends is not None else compared_backends()
    return compared(passes, chosen, progress, most_ambiguous)


def compared(
    passes: Passes,
    backends: Iterable[str | Backend],
    progress: Callable[[str], None] = lambda _: None,
    most_ambiguous: float = MOST_AMBIGUOUS,
) -> Report:
    """Compare backends for one run of a graph that is already planned."""
    comparison = _Comparison(passes, progress, most_ambiguous)
    return Report(tuple(comparison.judged(backend) for backend in backends), passes.plan, comparison.difference)


class _Comparison:
    """Compare one graph on several backends, one after the other."""

    def __init__(self, passes: Passes, progress: Callable[[str], None], most_ambiguous: float) -> None:
        self.passes, self.progress, self.most_ambiguous = passes, progress, most_ambiguous
        #: Name of the first backend that ran, and what it computed from its own pictures; the others are compared with
        #: it.
        self.first: tuple[str, dict[Key, Picture]] | None = None
        self.difference: Difference | None = None
        self._differing: Key | None = None
        self._watches: dict[Promises, dict[int, Watch]] = {}

    def judged(self, chosen: str | Backend) -> BackendReport:
        """Open a backend, run it and measure it; its exceptions become its report."""
        name = chosen if isinstance(chosen, str) else chosen.name
        try:
            backend = open_backend(chosen) if isinstance(chosen, str) else chosen
        except DeviceMissingError as error:
            return BackendReport(name, missing=str(error))
        except PassgraphError as error:
            return BackendReport(name, failed=str(error))
        try:
            self.progress("reference and bounds")
            self.passes.allowed(backend.promises)
            self.progress(name)
            try:
                (pictures,), (judged,) = (
                    self.passes.written(backend),
                    self.passes.written(backend, self._expected(backend)),
                )
            except PassgraphError as error:
                return BackendReport(name, failed=str(error))
            except Exception as error:  # from a third-party backend
                return BackendReport(name, failed=f"{type(error).__name__}: {error}")
        finally:
            if isinstance(chosen, str):
                backend.close()
        self._hold_against_first(name, pictures)
        return BackendReport(name, self._measured(judged, pictures, backend.promises))

    def _expected(self, backend: Backend) -> dict[Key, Picture]:
        return self.passes.allowed(backend.promises)[0]

    def _hold_against_first(self, name: str, pictures_of_backend: dict[Key, Picture]) -> None:
        """Record the first target that differs from the first backend's; any two that differ, differ from it in one of
        them."""
        if self.first is None:
            self.first = name, pictures_of_backend
            return
        plan, (first, pictures) = self.passes.plan, self.first
        for key, picture in pictures_of_backend.items():
            if self._differing is not None and key[1] >= self._differing[1]:
                return
            differ = other_bits(pictures[key], picture)
            if not differ.any():
                continue
            apart = np.where(differ, distance(pictures[key], picture).max(axis=2), -1.0)
            row, column = (int(i) for i in np.unravel_index(np.argmax(apart), apart.shape))
            values = [tuple(float(v) for v in pixels[row, column]) for pixels in (pictures[key], picture)]
            self._differing = key
            self.difference = Difference(
                plan.steps[key[1]].name, plan.resources[key[2]].name, (first, name), int(differ.sum()),
                float(differ.mean()), (column, row), (values[0], values[1]),
            )  # fmt: skip
            return

    def _measured(
        self, judged: dict[Key, Picture], full_pictures: dict[Key, Picture], promises: Promises
    ) -> tuple[TargetReport, ...]:
        """Return the figures of every target; explain the values of another kind, and the first undecided target."""
        plan, (expected, allowed) = self.passes.plan, self.passes.allowed(promises)
        reports = {
            key: _measured(plan, key, judged[key], expected[key], allowed[key], full_pictures[key], self.most_ambiguous)
            for key in expected
        }
        other = other_kinds(judged, expected, allowed)
        undecided = [key for key, target in reports.items() if not target.decided][:1]
        both = {key: pixels for key in reports if (pixels := _both_not_finite(judged[key], expected[key])).any()}
        first_both = next(iter(both), None)
        told_both = [] if first_both is None else [first_both]
        watches = self._watches_of(promises, {key[1] for key in (*other, *undecided, *told_both)})
        for key in told_both:
            kind = first_other_kind(self.passes, key, both[key], judged[key], expected, watches[key[1]])
            reports[key] = replace(reports[key], non_finite=replace(kind, both=True))
        for key, pixels in other.items():
            kind = first_other_kind(self.passes, key, pixels, judged[key], expected, watches[key[1]])
            reports[key] = replace(reports[key], other_kind=kind)
        for key in undecided:
            reports[key] = replace(reports[key], places=_places(reports[key], watches[key[1]]))
        return tuple(reports.values())

    def _watches_of(self, promises: Promises, steps: set[int]) -> dict[int, Watch]:
        """Return the watches of steps; those made for an earlier backend are reused."""
        known = self._watches.setdefault(promises, {})
        known |= self.passes.watched(promises, sorted(steps - known.keys()))
        return known


def _both_not_finite(got: Picture, expected: Picture) -> NDArray[np.bool_]:
    return np.asarray((~np.isfinite(got) & ~np.isfinite(expected)).any(axis=2))


def _places(target: TargetReport, watch: Watch) -> tuple[tuple[Cause, int], ...]:
    """List the causes that leave a target undecided, with their number of pixels."""
    if target.ambiguous > target.most_ambiguous:
        return tuple(watch.decisions.most_common())
    if target.is_vague and target.unpromised <= max(target.most_ambiguous, MOST_UNPROMISED):
        return tuple(watch.imprecise.most_common())
    opened = {cause: len(np.unique(np.concatenate(parts))) for cause, parts in watch.opened.items()}
    return tuple(sorted(opened.items(), key=lambda item: -item[1]))


def distance(picture: Picture, reference: Picture) -> NDArray[np.float64]:
    """Return the distance of values; 0 for the same infinity or two NaN, infinite if only one is."""
    a, b = np.asarray(picture, np.float64), np.asarray(reference, np.float64)
    with np.errstate(invalid="ignore"):
        apart = np.abs(a - b)
    apart = np.where(np.isnan(apart), np.inf, apart)
    return np.where((a == b) | (np.isnan(a) & np.isnan(b)), 0.0, apart)


def _measured(
    plan: Plan,
    key: Key,
    got: Picture,
    reference: Picture,
    allowed: Allowed,
    full_picture: Picture,
    most_ambiguous: float,
) -> TargetReport:
    step, resource = plan.steps[key[1]], plan.resources[key[2]]
    apart = distance(got, reference)
    beyond = allowed.values.without(got)
    score = np.where(beyond, apart, -1.0) if beyond.any() else apart
    row, column, channel = (int(i) for i in np.unravel_index(np.argmax(score), score.shape))
    accumulated = distance(full_picture, reference)
    return TargetReport(
        step.name,
        resource.name,
        resource.format,
        float(apart.max()),
        _rmse(apart),
        float((apart > 0).any(axis=2).mean()),
        float(beyond.any(axis=2).mean()),
        float((allowed.ambiguous & ~allowed.unpromised).mean()),
        float(allowed.unpromised.mean()),
        tuple(allowed.names.most_common()),
        (column, row),
        float(got[row, column, channel]),
        float(reference[row, column, channel]),
        float(allowed.values.lo[row, column, channel]),
        float(allowed.values.hi[row, column, channel]),
        float(np.median(allowed.values.width)),
        float(accumulated.max()),
        _rmse(accumulated),
        most_ambiguous=most_ambiguous,
        untried=allowed.untried,
        spread=_spread(reference),
        bound_share=_bound_share(got, reference, allowed.values),
    )


def _bound_share(got: Picture, reference: Picture, bounds: Interval) -> float:
    """Return the largest distance of a number from the reference's, relative to the distance of its bound."""
    number, expected = np.asarray(got, np.float64), np.asarray(reference, np.float64)
    with np.errstate(invalid="ignore", divide="ignore"):
        error = np.abs(number - expected)
        share = error / np.abs(np.where(number > expected, bounds.hi, bounds.lo) - expected)
    return float(np.max(share, initial=0.0, where=np.isfinite(error) & (error > 0.0)))


def _spread(picture: Picture) -> float:
    """Return the span of finite values without the outermost twentieths, or their size if that is more."""
    finite = np.asarray(picture, np.float64)[np.isfinite(picture)]
    if not finite.size:
        return float("inf")
    low, middle, high = np.percentile(finite, (5, 50, 95))
    return float(max(high - low, abs(middle)))


def _rmse(apart: NDArray[np.float64]) -> float:
    return float(np.sqrt(np.mean(apart * apart)))
