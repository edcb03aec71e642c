"""The rows of the operations table over intervals: exact meaning from the table, widened by the row's own bound.

Sums and products are :mod:`.interval`'s; here is what they cannot give: functions of one or more numbers,
by where they rise and fall.  Jumps (floor, comparisons) are not here: see :mod:`.decisions`.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from passgraph.language.operation import ANGLE
from passgraph.language.operations import OPERATIONS, Operation
from passgraph.verify.oracle import interval as iv
from passgraph.verify.oracle.interval import (
    FLOAT_MAX,
    LARGEST_DIVISOR,
    ULP,
    Float64,
    Interval,
    Lanes,
    flushed,
    hull,
    rounded,
    where,
)

Function = Callable[..., Interval]

#: Where the documented domain of an angle ends.
LARGEST_ANGLE = ANGLE.high


def _widened(name: str, lo: Float64, hi: Float64, nan: Lanes) -> Interval:
    row = OPERATIONS[name]
    # What overflows may stop at the largest number.
    lo, hi = np.minimum(lo, FLOAT_MAX), np.maximum(hi, -FLOAT_MAX)
    return rounded(lo, hi, nan, max(row.ulp, 1.0), row.absolute)


def monotone(row: Operation) -> Function:
    """A function that only rises (or only falls) on its documented domain; beyond it nothing is promised."""
    low, high = row.domain_of(0).promised

    def apply(a: Interval) -> Interval:
        first, last = (np.clip(x, low, high) for x in ((a.hi, a.lo) if row.course == "falls" else (a.lo, a.hi)))
        made = _widened(row.name, row.reference(first), row.reference(last), a.nan)
        return where((a.lo < low) | (a.hi > high), Interval.anything(a.shape), made)

    return apply


def corners(name: str, *arguments: Interval) -> tuple[Float64, Float64, Lanes]:
    """Smallest and largest result at all combinations of bounds: the range, where each argument alone is monotone."""
    reference = OPERATIONS[name].reference
    lo: NDArray[Any] = np.array(np.nan)
    hi: NDArray[Any] = np.array(np.nan)
    nan = np.zeros((), np.bool_)
    for number in range(2 ** len(arguments)):
        bounds = [a.hi if number >> i & 1 else a.lo for i, a in enumerate(arguments)]
        value = reference(*np.broadcast_arrays(*bounds))
        lo, hi, nan = np.fmin(lo, value), np.fmax(hi, value), nan | np.isnan(value)
    for a in arguments:
        nan = nan | a.nan
    return lo, hi, nan


def _sine_like(name: str) -> Function:
    """|derivative| <= 1, so the middle of the interval and its half width bound the result."""
    reference = OPERATIONS[name].reference

    def apply(a: Interval) -> Interval:
        middle, half = 0.5 * (a.lo + a.hi), 0.5 * a.width
        value = reference(middle)
        made = _widened(name, np.maximum(value - half, -1.0), np.minimum(value + half, 1.0), a.nan | np.isnan(value))
        return where(a.magnitude <= LARGEST_ANGLE, made, _beyond(a, 1.0))

    return apply


def _tan(a: Interval) -> Interval:
    branch = np.floor(a.lo / np.pi + 0.5)
    one_branch = (branch == np.floor(a.hi / np.pi + 0.5)) & (a.magnitude <= LARGEST_ANGLE)
    made = _widened("tan", np.tan(a.lo), np.tan(a.hi), a.nan)
    return where(one_branch, made, _beyond(a, np.inf))


def _beyond(a: Interval, largest: float) -> Interval:
    """Of angles too large to tell a number of some size, which is NaN of infinite ones only."""
    lo = np.full(a.shape, -largest)
    return where(np.isfinite(a.magnitude), Interval(lo, -lo, a.nan), Interval.anything(a.shape))


def even(row: Operation) -> Function:
    """Falls to 0, rises from there."""

    def apply(a: Interval) -> Interval:
        nearest = np.where(a.has(0.0), 0.0, np.minimum(np.abs(a.lo), np.abs(a.hi)))
        return _widened(row.name, row.reference(nearest), row.reference(a.magnitude), a.nan)

    return apply


def _pow(x: Interval, y: Interval) -> Interval:
    """Of a negative x, the power of its size with the sign that a sure exponent's parity gives."""
    positive, negative = _power_of_size(x, y), _power_of_size(iv.neg(x), y)
    whole, half = np.floor(y.lo) == y.lo, 0.5 * y.lo
    negative = where(whole & (np.floor(half) != half), iv.neg(negative), negative)
    one = Interval.point(np.ones_like(positive.lo))
    no_number = Interval.point(np.full_like(one.lo, np.nan))
    # Of an exponent that is not surely whole nothing is known, but that between -1 and 1 only 0 is whole.
    small = where(y.has(0.0), hull(one, no_number), no_number)
    unsure = where((y.lo > -1) & (y.hi < 1), small, Interval.anything(one.shape))
    negative = where(y.exact, where(whole, negative, no_number), unsure)
    made = where(x.lo >= 0, positive, where(x.hi < 0, negative, hull(positive, negative)))
    # The sign of a zero is not kept, so that its odd negative powers are infinite either way.
    either = Interval(np.full_like(one.lo, -np.inf), np.full_like(one.lo, np.inf), made.nan)
    made = where(x.has(0.0) & (y.lo < 0) & ~np.isnan(y.lo), either, made)
    return where(y.exact & (y.lo == 0), one, made)


def _power_of_size(x: Interval, y: Interval) -> Interval:
    """Monotone in x and in y for x >= 0."""
    base = Interval(np.maximum(x.lo, 0.0), np.maximum(x.hi, 0.0), x.nan)
    made = _widened("pow", *corners("pow", base, y))
    one = Interval.point(np.ones_like(made.lo))
    return where(y.has(0.0) & x.nan, hull(made, one), made)  # 1 even where x is NaN


def _atan2(y: Interval, x: Interval) -> Interval:
    """Monotone in each argument but for the cut, where π (of y = 0, -0 too) jumps to -π (of any y below)."""
    lo, hi, nan = corners("atan2", y, x)
    around = (y.lo < 0) & (y.hi >= 0) & (x.lo <= 0)
    lo, hi = np.where(around, -np.pi, lo), np.where(around, np.pi, hi)
    # A denormal x that is not 0 when it is compared may be 0 when it divides.
    made = _widened("atan2", lo, hi, nan | (y.has(0.0) & x.has(0.0) & (x.lo != x.hi)))
    # The quotient y / x is undefined on OpenGL from there on.
    return where(x.magnitude > LARGEST_DIVISOR, Interval.anything(made.shape), made)


def _ldexp(x: Interval, n: Interval) -> Interval:
    """Monotone in x; an int is one number."""
    made = x.both(lambda end: OPERATIONS["ldexp"].reference(end, n.lo))
    return rounded(made.lo, made.hi, made.nan, 0.5)


def _mix(x: Interval, y: Interval, a: Interval) -> Interval:
    """x * (1 - a) + y * a, where the two products do not move apart as a moves.

    For one a it is smallest with each of x and y at one of its ends, and that is concave in a: smallest at an
    end of a.  Of that the float32 result is off by three roundings of the first term and two of the second.
    Step by step it is bounded too, loosely where a is wide, exactly where a is 0 or 1.
    """
    rest = iv.sub(Interval.point(np.ones_like(a.lo)), a)
    steps = iv.add(iv.mul(x, rest), iv.mul(y, a))
    lows, highs = [], []
    for end in (a.lo, a.hi):
        other = 1.0 - end
        x_rises, y_rises = other >= 0, end >= 0
        lows.append(np.where(x_rises, x.lo, x.hi) * other + np.where(y_rises, y.lo, y.hi) * end)
        highs.append(np.where(x_rises, x.hi, x.lo) * other + np.where(y_rises, y.hi, y.lo) * end)
    terms = x.magnitude * rest.magnitude, y.magnitude * a.magnitude
    off = ULP * (3.0 * terms[0] + 2.0 * terms[1])
    linear = rounded(np.minimum(*lows) - off, np.maximum(*highs) + off, steps.nan, 0.5)
    largest = np.maximum(np.maximum(*terms), np.maximum(x.magnitude, y.magnitude))
    # Beyond, terms overflow or vanish.
    tame = (np.minimum(*terms) > 1e-30) & (largest < 1e30)
    return where(tame, iv.overlap(linear, steps), steps)


#: Rows of one and more numbers that have no jump: those whose course says all, and others.
FUNCTIONS: dict[str, Function] = {
    **{row.name: even(row) if row.course == "even" else monotone(row) for row in OPERATIONS.values() if row.course},
    "inversesqrt": lambda a: iv.div(Interval.point(np.ones_like(a.lo)), iv.sqrt(a)),
    "sin": _sine_like("sin"),
    "cos": _sine_like("cos"),
    "tan": _tan,
    "pow": _pow,
    "atan2": _atan2,
    "mix": _mix,
    "fma": lambda a, b, c: iv.add(iv.mul(a, b), c),
    "ldexp": _ldexp,
}


def increasing(function: Callable[[NDArray[Any]], NDArray[Any]], a: Interval, ulp: float, scale: float) -> Interval:
    """A rising function outside the table (sRGB curves), ``ulp`` units of the result plus ``scale`` off."""
    lo, hi = function(a.lo), function(a.hi)
    slack = ulp * 2.0**-23
    return flushed(Interval(lo - slack * (np.abs(lo) + scale), hi + slack * (np.abs(hi) + scale), a.nan))
