"""Judge one case on open backends: compare every target of every pass of every frame with the oracle's bounds.

Each pass reads the reference's pictures: its results are replaced before the next pass reads them.  A difference
therefore belongs to its pass, in later frames too.
"""

from __future__ import annotations

import traceback
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from time import perf_counter
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from passgraph.backends.base import Backend
from passgraph.errors import UnsupportedError
from passgraph.formats import Format
from passgraph.language.native import Math
from passgraph.plan.data import Options
from passgraph.run.compile import compile
from passgraph.verify.compare import distance
from passgraph.verify.conformance.border_swaps import border_swap
from passgraph.verify.conformance.case import Case, Picture
from passgraph.verify.conformance.causes import Found, cause
from passgraph.verify.kinds import reads_at, reads_in_words
from passgraph.verify.oracle.allowed import Allowed
from passgraph.verify.oracle.kept import Kept
from passgraph.verify.oracle.pass_bounds import Key, Passes

#: ``"undecided"``: a vacuous case of ``math="native"``, where specifications promise little; it is no fault.
#: ``"unsupported"``: the backend refused the case before it ran, and named what its device lacks; that is no fault.
#: ``"flaky"``: a case that ran several times, with different outcomes.
Outcome = Literal["passed", "diverged", "undecided", "unsupported", "vacuous", "failed", "flaky"]
#: Outcomes that are no fault.
GOOD: tuple[Outcome, ...] = ("passed", "undecided", "unsupported")

#: A value has narrow bounds if they span at most this share of its size, a step of its format, or …
NARROW_SHARE = 1.0 / 64.0
#: … this distance (the specified error of sine at its zeros is 2^-22).
NARROW_DISTANCE = 2.0**-20


@dataclass(frozen=True)
class TargetVerdict:
    """The verdict on one target of one pass in one frame.

    Attributes
    ----------
    outside : share of pixels with a value that no conforming backend may have
    ambiguous : share of pixels where rounding may change a decision and the outcomes differ
    narrow : share of values with finite and narrow bounds
    error : largest distance from the reference at pixels that are not ambiguous; infinite if only one is NaN
    known : True if the case has the exact picture, so that ``ambiguous`` and ``narrow`` do not matter
    """

    frame: int
    step: str
    target: str
    outside: float
    ambiguous: float
    narrow: float
    error: float
    known: bool


@dataclass(frozen=True, eq=False)
class Divergence:
    """The first target outside its bounds, and its worst pixel.

    ``reads``: the texels at this pixel of the images that the pass reads, by the kernel's name; ``cause``: the likely
    mistake, empty if unknown.
    """

    where: str
    pixel: tuple[int, int]  # column, row
    channel: int
    got: float
    expected: float
    low: float
    high: float
    pictures: tuple[Picture, Picture, NDArray[np.bool_]]  # got, expected, pixels outside
    reads: tuple[tuple[str, tuple[float, ...]], ...] = ()
    cause: str = ""

    def __str__(self) -> str:
        column, row = self.pixel
        share = self.pictures[2].mean()
        return (
            f"{self.where}: outside its bounds at {share:.3%} of pixels; worst at column {column}, row {row}, "
            f"channel {self.channel}: {self.got:.9g} where {self.expected:.9g} is expected and {self.low:.9g} to "
            f"{self.high:.9g} is allowed{reads_in_words(self.reads)}{'. ' if self.cause else ''}{self.cause}"
        )


@dataclass(frozen=True)
class Verdict:
    """The verdict of one case on one backend."""

    group: str
    name: str
    backend: str
    outcome: Outcome
    seconds: float
    targets: tuple[TargetVerdict, ...] = ()
    divergence: Divergence | None = None
    reason: str = ""  # for a case that is vacuous, unsupported, failed or flaky

    @classmethod
    def of_failure(cls, case: Case, backend: str, seconds: float, targets: tuple[TargetVerdict, ...] = ()) -> Verdict:
        """Build a verdict from the end of the traceback being handled."""
        reason = traceback.format_exc(limit=-4).strip()
        return cls(case.group, case.name, backend, "failed", seconds, targets, None, reason)

    @property
    def id(self) -> str:
        return f"{self.group}/{self.name}"

    @property
    def ambiguous(self) -> float:
        """Return the largest ambiguous share of any target without an exact picture."""
        return max((target.ambiguous for target in self.targets if not target.known), default=0.0)

    @property
    def narrow(self) -> float:
        """Return the smallest share of narrow bounds of any target without an exact picture."""
        return min((target.narrow for target in self.targets if not target.known), default=1.0)

    @property
    def error(self) -> float:
        """Return the largest error of any target."""
        return max((target.error for target in self.targets), default=0.0)

    def __str__(self) -> str:
        detail = " ".join(filter(None, (self.reason, str(self.divergence or ""))))
        return f"{self.id} on {self.backend}: {self.outcome}{': ' if detail else ''}{detail}"


class Judge:
    """A case with its plan; bounds are computed when first needed, or read from the cache."""

    def __init__(self, case: Case, kept: Kept | None = None, math: Math = "exact") -> None:
        self.case, self.math = case, math
        self.outputs = dict(case.graph())
        self.passes = Passes(self.outputs, case.size, case.frames, kept=kept or Kept(on_disk=True), math=math)

    def verdict(self, backend: Backend) -> Verdict:
        """Judge one open backend; an exception becomes the verdict."""
        start = perf_counter()
        name, case = backend.name, self.case
        targets: list[TargetVerdict] = []
        first: Divergence | None = None
        try:
            for target, divergent in self._targets(backend):
                targets.append(target)
                first = first or divergent
            first = first or self._inexact(backend)
        except UnsupportedError as error:
            return Verdict(case.group, case.name, name, "unsupported", perf_counter() - start, reason=str(error))
        except Exception:
            return Verdict.of_failure(case, name, perf_counter() - start, tuple(targets))
        outcome, reason = self._vacuous(targets)
        if outcome == "vacuous" and self.math == "native":
            outcome, reason = "undecided", f"{reason}{self._unpromised(backend)}"
        if first:
            outcome, reason = "diverged", ""
        seconds = perf_counter() - start
        return Verdict(case.group, case.name, name, outcome, seconds, tuple(targets), first, reason)

    def _targets(self, backend: Backend) -> Iterator[tuple[TargetVerdict, Divergence | None]]:
        """Yield the verdict on every target of every frame, in the order in which they are written."""
        plan = self.passes.plan
        expected, allowed = self.passes.allowed(backend.promises)
        for written in self.passes.written(backend, expected):
            for key, got in written.items():
                frame, step, target = key[0], plan.steps[key[1]], plan.resources[key[2]]
                bounds = allowed[key]
                beyond = bounds.values.without(got)
                share = float(beyond.any(axis=2).mean())
                narrow = float(are_decided(bounds, target.format).mean())
                error = float(distance(got, expected[key])[~bounds.ambiguous].max(initial=0.0))
                figures = share, float(bounds.ambiguous.mean()), narrow, error
                known = target.name in self.case.exact
                divergent = self._divergent(key, got, expected, allowed, beyond) if share else None
                yield TargetVerdict(frame, step.name, target.name, *figures, known), divergent

    def _divergent(
        self, key: Key, got: Picture, expected: dict[Key, Picture], allowed: dict[Key, Allowed],
        beyond: NDArray[np.bool_],
    ) -> Divergence:  # fmt: skip
        """Return the divergence with its likely cause."""
        plan, bounds, before = self.passes.plan, allowed[key].values, allowed.get((key[0] - 1, *key[1:]))
        target = plan.resources[key[2]]
        where = f"frame {key[0]}, pass {plan.steps[key[1]].name}, target {target.name}"
        found_at = divergence(where, got, expected[key], bounds.lo, bounds.hi, beyond)
        column, row = found_at.pixel
        found = Found(got, expected[key], bounds, target.format, None if before is None else before.values)
        reason = border_swap(self.passes, key, expected, found) or cause(found)
        return replace(found_at, reads=reads_at(self.passes, key, expected, row, column), cause=reason)

    def _vacuous(self, targets: Sequence[TargetVerdict]) -> tuple[Outcome, str]:
        for target in targets:
            if target.known:
                continue
            where = f"frame {target.frame}, pass {target.step}, target {target.target}"
            if target.ambiguous > self.case.most_ambiguous:
                return "vacuous", (
                    f"{where}: {target.ambiguous:.2%} of the pixels are ambiguous, above {self.case.most_ambiguous:.2%}"
                )
            least = self.case.told_less.get(target.target, self.case.least_told)
            if target.narrow < least:
                told_of = f"of {target.narrow:.1%} of the values something is known, below {least:.1%}"
                return "vacuous", f"{where}: {told_of}"
        return "passed", ""

    def _unpromised(self, backend: Backend) -> str:
        """Name the device's functions of which its specification promises nothing, at least for some arguments."""
        names: Counter[str] = sum((one.names for one in self.passes.allowed(backend.promises)[1].values()), Counter())
        native = [name for name in names if name.endswith(" of the device")]
        return f"; nothing is promised, for some arguments at least, of {', '.join(sorted(native))}" if native else ""

    def _inexact(self, backend: Backend) -> Divergence | None:
        """Return the first difference between the program's outputs, compiled with defaults, and the exact ones."""
        if not self.case.exact:
            return None
        with compile(self.outputs, backend, self.case.size, Options(math=self.math)) as program:
            for frame in self.case.frames:
                program.run(**frame)
            results = program.read()
        for name, known in self.case.exact.items():
            number = known() if callable(known) else known
            got = results[name]
            expected = np.broadcast_to(np.asarray(number, np.float32), got.shape)
            beyond = ~((got == expected) | (np.isnan(got) & np.isnan(expected)))
            if beyond.any():
                return divergence(f"output {name}, all optimisations on", got, expected, expected, expected, beyond)
        return None


def first_outside(passes: Passes, backend: Backend) -> tuple[Key, Picture] | None:
    """Run a graph, each pass on the reference's pictures; return the first target outside of its bounds, as it is."""
    expected, allowed = passes.allowed(backend.promises)
    for written in passes.written(backend, expected):
        for key, got in written.items():
            if allowed[key].values.without(got).any():
                return key, got
    return None


def explain(passes: Passes, backend: Backend) -> str:
    """Return the likely mistake in the first target that is outside of its bounds; empty if unknown or none is."""
    first = first_outside(passes, backend)
    if first is None:
        return ""
    (key, got), (expected, allowed) = first, passes.allowed(backend.promises)
    found = Found(got, expected[key], allowed[key].values, passes.plan.resources[key[2]].format)
    return border_swap(passes, key, expected, found) or cause(found)


def divergence(
    where: str,
    got: Picture,
    expected: Picture,
    low: NDArray[np.floating],
    high: NDArray[np.floating],
    beyond: NDArray[np.bool_],
) -> Divergence:
    """Return the divergence at the worst pixel."""
    apart = np.where(beyond, distance(got, expected), -1.0)
    row, column, channel = (int(i) for i in np.unravel_index(np.argmax(apart), apart.shape))
    at = row, column, channel
    return Divergence(
        where, (column, row), channel, float(got[at]), float(expected[at]), float(low[at]), float(high[at]),
        (got, expected, np.asarray(beyond.any(axis=2))),
    )  # fmt: skip


def are_decided(bounds: Allowed, format_: Format) -> NDArray[np.bool_]:
    """Return which values are decided: those with a narrow interval, or a certain NaN."""
    values = bounds.values
    size = values.magnitude
    near = values.width <= np.fmax(NARROW_SHARE * size, max(NARROW_DISTANCE, format_.unit))
    return np.asarray(near & (~values.nan | np.isnan(values.lo)))


def settled(verdicts: Sequence[Verdict]) -> Verdict:
    """Return the verdict on a case that ran several times on one backend: flaky if outcomes differ."""
    first, seconds = verdicts[0], sum(verdict.seconds for verdict in verdicts)
    counts = Counter(verdict.outcome for verdict in verdicts)
    if len(counts) == 1:
        return replace(first, seconds=seconds)
    worst = next(verdict for verdict in verdicts if verdict.outcome != "passed")
    of = ", ".join(f"{count} {outcome}" for outcome, count in counts.items())
    reason = " ".join(filter(None, (f"of {len(verdicts)} runs {of}.", worst.reason)))
    return replace(worst, outcome="flaky", seconds=seconds, reason=reason)


def judge(case: Case, backends: Sequence[Backend], math: Math = "exact") -> list[Verdict]:
    """Judge a case on several open backends, which share the reference's work."""
    start = perf_counter()
    try:
        judging = Judge(case, math=math)
    except Exception:
        seconds = perf_counter() - start
        return [Verdict.of_failure(case, backend.name, seconds) for backend in backends]
    return [judging.verdict(backend) for backend in backends]
