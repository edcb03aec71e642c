"""Conformance of backends: many small graphs, each target compared with the oracle's bounds.

In reading order: ``case``, ``judging`` (one case), ``suite`` (all of them), the groups (``operations``, ``language``,
``derivatives``, ``pictures``, ``draw_states``, ``coverage``, ``sequences``, ``effects``), ``page`` (an HTML report),
``pytest_plugin``.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from passgraph.verify.conformance.case import Case
    from passgraph.verify.conformance.judging import Divergence, TargetVerdict, Verdict, judge
    from passgraph.verify.conformance.suite import GROUPS, SuiteReport, cases, run

_HOMES = {
    "Case": "case", "Divergence": "judging", "TargetVerdict": "judging", "Verdict": "judging", "judge": "judging",
    "GROUPS": "suite", "SuiteReport": "suite", "cases": "suite", "run": "suite",
}  # fmt: skip


def __getattr__(name: str) -> Any:
    """Import on first use: pytest imports this package at every start, for its plugin."""
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from importlib import import_module

    return getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)


__all__ = ["GROUPS", "Case", "Divergence", "SuiteReport", "TargetVerdict", "Verdict", "cases", "judge", "run"]
