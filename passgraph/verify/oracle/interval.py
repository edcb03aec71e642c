"""Intervals of float32 results: every value that a conforming backend may have at a place, and whether NaN is one.

Bounds are float64 arrays with the lanes (pixels, fragments, vertices) on axis 0, as in the reference backend.
Arithmetic follows R. E. Moore, Interval Analysis, 1966; that each operation is widened by what its target's
standard allows follows the WebGPU conformance suite's floating-point primer (gpuweb/cts, docs/fp_primer.md).
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
#: Below this a backend may flush to zero, what it reads and what it makes.
SMALLEST_NORMAL = 2.0**-126
#: The largest number of those.
LARGEST_DENORMAL = 2.0**-126 - 2.0**-149
#: How many numbers of one sign are too small to be normal.
DENORMALS = np.uint32((1 << 23) - 1)
#: The bits of the negative number next to 0.
FIRST_BELOW_ZERO = np.uint32(0x80000001)
#: Beyond this divisor OpenGL promises nothing of a quotient: its reciprocal may be flushed.
LARGEST_DIVISOR = 2.0**126


@dataclass(frozen=True, eq=False)
class Interval:
    """Numbers from ``lo`` to ``hi`` (equal shapes), and NaN where ``nan`` holds.

    Where both bounds are NaN there is no number: the value is NaN for sure.
    """

    lo: Float64
    hi: Float64
    nan: Lanes

    @classmethod
    def point(cls, numbers: NDArray[Any]) -> Interval:
        """Exactly these numbers."""
        exact = np.asarray(numbers, np.float64)
        return cls(exact, exact, np.isnan(exact))

    @classmethod
    def of(cls, numbers: NDArray[Any]) -> Interval:
        """Numbers that a backend reads: denormals may have become 0."""
        return flushed(cls.point(numbers))

    @classmethod
    def anything(cls, shape: tuple[int, ...]) -> Interval:
        """No statement at all."""
        return cls(np.full(shape, -np.inf), np.full(shape, np.inf), np.ones(shape, np.bool_))

    def without(self, numbers: NDArray[Any]) -> Lanes:
        """Return which of some numbers lie outside."""
        exact = numbers.astype(np.float64)
        inside = (exact >= self.lo) & (exact <= self.hi)
        return np.asarray(np.where(np.isnan(exact), ~self.nan, ~inside))

    def map(self, function: Callable[[NDArray[Any]], NDArray[Any]]) -> Interval:
        """The same rearrangement of all three arrays; of numbers that are known, one array stays both bounds."""
        lo = function(self.lo)
        return Interval(lo, lo if self.hi is self.lo else function(self.hi), function(self.nan))

    def both(self, function: Callable[[Float64], Float64]) -> Interval:
        """Both bounds through a function that does not fall."""
        return Interval(function(self.lo), function(self.hi), self.nan)

    def take(self, chosen: NDArray[Any] | slice | tuple[slice, ...]) -> Interval:
        """Some of the lanes."""
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
        """Distance of the bounds; 0 for one number, infinite or not, and for a sure NaN."""
        with np.errstate(invalid="ignore"):
            return np.asarray(np.where((self.lo == self.hi) | np.isnan(self.lo), 0.0, self.hi - self.lo))

    def has(self, number: float) -> Lanes:
        return np.asarray((self.lo <= number) & (self.hi >= number))

    @property
    def magnitude(self) -> Float64:
        """The largest absolute value."""
        return np.asarray(np.maximum(np.abs(self.lo), np.abs(self.hi)))


#: What the oracle computes with: intervals for floats, plain numbers for ints and bools.
Bounded: TypeAlias = Interval | NDArray[Any]


def as_interval(value: Bounded) -> Interval:
    """Numbers that are known exactly as an interval."""
    return value if isinstance(value, Interval) else Interval.point(value)


def mapped(value: Bounded, function: Callable[[NDArray[Any]], NDArray[Any]]) -> Bounded:
    """The same rearrangement of all arrays."""
    return value.map(function) if isinstance(value, Interval) else function(value)


def flushed(a: Interval) -> Interval:
    """Include 0 where a number too small to be normal may occur; known numbers stay one array."""
    if a.lo is a.hi and not ((np.abs(a.lo) < SMALLEST_NORMAL) & (a.lo != 0)).any():
        return a
    lo = np.where((a.lo > 0) & (a.lo < SMALLEST_NORMAL), 0.0, a.lo)
    hi = np.where((a.hi < 0) & (a.hi > -SMALLEST_NORMAL), 0.0, a.hi)
    return Interval(lo, hi, a.nan)


def hull(a: Interval, b: Interval) -> Interval:
    """Everything that either may be; a sure NaN adds no number."""
    return Interval(np.fmin(a.lo, b.lo), np.fmax(a.hi, b.hi), a.nan | b.nan)


def overlap(a: Interval, b: Interval) -> Interval:
    """Return the intersection of two bounds that both hold."""
    return Interval(np.maximum(a.lo, b.lo), np.minimum(a.hi, b.hi), a.nan & b.nan)


def where(condition: Lanes, a: Interval, b: Interval) -> Interval:
    return Interval(np.where(condition, a.lo, b.lo), np.where(condition, a.hi, b.hi), np.where(condition, a.nan, b.nan))


def rounded(lo: Float64, hi: Float64, nan: Lanes, ulp: float, absolute: float = 0.0) -> Interval:
    """Bounds of exact results widened to what float32 may hold of them.

    Up to one ULP is any of the rounding modes: outward to the next float32, so that what float32 holds
    exactly stays.  More is that many units in the last place of the bound itself, and ``absolute``.
    """
    if ulp > 1.0 or absolute > 0.0:
        lo = lo - np.nan_to_num(ulp * spacing(lo) + absolute, nan=0.0)
        hi = hi + np.nan_to_num(ulp * spacing(hi) + absolute, nan=0.0)
    return Interval(*_outward(lo, hi), nan)


def spacing(number: Float64) -> Float64:
    """One ULP of float32 at each number; 0 where it is not finite."""
    size = np.minimum(np.abs(number), FLOAT_MAX).astype(np.float32)
    unit = np.spacing(np.maximum(size, np.float32(SMALLEST_NORMAL))).astype(np.float64)
    return np.where(np.isfinite(number), unit, 0.0)


def _outward(lo: Float64, hi: Float64) -> tuple[Float64, Float64]:
    """The next float32 down and up of what is none, and 0 where that way a denormal may have become it.

    Both at once, as negated, what is next down is next up: small arrays take as long as there are calls.
    """
    exact = np.empty((2, *lo.shape))
    np.negative(lo, out=exact[0])
    exact[1] = hi
    nearest = exact.astype(np.float32)
    bits = nearest.view(np.int32)
    # Neighbors of a float32 have neighboring bits, that grow away from 0; what rounds to a zero keeps its sign.
    bits += ((bits >> 31) | 1) * (nearest < exact)
    tiny = bits.view(np.uint32) - FIRST_BELOW_ZERO < DENORMALS
    if tiny.any():
        nearest[0][tiny[0]], nearest[1][tiny[1]] = -0.0, 0.0
    outward = nearest.astype(np.float64)
    return np.negative(outward[0], out=outward[0]), outward[1]


# Arithmetic


def _all_finite(lo: Float64, hi: Float64) -> bool:
    """Whether nothing infinite or NaN went into sums or products, of which none overflows float64."""
    return bool(np.isfinite(lo.sum() + hi.sum()))


def add(a: Interval, b: Interval, ulp: float = 0.5) -> Interval:
    lo, hi = a.lo + b.lo, a.hi + b.hi
    if _all_finite(lo, hi):
        return rounded(lo, hi, a.nan | b.nan, ulp)
    cancel = ((a.hi == np.inf) & (b.lo == -np.inf)) | ((a.lo == -np.inf) & (b.hi == np.inf))
    # Of a NaN at one end only, numbers may still be left beside it.
    one = np.isnan(lo) != np.isnan(hi)
    lo, hi = np.where(one & np.isnan(lo), -np.inf, lo), np.where(one & np.isnan(hi), np.inf, hi)
    return rounded(lo, hi, a.nan | b.nan | cancel, ulp)


def neg(a: Interval) -> Interval:
    return Interval(-a.hi, -a.lo, a.nan)


def sub(a: Interval, b: Interval, ulp: float = 0.5) -> Interval:
    return add(a, neg(b), ulp)


def mul(a: Interval, b: Interval, ulp: float = 0.5) -> Interval:
    a, b = (b, a) if a.lo is a.hi else (a, b)
    known = b.lo is b.hi  # as parameters, literals and texels are
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
    # Beside 0 times infinity there is 0 times everything less.
    zero = (a.has(0.0) & infinite_b & ~_only_infinite(b)) | (b.has(0.0) & infinite_a & ~_only_infinite(a))
    lo, hi = np.where(zero, np.fmin(lo, 0.0), lo), np.where(zero, np.fmax(hi, 0.0), hi)
    return rounded(lo, hi, nan, ulp)


def _only_infinite(a: Interval) -> Lanes:
    return np.asarray((a.lo == a.hi) & np.isinf(a.lo))


def square(a: Interval) -> Interval:
    """a * a with both factors the same number."""
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
    # OpenGL may multiply by the reciprocal; beside 0 over 0 there is 0 over everything else.
    zero = tiny | (a.has(0.0) & b.has(0.0) & (b.lo != b.hi))
    lo, hi = np.where(zero, np.fmin(lo, 0.0), lo), np.where(zero, np.fmax(hi, 0.0), hi)
    # No standard keeps the sign of a zero through all operations, so a zero divisor gives either infinity.
    pole = b.has(0.0) & ~((a.lo == 0) & (a.hi == 0)) & ~np.isnan(a.lo)
    lo, hi = np.where(pole, -np.inf, lo), np.where(pole, np.inf, hi)
    # However a quotient is computed, that of 0 has nothing to round.
    nothing = (a.lo == 0) & (a.hi == 0)
    return where(nothing, Interval(lo, hi, nan), rounded(lo, hi, nan, ulp))


def sqrt(a: Interval, ulp: float = 3.0) -> Interval:
    """Below 0 nothing is promised, but of what is too small to be normal: the root of 0, or NaN."""
    lo, hi = np.sqrt(np.maximum(a.lo, 0.0)), np.sqrt(np.maximum(a.hi, 0.0))
    result = rounded(lo, hi, a.nan | (a.lo < 0), ulp)
    zero = (a.lo > -SMALLEST_NORMAL) & (a.hi <= 0)  # 0 has its exact root on every target
    result = where(zero, Interval(lo, lo, result.nan), result)
    return where(a.lo <= -SMALLEST_NORMAL, Interval.anything(lo.shape), result)


def absolute(a: Interval) -> Interval:
    lo = np.where(a.has(0.0), 0.0, np.minimum(np.abs(a.lo), np.abs(a.hi)))
    return Interval(lo, a.magnitude, a.nan)


def minimum(a: Interval, b: Interval) -> Interval:
    """``b if b < a else a``: a NaN in ``b`` gives a, one in ``a`` stays."""
    hi = np.minimum(a.hi, b.hi)
    hi = np.where(_taken_for_equal(a, b), np.maximum(hi, np.minimum(np.maximum(a.hi, b.hi), LARGEST_DENORMAL)), hi)
    return _with_nan(a, b, Interval(np.minimum(a.lo, b.lo), hi, a.nan))


def maximum(a: Interval, b: Interval) -> Interval:
    """``b if a < b else a``."""
    lo = np.maximum(a.lo, b.lo)
    lo = np.where(_taken_for_equal(a, b), np.minimum(lo, np.maximum(np.minimum(a.lo, b.lo), -LARGEST_DENORMAL)), lo)
    return _with_nan(a, b, Interval(lo, np.maximum(a.hi, b.hi), a.nan))


def _taken_for_equal(a: Interval, b: Interval) -> Lanes:
    """Return where both may be denormal: a comparison may see two zeros, and pass on either unchanged.

    GLSL 4.60, 4.7.1, lets any operation flush what it reads, OpenCL C 3.0, 7.5.3, a device without denormals; both
    define the two functions by a comparison that chooses.
    """
    return np.asarray(
        (a.lo < SMALLEST_NORMAL) & (a.hi > -SMALLEST_NORMAL) & (b.lo < SMALLEST_NORMAL) & (b.hi > -SMALLEST_NORMAL)
    )


def _with_nan(a: Interval, b: Interval, both: Interval) -> Interval:
    result = where(b.nan, hull(a, both), both)
    result = where(np.isnan(b.lo), a, result)
    return where(np.isnan(a.lo), a, result)
