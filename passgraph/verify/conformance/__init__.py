"""Whether a backend computes what kernels and draws mean: many small graphs, each target held against the oracle.

In reading order: ``case``, ``judging`` (one case), ``suite`` (all of them), the groups (``operations``, ``language``,
``derivatives``, ``pictures``, ``draw_states``, ``coverage``, ``sequences``, ``effects``), ``page`` (a report to look
at), ``pytest_plugin``.
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
    """Loaded when first used: pytest imports this package at every start, for the plugin in it."""
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from importlib import import_module

    return getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)


__all__ = ["GROUPS", "Case", "Divergence", "SuiteReport", "TargetVerdict", "Verdict", "cases", "judge", "run"]
