"""What all pixels of a quad have in common is computed once; what only looks so is each pixel's own."""

from __future__ import annotations

import numpy as np
import pytest

import passgraph as pg
from passgraph.language import scalar as s
from passgraph.language.lower import lower

#: A branch too long to be a choice, of numbers that no pixel changes.
BRANCH = """
    k = 1.0
    if turn > 0.5:
        for i in range(3):
            k = k * 0.75 + sin(turn + k)
            if k > 9.0:
                break
"""
SIZE = (7, 5)


def gradients(body: str) -> pg.Program:
    lines = f"def gradients(turn: float) -> float:\n    x = float(pixel().x)\n{body}"
    return pg.compile(pg.kernel(source=lines)(into=pg.target("out", "r32f", SIZE), turn=0.75), backend="numpy")


def sines(body: str) -> int:
    lines = f"def gradients(turn: float) -> float:\n    x = float(pixel().x)\n{body}"
    program = lower(pg.kernel(source=lines).program)
    return sum(isinstance(i, s.Op) and i.operation == "round" for i in s.walk(program.body))


def common() -> float:
    k = 1.0
    for _ in range(3):
        k = k * 0.75 + np.sin(0.75 + k)
    return k


def shown(body: str) -> np.ndarray:  # type: ignore[type-arg]
    with gradients(body) as program:
        return program()["out"][..., 0]


def test_what_no_pixel_changes_is_computed_once() -> None:
    body = BRANCH + "    return dfdx(k * x) + dfdy(k * x * x)\n"
    assert sines(body) == 1
    np.testing.assert_allclose(shown(body), np.full(SIZE[::-1], common()), rtol=1e-5)


@pytest.mark.parametrize("place", ["x", "float(pixel().x)"])
def test_what_hangs_on_a_pixel_in_its_conditions_is_its_own(place: str) -> None:
    body = BRANCH.replace("turn > 0.5", f"{place} > 2.5") + "    return dfdx(k)\n"
    assert sines(body) == 2
    want = np.float64([0, 0, common() - 1, common() - 1, 0, 0, 0])
    np.testing.assert_allclose(shown(body), np.tile(want, (5, 1)), atol=1e-5)


@pytest.mark.parametrize("jump", ["", "        if x > 3.5:\n            break\n"])
def test_what_a_loop_of_each_pixel_assigns_begins_anew_for_each(jump: str) -> None:
    """``k`` asks for no pixel, but the other pixel's trips begin when this one's have ended."""
    trip = f"        k = k * 0.5 + turn\n{jump}        total += k * x\n"
    body = f"    k = 1.0\n    total = 0.0\n    for i in range(70):\n{trip}"
    k, sums, at = 1.0, [], np.arange(8.0)
    for _ in range(70):
        k = k * 0.5 + 0.75
        sums.append(k)
    total = np.where(at > 3.5, 0.0, sum(sums) * at) if jump else sum(sums) * at
    want = np.repeat(total[1::2] - total[::2], 2)[:7]
    np.testing.assert_allclose(shown(body + "    return dfdx(total)\n"), np.tile(want, (5, 1)), rtol=1e-5, atol=1e-4)
