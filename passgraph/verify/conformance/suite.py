"""The conformance suite: run every group of cases on a backend."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from html import escape
from importlib import import_module
from time import monotonic
from typing import Literal, cast

from passgraph.arguments import among, flag, function, instance, iterable, one_of, real, shown, whole_number
from passgraph.backends.base import Backend
from passgraph.backends.registry import open_backend
from passgraph.errors import BackendError, InputError
from passgraph.language.native import MATH, Math
from passgraph.verify.conditions import Conditions
from passgraph.verify.conformance.case import Case
from passgraph.verify.conformance.judging import GOOD, Outcome, Verdict, judge, settled

#: Group → the module whose ``cases`` yields it.
GROUPS = {
    "operations": "passgraph.verify.conformance.operation_cases",
    "language": "passgraph.verify.conformance.language_cases",
    "composites": "passgraph.verify.conformance.composite_cases",
    "derivatives": "passgraph.verify.conformance.derivative_cases",
    "pictures": "passgraph.verify.conformance.picture_cases",
    "draw states": "passgraph.verify.conformance.draw_state_cases",
    "draws": "passgraph.verify.conformance.draw_cases",
    "coverage": "passgraph.verify.conformance.coverage_cases",
    "sequences": "passgraph.verify.conformance.sequence_cases",
    "plans": "passgraph.verify.conformance.plan_cases",
    "effects": "passgraph.verify.conformance.effect_cases",
}


def cases(groups: Iterable[str] | None = None, *, quick: bool = False) -> Iterator[Case]:
    """Yield the cases of some groups (default: all), each built on request.

    Parameters
    ----------
    groups
        Names in :data:`GROUPS`.
    quick
        Leave out cases that are similar to others.

    Raises
    ------
    InputError
        For an unknown group.

    Examples
    --------
    >>> next(cases(["operations"])).id
    'operations/add'
    """
    quick = flag(quick, "quick", InputError)
    expected = "a list of names of groups"
    chosen = list(GROUPS) if groups is None else list(iterable(groups, "groups", expected, InputError))
    for group in chosen:
        if not among(group, GROUPS):
            raise InputError(f"there is no group {shown(group)} of cases; there are {', '.join(GROUPS)}")
    for group in chosen:
        for case in import_module(GROUPS[group]).cases():
            if case.quick or not quick:
                yield case


@dataclass(frozen=True)
class Summary:
    """Figures of one group."""

    group: str
    cases: int
    passed: int
    most_ambiguous: float
    mean_ambiguous: float
    least_told: float
    seconds: float


@dataclass(frozen=True)
class SuiteReport:
    """The verdicts of every case on one backend.

    Attributes
    ----------
    backend : the name that it was opened with
    verdicts : in the order in which the cases ran
    conditions : device, driver, versions, options and date
    not_run : identifiers of the cases that did not run because the time was up
    """

    backend: str
    verdicts: tuple[Verdict, ...]
    conditions: Conditions | None = None
    not_run: tuple[str, ...] = ()

    @property
    def passed(self) -> bool:
        """Return True if some case ran and none is a fault."""
        return any(verdict.outcome != "unsupported" for verdict in self.verdicts) and not self.faults

    @property
    def faults(self) -> tuple[Verdict, ...]:
        """Return the verdicts that did not pass, in order."""
        return tuple(verdict for verdict in self.verdicts if verdict.outcome not in GOOD)

    def count(self, outcome: Outcome) -> int:
        return sum(verdict.outcome == outcome for verdict in self.verdicts)

    @property
    def groups(self) -> tuple[Summary, ...]:
        """Return the figures of each group."""
        names = dict.fromkeys(verdict.group for verdict in self.verdicts)
        return tuple(_summary(name, [v for v in self.verdicts if v.group == name]) for name in names)

    def _repr_mimebundle_(self, **_: object) -> dict[str, str]:
        """Show the groups of cases in a notebook, and the cases that did not pass."""
        from passgraph import notebook

        verdict = "passes" if self.passed else "does not pass"
        text = f"conformance of {self.backend}: {len(self.verdicts)} cases, {len(self.faults)} not passed: {verdict}"
        rows = [(g.group, g.cases, g.passed, f"{g.most_ambiguous:.2%}", f"{g.seconds:.1f}") for g in self.groups]
        faults = [(v.id, v.outcome, str(v.divergence or v.reason)) for v in self.faults]
        heads = ("group", "cases", "passed", "most ambiguous", "seconds")
        parts = [f"<p>{escape(text)}</p>", notebook.table(heads, rows)]
        if faults:
            parts.append(notebook.table(("case", "outcome", "why"), faults))
        lines = [text, *(f"{case}: {outcome}: {why}" for case, outcome, why in faults)]
        return notebook.bundle("\n".join(lines), "".join(parts))


def _summary(group: str, verdicts: Sequence[Verdict]) -> Summary:
    shares = [verdict.ambiguous for verdict in verdicts]
    passed = sum(verdict.outcome == "passed" for verdict in verdicts)
    return Summary(
        group, len(verdicts), passed, max(shares), sum(shares) / len(shares),
        min(verdict.narrow for verdict in verdicts), sum(verdict.seconds for verdict in verdicts),
    )  # fmt: skip


#: The function under another name: `run` has a parameter ``cases``.
_all_cases = cases
Progress = Callable[[int, Case, Literal["start"] | Verdict], None]


def run(
    backend: str | Backend,
    cases: Iterable[Case] | None = None,
    *,
    groups: Iterable[str] | None = None,
    quick: bool = False,
    math: Math = "exact",
    repeat: int = 1,
    most_seconds: float | None = None,
    progress: Progress = lambda number, case, state: None,
) -> SuiteReport:
    """Run cases on a backend, one after another.

    Parameters
    ----------
    backend
        A name such as ``"gl"`` or ``"opencl:1"``, or an open backend, which stays open.
    cases
        Default: those of :func:`passgraph.verify.conformance.cases` with ``groups`` and ``quick``.
    groups, quick
        As for that function.
    math
        ``"native"``: kernels call the device's own functions, whose bounds follow from its specification.
    repeat
        How often each case runs, 1 to 1000; it is ``"flaky"`` if the outcomes differ.
    most_seconds
        No case begins after this time; None: no limit.
    progress
        Called with the case's number, the case, and ``"start"`` or its verdict.

    Returns
    -------
    SuiteReport
        A backend that raises has failed the case; the run continues.

    Raises
    ------
    DeviceMissingError, BackendError
        If the backend cannot be opened.
    InputError
        For an unknown group.
    """
    chosen: Iterable[Case] = _all_cases(groups, quick=quick)
    if cases is not None:
        chosen = iterable(cases, "cases", "a list of passgraph.verify.conformance.Case", InputError)
    function(progress, "progress", InputError)
    repeat = whole_number(repeat, "repeat", 1, 1000, InputError)
    if most_seconds is not None:
        most_seconds = real(most_seconds, "most_seconds", 0.0, error=InputError)
    typed = cast("Math", one_of(math, "math", MATH, InputError))
    instance(backend, (str, Backend), "backend", "a name such as 'gl' or an open backend", BackendError)
    opened = open_backend(backend) if isinstance(backend, str) else backend
    verdicts, not_run, start = list[Verdict](), list[str](), monotonic()
    try:
        for number, case in enumerate(chosen):
            instance(case, Case, f"case {number}", "a passgraph.verify.conformance.Case", InputError)
            if most_seconds is not None and monotonic() - start >= most_seconds:
                not_run.append(case.id)
                continue
            progress(number, case, "start")
            verdicts.append(settled(judge(case, [opened] * repeat, typed)))
            progress(number, case, verdicts[-1])
        conditions = Conditions.now(opened, math=math, repeat=repeat, most_seconds=most_seconds)
    finally:
        if isinstance(backend, str):
            opened.close()
    name = backend if isinstance(backend, str) else backend.name
    return SuiteReport(name, tuple(verdicts), conditions, tuple(not_run))
