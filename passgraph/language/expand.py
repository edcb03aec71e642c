"""Expand vector and matrix operations into scalar ones, with sums in source order."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TypeAlias

from passgraph.language import scalar as s
from passgraph.language.emitter import Emitter
from passgraph.language.types import Matrix, Type
from passgraph.records import dataclass


@dataclass(frozen=True)
class Steps:
    """The operations of a function in order, on its arguments 1, 2 …."""

    body: tuple[s.Op | s.Choose, ...]
    result: s.Operand

    def repeated(self, e: Emitter, arguments: Sequence[s.Operand]) -> s.Operand:
        """Apply them to other values; folded and shared as if expanded there."""
        operands: dict[int, s.Operand] = dict(enumerate(arguments, 1))

        def operand_of(x: s.Operand) -> s.Operand:
            return operands[x.id] if isinstance(x, s.Val) else x

        for i in self.body:
            e.step()  # folding and sharing take time too
            if isinstance(i, s.Op):
                operands[i.to.id] = e.op(i.operation, *[operand_of(x) for x in i.arguments], span=i.span)
            else:
                operands[i.to.id] = e.choose(operand_of(i.condition), operand_of(i.then), operand_of(i.orelse))
        return operand_of(self.result)


Values: TypeAlias = list[s.Operand]
Expansion: TypeAlias = Callable[[Emitter, list[Values], list[Type]], Values]

ZERO, ONE = s.Lit("float", 0.0), s.Lit("float", 1.0)
#: Bits of the power of two that scales a size with exponent bits 0 to at least 1, except for denormals.
NEAR_ONE = 0x7F000000
#: Exponents of ``pow`` that become products.  A reciprocal is off by 2.5 units, so its cube may be off by 19.
MULTIPLIED_OUT = frozenset(range(-2, 9))


def dot(e: Emitter, a: Values, b: Values) -> s.Operand:
    total = e.op("mul", a[0], b[0])
    for x, y in zip(a[1:], b[1:], strict=True):
        total = e.op("add", total, e.op("mul", x, y))
    return total


def whole_power(e: Emitter, x: s.Operand, exponent: s.Operand) -> s.Operand | None:
    """Expand ``pow`` to products for a known integer exponent whose rounding stays within the row's bound; else None.

    Eight factors cause at most seven roundings of a unit each, which may be 14 of the result's.  Negative powers are
    powers of the reciprocal: the positive power itself could underflow to zero.
    """
    if not isinstance(exponent, s.Lit) or exponent.value not in MULTIPLIED_OUT:
        return None
    n = int(exponent.value)
    if n < 0:
        x, n = e.op("div", ONE, x), -n
    result: s.Operand = ONE
    while n:
        if n & 1:
            result = e.op("mul", result, x)
        n >>= 1
        if n:
            x = e.op("mul", x, x)
    return result


def _scale(e: Emitter, v: Values, k: s.Operand) -> Values:
    return [e.op("mul", x, k) for x in v]


def _subtract(e: Emitter, a: Values, b: Values) -> Values:
    return [e.op("sub", x, y) for x, y in zip(a, b, strict=True)]


def _cross(e: Emitter, args: list[Values], _: list[Type]) -> Values:
    a, b = args
    return [e.op("sub", e.op("mul", a[i], b[j]), e.op("mul", a[j], b[i])) for i, j in ((1, 2), (2, 0), (0, 1))]


def _step_of(e: Emitter, v: Values) -> s.Operand:
    """Return the exponent of the vector's magnitude, in steps of 16, as bits of a float.

    A sum of magnitudes is cheaper than their maximum and as good; infinite ones get the step of the largest numbers.
    """
    total = e.op("abs", v[0])
    for x in v[1:]:
        total = e.op("add", total, e.op("abs", x))
    return e.op("bit_and", e.op("bits_from_float", total), s.Lit("int", 0x78000000))


def _toward_one(e: Emitter, step: s.Operand, bits: int) -> s.Operand:
    """Return a power of two.  Multiplying by it is exact, except for overflow and underflow."""
    return e.op("float_from_bits", e.op("sub", s.Lit("int", bits), step))


def _length_of(e: Emitter, v: Values) -> s.Operand:
    # To 2**-4 at least, so that the reciprocal of the power is a normal number too.
    step = _step_of(e, v)
    near = _scale(e, v, _toward_one(e, step, 0x7D000000))
    back = e.op("float_from_bits", e.op("add", step, s.Lit("int", 0x02000000)))
    return e.op("mul", e.op("sqrt", dot(e, near, near)), back)


def _normalize(e: Emitter, args: list[Values], _: list[Type]) -> Values:
    v = _scale(e, args[0], _toward_one(e, _step_of(e, args[0]), NEAR_ONE))
    length = e.op("sqrt", dot(e, v, v))
    zero = e.op("equal", length, ZERO)
    divisor = e.choose(zero, ONE, length)
    return [e.op("div", x, divisor) for x in v]


def _reflect(e: Emitter, args: list[Values], _: list[Type]) -> Values:
    incident, normal = args
    twice = e.op("mul", s.Lit("float", 2.0), dot(e, normal, incident))
    return _subtract(e, incident, _scale(e, normal, twice))


def _refract(e: Emitter, args: list[Values], _: list[Type]) -> Values:
    incident, normal, (ratio,) = args
    cosine = dot(e, normal, incident)
    rest = e.op("sub", ONE, e.op("mul", cosine, cosine))
    k = e.op("sub", ONE, e.op("mul", e.op("mul", ratio, ratio), rest))
    total = e.op("less", k, ZERO)
    root = e.op("sqrt", e.choose(total, ZERO, k))
    along = e.op("add", e.op("mul", ratio, cosine), root)
    bent = _subtract(e, _scale(e, incident, ratio), _scale(e, normal, along))
    return [e.choose(total, ZERO, x) for x in bent]


def _faceforward(e: Emitter, args: list[Values], _: list[Type]) -> Values:
    normal, incident, reference = args
    toward = e.op("less", dot(e, reference, incident), ZERO)
    return [e.choose(toward, x, e.op("neg", x)) for x in normal]


def _reduce(name: str) -> Expansion:
    def expansion(e: Emitter, args: list[Values], _: list[Type]) -> Values:
        result = args[0][0]
        for value in args[0][1:]:
            result = e.op(name, result, value)
        return [result]

    return expansion


def columns(values: Values, size: int) -> list[Values]:
    """Return the columns of a matrix whose columns have ``size`` numbers."""
    return [values[i : i + size] for i in range(0, len(values), size)]


def rows(values: Values, size: int) -> list[Values]:
    return [values[i::size] for i in range(size)]


def _matmul(e: Emitter, args: list[Values], types: list[Type]) -> Values:
    a, b = args
    left, right = types
    if isinstance(left, Matrix) and isinstance(right, Matrix):
        return [dot(e, row, column) for column in columns(b, right.rows) for row in rows(a, left.rows)]
    if isinstance(left, Matrix):
        return [dot(e, row, b) for row in rows(a, left.rows)]
    assert isinstance(right, Matrix)
    return [dot(e, a, column) for column in columns(b, right.rows)]


def _minor(m: list[Values], row: int, column: int) -> list[Values]:
    return [[v for r, v in enumerate(c) if r != row] for i, c in enumerate(m) if i != column]


def _determinant_of(e: Emitter, m: list[Values]) -> s.Operand:
    if len(m) == 1:
        return m[0][0]
    total: s.Operand | None = None
    for i, column in enumerate(m):
        term = e.op("mul", column[0], _determinant_of(e, _minor(m, 0, i)))
        total = term if total is None else e.op("sub" if i % 2 else "add", total, term)
    assert total is not None
    return total


def _determinant(e: Emitter, args: list[Values], types: list[Type]) -> Values:
    assert isinstance(types[0], Matrix)
    return [_determinant_of(e, columns(args[0], types[0].rows))]


def plain_inverse(e: Emitter, m: list[Values]) -> Values:
    """Return adjugate over determinant; a zero determinant gives NaN throughout."""
    n = len(m)
    determinant = _determinant_of(e, m)
    singular = e.op("equal", determinant, ZERO)
    nan = s.Lit("float", float("nan"))
    cells = []
    for column in range(n):
        for row in range(n):
            cofactor = _determinant_of(e, _minor(m, column, row))
            signed = e.op("neg", cofactor) if (row + column) % 2 else cofactor
            cells.append(e.choose(singular, nan, e.op("div", signed, determinant)))
    return cells


def _inverse(e: Emitter, args: list[Values], types: list[Type]) -> Values:
    """Invert with each column scaled near 1, so that products of columns neither overflow nor vanish."""
    assert isinstance(types[0], Matrix)
    m = columns(args[0], types[0].rows)
    powers = [_toward_one(e, _step_of(e, column), NEAR_ONE) for column in m]
    near = plain_inverse(e, [_scale(e, column, power) for column, power in zip(m, powers, strict=True)])
    inverse = columns(near, len(m))
    return [e.op("mul", cell, power) for column in inverse for cell, power in zip(column, powers, strict=True)]


def _transpose(e: Emitter, args: list[Values], types: list[Type]) -> Values:
    assert isinstance(types[0], Matrix)
    return [v for row in rows(args[0], types[0].rows) for v in row]


EXPANSIONS: dict[str, Expansion] = {
    "dot": lambda e, args, _: [dot(e, *args)],
    "cross": _cross,
    "length": lambda e, args, _: [_length_of(e, args[0])],
    "distance": lambda e, args, _: [_length_of(e, _subtract(e, *args))],
    "normalize": _normalize,
    "faceforward": _faceforward,
    "reflect": _reflect,
    "refract": _refract,
    "any": _reduce("logical_or"),
    "all": _reduce("logical_and"),
    "matmul": _matmul,
    "transpose": _transpose,
    "determinant": _determinant,
    "inverse": _inverse,
    "outer": lambda e, args, _: [e.op("mul", r, c) for c in args[1] for r in args[0]],
}
