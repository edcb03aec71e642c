"""The first case of each group and of each effect on every backend: what `tests/run.sh --quick` has of the suite."""

from __future__ import annotations

import pytest

from passgraph.backends.base import Backend
from passgraph.verify.conformance import Case, judge
from tests.conformance.choice import first_of_each


@pytest.mark.parametrize("case", first_of_each(), ids=lambda case: case.id)
def test_every_backend_conforms(case: Case, backends: list[Backend]) -> None:
    faults = [str(verdict) for verdict in judge(case, backends) if verdict.outcome != "passed"]
    assert not faults, "\n".join(faults)
