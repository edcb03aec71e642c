"""Every case on every backend that is here, but those of test_first_cases.py.

The reference's work is done once for all of them.
"""

from __future__ import annotations

import pytest

from passgraph.backends.base import Backend
from passgraph.language.operations import OPERATIONS
from passgraph.verify.conformance import Case, cases, judge
from tests.conformance.choice import CASES, first_of_each

FIRST = {case.id for case in first_of_each()}


def is_quick_effect(case: Case) -> bool:
    return case.group == "effects" and case.quick and case.id not in FIRST


def assert_all_conform(case: Case, backends: list[Backend]) -> None:
    faults = [str(verdict) for verdict in judge(case, backends) if verdict.outcome != "passed"]
    assert not faults, "\n".join(faults)


@pytest.mark.parametrize(
    "case",
    [
        pytest.param(case, id=case.id, marks=() if case.quick else pytest.mark.slow)
        for case in CASES
        if case.id not in FIRST and not is_quick_effect(case)
    ],
)
def test_every_backend_conforms(case: Case, backends: list[Backend]) -> None:
    assert_all_conform(case, backends)


@pytest.mark.every_third
@pytest.mark.parametrize("on_opencl", [False, pytest.param(True, marks=pytest.mark.slow)], ids=["others", "opencl"])
@pytest.mark.parametrize("case", list(filter(is_quick_effect, CASES)), ids=lambda case: case.id)
def test_every_backend_conforms_in_effects(case: Case, backends: list[Backend], on_opencl: bool) -> None:
    """PoCL compiles their many programs for seconds; what these are made of is in the other groups, and each effect's
    first case in test_first_cases.py, on OpenCL too."""
    assert_all_conform(case, [backend for backend in backends if (backend.name == "opencl") == on_opencl])


def test_names_are_unique() -> None:
    assert len({case.id for case in CASES}) == len(CASES)


def test_every_row_of_the_operations_table_has_a_case() -> None:
    named = {case.name.partition(" of ")[0] for case in CASES if case.group == "operations"}
    assert named == set(OPERATIONS)


def test_a_quick_run_leaves_no_group_out() -> None:
    assert {case.group for case in cases(quick=True)} == {case.group for case in CASES}
