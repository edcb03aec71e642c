"""Intervals of float32 results: the values that a conforming backend may compute, and a flag for NaN.

Bounds are float64 arrays with the lanes (pixels, fragments, vertices) on axis 0, as in the reference backend.
Arithmetic follows R. E. Moore, Interval Analysis, 1966; widening each operation by its error bound in the target's
standard follows the WebGPU conformance suite's floating-point primer (gpuweb/cts, docs/fp_primer.md).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

Float64 = NDArray[np.float64]
Lanes = NDArray[np.bool_]

#: One unit in the last place of float32, relative to the leading bit.
ULP = 2.0**-23
FLOAT_MAX = float(np.finfo(np.float32).max)
#: The smallest normal float32; a backend may flush smaller operands and results to zero.
SMALLEST_NORMAL = 2.0**-126
#: The largest denormal float32.
LARGEST_DENORMAL = 2.0**-126 - 2.0**-149
#: Number of denormals of one sign.
DENORMALS = np.uint32((1 << 23) - 1)
#: Bit pattern of the negative number next to 0.
FIRST_BELOW_ZERO = np.uint32(0x80000001)
#: OpenGL defines no quotient by a larger divisor, since its reciprocal may be flushed.
LARGEST_DIVISOR = 2.0**126


@dataclass(frozen=True, eq=False)
class Interval:
    """The numbers from ``lo`` to ``hi`` (equal shapes), and NaN where ``nan`` is True.

    If both bounds are NaN, the value is certainly NaN.
    """

    lo: Float64
    hi: Float64
    nan: Lanes

    @classmethod
    def point(cls, numbers: NDArray[Any]) -> Interval:
        """Return intervals of exactly these numbers."""
        exact = np.asarray(numbers, np.float64)
        return cls(exact, exact, np.isnan(exact))

    @classmethod
    def as_read(cls, numbers: NDArray[Any]) -> Interval:
        """Return intervals of numbers that a backend reads: denormals may be flushed to 0."""
        return flushed(cls.point(numbers))

    @classmethod
    def anything(cls, shape: tuple[int, ...]) -> Interval:
        """Return unbounded intervals, NaN included."""
        return cls(np.full(shape, -np.inf), np.full(shape, np.inf), np.ones(shape, np.bool_))

    def without(self, numbers: NDArray[Any]) -> Lanes:
        """Return which of some numbers lie outside."""
        exact = numbers.astype(np.float64)
        inside = (exact >= self.lo) & (exact <= self.hi)
        return np.asarray(np.where(np.isnan(exact), ~self.nan, ~inside))

    def map(self, function: Callable[[NDArray[Any]], NDArray[Any]]) -> Interval:
        """Rearrange all three arrays alike; exactly known numbers keep sharing one array."""
        lo = function(self.lo)
        return Interval(lo, lo if self.hi is self.lo else function(self.hi), function(self.nan))

    def both(self, function: Callable[[Float64], Float64]) -> Interval:
        """Apply a non-decreasing function to both bounds."""
        return Interval(function(self.lo), function(self.hi), self.nan)

    def take(self, chosen: NDArray[Any] | slice | tuple[slice, ...]) -> Interval:
        """Return some of the lanes."""
        return Interval(self.lo[chosen], self.hi[chosen], self.nan[chosen])

    @property
    def shape(self) -> tuple[int, ...]:
        return self.lo.shape

    @property
    def ndim(self) -> int:
        return self.lo.ndim

    def __len__(self) -> int:
        return len(self.lo)

    @property
    def exact(self) -> Lanes:
        """Return where only one number is possible."""
        return np.asarray((self.lo == self.hi) & ~self.nan)

    @property
    def width(self) -> Float64:
        """Return the distance of the bounds; 0 for a single number, infinite or not, and for a certain NaN."""
        with np.errstate(invalid="ignore"):
            return np.asarray(np.where((self.lo == self.hi) | np.isnan(self.lo), 0.0, self.hi - self.lo))

    def has(self, number: float) -> Lanes:
        return np.asarray((self.lo <= number) & (self.hi >= number))

    @property
    def magnitude(self) -> Float64:
        """Return the largest absolute value."""
        return np.asarray(np.maximum(np.abs(self.lo), np.abs(self.hi)))


#: Values of the oracle: intervals for floats, plain numbers for ints and bools.
Bounded: TypeAlias = Interval | NDArray[Any]


def as_interval(value: Bounded) -> Interval:
    """Return exactly known numbers as an interval."""
    return value if isinstance(value, Interval) else Interval.point(value)


def mapped(value: Bounded, function: Callable[[NDArray[Any]], NDArray[Any]]) -> Bounded:
    """Rearrange all arrays of a value alike."""
    return value.map(function) if isinstance(value, Interval) else function(value)


def flushed(a: Interval) -> Interval:
    """Include 0 where a denormal may occur; exactly known numbers keep sharing one array."""
    if a.lo is a.hi and not ((np.abs(a.lo) < SMALLEST_NORMAL) & (a.lo != 0)).any():
        return a
    lo = np.where((a.lo > 0) & (a.lo < SMALLEST_NORMAL), 0.0, a.lo)
    hi = np.where((a.hi < 0) & (a.hi > -SMALLEST_NORMAL), 0.0, a.hi)
    return Interval(lo, hi, a.nan)


def hull(a: Interval, b: Interval) -> Interval:
    """Return the hull of both; a certain NaN adds no number."""
    return Interval(np.fmin(a.lo, b.lo), np.fmax(a.hi, b.hi), a.nan | b.nan)


def overlap(a: Interval, b: Interval) -> Interval:
    """Return the intersection of two bounds that both hold."""
    return Interval(np.maximum(a.lo, b.lo), np.minimum(a.hi, b.hi), a.nan & b.nan)


def where(condition: Lanes, a: Interval, b: Interval) -> Interval:
    return Interval(np.where(condition, a.lo, b.lo), np.where(condition, a.hi, b.hi), np.where(condition, a.nan, b.nan))


def rounded(lo: Float64, hi: Float64, nan: Lanes, ulp: float, absolute: float = 0.0) -> Interval:
    """Widen the bounds of exact results to the float32 values that a backend may return.

    Up to one ULP stands for any rounding mode: outward to the next float32, while exact float32 values stay.  More than
    one widens by that many units in the last place of the bound, and by ``absolute``.
    """
    if ulp > 1.0 or absolute > 0.0:
        lo = lo - np.nan_to_num(ulp * spacing(lo) + absolute, nan=0.0)
        hi = hi + np.nan_to_num(ulp * spacing(hi) + absolute, nan=0.0)
    return Interval(*_outward(lo, hi), nan)


def spacing(number: Float64) -> Float64:
    """Return one ULP of float32 at each number; 0 for non-finite numbers."""
    size = np.minimum(np.abs(number), FLOAT_MAX).astype(np.float32)
    unit = np.spacing(np.maximum(size, np.float32(SMALLEST_NORMAL))).astype(np.float64)
    return np.where(np.isfinite(number), unit, 0.0)


def _outward(lo: Float64, hi: Float64) -> tuple[Float64, Float64]:
    """Round outward to float32, and to 0 where a denormal may be flushed that way.

    Both bounds are computed in one call, with the lower one negated: for small arrays the number of calls determines
    the time.
    """
    exact = np.empty((2, *lo.shape))
    np.negative(lo, out=exact[0])
    exact[1] = hi
    nearest = exact.astype(np.float32)
    bits = nearest.view(np.int32)
    # Neighboring float32 values have neighboring bit patterns, which grow away from 0; rounding to zero keeps the sign.
    bits += ((bits >> 31) | 1) * (nearest < exact)
    tiny = bits.view(np.uint32) - FIRST_BELOW_ZERO < DENORMALS
    if tiny.any():
        nearest[0][tiny[0]], nearest[1][tiny[1]] = -0.0, 0.0
    outward = nearest.astype(np.float64)
    return np.negative(outward[0], out=outward[0]), outward[1]


def compared(name: str, a: Interval, b: Interval) -> tuple[Lanes, Lanes]:
    """Return where a comparison may hold, and where it may fail, as for NaN."""
    same = a.exact & b.exact & (a.lo == b.lo)
    meet, nan = (a.lo <= b.hi) & (b.lo <= a.hi), a.nan | b.nan
    return {
        "never": (np.zeros_like(meet), np.ones_like(meet)),
        "always": (np.ones_like(meet), np.zeros_like(meet)),
        "less": (a.lo < b.hi, ~(a.hi < b.lo) | nan),
        "less_equal": (a.lo <= b.hi, ~(a.hi <= b.lo) | nan),
        "greater": (a.hi > b.lo, ~(a.lo > b.hi) | nan),
        "greater_equal": (a.hi >= b.lo, ~(a.lo >= b.hi) | nan),
        "equal": (meet, ~same),
        "not_equal": (~same, meet),
    }[name]


# Arithmetic


def _all_finite(lo: Float64, hi: Float64) -> bool:
    """Return True if sums or products had no infinite or NaN operand; none of them overflows float64."""
    return bool(np.isfinite(lo.sum() + hi.sum()))


def add(a: Interval, b: Interval, ulp: float = 0.5) -> Interval:
    lo, hi = a.lo + b.lo, a.hi + b.hi
    if _all_finite(lo, hi):
        return rounded(lo, hi, a.nan | b.nan, ulp)
    cancel = ((a.hi == np.inf) & (b.lo == -np.inf)) | ((a.lo == -np.inf) & (b.hi == np.inf))
    # If only one end is NaN, there are still other numbers.
    one = np.isnan(lo) != np.isnan(hi)
    lo, hi = np.where(one & np.isnan(lo), -np.inf, lo), np.where(one & np.isnan(hi), np.inf, hi)
    return rounded(lo, hi, a.nan | b.nan | cancel, ulp)


def neg(a: Interval) -> Interval:
    return Interval(-a.hi, -a.lo, a.nan)


def sub(a: Interval, b: Interval, ulp: float = 0.5) -> Interval:
    return add(a, neg(b), ulp)


def mul(a: Interval, b: Interval, ulp: float = 0.5) -> Interval:
    a, b = (b, a) if a.lo is a.hi else (a, b)
    known = b.lo is b.hi  # parameters, literals and texels
    products = (a.lo * b.lo, a.hi * b.lo) if known else (a.lo * b.lo, a.hi * b.lo, a.lo * b.hi, a.hi * b.hi)
    lo, hi = np.minimum(*products[:2]), np.maximum(*products[:2])
    if not known:
        lo, hi = np.minimum(lo, np.minimum(*products[2:])), np.maximum(hi, np.maximum(*products[2:]))
    if _all_finite(lo, hi):
        return rounded(lo, hi, a.nan | b.nan, ulp)
    lo, hi = products[0], products[0]
    for product in products[1:]:
        lo, hi = np.fmin(lo, product), np.fmax(hi, product)
    infinite_a, infinite_b = np.isinf(a.magnitude), np.isinf(b.magnitude)
    undefined = (a.has(0.0) & infinite_b) | (b.has(0.0) & infinite_a)
    nan = a.nan | b.nan | undefined
    # In addition to 0 times infinity, 0 times all smaller numbers is possible.
    zero = (a.has(0.0) & infinite_b & ~_only_infinite(b)) | (b.has(0.0) & infinite_a & ~_only_infinite(a))
    lo, hi = np.where(zero, np.fmin(lo, 0.0), lo), np.where(zero, np.fmax(hi, 0.0), hi)
    return rounded(lo, hi, nan, ulp)


def _only_infinite(a: Interval) -> Lanes:
    return np.asarray((a.lo == a.hi) & np.isinf(a.lo))


def square(a: Interval) -> Interval:
    """Return a * a, where both factors are the same number."""
    low, high = a.lo * a.lo, a.hi * a.hi
    lo = np.where(a.has(0.0), 0.0, np.minimum(low, high))
    return rounded(lo, np.maximum(low, high), a.nan, 0.5)


def div(a: Interval, b: Interval, ulp: float = 2.5) -> Interval:
    quotients = (a.lo / b.lo, a.lo / b.hi, a.hi / b.lo, a.hi / b.hi)
    lo, hi = quotients[0], quotients[0]
    for quotient in quotients[1:]:
        lo, hi = np.fmin(lo, quotient), np.fmax(hi, quotient)
    tiny = b.magnitude > LARGEST_DIVISOR
    nan = a.nan | b.nan | (np.isinf(a.magnitude) & tiny) | (a.has(0.0) & b.has(0.0))
    # OpenGL may multiply by the reciprocal; in addition to 0 / 0, 0 over all other divisors is possible.
    zero = tiny | (a.has(0.0) & b.has(0.0) & (b.lo != b.hi))
    lo, hi = np.where(zero, np.fmin(lo, 0.0), lo), np.where(zero, np.fmax(hi, 0.0), hi)
    # No standard preserves the sign of zero through all operations, so a zero divisor gives either infinity.
    pole = b.has(0.0) & ~((a.lo == 0) & (a.hi == 0)) & ~np.isnan(a.lo)
    lo, hi = np.where(pole, -np.inf, lo), np.where(pole, np.inf, hi)
    # A quotient of 0 is exact, however it is computed.
    nothing = (a.lo == 0) & (a.hi == 0)
    return where(nothing, Interval(lo, hi, nan), rounded(lo, hi, nan, ulp))


def sqrt(a: Interval, ulp: float = 3.0) -> Interval:
    """Return the square root: unbounded below 0, except for denormals, which give the root of 0 or NaN."""
    lo, hi = np.sqrt(np.maximum(a.lo, 0.0)), np.sqrt(np.maximum(a.hi, 0.0))
    result = rounded(lo, hi, a.nan | (a.lo < 0), ulp)
    zero = (a.lo > -SMALLEST_NORMAL) & (a.hi <= 0)  # 0 has its exact root on every target
    result = where(zero, Interval(lo, lo, result.nan), result)
    return where(a.lo <= -SMALLEST_NORMAL, Interval.anything(lo.shape), result)


def absolute(a: Interval) -> Interval:
    lo = np.where(a.has(0.0), 0.0, np.minimum(np.abs(a.lo), np.abs(a.hi)))
    return Interval(lo, a.magnitude, a.nan)


def minimum(a: Interval, b: Interval) -> Interval:
    """Return ``b if b < a else a``: a NaN in ``b`` gives a, one in ``a`` stays."""
    hi = np.minimum(a.hi, b.hi)
    hi = np.where(_taken_for_equal(a, b), np.maximum(hi, np.minimum(np.maximum(a.hi, b.hi), LARGEST_DENORMAL)), hi)
    return _with_nan(a, b, Interval(np.minimum(a.lo, b.lo), hi, a.nan))


def maximum(a: Interval, b: Interval) -> Interval:
    """Return ``b if a < b else a``."""
    lo = np.maximum(a.lo, b.lo)
    lo = np.where(_taken_for_equal(a, b), np.minimum(lo, np.maximum(np.minimum(a.lo, b.lo), -LARGEST_DENORMAL)), lo)
    return _with_nan(a, b, Interval(lo, np.maximum(a.hi, b.hi), a.nan))


def _taken_for_equal(a: Interval, b: Interval) -> Lanes:
    """Return where both may be denormal: a comparison may see two zeros, and the function may return either unflushed.

    GLSL 4.60, 4.7.1, lets any operation flush its operands; OpenCL C 3.0, 7.5.3, does so for a device without
    denormals; both define these functions by a comparison and a selection.
    """
    return np.asarray(
        (a.lo < SMALLEST_NORMAL) & (a.hi > -SMALLEST_NORMAL) & (b.lo < SMALLEST_NORMAL) & (b.hi > -SMALLEST_NORMAL)
    )


def _with_nan(a: Interval, b: Interval, both: Interval) -> Interval:
    result = where(b.nan, hull(a, both), both)
    result = where(np.isnan(b.lo), a, result)
    return where(np.isnan(a.lo), a, result)
