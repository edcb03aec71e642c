"""Bounds of the values of a scalar program, from their operands: the reach of loops and footprints.

They hold for every input, including NaN and infinities, and for every lane, including idle ones: each operation is
bounded by itself, never by its enclosing branch.  If only a number's type bounds it, its end is infinite.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from passgraph.language import scalar as s
from passgraph.language.meanings import INT_MAX, INT_MIN

#: Depth to which a value's operands are followed.
MAX_DEPTH = 64
#: Depth for a difference, both sides of which branch.
MAX_DIFFERENCE_DEPTH = 4
#: Largest rounding error of a sum or product of floats, relative and absolute: far above an ULP, to include contracted
#: and flushed results.
ROUNDING, SMALLEST = 2.0**-20, 1e-30
#: Below the largest float32: larger results may be infinite.
LARGEST = 3.4e38


class Range(NamedTuple):
    """An inclusive range.  ``nan``: True if a float may also be NaN."""

    low: float
    high: float
    nan: bool = False

    @property
    def known(self) -> bool:
        """Return True if both ends are known."""
        return math.isfinite(self.low) and math.isfinite(self.high)


ANY_INT = Range(-math.inf, math.inf)
ANY_FLOAT = Range(-math.inf, math.inf, True)
TRUTH = Range(0, 1)


class Ranges:
    """Ranges of values; ``made`` has their instructions, ``indices`` the known ranges, such as loop indices'."""

    def __init__(self, producers: Mapping[int, s.Op | s.Choose], indices: Mapping[int, tuple[float, float]]) -> None:
        self.made, self.indices = producers, indices
        self.found: dict[int, Range] = {}

    def forget(self, number: int) -> None:
        """Forget a value's range, as its number is reused."""
        self.found.pop(number, None)

    def range_of(self, value: s.Operand, depth: int = 0) -> Range:
        """Return the range of an int, float or bool (0 or 1)."""
        if isinstance(value, s.Lit):
            return of_number(float(value.value)) if value.type == "float" else Range(value.value, value.value)
        if value.id in self.indices:
            return Range(*self.indices[value.id])
        if value.id not in self.found:
            instruction = self.made.get(value.id)
            unknown = {"int": ANY_INT, "float": ANY_FLOAT, "bool": TRUTH}[value.type]
            if instruction is None or depth > MAX_DEPTH or value.type == "bool":
                return unknown
            self.found[value.id] = self._range_of(instruction, depth + 1) or unknown
        return self.found[value.id]

    def _range_of(self, instruction: s.Op | s.Choose, depth: int) -> Range | None:
        if isinstance(instruction, s.Choose):
            return union(self.range_of(instruction.then, depth), self.range_of(instruction.orelse, depth))
        return of_operation(
            instruction.operation, instruction.on == "float", [self.range_of(a, depth) for a in instruction.arguments]
        )

    # Differences: terms that both sides share, such as a pixel's position, cancel.

    def apart(self, high: s.Operand, low: s.Operand, depth: int = 0) -> float:
        """Return the largest difference of int ``high`` minus ``low``, as numbers that do not wrap."""
        (_, top), (bottom, _) = _ends(self.range_of(high)), _ends(self.range_of(low))
        best = self._offset(high, low, top - bottom)
        if depth < MAX_DIFFERENCE_DEPTH:
            for one in self._alternatives(high, "min"):
                best = min(best, self.apart(one, low, depth + 1))
            for one in self._alternatives(low, "max"):
                best = min(best, self.apart(high, one, depth + 1))
        return best

    def _alternatives(self, value: s.Operand, operation: str) -> tuple[s.Operand, ...]:
        """Return the operands of which a value is the minimum (or maximum)."""
        instruction = self.made.get(value.id) if isinstance(value, s.Val) else None
        return instruction.arguments if isinstance(instruction, s.Op) and instruction.operation == operation else ()

    def _offset(self, high: s.Operand, low: s.Operand, otherwise: float) -> float:
        """Return the largest difference, up to a multiple of 2**32, if it lies between 0 and the largest int; another
        multiple of 2**32 would be negative."""
        terms, constant = self._terms(high)
        low_terms, subtracted = self._terms(low)
        for number, factor in low_terms.items():
            terms[number] = terms.get(number, 0) - factor
        least = most = float(constant - subtracted)
        for number, factor in terms.items():
            if factor:
                ends = [factor * end for end in _ends(self.range_of(s.Val("int", number)))]
                least, most = least + min(ends), most + max(ends)
        return most if least >= 0 and most <= INT_MAX else otherwise

    def _terms(self, value: s.Operand, depth: int = 0) -> tuple[dict[int, int], int]:
        """Return a sum of values with integer factors, and a constant: equal to ``value`` up to multiples of 2**32."""
        if isinstance(value, s.Lit):
            return {}, int(value.value)
        instruction = self.made.get(value.id)
        if isinstance(instruction, s.Op) and depth < MAX_DIFFERENCE_DEPTH:
            name, parts = instruction.operation, instruction.arguments
            if name in ("add", "sub"):
                (terms, constant), (other_terms, other) = (self._terms(part, depth + 1) for part in parts)
                sign = 1 if name == "add" else -1
                for number, factor in other_terms.items():
                    terms[number] = terms.get(number, 0) + sign * factor
                return terms, constant + sign * other
            factors = [part for part in parts if isinstance(part, s.Lit)]
            if name == "mul" and len(factors) == 1:
                times = int(factors[0].value)
                terms, constant = self._terms(next(p for p in parts if p is not factors[0]), depth + 1)
                return {number: factor * times for number, factor in terms.items()}, constant * times
        return {value.id: 1}, 0


def _ends(a: Range) -> tuple[int, int]:
    """Return an int's ends; those of its type if no others are known."""
    return int(max(a.low, INT_MIN)), int(min(a.high, INT_MAX))


def _fitting(low: int, high: int) -> Range:
    """Return an int's range; unknown if it may wrap."""
    return Range(low, high) if low >= INT_MIN and high <= INT_MAX else ANY_INT


def _int_range(low: int, high: int) -> Range:
    """Return an int's range; ends equal to the type's count as unknown."""
    if low == high:
        return Range(low, high)
    return Range(low if low > INT_MIN else -math.inf, high if high < INT_MAX else math.inf)


def union(a: Range, b: Range) -> Range:
    """Return the smallest range that contains both."""
    return Range(min(a.low, b.low), max(a.high, b.high), a.nan or b.nan)


# Ints.  An end given only by the type stays unknown when it is shifted.


def _add(a: Range, b: Range) -> Range:
    (a0, a1), (b0, b1) = _ends(a), _ends(b)
    sum_range = _fitting(a0 + b0, a1 + b1)
    return Range(
        sum_range.low if math.isfinite(a.low + b.low) else -math.inf,
        sum_range.high if math.isfinite(a.high + b.high) else math.inf,
    )


def _neg(a: Range) -> Range:
    low, high = _ends(a)
    negated = _fitting(-high, -low)
    return Range(negated.low if math.isfinite(a.high) else -math.inf, negated.high)


def _sub(a: Range, b: Range) -> Range:
    (a0, a1), (b0, b1) = _ends(a), _ends(b)
    difference = _fitting(a0 - b1, a1 - b0)
    return Range(
        difference.low if math.isfinite(a.low) and math.isfinite(b.high) else -math.inf,
        difference.high if math.isfinite(a.high) and math.isfinite(b.low) else math.inf,
    )


def _abs(a: Range) -> Range:
    low, high = _ends(a)
    return _fitting(0 if low <= 0 <= high else min(abs(low), abs(high)), max(abs(low), abs(high)))


def _mul(a: Range, b: Range) -> Range:
    products = [p * q for p in _ends(a) for q in _ends(b)]
    return _fitting(min(products), max(products))


def _floor_divide(a: Range, b: Range) -> Range | None:
    if b.low < 1:
        return None
    quotients = [p // q for p in _ends(a) for q in _ends(b)]
    return _int_range(min(quotients), max(quotients))


def _int_mod(a: Range, b: Range) -> Range | None:
    if b.low < 1:
        return None
    highest = _ends(b)[1] - 1
    return Range(0, min(highest, _ends(a)[1]) if a.low >= 0 else highest)


def _bit_and(a: Range, b: Range) -> Range | None:
    """A bit is set only if it is set in both."""
    highest = [r.high for r in (a, b) if r.low >= 0]
    return Range(0, min(highest)) if highest else None


def _bit_or(a: Range, b: Range) -> Range | None:
    if a.low < 0 or b.low < 0:
        return None
    return Range(0, (1 << max(_ends(a)[1], _ends(b)[1]).bit_length()) - 1)


def _shift_right(a: Range, b: Range) -> Range | None:
    if b.low != b.high:
        return Range(0, a.high) if a.low >= 0 else None
    low, high = _ends(a)
    return _int_range(low >> (int(b.low) & 31), high >> (int(b.low) & 31))


def _shift_left(a: Range, b: Range) -> Range | None:
    if b.low != b.high:
        return None
    low, high = _ends(a)
    return _fitting(low << (int(b.low) & 31), high << (int(b.low) & 31))


def _lower(a: Range, b: Range) -> Range:
    return Range(min(a.low, b.low), min(a.high, b.high))


def _upper(a: Range, b: Range) -> Range:
    return Range(max(a.low, b.low), max(a.high, b.high))


def _exactly(a: Range) -> Range:
    """Return an int or bool as an int."""
    return a


_INTS: dict[str, Callable[..., Range | None]] = {
    "add": _add, "sub": _sub, "neg": _neg, "abs": _abs, "mul": _mul, "min": _lower, "max": _upper,
    "floor_divide": _floor_divide, "int_mod": _int_mod, "bit_and": _bit_and, "bit_or": _bit_or, "bit_xor": _bit_or,
    "shift_left": _shift_left, "shift_right": _shift_right, "to_int": _exactly,
    "to_float": lambda a: _rounded(a.low, a.high, False),
}  # fmt: skip


# Floats.  NaN as the first argument of min and max stays; as the second the first is the result.


def of_number(number: float) -> Range:
    """Return the range of a literal as float32, including 0 if a device may flush it."""
    with np.errstate(over="ignore", under="ignore"):
        exact = float(np.float32(number))
    if exact != exact:
        return ANY_FLOAT
    return Range(exact, exact) if abs(exact) > SMALLEST else Range(min(exact, 0.0), max(exact, 0.0))


def _float_lower(a: Range, b: Range) -> Range:
    return Range(min(a.low, b.low), a.high if b.nan else min(a.high, b.high), a.nan)


def _float_upper(a: Range, b: Range) -> Range:
    return Range(a.low if b.nan else max(a.low, b.low), max(a.high, b.high), a.nan)


def _rounded(low: float, high: float, nan: bool) -> Range:
    """Return the range of a result that may be rounded either way."""
    return Range(low - (abs(low) * ROUNDING + SMALLEST), high + (abs(high) * ROUNDING + SMALLEST), nan)


def _corners(combine: Callable[[float, float], float]) -> Callable[[Range, Range], Range | None]:
    def rule(a: Range, b: Range) -> Range | None:
        # Infinite ends stay unknown: infinities cancel, and times 0 they are NaN.
        if not (a.known and b.known):
            return None
        results = [combine(float(p), float(q)) for p in a[:2] for q in b[:2]]
        if max(map(abs, results)) > LARGEST:  # may be infinite
            return None
        return _rounded(min(results), max(results), a.nan or b.nan)

    return rule


def _float_abs(a: Range) -> Range:
    low = 0.0 if a.low <= 0 <= a.high else min(abs(a.low), abs(a.high))
    return Range(low, max(abs(a.low), abs(a.high)), a.nan)


def _rounding(function: Callable[[float], int]) -> Callable[[Range], Range]:
    def rule(a: Range) -> Range:
        low, high = (float(function(end)) if math.isfinite(end) else end for end in a[:2])
        return Range(low, high, a.nan)

    return rule


def _to_int(a: Range) -> Range:
    """Convert toward zero, saturating; NaN gives 0."""
    low, high = (math.trunc(min(max(end, INT_MIN), INT_MAX)) for end in a[:2])
    return _int_range(min(low, 0), max(high, 0)) if a.nan else _int_range(low, high)


def _fma(a: Range, b: Range, c: Range) -> Range | None:
    product = _corners(lambda p, q: p * q)(a, b)
    return product and _corners(lambda p, q: p + q)(product, c)


_FLOATS: dict[str, Callable[..., Range | None]] = {
    "add": _corners(lambda p, q: p + q), "sub": _corners(lambda p, q: p - q), "mul": _corners(lambda p, q: p * q),
    "min": _float_lower, "max": _float_upper, "neg": lambda a: Range(-a.high, -a.low, a.nan), "abs": _float_abs,
    "floor": _rounding(math.floor), "ceil": _rounding(math.ceil), "trunc": _rounding(math.trunc),
    "round": _rounding(round), "to_int": _to_int, "fma": _fma,
}  # fmt: skip


def of_operation(name: str, of_floats: bool, operands: Sequence[Range]) -> Range | None:
    """Return the range of an operation on ints or floats; None if unknown."""
    rule = (_FLOATS if of_floats else _INTS).get(name)
    return None if rule is None else rule(*operands)
