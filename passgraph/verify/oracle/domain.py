"""The interpreter's domain for bounds: intervals for floats, plain numbers for ints and bools.

An int or bool that depends on a float is a decision (:mod:`.decisions`): on one path of the program it has one value,
so control flow, indices and texel positions are exact.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from passgraph.backends.reference.interpreter import Domain, NumberDomain, Numbers, Part, shaped
from passgraph.language import ir
from passgraph.language.meanings import BELOW_ONE, INT_MAX, INT_MIN
from passgraph.language.native import Accuracy
from passgraph.language.operations import OPERATIONS
from passgraph.language.symbols import UINT_MAX
from passgraph.language.types import Array, Type, Value, element_of, shape_of
from passgraph.verify.oracle import interval as iv
from passgraph.verify.oracle import interval_functions
from passgraph.verify.oracle.decisions import Track
from passgraph.verify.oracle.interval import FLOAT_MAX, Bounded, Interval, Lanes, as_interval, mapped
from passgraph.verify.oracle.interval_functions import FUNCTIONS
from passgraph.verify.oracle.native_bounds import native_bound

_PLUS_OR_MINUS: dict[str, Callable[..., Interval]] = {"add": iv.add, "sub": iv.sub, "mul": iv.mul}
_SIMPLE: dict[str, Callable[..., Interval]] = {
    "div": iv.div, "neg": iv.neg, "abs": iv.absolute, "sqrt": iv.sqrt, "min": iv.minimum, "max": iv.maximum,
}  # fmt: skip
COMPARISONS = ("less", "less_equal", "greater", "greater_equal", "equal", "not_equal")
#: Operations on floats that jump between whole numbers.
_WHOLE = {"floor": np.floor, "ceil": np.ceil, "trunc": np.trunc, "round": np.rint}


#: Error in ULP of t * t * (3 - 2 * t): three roundings (3 - 2t, and two products), each one ULP of its own result in
#: any rounding mode, which is at most two of the last result's.
HERMITE_ULP = 6.0
#: Divisor: lanes that still loop are computed separately if they are at most this fraction of all.
WORTH_MOVING = 2
#: Limits within which remainders are exact: docs/kernels.md.
MOD_QUOTIENT, MOD_DIVISOR = 2.0**20, 2.0**-100


class IntervalDomain(Domain[Bounded, Lanes]):
    """Widens each operation by its bound; decisions follow the track.

    ``native``: functions that the device computes itself.
    """

    def __init__(self, track: Track, native: Mapping[str, Accuracy] = MappingProxyType({})) -> None:
        self.track = track
        self.native = native
        self.parts: list[_Part] = []
        self.numbers = NumberDomain()

    def constant(self, type_: Type, numbers: Sequence[ir.Number]) -> Bounded:
        values = shaped(numbers, type_)
        # Literals are float32 on every backend.
        return Interval.as_read(values.astype(np.float32)) if values.dtype.kind == "f" else values

    def widened(self, value: Bounded, slack: Bounded) -> Bounded:
        assert isinstance(value, Interval)
        assert isinstance(slack, Interval)
        reach = np.where(slack.nan | np.isnan(slack.hi), np.inf, slack.hi)
        wide = Interval(value.lo - reach, value.hi + reach, value.nan | np.isinf(reach))
        return iv.where(np.isinf(reach), Interval.anything(wide.lo.shape), wide)

    def trips(self, start: Bounded, stop: Bounded, step: Bounded) -> Iterator[tuple[Bounded, Lanes]]:
        bounds = [bound for bound in (start, stop, step) if not isinstance(bound, Interval)]
        self._mark_lost(bounds)
        depth = len(self.parts)
        for index, over in self.numbers.trips(*bounds):
            for part in self.parts[depth:]:
                index, over = part.picked(index), part.picked(over)
            yield index, over

    def apply(self, operation: str, arguments: Sequence[Bounded]) -> Bounded:
        row = OPERATIONS[operation]
        if row.kind == "expanded":
            return interval_functions.expanded(self, operation, arguments)
        numbers = [a for a in arguments if not isinstance(a, Interval)]
        if len(numbers) == len(arguments):
            exact = self.numbers.apply(operation, numbers)
            if exact.dtype.kind not in "iu":
                self._mark_lost(numbers)
            if exact.dtype.kind != "f":
                return exact
            # Only to_float and bit patterns take ints: rounded like a sum.
            return iv.rounded(exact, exact, np.isnan(exact), row.ulp)
        self._mark_lost(numbers)
        if operation == "mul" and arguments[0] is arguments[1]:
            return iv.square(as_interval(arguments[0]))
        return self._float(operation, _spread([as_interval(a) for a in arguments]))

    def _mark_lost(self, numbers: Sequence[Numbers]) -> None:
        """Mark lanes as lost where an unknown int affects more than which texel is read."""
        if any(n.dtype.kind in "iu" for n in numbers) and self.track.vague.any():
            self.track.mark(self.track.lost, self.track.vague)

    def _float(self, name: str, a: list[Interval]) -> Bounded:
        if name in _PLUS_OR_MINUS:
            return _PLUS_OR_MINUS[name](*a)
        if name in _SIMPLE:
            return _SIMPLE[name](*a)
        if name in COMPARISONS:
            return self._compared(name, *a)
        if name in _WHOLE:
            return self._to_integer(_WHOLE[name], a[0], name)
        if name in self.native:
            return native_bound(self, self.track, name, self.native[name], a)
        if name in FUNCTIONS:
            return FUNCTIONS[name](*a)
        result: Bounded = getattr(self, f"_{name}")(*a)
        return result

    # Decisions

    def _decided(self, can_be: Lanes, can_fail: Lanes, name: str) -> Lanes:
        other = self.track.choose(can_be & can_fail, name)
        return np.asarray(can_be & ~other)

    def _to_integer(self, function: Callable[[Any], Any], a: Interval, name: str) -> Interval:
        low, high = function(a.lo), function(a.hi)
        wide = self.track.mark(self.track.wide, ~(high - low <= 1) & (low != high) & ~np.isnan(low))
        chosen = np.where(self.track.choose((low < high) & ~wide, name), high, low)
        return Interval(chosen, np.where(wide, high, chosen), a.nan)

    def _compared(self, name: str, a: Interval, b: Interval) -> Lanes:
        if name == "not_equal":  # its first way is that of equal numbers
            return ~self._decided(*iv.compared("equal", a, b), name)
        return self._decided(*iv.compared(name, a, b), name)

    def _isnan(self, a: Interval) -> Lanes:
        return self._decided(a.nan, ~np.isnan(a.lo), "isnan")

    def _isinf(self, a: Interval) -> Lanes:
        finite = ~(np.isinf(a.lo) & (a.lo == a.hi)) | a.nan
        return self._decided(np.isinf(a.lo) | np.isinf(a.hi), finite, "isinf")

    def _isfinite(self, a: Interval) -> Lanes:
        sure = np.isfinite(a.lo) & np.isfinite(a.hi) & ~a.nan
        none = np.isnan(a.lo) | (np.isinf(a.lo) & (a.lo == a.hi))
        return self._decided(~none, ~sure, "isfinite")

    def _half_bits(self, a: Interval) -> Numbers:
        """Return one of two neighbors; with more candidates, or the bits of NaN or of a zero's sign, the lane is
        lost."""
        low, high = (OPERATIONS["half_bits"].reference(end).astype(np.int64) for end in (a.lo, a.hi))
        unknown = (np.abs(high - low) > 1) | a.nan | a.has(0.0)
        self.track.mark(self.track.lost, unknown)
        chosen = np.where(self.track.choose((low != high) & ~unknown, "half_bits"), high, low)
        return np.asarray(chosen.astype(np.uint32))

    def _to_int(self, a: Interval) -> Numbers:
        return self._to_whole(a, INT_MIN, INT_MAX).astype(np.int64)

    def _uint_from_float(self, a: Interval) -> Numbers:
        return self._to_whole(a, 0, UINT_MAX).astype(np.uint32)

    def _to_whole(self, a: Interval, least: int, most: int) -> Numbers:
        number = a.nan & np.isnan(a.lo)
        low, high = (np.trunc(np.clip(np.where(number, 0.0, x), least, most)) for x in (a.lo, a.hi))
        wide = self.track.mark(self.track.vague, (high - low > 1) | (a.nan & ~number))
        chosen = np.where(self.track.choose((low < high) & ~wide, "to_int"), high, low)
        return np.asarray(np.where(wide, np.trunc(0.5 * (low + high)), chosen))

    def _bits_from_float(self, a: Interval) -> Numbers:
        # The bits of a NaN, the sign of a zero and a flushed denormal differ between backends.
        self.track.mark(self.track.lost, ~a.exact | (a.lo == 0))
        return OPERATIONS["bits_from_float"].reference(a.lo)

    def _sign(self, a: Interval) -> Interval:
        positive = self._decided(a.hi > 0, ~(a.lo > 0) | a.nan, "sign")
        negative = self._decided((a.lo < 0) & ~positive, ~(a.hi < 0) | a.nan, "sign")
        return Interval.point(np.where(positive, 1.0, np.where(negative, -1.0, 0.0)))

    def _step(self, edge: Interval, x: Interval) -> Interval:
        return Interval.point(np.where(self._compared("less", x, edge), 0.0, 1.0))

    def _clamp(self, x: Interval, low: Interval, high: Interval) -> Interval:
        return iv.minimum(iv.maximum(x, low), high)

    def _saturate(self, x: Interval) -> Interval:
        zero = Interval.point(np.zeros_like(x.lo))
        return self._clamp(x, zero, Interval.point(np.ones_like(x.lo)))

    def _fract(self, x: Interval) -> Interval:
        below = self._to_integer(np.floor, x, "fract")
        part = iv.sub(x, below)
        # Negative only if x is an unrounded product in the difference (contraction): by its rounding error.
        least = -iv.spacing(x.magnitude)
        return part.both(lambda end: np.clip(end, least, BELOW_ONE))

    def _mod(self, x: Interval, y: Interval) -> Interval:
        """Return the remainder of exact numbers for each possible whole quotient; if there are too many, any
        remainder."""
        ends = [x.lo / y.lo, x.lo / y.hi, x.hi / y.lo, x.hi / y.hi]
        low, high = np.floor(np.minimum.reduce(ends)), np.floor(np.maximum.reduce(ends))
        smallest = iv.absolute(y).lo
        size = np.maximum(np.abs(low), np.abs(high))
        is_bounded = (size < MOD_QUOTIENT) & (smallest >= MOD_DIVISOR) & (high - low <= 1)
        quotient = np.where(self.track.choose(is_bounded & (low < high), "floor"), high, low)
        times = (y.lo * quotient, y.hi * quotient)
        rest = iv.rounded(x.lo - np.maximum(*times), x.hi - np.minimum(*times), x.nan | y.nan, 1.0)
        # Remainders are at most the number below y.
        below = [np.nextafter(end.astype(np.float32), np.float32(0)).astype(np.float64) for end in (y.lo, y.hi)]
        lo, hi = (
            np.clip(end, np.minimum(cap, 0.0), np.maximum(cap, 0.0))
            for end, cap in zip((rest.lo, rest.hi), below, strict=True)
        )
        any_rest = Interval(np.minimum(below[0], 0.0), np.maximum(below[1], 0.0), rest.nan | (size > FLOAT_MAX))
        result = iv.where(is_bounded, Interval(lo, hi, rest.nan), any_rest)
        known = np.isfinite(x.magnitude) & np.isfinite(y.magnitude) & ~y.has(0.0)
        return iv.where(known, result, Interval.anything(result.shape))

    def _float_floor_divide(self, a: Interval, b: Interval) -> Interval:
        return self._to_integer(np.floor, iv.div(a, b), "floor")

    def _smoothstep(self, low: Interval, high: Interval, x: Interval) -> Interval:
        low, high, x = (a.both(lambda end: 0.5 * end) for a in (low, high, x))  # exact, as the prelude does
        width = iv.sub(high, low)
        equal = self._compared("equal", width, Interval.point(np.zeros_like(width.lo)))
        one = Interval.point(np.ones_like(width.lo))
        inside = iv.div(iv.sub(x, low), iv.where(equal, one, width))
        # Only in lanes with equal edges: the decisions that a lane meets must depend on that lane only.
        below = self._decided(equal & (x.lo < low.hi), ~(x.hi < low.lo) | x.nan | low.nan, "smoothstep")
        t = self._saturate(iv.where(equal, Interval.point(np.where(below, 0.0, 1.0)), inside))
        lo, hi = (v * v * (3 - 2 * v) for v in (t.lo, t.hi))  # rises with t
        lo = np.where(lo < 4 * iv.SMALLEST_NORMAL, 0.0, lo)  # if the square was flushed
        result = iv.rounded(lo, hi, t.nan, HERMITE_ULP)
        result = Interval(np.maximum(result.lo, 0.0), result.hi, result.nan)
        exact = t.exact & ((t.lo == 0) | (t.lo == 1))
        return iv.where(exact, t, result)

    def select(self, condition: Bounded, then: Bounded, orelse: Bounded) -> Bounded:
        assert not isinstance(condition, Interval)
        return self.merge(condition, then, orelse)

    def swizzle(self, value: Bounded, components: tuple[int, ...]) -> Bounded:
        return mapped(value, lambda x: x[:, components[0]] if len(components) == 1 else x[:, list(components)])

    def construct(self, type_: Value | Array, parts: Sequence[Bounded]) -> Bounded:
        if element_of(type_).name != "float":
            return self.numbers.construct(type_, parts)  # type: ignore[arg-type]
        intervals = [as_interval(p) for p in parts]
        arrays = [
            self.numbers_of([getattr(p, name) for p in intervals], shape_of(type_)) for name in ("lo", "hi", "nan")
        ]
        return Interval(arrays[0], arrays[1], arrays[2].astype(np.bool_))

    @staticmethod
    def numbers_of(parts: list[Numbers], shape: tuple[int, ...]) -> Numbers:
        count = max(len(p) for p in parts)
        flat = [np.broadcast_to(p.reshape(len(p), -1), (count, p.size // len(p))) for p in parts]
        return np.concatenate(flat, axis=1).reshape(count, *shape)

    def index(self, value: Bounded, index: Bounded) -> Bounded:
        assert not isinstance(index, Interval)
        self._mark_lost([index])
        return mapped(value, lambda x: self.numbers.index(x, index))

    def insert(self, value: Bounded, index: Bounded, element: Bounded) -> Bounded:
        assert not isinstance(index, Interval)
        self._mark_lost([index])
        if isinstance(value, Interval):
            new = as_interval(element)
            lo, hi, nan = (
                self.numbers.insert(getattr(value, name), index, getattr(new, name)) for name in ("lo", "hi", "nan")
            )
            return Interval(lo, hi, nan)
        return self.numbers.insert(value, index, element)  # type: ignore[arg-type]

    # Masks: the lanes on this path, known exactly.

    def everywhere(self) -> Lanes:
        return self.numbers.everywhere()

    def nowhere(self) -> Lanes:
        return self.numbers.nowhere()

    def some(self, mask: Lanes) -> bool:
        return self.numbers.some(mask)

    def narrow(self, mask: Lanes, condition: Bounded, holds: bool) -> Lanes:
        assert not isinstance(condition, Interval)
        return self.numbers.narrow(mask, condition, holds)

    def join(self, one: Lanes, other: Lanes) -> Lanes:
        return self.numbers.join(one, other)

    def without(self, mask: Lanes, removed: Lanes) -> Lanes:
        return self.numbers.without(mask, removed)

    def merge(self, mask: Lanes, new: Bounded, old: Bounded) -> Bounded:
        if isinstance(new, Interval) or isinstance(old, Interval):
            new, old = as_interval(new), as_interval(old)
            mask = mask.reshape(mask.shape + (1,) * (new.ndim - mask.ndim))
            return new if mask.all() else iv.where(mask, new, old)
        return self.numbers.merge(mask, new, old)

    def focus(self, mask: Lanes) -> None:
        self.track.active = np.broadcast_to(mask, self.track.active.shape)

    def part(self, mask: Lanes) -> Part[Bounded] | None:
        rows = np.flatnonzero(mask)
        if len(mask) == 1 or WORTH_MOVING * len(rows) > len(mask):
            return None
        self.parts.append(_Part(self, rows))
        return self.parts[-1]


class _Part(Part[Bounded]):
    """A subset of the lanes of a track."""

    def __init__(self, domain: IntervalDomain, rows: NDArray[np.int64]) -> None:
        self.domain, self.rows, self.all = domain, rows, domain.track
        domain.track = self.all.part(rows)

    def take(self, value: Bounded) -> Bounded:
        return mapped(value, self.picked)

    def picked(self, value: NDArray[Any]) -> NDArray[Any]:
        return value if len(value) == 1 else value[self.rows]

    def put(self, new: Bounded, old: Bounded | None) -> Bounded:
        if isinstance(new, Interval) or isinstance(old, Interval):
            bound, before = as_interval(new), as_interval(new if old is None else old)
            lo, hi, nan = (self._put(getattr(bound, name), getattr(before, name)) for name in ("lo", "hi", "nan"))
            return Interval(lo, hi, nan)
        return self._put(new, new if old is None else old)

    def _put(self, new: NDArray[Any], old: NDArray[Any]) -> NDArray[Any]:
        shape = len(self.all.lanes), *old.shape[1:]
        merged = np.broadcast_to(old, shape).copy() if len(old) in (1, shape[0]) else np.zeros(shape, old.dtype)
        merged[self.rows] = new
        return merged

    def end(self) -> None:
        self.domain.parts.pop()
        self.all.rejoin(self.domain.track, self.rows)
        self.domain.track = self.all


def _spread(values: list[Interval]) -> list[Interval]:
    """Give scalars an axis for components if others are vectors."""
    depth = max(v.ndim for v in values)
    return [v if v.ndim == depth else v.map(lambda x: x.reshape(x.shape + (1,) * (depth - x.ndim))) for v in values]
