"""The numbers of the suites of others are those that are kept.

Set ``PASSGRAPH_VK_GL_CTS`` and ``PASSGRAPH_PIGLIT`` to checkouts of KhronosGroup/VK-GL-CTS and Igalia/piglit. After a
change for the better, keep the new numbers: ``python -m tests.suites --write``.
"""

from __future__ import annotations

import json

import pytest

from passgraph.backends.registry import open_backend
from passgraph.errors import DeviceMissingError
from tests.suites.judgment import numbers_of
from tests.suites.runs import COMPILED, NUMBERS, SUITES, judged, sample_of

#: GLSL leaves NaN open (GLSL 4.60, 4.7.1). These want max(NaN, y) to be y; by the formula of GLSL, 8.3, it is NaN here.
#: The same section lets numbers below 1.2e-38 stay, or become 0, which ``underflow`` and ``ldexp`` want.
#: Tests of ``fma`` want the rounding of float32; the reference computes in float64.
KNOWN_WRONG = ("of_nan", "nan-builtin", "underflow", "-ldexp", "fma-float-float-float")
KEPT = json.loads(NUMBERS.read_text())


def is_here(backend: str) -> bool:
    try:
        open_backend(backend).close()
    except DeviceMissingError:
        return False
    return True


@pytest.mark.slow
@pytest.mark.parametrize("suite", SUITES)
def test_the_numbers_are_those_that_are_kept(suite: str) -> None:
    backends = [backend for backend in SUITES[suite].backends if backend == COMPILED or is_here(backend)]
    by_backend = judged(suite, backends)
    if by_backend is None:
        pytest.skip(f"{SUITES[suite].variable} names no checkout")
    numbers = {backend: numbers_of(judgments, sample_of(backend)) for backend, judgments in by_backend.items()}
    assert numbers == {backend: KEPT[suite][backend] for backend in backends}


@pytest.mark.parametrize("suite", SUITES)
def test_each_suite_has_numbers_of_all_backends_without_a_wrong_one(suite: str) -> None:
    assert set(KEPT[suite]) == set(SUITES[suite].backends)
    for backend, numbers in KEPT[suite].items():
        assert numbers["right"], backend
        assert not [name for name in numbers["names of wrong"] if not any(part in name for part in KNOWN_WRONG)], (
            backend
        )


def test_the_sample_of_opencl_is_refused_and_wrong_as_the_whole_is_on_numpy() -> None:
    for suite in (name for name in KEPT if SUITES[name].runs):
        whole, sample = KEPT[suite]["numpy"], KEPT[suite]["opencl"]
        assert sample["reasons"].keys() <= whole["reasons"].keys()
        assert set(sample["names of wrong"]) <= set(whole["names of wrong"])
        assert 8 * sample["right"] > whole["right"] > 4 * sample["right"]
