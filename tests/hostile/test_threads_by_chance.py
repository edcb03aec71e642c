"""A quick part of what ``python -m tests.hostile.threads`` does at length."""

from __future__ import annotations

import pytest

from tests.conftest import require
from tests.hostile.threads import hostile_threads
from tests.test_threads import BACKENDS, child


@pytest.mark.sampled
@pytest.mark.parametrize("name", BACKENDS)
def test_chance_over_threads_finds_only_what_the_rules_allow(name: str) -> None:
    if name != "reference":
        require(name)
    assert child(hostile_threads, name, 120, 7).startswith(f"{name} 7 ")
