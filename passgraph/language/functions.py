"""Rows of scalar functions of the kernel language: each is the function with its name in :mod:`.prelude`, for ints with
the suffix ``_int``.

Functions are names of this module; imports have an underscore, so that ``from … import *`` takes only the functions.
"""

from __future__ import annotations

import math as _math
from functools import partial as _partial

import numpy as _np

from passgraph.language import meanings as _of
from passgraph.language import operation as _in
from passgraph.language.operation import row as _any_row

_row = _partial(_any_row, "prelude")
_INF, _NAN = _math.inf, _math.nan

# fmt: off
sign = _row("sign", "N -> N", "-1, 0 or 1; 0 for 0 and for NaN", _of.sign, (-3.0, -1.0), (0.0, 0.0), (_NAN, 0.0),
            (5, 1), unsigned="sign_uint")
clamp = _row("clamp", "N N N -> N", "min(max(x, low), high)", _of.clamp, (5.0, 0.0, 1.0, 1.0), (-5, 0, 3, 0),
             (0.5, 2.0, 1.0, 1.0), tame=((-8, 8), (-8, 0), (0, 8)), unsigned="clamp_uint")
saturate = _row("saturate", "G -> G", "clamp(x, 0, 1)", _of.saturate, (2.0, 1.0), (-_INF, 0.0), (_INF, 1.0),
                (0.25, 0.25))
fract = _row("fract", "G -> G", "x - floor(x), capped below 1", _of.fract, (1.25, 0.25), (-0.25, 0.75),
             (-1e-30, _of.BELOW_ONE), ulp=1)
mod = _row("mod", "G G -> G",
           "x - y * floor(x / y): the sign of y, smaller than y; exact for |x / y| < 2^20, |y| >= 2^-100", _of.modulo,
           (-1.0, 3.0, 2.0), (1.0, -3.0, -2.0), (5.5, 2.0, 1.5), written=("mod(x, y)", "x % y"), ulp=1,
           domain=(_in.MODERATE, _in.MODERATE_NOT_ZERO), tame=((-8, 8), (0.5, 8)))
fma = _row("fma", "G G G -> G", "a * b + c, rounded once or twice", _of.fma, (2.0, 3.0, 1.0, 7.0), ulp=1.5,
           of_terms=True, domain=(_in.MODERATE,) * 3, tame=((-2, 2), (-2, 2), (-4, 4)))
ldexp = _row("ldexp", "G S -> G", "x times 2 to the power n, for any int n", _of.ldexp, (0.75, 3, 6.0),
             (1.0, -2, 0.25), (1.0, 200, _INF), (1.0, -200, 0.0), (_INF, -5, _INF), (0.0, 2147483647, 0.0), ulp=0.5)
inversesqrt = _row("inversesqrt", "G -> G", "1 / sqrt(x), x > 0", _of.inversesqrt, (4.0, 0.5), (0.0, _INF), ulp=4,
                   domain=(_in.POSITIVE,), tame=((0.125, 8),))
step = _row("step", "G G -> G", "0 where x < edge, else 1", _of.step, (1.0, 1.0, 1.0), (1.0, 0.5, 0.0))
smoothstep = _row("smoothstep", "G G G -> G", "Hermite step between two finite edges; equal edges give step",
                  _of.smoothstep, (0.0, 1.0, 0.5, 0.5), (0.0, 1.0, 2.0, 1.0), (1.0, 1.0, 1.0, 1.0),
                  (1.0, 1.0, 0.0, 0.0), ulp=8, domain=(_in.MODERATE,) * 3, tame=((-8, 0), (0.5, 8)))
mix = _row("mix", "G G G -> G", "x * (1 - a) + y * a", _of.mix, (1.0, 3.0, 0.5, 2.0), (1.0, 3.0, 1.0, 3.0), ulp=3,
           of_terms=True, domain=(_in.MODERATE,) * 3, tame=((-8, 8), (-8, 8), (0, 1)))

exp2 = _row("exp2", "G -> G", "2 to the power x", _np.exp2, (3.0, 8.0), (-_INF, 0.0), ulp=3, domain=(_in.EXPONENT,),
            tame=((-3, 3),), course="rises")
exp = _row("exp", "G -> G", "e to the power x", _np.exp, (0.0, 1.0), (1.0, _math.e), ulp=3, domain=(_in.EXPONENT,),
           tame=((-2, 2),), course="rises")
log2 = _row("log2", "G -> G", "logarithm to base 2, x >= 0", _np.log2, (8.0, 3.0), (0.0, -_INF), ulp=3,
            domain=(_in.NOT_NEGATIVE,), tame=((0.125, 8),), course="rises")
log = _row("log", "G -> G", "natural logarithm, x >= 0", _np.log, (_math.e, 1.0), (0.0, -_INF), ulp=3,
           domain=(_in.NOT_NEGATIVE,), tame=((0.125, 8),), course="rises")
log10 = _row("log10", "G -> G", "logarithm to base 10, x >= 0", _np.log10, (100.0, 2.0), (0.0, -_INF), ulp=5,
             domain=(_in.NOT_NEGATIVE,), tame=((0.125, 8),), course="rises")
_row("pow", "G G -> G", "x to the power y; x < 0 takes whole y only; pow(x, 0) is 1", _of.power,
     (2.0, 0.5, _math.sqrt(2)), (0.0, 0.0, 1.0), (0.0, 2.0, 0.0), (_NAN, 0.0, 1.0), written=("pow(x, y)", "x**y"),
     ulp=16, domain=(_in.MODERATE, _in.POWER), tame=((0.5, 2), (-2, 2)))

sin = _row("sin", "G -> G", "sine, radians, |x| <= 8192; beyond, a number from -1 to 1", _np.sin, (_math.pi / 6, 0.5),
           (0.0, 0.0), ulp=4, absolute=2**-22, domain=(_in.ANGLE,))
cos = _row("cos", "G -> G", "cosine, radians, |x| <= 8192; beyond, a number from -1 to 1", _np.cos,
           (_math.pi / 3, 0.5), (0.0, 1.0), ulp=4, absolute=2**-22, domain=(_in.ANGLE,))
tan = _row("tan", "G -> G", "tangent, radians, |x| <= 8192; beyond, any number", _np.tan, (_math.pi / 4, 1.0), ulp=16,
           absolute=2**-21, domain=(_in.ANGLE,), tame=((-1.25, 1.25),))
asin = _row("asin", "G -> G", "arc sine, radians, -1 <= x <= 1", _np.arcsin, (0.5, _math.pi / 6), (1.0, _math.pi / 2),
            ulp=6, domain=(_in.UNIT,), course="rises")
acos = _row("acos", "G -> G", "arc cosine, radians, -1 <= x <= 1", _np.arccos, (0.5, _math.pi / 3), (-1.0, _math.pi),
            ulp=6, absolute=2**-22, domain=(_in.UNIT,), course="falls")
atan = _row("atan", "G -> G", "arc tangent, radians", _np.arctan, (1.0, _math.pi / 4), (-_INF, -_math.pi / 2), ulp=5,
            course="rises")
_row("atan2", "G G -> G", "angle of the vector (x, y), written atan(y, x); atan(0, 0) is 0", _of.angle,
     (1.0, -1.0, 3 * _math.pi / 4), (0.0, 0.0, 0.0), (-1.0, 0.0, -_math.pi / 2), (-0.0, -0.0, 0.0),
     written=("atan(y, x)",), ulp=8, domain=(_in.MODERATE,) * 2)
sinh = _row("sinh", "G -> G", "hyperbolic sine", _np.sinh, (1.0, _math.sinh(1)), ulp=8, absolute=2**-24,
            domain=(_in.EXPONENT,), tame=((-2, 2),), course="rises")
cosh = _row("cosh", "G -> G", "hyperbolic cosine", _np.cosh, (1.0, _math.cosh(1)), ulp=8, domain=(_in.EXPONENT,),
            tame=((-2, 2),), course="even")
tanh = _row("tanh", "G -> G", "hyperbolic tangent", _np.tanh, (1.0, _math.tanh(1)), (_INF, 1.0), ulp=8, course="rises")
asinh = _row("asinh", "G -> G", "inverse hyperbolic sine", _np.arcsinh, (1.0, _math.asinh(1)), (-_INF, -_INF), ulp=8,
             course="rises")
acosh = _row("acosh", "G -> G", "inverse hyperbolic cosine, x >= 1", _np.arccosh, (2.0, _math.acosh(2)), (1.0, 0.0),
             (_INF, _INF), ulp=8, domain=(_in.FROM_ONE,), tame=((1, 8),), course="rises")
atanh = _row("atanh", "G -> G", "inverse hyperbolic tangent, -1 <= x <= 1", _np.arctanh, (0.5, _math.atanh(0.5)),
             (1.0, _INF), (-1.0, -_INF), ulp=8, domain=(_in.UNIT,), tame=((-0.875, 0.875),), course="rises")
radians = _row("radians", "G -> G", "degrees to radians", _np.radians, (180.0, _math.pi), ulp=2, course="rises")
degrees = _row("degrees", "G -> G", "radians to degrees", _np.degrees, (_math.pi, 180.0), ulp=2,
               tame=((-0.125, 0.125),), course="rises")
isfinite = _row("isfinite", "G -> B", "whether it is a number and not infinite", _np.isfinite, (1.0, True),
                (-_INF, False), (_NAN, False))
_row("float_floor_divide", "G G -> G", "floor(a / b)", _of.floor_divide, (-7.0, 2.0, -4.0), (7.5, 2.0, 3.0),
     written=("a // b",), ulp=2.5, domain=(_in.DIVIDEND, _in.SMALL_DIVISOR))
# fmt: on

#: Names that kernels call; `python -m passgraph.language.stubs` writes stubs for type checkers.
__all__ = [name for name in vars() if "a" <= name[0] <= "z" and name != "annotations"]
