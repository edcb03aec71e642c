"""Border rules: every read finds a texel inside, the one that padding puts there."""

from __future__ import annotations

import numpy as np
import pytest

from passgraph.language import scalar as s
from passgraph.language.borders import BORDERS, border_place, border_program, computed, period_program

PADS = {"clamp": "edge", "zero": "edge", "repeat": "wrap", "mirror": "symmetric", "reflect-101": "reflect"}
FAR = np.array([-(2**31), -(2**31) + 1, 2**31 - 2, 2**31 - 1, 2**32 + 5])


@pytest.mark.parametrize("rule", BORDERS)
@pytest.mark.parametrize("size", [1, 2, 5, 64])
def test_a_rule_leads_inside_and_is_what_its_row_says(rule: str, size: int) -> None:
    inside, far = np.arange(size), border_place(rule, FAR, size)
    np.testing.assert_array_equal(border_place(rule, inside, size), inside)
    assert ((far >= 0) & (far < size)).all()
    around = np.arange(-9 * size, 9 * size)
    once = border_place(rule, around, size)
    if BORDERS[rule].period:
        period = computed(period_program(rule), {"size": np.int64(size)})
        np.testing.assert_array_equal(border_place(rule, around + period, size), once)
    else:
        np.testing.assert_array_equal(once[around < -2 * size], border_place(rule, -2 * size - 1, size))
        np.testing.assert_array_equal(once[around >= 3 * size], border_place(rule, 3 * size, size))


@pytest.mark.parametrize("rule", PADS)
def test_a_rule_is_a_way_of_padding(rule: str) -> None:
    padded = np.pad(np.arange(5), 12, PADS[rule])  # type: ignore[call-overload]
    np.testing.assert_array_equal(border_place(rule, np.arange(-12, 17), 5), padded)


@pytest.mark.parametrize("rule", BORDERS)
def test_a_rule_is_straight_and_of_ints(rule: str) -> None:
    program = border_program(rule)
    assert all(isinstance(i, (s.LoadBuiltin, s.Op)) for i in program.body)
    assert {value.type for i in program.body for value in s.results_of(i)} == {"int"}


@pytest.mark.parametrize("rule", BORDERS)
def test_a_rule_never_leaves_32_bits(rule: str) -> None:
    """Devices compute it for the farthest ints; hosts bring those nearer first."""
    far = FAR[:4]
    for size in (1, 5, 16384):
        made = computed(border_program(rule), {"i": far, "size": np.int64(size)})
        np.testing.assert_array_equal(made, border_place(rule, far, size))
