"""The numbers of the suites of others are those that are kept.

Set ``PASSGRAPH_VK_GL_CTS`` and ``PASSGRAPH_PIGLIT`` to checkouts of KhronosGroup/VK-GL-CTS and Igalia/piglit. After a
change for the better, keep the new numbers: ``python -m tests.suites --backend numpy --write``.
"""

from __future__ import annotations

import json

import pytest

from tests.suites.judgment import numbers_of
from tests.suites.runs import NUMBERS, SUITES, judged

#: GLSL leaves NaN open; a function that is declared after its use hides the built-in one of its name.
KNOWN_WRONG = ("of_nan", "override-builtin")
KEPT = json.loads(NUMBERS.read_text())


@pytest.mark.slow
@pytest.mark.parametrize(("suite", "backend"), [(suite, backend) for suite in KEPT for backend in KEPT[suite]])
def test_the_numbers_are_those_that_are_kept(suite: str, backend: str) -> None:
    judgments = judged(suite, backend)
    if judgments is None:
        pytest.skip(f"{SUITES[suite].variable} names no checkout")
    assert numbers_of(judgments) == KEPT[suite][backend]


def test_each_suite_has_numbers_without_a_wrong_one() -> None:
    assert set(KEPT) == set(SUITES)
    for suite, backends in KEPT.items():
        for backend, numbers in backends.items():
            known = {name for name in numbers["names of wrong"] if any(part in name for part in KNOWN_WRONG)}
            assert not set(numbers["names of wrong"]) - known, (suite, backend)
