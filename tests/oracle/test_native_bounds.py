"""Bounds of a device's own functions, held to the specifications' numbers with exact values from mpmath."""

from __future__ import annotations

import mpmath
import numpy as np
import pytest
from numpy.typing import NDArray

from passgraph.language.native import GLSL, NOTHING, OPENCL, WGSL, Accuracy
from passgraph.verify.oracle.decisions import Track
from passgraph.verify.oracle.domain import IntervalDomain
from passgraph.verify.oracle.interval import Interval

SPECIFICATIONS = {"GLSL": GLSL, "WGSL": WGSL, "OpenCL": OPENCL}
#: Arguments of each function, away from its poles.
POINTS: dict[str, list[tuple[float, ...]]] = {
    "pow": [(0.3, 2.7), (7.5, -1.25), (1.0625, 12.5)], "atan2": [(0.5, -2.0), (-3.0, 0.25), (1e-3, 4.0)],
    "acosh": [(1.5,), (40.0,)], "log": [(0.3,), (0.75,), (1.5,), (9.0,)], "log2": [(0.3,), (0.75,), (1.5,), (9.0,)],
    "exp": [(-20.0,), (0.1,), (6.5,)], "exp2": [(-20.0,), (0.1,), (6.5,)], "inversesqrt": [(0.01,), (3.0,)],
    "atanh": [(-0.5,), (0.9,)], "asin": [(-0.9,), (0.25,)], "acos": [(-0.9,), (0.25,)],
    "mod": [(2.5, 0.7), (-1.3, 0.45)], "smoothstep": [(-1.5, 1.25, 0.3), (0.1, 0.7, 0.65)],
}  # fmt: skip
ORDINARY = [(-2.5,), (0.3,), (1.2,)]
_EXACT = {"inversesqrt": lambda x: 1 / mpmath.sqrt(x), "exp2": lambda x: mpmath.mpf(2) ** x, "pow": mpmath.power,
          "log2": lambda x: mpmath.log(x, 2), "fract": lambda x: x - mpmath.floor(x),
          "mod": lambda x, y: x - y * mpmath.floor(x / y),
          "smoothstep": lambda low, high, x: ((x - low) / (high - low)) ** 2 * (3 - 2 * (x - low) / (high - low)),
}  # fmt: skip


def exact(name: str, point: tuple[float, ...]) -> float:
    with mpmath.workprec(200):
        return float(_EXACT.get(name, getattr(mpmath, name, None))(*(mpmath.mpf(float(np.float32(x))) for x in point)))


def bound(specification: dict[str, Accuracy], name: str, point: tuple[float, ...]) -> tuple[float, float, bool]:
    track = Track(np.empty((1, 0), np.int8), np.arange(1))
    arguments = [Interval.point(np.float32([x]).astype(np.float64)) for x in point]
    with np.errstate(all="ignore"):
        made = IntervalDomain(track, specification).apply(name, arguments)
    assert isinstance(made, Interval)
    return float(made.lo[0]), float(made.hi[0]), bool(np.any(made.nan))


def ulp(x: float) -> float:
    return float(np.spacing(np.float32(abs(x))))


def promised(accuracy: Accuracy, x: float, value: float) -> float:
    """The largest error that the specification's own numbers permit, leaving out formulas."""
    units = ((accuracy.ulp or 0.0) + accuracy.ulp_by_size * abs(x)) * ulp(value)
    return max(units, accuracy.absolute, accuracy.near_one if 0.5 <= abs(x) <= 2.0 else 0.0)


CASES = [
    pytest.param(which, name, point, id=f"{which}-{name}-{point[0]}")
    for which, functions in SPECIFICATIONS.items()
    for name, accuracy in functions.items()
    if accuracy.promises
    for point in POINTS.get(name, ORDINARY)
]


@pytest.mark.parametrize(("which", "name", "point"), CASES)
def test_errors_that_a_specification_permits_are_allowed_and_hardly_larger_ones(
    which: str, name: str, point: tuple[float, ...]
) -> None:
    accuracy = SPECIFICATIONS[which][name]
    value = exact(name, point)
    low, high, nan = bound(dict(SPECIFICATIONS[which]), name, point)
    most = promised(accuracy, np.float32(point[0]).item(), value)
    assert low <= value - 0.999 * most
    assert high >= value + 0.999 * most
    assert not nan
    if not accuracy.formula:
        # The exact value is rounded outward to float32 first, and the bound's ends are too.
        assert low >= value - most - 3 * ulp(value)
        assert high <= value + most + 3 * ulp(value)
    else:
        assert np.isfinite([low, high]).all()


def test_a_power_inherits_the_errors_of_its_formula() -> None:
    """Of exp2(y * log2(x)): an error of log2 is multiplied by y, and exp2 of 90 may be 183 ULP off."""
    value = exact("pow", (2.0, 90.5))
    low, high, _ = bound(dict(GLSL), "pow", (2.0, 90.5))
    of_logarithm = 90.5 * 2.0**-21 * np.log(2.0) * value
    of_power = (3.0 + 2.0 * 90.5) * ulp(value)
    assert high - value == pytest.approx(of_logarithm + of_power, rel=0.1)
    assert value - low == pytest.approx(of_logarithm + of_power, rel=0.1)


@pytest.mark.parametrize("name", [name for name, accuracy in GLSL.items() if accuracy == NOTHING])
def test_where_nothing_is_promised_any_number_is_allowed(name: str) -> None:
    low, high, nan = bound(dict(GLSL), name, (0.5, 0.5)[: 2 if name == "atan2" else 1])
    assert (low, high, nan) == (-np.inf, np.inf, True)


@pytest.mark.parametrize(
    ("name", "point"),
    [("sin", (4.0,)), ("cos", (-3.5,)), ("exp", (np.inf,)), ("exp2", (np.nan,)), ("log2", (-1.0,)),
     ("pow", (-2.0, 2.0)), ("inversesqrt", (0.0,)), ("asin", (1.5,))],
)  # fmt: skip
def test_outside_of_what_is_promised_any_number_is_allowed(name: str, point: tuple[float, ...]) -> None:
    low, high, nan = bound(dict(WGSL), name, point)
    assert (low, high, nan) == (-np.inf, np.inf, True)


def test_a_denormal_argument_may_be_taken_for_zero() -> None:
    low, _, _ = bound(dict(GLSL), "log2", (1e-40,))
    assert low == -np.inf


def test_bounds_of_an_interval_hold_for_the_numbers_inside() -> None:
    random = np.random.default_rng(4)
    ends: NDArray[np.float64] = np.sort(np.float32(random.uniform(0.1, 3.0, (2, 500))), axis=0).astype(np.float64)
    inside = np.float32(ends[0] + (ends[1] - ends[0]) * random.random(500)).astype(np.float64)
    for name in ("exp", "log2", "inversesqrt", "sin", "tanh", "atan"):
        track = Track(np.empty((500, 0), np.int8), np.arange(500))
        wide = IntervalDomain(track, WGSL).apply(name, [Interval(ends[0], ends[1], np.zeros(500, np.bool_))])
        point = IntervalDomain(track, WGSL).apply(name, [Interval.point(inside)])
        assert isinstance(wide, Interval)
        assert isinstance(point, Interval)
        assert (wide.lo <= point.lo).all(), name
        assert (wide.hi >= point.hi).all(), name
