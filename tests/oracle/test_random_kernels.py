"""Random kernels and graphs of passgraph.verify.fuzz, computed as badly as the standards allow: inside, always.

The figures printed (``pytest -s``) say how many cases and verdicts there were and how many pixels were ambiguous:
were all of them, the test would prove nothing.
"""

from __future__ import annotations

import pytest
from conforming import Conforming

from passgraph.backends.reference import ReferenceBackend
from passgraph.verify.fuzz.cases import Case, Tally
from passgraph.verify.fuzz.search import batch, strategies


def counts_nothing(case: Case) -> bool:
    """Whether no pass goes through all texels of a picture, which the evaluator does in Python, one after the other.

    A histogram has whole numbers, that nothing rounds.
    """
    return all(step[0] != "histogram" for step in case.get("steps", ()))


@pytest.mark.parametrize(
    ("kind", "count"),
    [
        ("kernels", 15),
        ("graphs", 6),
        pytest.param("kernels", 60, marks=pytest.mark.slow),
        pytest.param("graphs", 12, marks=pytest.mark.slow),
    ],
)
def test_what_the_standards_allow_lies_inside(kind: str, count: int) -> None:
    tally = Tally()
    # Rounding to nearest: the bounds of polynomials count on it.
    made = strategies()[kind].filter(counts_nothing)
    failure = batch(made, [ReferenceBackend(), Conforming(7, directed=False)], 7, tally, count)
    assert failure is None, f"{failure.why}\n{failure.case}"
    print(tally)
    assert tally.verdicts["conforming"] >= count // 2
    assert tally.verdicts["reference"] == tally.verdicts["conforming"]
    assert tally.vague / tally.targets < 0.2
