"""The one table of operations: types, documentation, reference meaning, spelling, error bound.

A row is either *primitive* (it has a spelling for each target), *prelude* (a scalar function written in
the kernel language itself, see :mod:`.prelude`; every target then computes the same polynomial) or
*expanded* (vector and matrix operations, taken apart by :mod:`.expand`).

Signatures are written in letters: ``N`` a number of any size (int or float), ``G`` floats of any size,
``I`` ints, ``B`` bools, ``V`` a float vector, ``v3`` a vec3, ``M`` a matrix, ``f i b`` scalars.  A letter
that occurs twice stands for one type, except that a scalar may stand beside vectors and is then spread.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Values = NDArray[Any]
#: Languages that the table spells operations in.  The numpy backend builds LLVM instead
#: (backends/numpy/vector/operations.py).
TARGETS = ("glsl", "opencl")

INT_MIN, INT_MAX, UINT_MAX = -(2**31), 2**31 - 1, 2**32 - 1
#: The largest float32 below one: where fract is capped.
BELOW_ONE = float(np.nextafter(np.float32(1), np.float32(0)))


@dataclass(frozen=True, slots=True)
class Operation:
    """One row.

    ``reference`` takes and returns float64, int64 or bool arrays, a batch on the first axis and components
    behind it.  ``ulp`` bounds the distance of any conforming backend's float32 result from the exact value,
    in units in the last place, on the documented domain; ``absolute`` is added to it.
    For rows in :data:`OF_TERMS` the unit is that of the largest term of the sum instead of the result.
    """

    name: str
    signature: str
    doc: str
    reference: Callable[..., Values]
    kind: str  # "primitive", "prelude" or "expanded"
    ulp: float = 0.0
    absolute: float = 0.0
    spelling: tuple[tuple[str, tuple[str, str]], ...] = ()  # scalar type: (glsl, opencl)

    def spell(self, scalar: str, target: str) -> str:
        """The expression template of this operation on ``scalar`` arguments in a target's language."""
        for kind, texts in self.spelling:
            if kind == scalar:
                return texts[TARGETS.index(target)]
        raise KeyError(f"{self.name} has no {scalar} spelling")


def wrap32(values: Values) -> Values:
    """Two's complement, 32 bits: what int arithmetic means when it overflows."""
    return ((np.asarray(values, np.int64) + 2**31) & 0xFFFFFFFF) - 2**31


def _is_int(values: Values) -> bool:
    return bool(np.asarray(values).dtype.kind == "i")


def _arith(function: Callable[[Values, Values], Values]) -> Callable[[Values, Values], Values]:
    return lambda a, b: wrap32(function(a, b)) if _is_int(a) else function(a, b)


def _floor_divide(a: Values, b: Values) -> Values:
    if _is_int(a):
        return wrap32(np.where(b == 0, 0, a // np.where(b == 0, 1, b)))
    return np.asarray(np.floor(a / b))


def _modulo(a: Values, b: Values) -> Values:
    if _is_int(a):
        return wrap32(np.where(b == 0, 0, a % np.where(b == 0, 1, b)))
    known = np.isfinite(a) & np.isfinite(b) & (b != 0)
    made = np.mod(np.where(known, a, 0.0), np.where(known, b, 1.0))
    # The sum of a tiny negative number and b may be b itself, which no rest is.
    largest = np.nextafter(np.abs(np.asarray(b)).astype(np.float32), np.float32(0)).astype(np.float64)
    made = np.copysign(np.minimum(np.abs(made), largest), made)
    return np.where(known, made, np.nan)


def _to_int(a: Values) -> Values:
    a = np.asarray(a)
    if a.dtype.kind != "f":
        return a.astype(np.int64)
    clean = np.where(np.isnan(a), 0.0, a)
    return np.asarray(np.trunc(np.clip(clean, INT_MIN, INT_MAX)).astype(np.int64))


def _minimum(a: Values, b: Values) -> Values:
    return np.where(b < a, b, a)


def _maximum(a: Values, b: Values) -> Values:
    return np.where(a < b, b, a)


def _normalize(v: Values) -> Values:
    # No square of a float32 leaves the range of float64.
    size = np.sqrt(np.sum(v * v, axis=-1, keepdims=True))
    return np.where(size > 0, v / np.where(size > 0, size, 1), np.where(np.isnan(size), size, 0.0))


def _smoothstep(low: Values, high: Values, x: Values) -> Values:
    width = high - low
    t = np.where(width == 0, np.where(x < low, 0.0, 1.0), (x - low) / np.where(width == 0, 1.0, width))
    t = _minimum(_maximum(t, np.zeros_like(t)), np.ones_like(t))
    return np.asarray(t * t * (3 - 2 * t))


def _dot(a: Values, b: Values) -> Values:
    return np.asarray(np.sum(a * b, axis=-1))


def _power(x: Values, y: Values) -> Values:
    """Of a negative x only whole powers; a zero has no sign here, so that its negative powers have none either."""
    missing = np.isnan(y) | ((x < 0) & (np.floor(y) != y))
    return np.where(missing, np.nan, np.power(np.where(missing, 1.0, x + 0.0), np.where(missing, 1.0, y)))


def _refract(incident: Values, normal: Values, ratio: Values) -> Values:
    cosine = _dot(normal, incident)
    k = 1 - ratio * ratio * (1 - cosine * cosine)
    bent = ratio[..., None] * incident - (ratio * cosine + np.sqrt(np.maximum(k, 0)))[..., None] * normal
    return np.where((k < 0)[..., None], 0.0, bent)


def _matmul(a: Values, b: Values) -> Values:
    """Columns on axis -2: M*v, v*M and M*N with the meaning of GLSL."""
    if a.ndim == 3 and b.ndim == 3:
        return np.asarray(np.einsum("ncr,nkc->nkr", a, b))
    if a.ndim == 3:
        return np.asarray(np.einsum("ncr,nc->nr", a, b))
    return np.asarray(np.einsum("nr,ncr->nc", a, b))


def _shift(function: Callable[[Values, Values], Values]) -> Callable[[Values, Values], Values]:
    return lambda a, b: wrap32(function(a, b & 31))


def _float_bits(a: Values) -> Values:
    return np.asarray(a).astype(np.float32).view(np.int32).astype(np.int64)


def _bits_float(a: Values) -> Values:
    return np.asarray(a).astype(np.int32).view(np.float32).astype(np.float64)


def _inverse(m: Values) -> Values:
    with np.errstate(all="ignore"):
        determinant = np.linalg.det(m)
        safe = np.where((determinant == 0)[:, None, None], np.eye(m.shape[-1]), m)
        return np.where((determinant == 0)[:, None, None], np.nan, np.linalg.inv(safe))


def _spelled(glsl: str, opencl: str | None = None) -> tuple[str, str]:
    return glsl, glsl if opencl is None else opencl


OPERATIONS: dict[str, Operation] = {}


def _add(row: Operation) -> None:
    OPERATIONS[row.name] = row


def _primitive(
    name: str,
    signature: str,
    doc: str,
    reference: Callable[..., Values],
    *,
    ulp: float = 0.0,
    **spell: tuple[str, str],
) -> None:
    rows = tuple(spell.items())
    _add(Operation(name, signature, doc, reference, "primitive", ulp, spelling=rows))


def _composite(
    kind: str,
    name: str,
    signature: str,
    doc: str,
    reference: Callable[..., Values],
    *,
    ulp: float,
    absolute: float = 0.0,
) -> None:
    _add(Operation(name, signature, doc, reference, kind, ulp, absolute))


def _comparison(name: str, sign: str, doc: str, reference: Callable[..., Values]) -> None:
    text = _spelled(f"({{0}} {sign} {{1}})")
    _primitive(name, "N N -> B", doc, reference, float=text, int=text)


# fmt: off
# Arithmetic.  Float rows are correctly rounded except where a target's standard gives less: GLSL and OpenCL
# both allow 2.5 ULP for a quotient and 3 for a square root.
_primitive("add", "N N -> N", "a + b", _arith(np.add), ulp=0.5,
           float=_spelled("({0} + {1})"), int=_spelled("({0} + {1})", "pg_add({0}, {1})"))
_primitive("sub", "N N -> N", "a - b", _arith(np.subtract), ulp=0.5,
           float=_spelled("({0} - {1})"), int=_spelled("({0} - {1})", "pg_sub({0}, {1})"))
_primitive("mul", "N N -> N", "a * b, component by component", _arith(np.multiply), ulp=0.5,
           float=_spelled("({0} * {1})"), int=_spelled("({0} * {1})", "pg_mul({0}, {1})"))
_primitive("div", "G G -> G", "a / b; IEEE 754 on a zero divisor", np.divide, ulp=2.5,
           float=_spelled("({0} / {1})"))
_primitive("neg", "N -> N", "-a", lambda a: wrap32(-a) if _is_int(a) else -a,
           float=_spelled("(-{0})"), int=_spelled("(-{0})", "pg_sub(0, {0})"))
_primitive("floor_divide", "I I -> I", "a // b, floored as in Python; a // 0 is 0", _floor_divide,
           int=_spelled("pg_floor_divide({0}, {1})"))
_primitive("int_mod", "I I -> I", "a % b with the sign of b, as in Python; a % 0 is 0", _modulo,
           int=_spelled("pg_int_mod({0}, {1})"))
_primitive("min", "N N -> N", "b if b < a else a", _minimum,
           float=_spelled("({1} < {0} ? {1} : {0})"),
           int=_spelled("({1} < {0} ? {1} : {0})"))
_primitive("max", "N N -> N", "b if a < b else a", _maximum,
           float=_spelled("({0} < {1} ? {1} : {0})"),
           int=_spelled("({0} < {1} ? {1} : {0})"))
_primitive("abs", "N -> N", "the magnitude", lambda a: wrap32(np.abs(a)) if _is_int(a) else np.abs(a),
           float=_spelled("abs({0})", "fabs({0})"),
           int=_spelled("abs({0})", "pg_abs({0})"))
_primitive("floor", "G -> G", "the largest whole number not above", np.floor,
           float=_spelled("floor({0})"))
_primitive("ceil", "G -> G", "the smallest whole number not below", np.ceil,
           float=_spelled("ceil({0})"))
_primitive("trunc", "G -> G", "the whole part", np.trunc, float=_spelled("trunc({0})"))
_primitive("round", "G -> G", "the nearest whole number, halves to even", np.rint,
           float=_spelled("roundEven({0})", "rint({0})"))
_primitive("sqrt", "G -> G", "the square root, x >= 0", np.sqrt, ulp=3.0,
           float=_spelled("sqrt({0})"))

# Comparison and logic.
_comparison("less", "<", "a < b", np.less)
_comparison("less_equal", "<=", "a <= b", np.less_equal)
_comparison("greater", ">", "a > b", np.greater)
_comparison("greater_equal", ">=", "a >= b", np.greater_equal)
_comparison("equal", "==", "a == b", np.equal)
_comparison("not_equal", "!=", "a != b", np.not_equal)
_primitive("logical_and", "B B -> B", "a and b", np.logical_and, bool=_spelled("({0} && {1})"))
_primitive("logical_or", "B B -> B", "a or b", np.logical_or, bool=_spelled("({0} || {1})"))
_primitive("logical_not", "B -> B", "not a", np.logical_not, bool=_spelled("(!{0})"))
_primitive("isnan", "G -> B", "whether it is not a number", np.isnan,
           float=_spelled("pg_isnan({0})"))
_primitive("isinf", "G -> B", "whether it is infinite", np.isinf,
           float=_spelled("pg_isinf({0})"))

# Bits.
_primitive("bit_and", "I I -> I", "a & b", np.bitwise_and, int=_spelled("({0} & {1})"))
_primitive("bit_or", "I I -> I", "a | b", np.bitwise_or, int=_spelled("({0} | {1})"))
_primitive("bit_xor", "I I -> I", "a ^ b", np.bitwise_xor, int=_spelled("({0} ^ {1})"))
_primitive("bit_not", "I -> I", "~a", np.bitwise_not, int=_spelled("(~{0})"))
_primitive("shift_left", "I I -> I", "a << (b & 31)", _shift(np.left_shift),
           int=_spelled("({0} << ({1} & 31))", "pg_shl({0}, {1})"))
_primitive("shift_right", "I I -> I", "a >> (b & 31), keeping the sign", _shift(np.right_shift),
           int=_spelled("({0} >> ({1} & 31))"))
_primitive("bits_from_float", "f -> i", "the bits of a float32", _float_bits,
           float=_spelled("floatBitsToInt({0})", "as_int({0})"))
_primitive("float_from_bits", "i -> f", "the float32 with these bits", _bits_float,
           int=_spelled("intBitsToFloat({0})", "as_float({0})"))

# Conversions.  float -> int saturates and turns NaN into 0, which no target promises by itself.
_primitive("to_float", "N -> G", "as float", lambda a: np.asarray(a).astype(np.float64), ulp=0.5,
           int=_spelled("float({0})", "(float)({0})"),
           bool=_spelled("({0} ? 1.0 : 0.0)", "({0} ? 1.0f : 0.0f)"))
_primitive("to_int", "N -> I", "as int, toward zero; saturates, NaN gives 0", _to_int,
           float=_spelled("pg_to_int({0})"),
           bool=_spelled("({0} ? 1 : 0)"))

# Scalar functions written in the kernel language (prelude.py): one polynomial on every backend.
_P = "prelude"
_composite(_P, "sign", "N -> N", "-1, 0 or 1; 0 for 0 and for NaN",
           lambda a: np.where(a > 0, 1, np.where(a < 0, -1, 0)).astype(a.dtype), ulp=0)
_composite(_P, "clamp", "N N N -> N", "min(max(x, low), high)",
           lambda x, low, high: _minimum(_maximum(x, low), high), ulp=0)
_composite(_P, "saturate", "G -> G", "clamp(x, 0, 1)",
           lambda x: _minimum(_maximum(x, np.zeros_like(x)), np.ones_like(x)), ulp=0)
_composite(_P, "fract", "G -> G", "x - floor(x), capped below 1",
           lambda x: _minimum(x - np.floor(x), np.full_like(x, BELOW_ONE)), ulp=1)
_composite(_P, "mod", "G G -> G",
           "x - y * floor(x / y): the sign of y, smaller than y; exact for |x / y| < 2^20, |y| >= 2^-100",
           _modulo, ulp=1)
_composite(_P, "inversesqrt", "G -> G", "1 / sqrt(x), x > 0", lambda x: 1 / np.sqrt(x), ulp=4)
_composite(_P, "step", "G G -> G", "0 where x < edge, else 1",
           lambda edge, x: np.where(x < edge, 0.0, 1.0), ulp=0)
_composite(_P, "smoothstep", "G G G -> G", "Hermite step between two finite edges; equal edges give step",
           _smoothstep, ulp=8)
_composite(_P, "mix", "G G G -> G", "x * (1 - a) + y * a", lambda x, y, a: x * (1 - a) + y * a, ulp=3)
_composite(_P, "exp2", "G -> G", "2 to the power x", np.exp2, ulp=3)
_composite(_P, "exp", "G -> G", "e to the power x", np.exp, ulp=3)
_composite(_P, "log2", "G -> G", "logarithm to base 2, x >= 0", np.log2, ulp=3)
_composite(_P, "log", "G -> G", "natural logarithm, x >= 0", np.log, ulp=3)
_composite(_P, "pow", "G G -> G", "x to the power y; x < 0 takes whole y only; pow(x, 0) is 1", _power, ulp=16)
_composite(_P, "sin", "G -> G", "sine, radians, |x| <= 8192; beyond, a number from -1 to 1", np.sin,
           ulp=4, absolute=2**-22)
_composite(_P, "cos", "G -> G", "cosine, radians, |x| <= 8192; beyond, a number from -1 to 1", np.cos,
           ulp=4, absolute=2**-22)
_composite(_P, "tan", "G -> G", "tangent, radians, |x| <= 8192; beyond, any number", np.tan, ulp=16, absolute=2**-21)
_composite(_P, "asin", "G -> G", "arc sine, radians, -1 <= x <= 1", np.arcsin, ulp=6)
_composite(_P, "acos", "G -> G", "arc cosine, radians, -1 <= x <= 1", np.arccos, ulp=6, absolute=2**-22)
_composite(_P, "atan", "G -> G", "arc tangent, radians", np.arctan, ulp=5)
_composite(_P, "atan2", "G G -> G", "angle of the vector (x, y), written atan(y, x); atan(0, 0) is 0",
           lambda y, x: np.where((x == 0) & (y == 0), 0.0, np.arctan2(y + 0.0, x)), ulp=8)
_composite(_P, "sinh", "G -> G", "hyperbolic sine", np.sinh, ulp=8, absolute=2**-24)
_composite(_P, "cosh", "G -> G", "hyperbolic cosine", np.cosh, ulp=8)
_composite(_P, "tanh", "G -> G", "hyperbolic tangent", np.tanh, ulp=8)
_composite(_P, "radians", "G -> G", "degrees to radians", np.radians, ulp=2)
_composite(_P, "degrees", "G -> G", "radians to degrees", np.degrees, ulp=2)
_composite(_P, "float_floor_divide", "G G -> G", "floor(a / b)", _floor_divide, ulp=2.5)

# Vectors and matrices, taken apart by expand.py.
_E = "expanded"
_composite(_E, "dot", "V V -> f", "sum of products, first component first", _dot, ulp=4)
_composite(_E, "cross", "v3 v3 -> v3", "vector product", np.cross, ulp=3)
_composite(_E, "length", "V -> f", "Euclidean length", lambda v: np.sqrt(_dot(v, v)), ulp=5)
_composite(_E, "distance", "V V -> f", "length(a - b)", lambda a, b: np.sqrt(_dot(a - b, a - b)), ulp=6)
_composite(_E, "normalize", "V -> V", "the vector at length 1; zero stays zero", _normalize, ulp=8)
_composite(_E, "faceforward", "V V V -> V",
           "(n, incident, reference): n where dot(reference, incident) < 0, else -n",
           lambda n, i, r: np.where((_dot(r, i) < 0)[..., None], n, -n), ulp=0)
_composite(_E, "reflect", "V V -> V", "incident mirrored by a unit normal",
           lambda i, n: i - 2 * _dot(n, i)[..., None] * n, ulp=8)
_composite(_E, "refract", "V V f -> V", "incident refracted at a unit normal; zero on total reflection",
           _refract, ulp=16)
_composite(_E, "any", "B -> b", "whether one component holds", lambda v: np.any(v, axis=-1), ulp=0)
_composite(_E, "all", "B -> b", "whether every component holds", lambda v: np.all(v, axis=-1), ulp=0)
_composite(_E, "matmul", "M * -> *", "matrix product, columns as in GLSL", _matmul, ulp=6)
_composite(_E, "transpose", "M -> M", "rows and columns swapped", lambda m: np.swapaxes(m, -1, -2), ulp=0)
_composite(_E, "determinant", "M -> f", "determinant", np.linalg.det, ulp=32)
_composite(_E, "inverse", "M -> M", "inverse; NaN where the determinant is 0, of columns brought near 1",
           _inverse, ulp=64)
_composite(_E, "outer", "V V -> M", "column vector times row vector (GLSL outerProduct)",
           lambda a, b: np.einsum("nr,nc->ncr", a, b), ulp=0.5)
# fmt: on

#: Rows that add terms of both signs.  Where terms cancel, their rounding stays while the result is small, so
#: the bound counts units in the last place of the largest term.
OF_TERMS = frozenset({
    "mix", "dot", "cross", "reflect", "refract", "matmul", "determinant", "inverse",
})  # fmt: skip
