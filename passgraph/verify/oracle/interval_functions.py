"""Operations over intervals: exact functions widened by their error bounds; vectors and matrices by components."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from passgraph.backends.reference.interpreter import KINDS, Domain
from passgraph.language import expand
from passgraph.language import scalar as s
from passgraph.language.operation import ANGLE
from passgraph.language.operations import OPERATIONS, Operation
from passgraph.language.types import Matrix, Scalar, Type, Vector
from passgraph.verify.oracle import interval as iv
from passgraph.verify.oracle.interval import (
    FLOAT_MAX,
    LARGEST_DIVISOR,
    ULP,
    Bounded,
    Float64,
    Interval,
    Lanes,
    as_interval,
    flushed,
    hull,
    mapped,
    rounded,
    where,
)

Function = Callable[..., Interval]

#: End of the documented domain of angles.
LARGEST_ANGLE = ANGLE.high


def _widened(row: Operation, lo: Float64, hi: Float64, nan: Lanes) -> Interval:
    # Overflow may stop at the largest number.
    lo, hi = np.minimum(lo, FLOAT_MAX), np.maximum(hi, -FLOAT_MAX)
    return rounded(lo, hi, nan, max(row.ulp, 1.0), row.absolute)


def monotone(row: Operation) -> Function:
    """Return a function that is monotone on its documented domain, and unbounded outside."""
    low, high = row.domain_of(0).promised

    def apply(a: Interval) -> Interval:
        first, last = (np.clip(x, low, high) for x in ((a.hi, a.lo) if row.course == "falls" else (a.lo, a.hi)))
        widened = _widened(row, row.reference(first), row.reference(last), a.nan)
        return where((a.lo < low) | (a.hi > high), Interval.anything(a.shape), widened)

    return apply


def corners(name: str, *arguments: Interval) -> tuple[Float64, Float64, Lanes]:
    """Return the smallest and largest result over all combinations of bounds: the range of a function monotone in each
    argument."""
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


def _sine_like(row: Operation) -> Function:
    """Return a function with |derivative| <= 1, bounded by the middle of the interval and its half width."""

    def apply(a: Interval) -> Interval:
        middle, half = 0.5 * (a.lo + a.hi), 0.5 * a.width
        value = row.reference(middle)
        widened = _widened(row, np.maximum(value - half, -1.0), np.minimum(value + half, 1.0), a.nan | np.isnan(value))
        return where(a.magnitude <= LARGEST_ANGLE, widened, _beyond(a, 1.0))

    return apply


def _tan(row: Operation, a: Interval) -> Interval:
    branch = np.floor(a.lo / np.pi + 0.5)
    one_branch = (branch == np.floor(a.hi / np.pi + 0.5)) & (a.magnitude <= LARGEST_ANGLE)
    widened = _widened(row, np.tan(a.lo), np.tan(a.hi), a.nan)
    return where(one_branch, widened, _beyond(a, np.inf))


def _beyond(a: Interval, largest: float) -> Interval:
    """Return the bound of angles too large for a result; NaN only for infinite ones."""
    lo = np.full(a.shape, -largest)
    return where(np.isfinite(a.magnitude), Interval(lo, -lo, a.nan), Interval.anything(a.shape))


def even(row: Operation) -> Function:
    """Return a function that decreases to 0, then increases."""

    def apply(a: Interval) -> Interval:
        nearest = np.where(a.has(0.0), 0.0, np.minimum(np.abs(a.lo), np.abs(a.hi)))
        return _widened(row, row.reference(nearest), row.reference(a.magnitude), a.nan)

    return apply


def _pow(row: Operation, x: Interval, y: Interval) -> Interval:
    """Return the bound of powers; a negative x has the power of its magnitude, with the sign given by the parity of a
    known exponent."""
    positive, negative = _power_of_size(row, x, y), _power_of_size(row, iv.neg(x), y)
    is_integer, half = np.floor(y.lo) == y.lo, 0.5 * y.lo
    negative = where(is_integer & (np.floor(half) != half), iv.neg(negative), negative)
    one = Interval.point(np.ones_like(positive.lo))
    no_number = Interval.point(np.full_like(one.lo, np.nan))
    # For an exponent that may not be whole nothing is known; but between -1 and 1 the only whole number is 0.
    small = where(y.has(0.0), hull(one, no_number), no_number)
    unsure = where((y.lo > -1) & (y.hi < 1), small, Interval.anything(one.shape))
    negative = where(y.exact, where(is_integer, negative, no_number), unsure)
    result = where(x.lo >= 0, positive, where(x.hi < 0, negative, hull(positive, negative)))
    # The sign of a zero is not preserved, so odd negative powers of zero are either infinity.
    either = Interval(np.full_like(one.lo, -np.inf), np.full_like(one.lo, np.inf), result.nan)
    result = where(x.has(0.0) & (y.lo < 0) & ~np.isnan(y.lo), either, result)
    return where(y.exact & (y.lo == 0), one, result)


def _power_of_size(row: Operation, x: Interval, y: Interval) -> Interval:
    """Return the bound of powers for x >= 0, monotone in x and in y."""
    base = Interval(np.maximum(x.lo, 0.0), np.maximum(x.hi, 0.0), x.nan)
    result = _widened(row, *corners("pow", base, y))
    one = Interval.point(np.ones_like(result.lo))
    return where(y.has(0.0) & x.nan, hull(result, one), result)  # 1 even for NaN


def _atan2(row: Operation, y: Interval, x: Interval) -> Interval:
    """Monotone in each argument except at the branch cut, from π (for y = 0 and -0) to -π (for y below)."""
    lo, hi, nan = corners("atan2", y, x)
    around = (y.lo < 0) & (y.hi >= 0) & (x.lo <= 0)
    lo, hi = np.where(around, -np.pi, lo), np.where(around, np.pi, hi)
    # A denormal x may be nonzero in the comparison and 0 in the division.
    widened = _widened(row, lo, hi, nan | (y.has(0.0) & x.has(0.0) & (x.lo != x.hi)))
    # From there on the quotient y / x is undefined on OpenGL.
    return where(x.magnitude > LARGEST_DIVISOR, Interval.anything(widened.shape), widened)


def _ldexp(x: Interval, n: Interval) -> Interval:
    """Return the bound of ldexp, monotone in x; an int is a single number."""
    scaled = x.both(lambda end: OPERATIONS["ldexp"].reference(end, n.lo))
    return rounded(scaled.lo, scaled.hi, scaled.nan, 0.5)


def _mix(x: Interval, y: Interval, a: Interval) -> Interval:
    """Return the bound of x * (1 - a) + y * a, with both products correlated through a.

    For a given a the minimum has each of x and y at one of its ends, and is concave in a, so it is at an end of a. The
    float32 result differs from it by three roundings of the first term and two of the second. A second bound comes from
    the single operations: loose for wide a, exact where a is 0 or 1.
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
    # Outside, terms overflow or vanish.
    tame = (np.minimum(*terms) > 1e-30) & (largest < 1e30)
    return where(tame, iv.overlap(linear, steps), steps)


def functions_of(rows: Mapping[str, Operation]) -> dict[str, Function]:
    """Return the bounds of functions with an error of their own, by the rows that state it."""
    return {
        **{row.name: even(row) if row.course == "even" else monotone(row) for row in rows.values() if row.course},
        "sin": _sine_like(rows["sin"]),
        "cos": _sine_like(rows["cos"]),
        "tan": partial(_tan, rows["tan"]),
        "pow": partial(_pow, rows["pow"]),
        "atan2": partial(_atan2, rows["atan2"]),
    }


#: Operations of one or more numbers without a jump: monotone ones and others.
FUNCTIONS: dict[str, Function] = {
    **functions_of(OPERATIONS),
    "inversesqrt": lambda a: iv.div(Interval.point(np.ones_like(a.lo)), iv.sqrt(a)),
    "mix": _mix,
    "fma": lambda a, b, c: iv.add(iv.mul(a, b), c),
    "ldexp": _ldexp,
}


def increasing(function: Callable[[NDArray[Any]], NDArray[Any]], a: Interval, ulp: float, scale: float) -> Interval:
    """Return the bound of a rising function outside the table (sRGB curves): ``ulp`` units of the result plus
    ``scale``."""
    lo, hi = function(a.lo), function(a.hi)
    slack = ulp * 2.0**-23
    return flushed(Interval(lo - slack * (np.abs(lo) + scale), hi + slack * (np.abs(hi) + scale), a.nan))


def expanded(domain: Domain[Bounded, Lanes], operation: str, arguments: Sequence[Bounded]) -> Bounded:
    """Return the bound of an operation without a bound of its own, from the operations it expands to."""
    if operation == "normalize":
        return _normalize(domain, as_interval(arguments[0]))
    if operation == "length":
        return _length(as_interval(arguments[0]))
    if operation == "distance":
        return _length(iv.sub(as_interval(arguments[0]), as_interval(arguments[1])))
    if operation == "inverse":
        return _inverse(domain, as_interval(arguments[0]))
    types = [_type_of(a) for a in arguments]
    taken = {id(a): _components(a) for a in arguments}  # the same components for the same vector, for squares
    parts = [taken[id(a)] for a in arguments]
    emitter = _Emitter(domain)
    results = expand.EXPANSIONS[operation](emitter, parts, types)  # type: ignore[arg-type]
    shape = _shape_after(operation, arguments)
    values = [emitter.value(r) for r in results]
    if not isinstance(values[0], Interval):
        bools = np.stack(np.broadcast_arrays(*values), axis=-1)  # type: ignore[arg-type]
        return np.asarray(bools.reshape(len(bools), *shape))
    stacked = _stack([as_interval(m) for m in values])
    return stacked.map(lambda x: x.reshape(len(x), *shape))


# Vectors and columns are scaled near 1 by a power of two and back: for any power, rounding changes only at overflow or
# underflow.


def _length(v: Interval) -> Interval:
    power = _power_of(v.magnitude.max(axis=1))
    near = [_times(v.map(lambda x, i=i: x[:, i]), power) for i in range(v.shape[1])]  # type: ignore[misc]
    total = iv.square(near[0])
    for part in near[1:]:
        total = iv.add(total, iv.square(part))
    root = _times(iv.sqrt(total), 1.0 / power)
    return iv.rounded(root.lo, root.hi, root.nan, 0.5)


def _inverse(domain: Domain[Bounded, Lanes], m: Interval) -> Interval:
    power = _power_of(m.magnitude.max(axis=2))  # of each column
    near = _times(m, power[:, :, None])
    size = m.shape[1]
    emitter = _Emitter(domain)
    cells = expand.plain_inverse(emitter, expand.columns(_components(near), size))  # type: ignore[arg-type]
    inverse = _stack([as_interval(emitter.value(cell)) for cell in cells]).map(lambda x: x.reshape(len(x), size, size))
    inverse = _times(inverse, power[:, None, :])
    return iv.rounded(inverse.lo, inverse.hi, inverse.nan, 0.5)


def _normalize(domain: Domain[Bounded, Lanes], v: Interval) -> Interval:
    """Return v / |v| by components: with s the other components' squares, x / √(x² + s) rises with x."""
    v = _times(v, _power_of(v.magnitude.max(axis=1))[:, None])
    parts = [v.map(lambda x, i=i: x[:, i]) for i in range(v.shape[1])]  # type: ignore[misc]
    squares = [iv.square(p) for p in parts]
    total = squares[0]
    for other in squares[1:]:
        total = iv.add(total, other)
    length = iv.sqrt(total)
    results = []
    for i, p in enumerate(parts):
        rest_lo = np.sum([q.lo for j, q in enumerate(squares) if j != i], axis=0)
        rest_hi = np.sum([q.hi for j, q in enumerate(squares) if j != i], axis=0)
        candidates = [_unit(x, rest) for x in (p.lo, p.hi) for rest in (rest_lo, rest_hi)]
        lo, hi = np.min(candidates, axis=0), np.max(candidates, axis=0)
        # The sum of n squares loses n ULP, its root half of that and 3; each may be two ULP of the quotient, which
        # loses 2.5 itself.
        results.append(iv.rounded(lo, hi, p.nan | length.nan, 2.0 * (0.5 * len(parts) + 3.0) + 2.5))
    units = _stack(results)
    zero = domain.apply("equal", [length, Interval.point(np.zeros_like(length.lo))])
    assert not isinstance(zero, Interval)
    units = iv.where(zero[:, None], Interval.point(np.zeros_like(units.lo)), units)
    strange = ~np.isfinite(v.magnitude.max(axis=1))[:, None]
    return iv.where(strange, Interval.anything(units.shape), units)


class _Emitter:
    """Replaces the emitter of scalar code: computes bounds instead."""

    def __init__(self, domain: Domain[Bounded, Lanes]) -> None:
        self.domain = domain

    def value(self, operand: Any) -> Bounded:
        return self.domain.constant(Scalar("float"), (operand.value,)) if isinstance(operand, s.Lit) else operand

    def op(self, name: str, *operands: Any) -> Bounded:
        if name == "mul" and operands[0] is operands[1] and isinstance(operands[0], Interval):
            return iv.square(operands[0])
        return self.domain.apply(name, [self.value(o) for o in operands])

    def choose(self, condition: Any, then: Any, orelse: Any) -> Bounded:
        return self.domain.select(condition, self.value(then), self.value(orelse))


def _power_of(size: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the power of two that scales a size to [1/2, 1); 1 for 0 and non-finite sizes."""
    return np.where(np.isfinite(size) & (size > 0), np.ldexp(1.0, -np.frexp(size)[1]), 1.0)


def _times(a: Interval, power: NDArray[np.float64]) -> Interval:
    """Multiply exactly: no bound leaves the range of float64."""
    return a.both(lambda end: end * power)


def _unit(x: NDArray[np.float64], rest: NDArray[np.float64]) -> NDArray[np.float64]:
    length = np.sqrt(x * x + rest)
    return np.where(length > 0, x / np.where(length > 0, length, 1.0), 0.0)


def _components(value: Bounded) -> list[Any]:
    """Return the components in order (column by column for a matrix), each (lanes,)."""
    flat = mapped(value, lambda x: x.reshape(len(x), -1))
    count = flat.shape[1]
    return [mapped(flat, lambda x, i=i: x[:, i]) for i in range(count)]  # type: ignore[misc]


def _stack(parts: list[Interval]) -> Interval:
    lo, hi, nan = (np.stack(np.broadcast_arrays(*(getattr(p, n) for p in parts)), axis=-1) for n in ("lo", "hi", "nan"))
    return Interval(lo, hi, nan)


def _type_of(value: Bounded) -> Type:
    kind = "float" if isinstance(value, Interval) else {np.dtype(v): k for k, v in KINDS.items()}[value.dtype]
    element = Scalar(kind)
    if value.ndim == 1:
        return element
    return Vector(element, value.shape[1]) if value.ndim == 2 else Matrix(*value.shape[1:])


def _shape_after(operation: str, arguments: Sequence[Bounded]) -> tuple[int, ...]:
    first = arguments[0].shape[1:]
    if OPERATIONS[operation].result in ("f", "b"):
        return ()
    if operation == "outer":
        return (*arguments[1].shape[1:], *first)
    if operation == "matmul":
        last = arguments[1].shape[1:]
        if len(first) == len(last) == 2:
            return (last[0], first[1])
        return first[1:] if len(first) == 2 else last[:1]
    return first[::-1] if operation == "transpose" else first
