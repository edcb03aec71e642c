"""What constants rule out is not read: whole numbers and bools of the text, of the module and of calls."""

from __future__ import annotations

import numpy as np
import pytest

import passgraph as pg
from passgraph.errors import KernelError

FUNCTIONS = """
def chosen(c: Array[float, 3], k: int) -> float:
    return 9.0 if k == 3 else c[k]

def returned(c: Array[float, 3], k: int) -> float:
    if k >= len(c):
        return 9.0
    return c[k]

def linked(c: Array[float, 3], k: int) -> float:
    if k < 3 and c[k] > 0.5:
        return 1.0
    elif k >= 3 or c[k] < 0.0:
        x = 4.0
    else:
        x = 3.0
    return x

def left(c: Array[float, 3], k: int) -> float:
    total = 0.0
    for i in range(3):
        if k == 3:
            break
        total += c[k]
    return total
"""


def run(body: str) -> list[float]:
    text = f"{FUNCTIONS}\ndef f(image: Image) -> vec4:\n    c = [0.25, 0.5, 1.0]\n    return {body}\n"
    kernel = pg.kernel(source=text, name="f")
    shown = pg.compile(kernel(pg.Input("i"), into=pg.target("o", "rgba32f")))(i=np.zeros((1, 1, 4), np.float32))["o"]
    return list(map(float, np.asarray(shown)[0, 0]))


def test_sides_and_branches_that_a_constant_argument_rules_out_are_not_checked() -> None:
    assert run("vec4(chosen(c, 3), chosen(c, 2), chosen(c, 1 + 2), chosen(c, -1 + 1))") == [9.0, 1.0, 9.0, 0.25]
    assert run("vec4(returned(c, 3), returned(c, 1), linked(c, 3), linked(c, 2))") == [9.0, 0.5, 4.0, 1.0]
    assert run("vec4(left(c, 3), left(c, 1), linked(c, 0), 0.0)") == [0.0, 1.5, 3.0, 0.0]


def test_what_is_not_ruled_out_is_checked() -> None:
    with pytest.raises(KernelError, match="index 4 is outside"):
        run("vec4(chosen(c, 4))")
    with pytest.raises(KernelError, match="index 3 is outside"):
        run("vec4(9.0 if image[0, 0].x > 0.0 else c[3])")
    with pytest.raises(KernelError, match="a condition must be bool"):
        run("vec4(1.0 if 3 else 2.0)")


def test_the_type_of_a_choice_of_whole_numbers_is_that_of_both_sides() -> None:
    assert run("vec4((1 if 2 > 1 else 2.0) / 4)") == [0.25] * 4
    assert run("vec4((7 if 2 > 1 else missing) // 2)") == [3.0] * 4
    assert run("vec4(float((uint(5) if 1 > 2 else 7) - 8)) - 4294967295.0") == [0.0] * 4


@pytest.mark.parametrize(
    "branch", ["    if True:\n        x += 1.0\n", "    match 1:\n        case _:\n            x += 1.0\n"]
)
def test_branches_one_behind_another_are_no_deeper_than_one(branch: str) -> None:
    text = f"def f() -> vec4:\n    x = 0.0\n{branch * 1200}    return vec4(x)\n"
    shown = pg.compile(pg.kernel(source=text)(into=pg.target("o", "rgba32f")), size=(1, 1))()["o"]
    assert shown[0, 0].tolist() == [1200.0] * 4
