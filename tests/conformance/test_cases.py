"""Every case on every backend that is here, but those of test_first_cases.py.

The reference's work is done once for all of them.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from passgraph.backends.base import Backend
from passgraph.language.operations import OPERATIONS
from passgraph.verify.conformance import Case, cases
from tests.conformance.choice import CASES, assert_all_conform, first_of_each

FIRST = {case.id for case in first_of_each()}


def is_quick_effect(case: Case) -> bool:
    return case.group == "effects" and case.quick and case.id not in FIRST


#: Cases that are neither the first of their kind nor quick ones of effects.
OTHERS = [
    pytest.param(case, id=case.id, marks=() if case.quick else pytest.mark.slow)
    for case in CASES
    if case.id not in FIRST and not is_quick_effect(case)
]
#: Cases that have caught a planted mistake.
CATCHING = set(Path(__file__).with_name("catching.txt").read_text("utf-8").splitlines())


@pytest.mark.parametrize("case", [case for case in OTHERS if case.values[0].id in CATCHING])
def test_every_backend_conforms(case: Case, backends: list[Backend]) -> None:
    assert_all_conform(case, backends)


@pytest.mark.sampled
@pytest.mark.parametrize("case", [case for case in OTHERS if case.values[0].id not in CATCHING])
def test_every_backend_conforms_in_cases_like_these(case: Case, backends: list[Backend]) -> None:
    assert_all_conform(case, backends)


@pytest.mark.sampled
@pytest.mark.parametrize("on_opencl", [False, pytest.param(True, marks=pytest.mark.slow)], ids=["others", "opencl"])
@pytest.mark.parametrize("case", list(filter(is_quick_effect, CASES)), ids=lambda case: case.id)
def test_every_backend_conforms_in_effects(case: Case, backends: list[Backend], on_opencl: bool) -> None:
    """PoCL compiles their many programs for seconds: each effect's first case is in test_first_cases.py."""
    assert_all_conform(case, [backend for backend in backends if (backend.name == "opencl") == on_opencl])


def test_names_are_unique() -> None:
    assert len({case.id for case in CASES}) == len(CASES)


def test_every_row_of_the_operations_table_has_a_case() -> None:
    named = {case.name.partition(" of ")[0] for case in CASES if case.group == "operations"}
    assert named == set(OPERATIONS)


def test_a_quick_run_leaves_no_group_out() -> None:
    assert {case.group for case in cases(quick=True)} == {case.group for case in CASES}
