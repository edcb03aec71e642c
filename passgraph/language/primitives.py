"""Rows that backends spell: arithmetic, comparisons, bits, conversions.

Float rows are correctly rounded except where a target's standard allows more: GLSL and OpenCL both allow 2.5 ULP for a
quotient and 3 for a square root.  Rows called by their own name are names of this module; imports have an underscore,
so that ``from … import *`` takes only the rows.
"""

from __future__ import annotations

import math as _math
from functools import partial as _partial

import numpy as _np

from passgraph.language import meanings as _of
from passgraph.language import operation as _in
from passgraph.language.operation import row as _any_row

_row = _partial(_any_row, "primitive")
_INF, _NAN, _LEAST, _MOST = _math.inf, _math.nan, _of.INT_MIN, _of.INT_MAX

# fmt: off
# Arithmetic

_row("add", "N N -> N", "a + b", _of.arith(_np.add), (1.5, 2.0, 3.5), (_MOST, 1, _LEAST), (_INF, -_INF, _NAN),
     written=("a + b",), ulp=0.5, commutes=True)
_row("sub", "N N -> N", "a - b", _of.arith(_np.subtract), (1.5, 2.0, -0.5), (_LEAST, 1, _MOST), written=("a - b",),
     ulp=0.5)
_row("mul", "N N -> N", "a * b, component by component", _of.arith(_np.multiply), (1.5, 2.0, 3.0), (65536, 65536, 0),
     (0.0, _INF, _NAN), written=("a * b",), ulp=0.5, commutes=True)
_row("div", "G G -> G", "a / b; IEEE 754 on a zero divisor", _np.divide, (1.0, 4.0, 0.25), (1.0, 0.0, _INF),
     (-1.0, 0.0, -_INF), (0.0, 0.0, _NAN), written=("a / b",), ulp=2.5, domain=(_in.ANY, _in.DIVISOR))
_row("neg", "N -> N", "-a", _of.negative, (1.5, -1.5), (_LEAST, _LEAST), written=("-a",))
_row("floor_divide", "I I -> I", "a // b, floored as in Python; a // 0 is 0", _of.floor_divide, (7, -2, -4),
     (-7, 2, -4), (5, 0, 0), (_LEAST, -1, _LEAST), written=("a // b",), unsigned="floor_divide_uint")
_row("int_mod", "I I -> I", "a % b with the sign of b, as in Python; a % 0 is 0", _of.modulo, (7, -2, -1), (-7, 2, 1),
     (5, 0, 0), (_LEAST, -1, 0), written=("a % b",), unsigned="int_mod_uint")
_row("min", "N N -> N", "b if b < a else a", _of.minimum, (2.0, 1.0, 1.0), (1.0, _NAN, 1.0), (_NAN, 1.0, _NAN),
     (-3, 2, -3), unsigned="min_uint")
_row("max", "N N -> N", "b if a < b else a", _of.maximum, (2.0, 1.0, 2.0), (1.0, _NAN, 1.0), (_NAN, 1.0, _NAN),
     (-3, 2, 2), unsigned="max_uint")
_row("abs", "N -> N", "the magnitude", _of.magnitude, (-2.5, 2.5), (_LEAST, _LEAST), (-_INF, _INF),
     unsigned="abs_uint")
floor = _row("floor", "G -> G", "the largest whole number not above", _np.floor, (-0.5, -1.0), (2.0, 2.0), (_INF, _INF))
ceil = _row("ceil", "G -> G", "the smallest whole number not below", _np.ceil, (-0.5, 0.0), (2.1, 3.0))
trunc = _row("trunc", "G -> G", "the whole part", _np.trunc, (-1.9, -1.0), (1.9, 1.0))
_row("round", "G -> G", "the nearest whole number, halves to even", _np.rint, (0.5, 0.0), (1.5, 2.0), (2.5, 2.0),
     (-0.5, 0.0))
sqrt = _row("sqrt", "G -> G", "the square root, x >= 0", _np.sqrt, (9.0, 3.0), (0.0, 0.0), (_INF, _INF), ulp=3.0,
            domain=(_in.NOT_NEGATIVE,))

# Comparison and logic

less = _row("less", "N N -> B", "a < b", _np.less, (1.0, 2.0, True), (_NAN, 1.0, False), (2, 2, False),
            written=("a < b", "less(a, b)"), unsigned="less_uint")
less_equal = _row("less_equal", "N N -> B", "a <= b", _np.less_equal, (1.0, 1.0, True), (_NAN, _NAN, False),
                  (3, 2, False), written=("a <= b", "less_equal(a, b)"), unsigned="less_equal_uint")
greater = _row("greater", "N N -> B", "a > b", _np.greater, (2.0, 1.0, True), (1.0, _NAN, False), (2, 2, False),
               written=("a > b", "greater(a, b)"), unsigned="greater_uint")
greater_equal = _row("greater_equal", "N N -> B", "a >= b", _np.greater_equal, (1.0, 1.0, True), (_NAN, _NAN, False),
                     (2, 3, False), written=("a >= b", "greater_equal(a, b)"), unsigned="greater_equal_uint")
equal = _row("equal", "N N -> B", "a == b", _np.equal, (0.0, -0.0, True), (_NAN, _NAN, False), (2, 2, True),
             written=("a == b", "equal(a, b)"), commutes=True)
not_equal = _row("not_equal", "N N -> B", "a != b", _np.not_equal, (0.0, -0.0, False), (_NAN, _NAN, True),
                 (2, 2, False), written=("a != b", "not_equal(a, b)"), commutes=True)
_row("logical_and", "B B -> B", "a and b", _np.logical_and, (True, False, False), (True, True, True),
     written=("a and b",), commutes=True)
_row("logical_or", "B B -> B", "a or b", _np.logical_or, (True, False, True), (False, False, False),
     written=("a or b",), commutes=True)
_row("logical_not", "B -> B", "not a", _np.logical_not, (True, False), (False, True), written=("not a",))
isnan = _row("isnan", "G -> B", "whether it is not a number", _np.isnan, (_NAN, True), (_INF, False), (1.0, False))
isinf = _row("isinf", "G -> B", "whether it is infinite", _np.isinf, (-_INF, True), (_NAN, False), (1.0, False))

# Bits

_row("bit_and", "I I -> I", "a & b", _np.bitwise_and, (12, 10, 8), (-1, 7, 7), written=("a & b",), commutes=True)
_row("bit_or", "I I -> I", "a | b", _np.bitwise_or, (12, 10, 14), written=("a | b",), commutes=True)
_row("bit_xor", "I I -> I", "a ^ b", _np.bitwise_xor, (12, 10, 6), (-1, 0, -1), written=("a ^ b",), commutes=True)
_row("bit_not", "I -> I", "~a", _np.bitwise_not, (0, -1), (_MOST, _LEAST), written=("~a",))
_row("shift_left", "I I -> I", "a << (b & 31)", _of.shift(_np.left_shift), (1, 31, _LEAST), (1, 33, 2),
     (3, 31, _LEAST), written=("a << b",))
_row("shift_right", "I I -> I", "a >> (b & 31), keeping the sign", _of.shift(_np.right_shift), (_LEAST, 31, -1),
     (8, 35, 1), written=("a >> b",), unsigned="shift_right_uint")
bits_from_float = _row("bits_from_float", "f -> i", "the bits of a float32", _of.float_bits, (1.0, 0x3F800000),
                       (-0.0, _LEAST), (_INF, 0x7F800000), domain=(_in.KNOWN_BITS,))
float_from_bits = _row("float_from_bits", "i -> f", "the float32 with these bits", _of.bits_float, (0x3F800000, 1.0),
                       (0x7F800000, _INF), (_LEAST, -0.0))

# Conversions.  float -> int saturates and turns NaN into 0, which no target guarantees.

_row("to_float", "N -> G", "as float", _of.to_float, (3, 3.0), (True, 1.0), (_LEAST, -2147483648.0),
     written=("float(a)", "vec2(a)", "vec3(a)", "vec4(a)"), ulp=0.5, on=("int", "bool"),
     unsigned="float_from_uint")
_row("to_int", "N -> S", "as int, toward zero; saturates, NaN gives 0", _of.to_int, (-1.9, -1), (1e20, _MOST),
     (-1e20, _LEAST), (_NAN, 0), (_INF, _MOST), (True, 1), written=("int(a)", "ivec2(a)", "ivec3(a)", "ivec4(a)"),
     on=("float", "bool"), unsigned="int_from_uint")
# fmt: on

#: Names that kernels call; `python -m passgraph.language.stubs` writes stubs for type checkers.
__all__ = [name for name in vars() if "a" <= name[0] <= "z" and name != "annotations"]
