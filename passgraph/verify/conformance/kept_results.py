"""Results of the suite as data: written as JSON, read again, and two of them compared case by case."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, get_args

import numpy as np

from passgraph.errors import InputError
from passgraph.reading import parsed_json, read_text
from passgraph.verify.conformance.judging import GOOD, Outcome, Verdict
from passgraph.verify.conformance.suite import SuiteReport

MOST_BYTES = 1 << 28


def json_of(report: SuiteReport) -> str:
    """Return every case with its figures; NaN and infinity become strings, since JSON lacks them."""
    conditions = {} if report.conditions is None else report.conditions.as_data()
    document = {
        "backend": report.backend,
        "passed": report.passed,
        **conditions,
        "groups": [vars(group) for group in report.groups],
        "cases": [_entry(verdict) for verdict in report.verdicts],
        "not run": report.not_run,
    }
    return json.dumps(document, indent=1) + "\n"


def _entry(verdict: Verdict) -> dict[str, Any]:
    entry: dict[str, Any] = {
        "case": verdict.id,
        "outcome": verdict.outcome,
        "seconds": round(verdict.seconds, 4),
        "ambiguous": verdict.ambiguous,
        "told": verdict.narrow,
        "error": _number(verdict.error),
    }
    if verdict.reason:
        entry["reason"] = verdict.reason
    if verdict.divergence is not None:
        found = verdict.divergence
        entry["divergence"] = {
            "where": found.where,
            "column": found.pixel[0],
            "row": found.pixel[1],
            "channel": found.channel,
            **{name: _number(getattr(found, name)) for name in ("got", "expected", "low", "high")},
            "cause": found.cause,
        }
    return entry


def _number(value: float) -> float | str:
    return value if np.isfinite(value) else str(value)


@dataclass(frozen=True)
class KeptCase:
    """The outcome of one case; ``error`` is the largest distance from the reference."""

    outcome: str
    error: float

    def __str__(self) -> str:
        return f"{self.outcome}, error {self.error:.3g}"

    @property
    def is_good(self) -> bool:
        return self.outcome in GOOD


@dataclass(frozen=True)
class KeptReport:
    """The results of one run of the suite, as a file has them.

    Attributes
    ----------
    title : backend, device and date
    conditions : what the results depend on, by name
    cases : by identifier
    """

    title: str
    conditions: Mapping[str, Any]
    cases: Mapping[str, KeptCase]


def kept(document: Any, where: str) -> KeptReport:
    """Return the results in a document of `json_of`.

    Raises
    ------
    InputError
        If it is none; ``where`` names the file.
    """
    try:
        cases = {str(entry["case"]): _case(entry) for entry in document["cases"]}
        backend, date = str(document["backend"]), str(document.get("date", "of no known date"))
        conditions = {name: document.get(name) for name in _CONDITIONS if name in document}
        devices = [
            f"{d['name']}, {d['driver']} {d['version']}" for one in document.get("devices", {}).values() for d in one
        ]
        conditions["device"] = "; ".join(devices)
    except (AttributeError, KeyError, TypeError, ValueError) as error:
        raise InputError(
            f"{where}: is no report of the conformance suite ({type(error).__name__}: {error}); write one with "
            "passgraph conform --json FILE.json"
        ) from None
    return KeptReport("; ".join([backend, *devices, date]), conditions, cases)


def load(path: Path) -> KeptReport:
    """Read the results in a file."""
    try:
        document = parsed_json(read_text(path, "a report", MOST_BYTES))
    except ValueError as error:
        raise InputError(f"{path}: is not JSON ({error}); write a report with passgraph conform --json") from None
    return kept(document, str(path))


def _case(entry: Any) -> KeptCase:
    if entry["outcome"] not in get_args(Outcome):
        raise ValueError(f"unknown outcome {entry['outcome']!r}")
    return KeptCase(entry["outcome"], float(entry.get("error", "nan")))


#: Keys of a document whose differences may explain those of its results.
_CONDITIONS = ("passgraph", "system", "cpu", "options", "variables", "libraries", "python")


@dataclass(frozen=True)
class Change:
    """A case of two reports; None where a report lacks it."""

    case: str
    before: KeptCase | None
    after: KeptCase | None

    @property
    def kind(self) -> str:
        """``"new failure"``, ``"known failure"``, ``"mended"``, ``"not run"`` or ``"good"``."""
        if self.after is None:
            return "not run"
        known = self.before is not None and not self.before.is_good
        if self.after.is_good:
            return "mended" if known else "good"
        return (
            "known failure" if self.before is not None and self.before.outcome == self.after.outcome else "new failure"
        )

    @property
    def is_difference(self) -> bool:
        """True if the outcomes or the errors differ."""
        before, after = self.before, self.after
        if before is None or after is None:
            return True
        same = before.error == after.error or (np.isnan(before.error) and np.isnan(after.error))
        return before.outcome != after.outcome or not same

    @property
    def growth(self) -> float:
        """Return how many times as large the error became, or shrank; infinite from or to 0."""
        if self.before is None or self.after is None:
            return 0.0
        low, high = sorted((self.before.error, self.after.error))
        return 0.0 if np.isnan(low + high) else high / low if low else float("inf") if high else 0.0


def changes(before: KeptReport, after: KeptReport) -> list[Change]:
    """Return every case of either report, in their order."""
    names = dict.fromkeys((*before.cases, *after.cases))
    return [Change(name, before.cases.get(name), after.cases.get(name)) for name in names]


def other_conditions(before: KeptReport, after: KeptReport) -> Iterator[tuple[str, str, str]]:
    """Yield name and both texts of each condition that differs; of a mapping, its entries that do."""
    for name in dict.fromkeys((*before.conditions, *after.conditions)):
        one, other = before.conditions.get(name), after.conditions.get(name)
        if isinstance(one, dict) and isinstance(other, dict):
            for key in dict.fromkeys((*one, *other)):
                if one.get(key) != other.get(key):
                    yield f"{name}: {key}", _text(one.get(key)), _text(other.get(key))
        elif one != other:
            yield name, _text(one), _text(other)


def _text(value: Any) -> str:
    if value is None:
        return "none"
    return value if isinstance(value, str) else json.dumps(value)
