"""Results of :func:`passgraph.verify.compare.compare`: figures and a verdict for each backend and target."""

from __future__ import annotations

from dataclasses import dataclass
from html import escape

import numpy as np

from passgraph.formats import Format
from passgraph.plan.data import Plan
from passgraph.verify.kinds import OtherKind, numbers
from passgraph.verify.oracle.pass_bounds import Picture
from passgraph.verify.oracle.watch import Cause

#: Largest share of ambiguous pixels of a target; with more there is no verdict.
MOST_AMBIGUOUS = 0.05
#: Largest share of pixels of a target outside the documented domain of an operation; with more there is no verdict.
#: Test pictures have special values in a quarter of their pixels, and passes read neighborhoods.
MOST_UNPROMISED = 0.5
#: Bounds are vague if they span more than this share of the range of the target's values.
WIDEST_SHARE = 0.25
#: Bounds this narrow are never vague: steps of normalized formats, and float32's own precision.
NARROW_STEPS, NARROW = 4.0, 1e-6
#: Most decisions in a message, those of the most pixels.
MOST_DECISIONS = 3


@dataclass(frozen=True)
class TargetReport:
    """Result of one pass in one target on one backend, computed from the reference's pictures.

    Attributes
    ----------
    step, target : names
    format : of the target
    max_error, rmse : against the reference, over all values of all channels
    differing : share of pixels that are not equal to the reference
    outside : share of pixels with a value that no conforming backend may have
    ambiguous : share of pixels where rounding may change a decision and the outcomes differ
    unpromised : share of other pixels where the arguments of an operation are outside its documented domain
    decisions : operations with an uncertain decision, and in how many pixels, most first
    worst : (column, row) of the pixel farthest outside its bounds; if none is outside, of the largest error
    worst_got, worst_expected, worst_low, worst_high : values and bounds of the worst channel there
    median_width : median width of the bounds
    bound_share : the largest error of a value, relative to what its own bounds allow in that direction; 1 is the most
        that a conforming backend may have
    spread : range of the reference's values without the lowest and highest twentieth, or their size if that is more
    accumulated_max, accumulated_rmse : on this backend's own pictures, with the errors of earlier passes
    other_kind : NaN or infinity in place of numbers, or the reverse, within bounds and not explained by a decision
    most_ambiguous : largest share of ambiguous pixels; with more there is no verdict
    non_finite : NaN or infinity in both pictures
    untried : pixels (of a draw: fragments) whose bounds were not computed within the time limit
    places : for the first undecided target: decisions with their lines of the kernel, and in how many pixels
    """

    step: str
    target: str
    format: Format
    max_error: float
    rmse: float
    differing: float
    outside: float
    ambiguous: float
    unpromised: float
    decisions: tuple[tuple[str, int], ...]
    worst: tuple[int, int]
    worst_got: float
    worst_expected: float
    worst_low: float
    worst_high: float
    median_width: float
    accumulated_max: float = 0.0
    accumulated_rmse: float = 0.0
    other_kind: OtherKind | None = None
    most_ambiguous: float = MOST_AMBIGUOUS
    untried: int = 0
    places: tuple[tuple[Cause, int], ...] = ()
    spread: float = np.inf
    non_finite: OtherKind | None = None
    bound_share: float = 0.0

    @property
    def is_vague(self) -> bool:
        """True if the bounds are so wide, compared with the values, that nearly any picture would pass."""
        narrow = NARROW_STEPS / self.format.steps if self.format.steps else NARROW
        return self.most_ambiguous < 1.0 and self.median_width > max(WIDEST_SHARE * self.spread, narrow)

    @property
    def within_bounds(self) -> bool:
        """True if every value is within the bounds of a conforming backend."""
        return self.outside == 0.0

    @property
    def decided(self) -> bool:
        """True if all pixels were checked, and few enough are ambiguous for a meaningful verdict."""
        return (
            not self.untried
            and not self.is_vague
            and self.ambiguous <= self.most_ambiguous
            and self.unpromised <= max(self.most_ambiguous, MOST_UNPROMISED)
        )

    @property
    def passed(self) -> bool:
        """True if the target is within bounds, decided, and of the reference's kind everywhere."""
        return self.within_bounds and self.other_kind is None and self.decided

    @property
    def verdict(self) -> str:
        """Return the verdict in a few words."""
        if not self.within_bounds:
            return f"outside {self.outside:.3%}"
        if self.other_kind is not None:
            return f"NaN or infinite {self.other_kind.share:.3%}"
        ambiguous = f"{self.ambiguous:.2%} ambiguous"
        return f"{'within' if self.decided else 'undecided'}, {ambiguous}"

    @property
    def figures(self) -> str:
        """Return the largest error, and the largest share that an error has of its bound, to follow the verdict."""
        share = f"at most {self.bound_share:.0%}" if np.isfinite(self.bound_share) else "more than all"
        return f"error {self.max_error:.2g}, {share} of its bound"

    @property
    def undecided(self) -> str:
        """Explain why there is no verdict; empty if there is one."""
        if self.decided:
            return ""
        where = f"pass {self.step}, target {self.target}"
        if self.untried:
            return (
                f"{where}: time was up before the bounds of {self.untried} pixels were found; give more "
                "(--most-seconds, most_seconds of compare), or smaller pictures"
            )
        promised = self.unpromised <= max(self.most_ambiguous, MOST_UNPROMISED)
        if self.is_vague and promised and self.ambiguous <= self.most_ambiguous:
            lost = ", ".join(f"{cause} at {count} pixels" for cause, count in self.places[:MOST_DECISIONS])
            return (
                f"{where}: half of all values may be {self.median_width:.3g} or more apart, and the values themselves "
                f"span {self.spread:.3g}, so that nearly any picture would pass. "
                f"{f'Precision is lost in {lost}. ' if lost else ''}Use smaller arguments there, or avoid "
                "differences of large numbers"
            )
        if self.ambiguous <= self.most_ambiguous:
            return (
                f"{where}: operations promise nothing for what they are given at {self.unpromised:.2%} of pixels, more "
                f"than {MOST_UNPROMISED:.0%}, so that next to any picture would pass{self._places_text('')}"
            )
        return (
            f"{where}: rounding may turn decisions at {self.ambiguous:.2%} of pixels, more than "
            f"{self.most_ambiguous:.2%}, so that next to any picture would pass"
            f"{self._places_text('; they are what is covered, or nearest')}"
        )

    def _places_text(self, otherwise: str) -> str:
        parts = [f"{cause} at {count}" for cause, count in self.places[:MOST_DECISIONS]]
        more = f" and {len(self.places) - MOST_DECISIONS} more" if len(self.places) > MOST_DECISIONS else ""
        return f"; they are {', '.join(parts)}{more}" if parts else otherwise

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
    """The report of one backend: its targets in schedule order, or why there are none."""

    name: str
    targets: tuple[TargetReport, ...] = ()
    missing: str = ""  # set if the driver or device is missing: the command that installs it
    failed: str = ""  # the backend was opened and then raised this error

    @property
    def within_bounds(self) -> bool:
        """True if the backend ran and every target is within bounds."""
        return bool(self.targets) and not self.failed and self.first_divergence is None

    @property
    def passed(self) -> bool:
        """True if the backend ran and every target passed."""
        return bool(self.targets) and not self.failed and all(target.passed for target in self.targets)

    @property
    def first_divergence(self) -> TargetReport | None:
        """Return the first target, in schedule order, that is outside its bounds."""
        return next((target for target in self.targets if not target.within_bounds), None)

    @property
    def faults(self) -> tuple[str, ...]:
        """Explain why it did not pass: the first target that diverges, that is of another kind, and that is
        undecided."""
        if self.missing or self.failed:
            return (f"missing: {self.missing}" if self.missing else f"failed: {self.failed}",)
        found = [] if self.first_divergence is None else [f"diverges first in {self.first_divergence}"]
        for target in self.targets:
            if target.other_kind is not None:
                found.append(f"pass {target.step}, target {target.target}: {target.other_kind}")
                break
        return (*found, *[f"undecided: {t.undecided}" for t in self.targets if t.undecided][:1])


@dataclass(frozen=True)
class Difference:
    """The first target, in schedule order, that differs in a bit between two backends.

    Each backend runs on its own pictures, so the results of all earlier passes are equal.

    Attributes
    ----------
    step, target : names
    backends : the two
    pixels, share : number of differing pixels, and their share of all
    pixel : (column, row) of the pixel with the largest difference
    values : all channels of that pixel on each of the two
    """

    step: str
    target: str
    backends: tuple[str, str]
    pixels: int
    share: float
    pixel: tuple[int, int]
    values: tuple[tuple[float, ...], tuple[float, ...]]

    def __str__(self) -> str:
        (one, other), (column, row) = self.backends, self.pixel
        return (
            f"first in pass {self.step}, target {self.target}: {one} and {other} differ at {self.pixels} "
            f"pixel{'' if self.pixels == 1 else 's'} ({self.share:.3%}), such as column {column}, row {row}: "
            f"{numbers(self.values[0])} on {one}, {numbers(self.values[1])} on {other}"
        )


@dataclass(frozen=True)
class Report:
    """The comparison of all backends with the reference, and with each other.

    Attributes
    ----------
    difference : where another backend first differs in a bit from the first one that ran; None if none does
    """

    backends: tuple[BackendReport, ...]
    plan: Plan
    difference: Difference | None = None

    @property
    def ran(self) -> tuple[BackendReport, ...]:
        """Return the backends that ran."""
        return tuple(report for report in self.backends if report.targets)

    @property
    def bit_for_bit(self) -> bool:
        """True if every backend that ran computed the same bits of every target; NaNs count as equal."""
        return self.difference is None

    @property
    def within_bounds(self) -> bool:
        """True if some backend ran and none diverges or failed; missing ones do not count."""
        ran = [report for report in self.backends if not report.missing]
        return bool(ran) and all(report.within_bounds for report in ran)

    @property
    def passed(self) -> bool:
        """True if some backend ran and all passed: within bounds, decided, of the reference's kind."""
        ran = [report for report in self.backends if not report.missing]
        return bool(ran) and all(report.passed for report in ran)

    def _repr_mimebundle_(self, **_: object) -> dict[str, str]:
        """Show each target on each backend against its bounds in a notebook."""
        from passgraph import notebook

        lines, rows = [], []
        for backend in self.backends:
            verdict = "; ".join(backend.faults) or "within bounds"
            lines.append(f"{backend.name}: {verdict}")
            if not backend.targets:
                rows.append((backend.name, "", "", "", "", verdict))
            for t in backend.targets:
                within = "within bounds" if t.within_bounds else f"outside at {t.outside:.3%} of pixels"
                rows.append((backend.name, t.step, t.target, f"{t.max_error:.3g}", f"{t.rmse:.3g}", within))
        lines += [self.equality] if self.equality else []
        heads = ("backend", "pass", "target", "largest error", "rmse", "verdict")
        return notebook.bundle("\n".join(lines), f"{notebook.table(heads, rows)}<p>{escape(self.equality)}</p>")

    @property
    def equality(self) -> str:
        """Say in a sentence if backends computed the same bits; empty if fewer than two ran."""
        names = [report.name for report in self.ran]
        if len(names) < 2:
            return ""
        if self.difference is None:
            return f"bit for bit the same on {', '.join(names[:-1])} and {names[-1]}"
        return f"not bit for bit the same: {self.difference}"


def other_bits(one: Picture, other: Picture) -> np.ndarray[tuple[int, int], np.dtype[np.bool_]]:
    """Return the pixels that differ in a bit; NaNs count as equal, -0 and 0 do not.

    >>> zeros = np.zeros((1, 1, 1), np.float32)
    >>> other_bits(zeros, -zeros).tolist(), other_bits(zeros * np.nan, -zeros * np.nan).tolist()
    ([[True]], [[False]])
    """
    same = one.view(np.uint32) == other.view(np.uint32)
    return np.asarray(~(same | (np.isnan(one) & np.isnan(other))).all(axis=2))
