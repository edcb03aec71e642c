"""Graphs on gl, opencl and numpy against what the oracle allows; the reference's work is done once for all of them.

Every effect is a case of the conformance suite, and so runs on webgpu there.
"""

from __future__ import annotations

from typing import Any

from passgraph.graph.targets import Outputs
from passgraph.verify.compare import Report, compare
from tests.conftest import present_devices


def assert_within_bounds(outputs: Outputs, size: tuple[int, int] | None = None, **given: Any) -> Report:
    """Every target of every pass on these devices; the report says what was compared."""
    report = compare(outputs, present_devices("gl", "opencl", "numpy"), size=size, **given)
    faults = [
        f"{b.name}: {b.missing or b.failed or b.first_divergence}" for b in report.backends if not b.within_bounds
    ]
    assert not faults, "\n".join(faults)
    return report
