"""The first case of each group and of each effect on every backend: what `tests/run.sh --quick` has of the suite."""

from __future__ import annotations

import pytest

from passgraph.backends.base import Backend
from passgraph.verify.conformance import Case
from tests.conformance.choice import assert_all_conform, first_of_each

GROUPS = [case for case in first_of_each() if case.group != "effects"]
EFFECTS = [case for case in first_of_each() if case.group == "effects"]


@pytest.mark.parametrize("case", GROUPS, ids=lambda case: case.id)
def test_every_backend_conforms(case: Case, backends: list[Backend]) -> None:
    assert_all_conform(case, backends)


@pytest.mark.parametrize("case", EFFECTS, ids=lambda case: case.id)
def test_every_other_backend_than_opencl_conforms_in_effects(case: Case, backends: list[Backend]) -> None:
    assert_all_conform(case, [backend for backend in backends if backend.name != "opencl"])


@pytest.mark.sampled
@pytest.mark.parametrize("case", EFFECTS, ids=lambda case: case.id)
def test_opencl_conforms_in_effects(case: Case, backends: list[Backend]) -> None:
    """PoCL compiles their many programs for seconds; what these are made of is in the other groups."""
    assert_all_conform(case, [backend for backend in backends if backend.name == "opencl"])
