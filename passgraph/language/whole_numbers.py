"""Rows of integer functions of the kernel language: operations of uints that differ from ints, and bit operations.

Each is the function with its name in :mod:`.prelude_whole`.  Programs store a uint as the int with the same bits, so a
row with equal bits for both has no second one here.  Functions are names of this module; imports have an underscore, so
that ``from … import *`` takes only the functions.
"""

from __future__ import annotations

from functools import partial as _partial

import numpy as _np

from passgraph.language import meanings as _of
from passgraph.language import operation as _in
from passgraph.language.operation import row as _any_row

_row = _partial(_any_row, "prelude")
_NAN, _INF = _np.nan, _np.inf
_HALF, _MOST, _LEAST, _LAST = 2**31, 2**32 - 1, _of.INT_MIN, _of.INT_MAX

# fmt: off
# Uints

_row("floor_divide_uint", "U U -> U", "a // b; a // 0 is 0", _of.floor_divide, (7, 2, 3), (_MOST, 2, _LAST),
     (_MOST, _HALF, 1), (5, 0, 0), written=("a // b",))
_row("int_mod_uint", "U U -> U", "a % b; a % 0 is 0", _of.modulo, (7, 4, 3), (_MOST, 10, 5), (5, 0, 0),
     written=("a % b",))
_row("min_uint", "U U -> U", "the smaller", _of.minimum, (3, _MOST, 3), written=("min(a, b)",))
_row("max_uint", "U U -> U", "the larger", _of.maximum, (3, _MOST, _MOST), written=("max(a, b)",))
_row("abs_uint", "U -> U", "a", _of.magnitude, (_MOST, _MOST), written=("abs(a)",))
_row("sign_uint", "U -> U", "0 or 1", _of.sign, (0, 0), (_MOST, 1), written=("sign(a)",))
_row("clamp_uint", "U U U -> U", "min(max(x, low), high)", _of.clamp, (_MOST, 0, _HALF, _HALF), (1, 2, 3, 2),
     written=("clamp(x, a, b)",))
_row("less_uint", "U U -> B", "a < b", _np.less, (1, _MOST, True), (_HALF, _LAST, False),
     written=("a < b", "less(a, b)"))
_row("less_equal_uint", "U U -> B", "a <= b", _np.less_equal, (1, _MOST, True), (_HALF, _LAST, False),
     written=("a <= b", "less_equal(a, b)"))
_row("greater_uint", "U U -> B", "a > b", _np.greater, (_MOST, 1, True), (_LAST, _HALF, False),
     written=("a > b", "greater(a, b)"))
_row("greater_equal_uint", "U U -> B", "a >= b", _np.greater_equal, (_MOST, 1, True), (_LAST, _HALF, False),
     written=("a >= b", "greater_equal(a, b)"))
_row("shift_right_uint", "U U -> U", "a >> (b & 31), zeros from above", _of.shift(_np.right_shift), (_HALF, 31, 1),
     (_MOST, 32, _MOST), (8, 35, 1), written=("a >> b",))
_row("float_from_uint", "U -> G", "as float", _of.to_float, (3, 3.0), (_HALF, 2147483648.0), (_MOST, 4294967295.0),
     written=("float(a)", "vec2(a)", "vec3(a)", "vec4(a)"), ulp=0.5)
_row("uint_from_float", "G -> U", "as uint, toward zero; saturates, so that what is below 1 gives 0, and NaN too",
     _of.to_uint, (1.9, 1), (-1.9, 0), (3e9, 3000000000), (1e20, _MOST), (_NAN, 0), (_INF, _MOST),
     written=("uint(a)", "uvec2(a)", "uvec3(a)", "uvec4(a)"))
_row("uint_from_int", "S -> U", "the uint with the same bits", _of.to_uint, (5, 5), (-1, _MOST), (_LEAST, _HALF),
     written=("uint(a)", "uvec2(a)", "uvec3(a)", "uvec4(a)"))
_row("int_from_uint", "U -> S", "the int with the same bits", _of.to_int, (5, 5), (_MOST, -1), (_HALF, _LEAST),
     written=("int(a)", "ivec2(a)", "ivec3(a)", "ivec4(a)"))

# Quotients as C and GLSL have them

quotient = _row("quotient", "I I -> I", "a / b toward zero, as in C; quotient(a, 0) is 0", _of.quotient, (7, -2, -3),
                (-7, 2, -3), (5, 0, 0), (_LEAST, -1, _LEAST), unsigned="floor_divide_uint")
remainder = _row("remainder", "I I -> I", "a - quotient(a, b) * b, with the sign of a, as in C; remainder(a, 0) is 0",
                 _of.remainder, (7, -2, 1), (-7, 2, -1), (5, 0, 0), (_LEAST, -1, 0), unsigned="int_mod_uint")

# Bits

bit_count = _row("bit_count", "I -> S", "how many bits are 1", _of.bit_count, (7, 3), (-1, 32), (0, 0))
find_lsb = _row("find_lsb", "I -> S", "the place of the lowest bit that is 1; -1 of 0", _of.find_lsb, (12, 2),
                (_LEAST, 31), (0, -1))
find_msb = _row("find_msb", "I -> S", "the place of the highest bit that is 1, below 0 that is 0; -1 of 0 and of -1",
                _of.find_msb, (12, 3), (-2, 0), (_LEAST, 30), (0, -1), (-1, -1), unsigned="find_msb_uint")
_row("find_msb_uint", "U -> S", "the place of the highest bit that is 1; -1 of 0", _of.find_msb, (12, 3), (_MOST, 31),
     (0, -1), written=("find_msb(a)",))
bitfield_reverse = _row("bitfield_reverse", "I -> I", "the bits in the opposite order", _of.bitfield_reverse,
                        (1, _LEAST), (6, 0x60000000))
bitfield_extract = _row("bitfield_extract", "I S S -> I",
                        "so many bits from an offset on, the highest going on above (a, offset, bits); the offset is "
                        "taken from 0 to 31, the bits from 0 to what is left above it", _of.bitfield_extract,
                        (0xABCD, 4, 8, -68), (0xABCD, 8, 4, -5), (-1, 0, 32, -1), (5, 3, 0, 0), (7, 40, 9, 0),
                        unsigned="bitfield_extract_uint")
_row("bitfield_extract_uint", "U S S -> U", "the same with zeros above", _of.bitfield_extract, (0xABCD, 4, 8, 0xBC),
     (_MOST, 0, 32, _MOST), (5, 3, 0, 0), written=("bitfield_extract(a, b, c)",))
bitfield_insert = _row("bitfield_insert", "I I S S -> I",
                       "a with its bits from an offset on replaced by the lowest so many of another "
                       "(a, other, offset, bits), which are taken as in bitfield_extract", _of.bitfield_insert,
                       (0xFFFF, 0, 4, 8, 0xF00F), (0, -1, 0, 32, -1), (5, 7, 3, 0, 5))
half_bits = _row("half_bits", "G -> U", "the 16 bits of the nearest binary16, halves to even; of NaN some NaN's",
                 _of.half_bits, (1.0, 0x3C00), (-2.0, 0xC000), (65520.0, 0x7C00), (2.0**-24, 1), (_INF, 0x7C00),
                 domain=(_in.HALVES,))
float_of_half = _row("float_of_half", "U -> G", "the number whose binary16 the lowest 16 bits are", _of.float_of_half,
                     (0x3C00, 1.0), (0xC000, -2.0), (1, 2.0**-24), (0x7C00, _INF), (0x7C01, _NAN))
# fmt: on

#: Names that kernels call; `python -m passgraph.language.stubs` writes stubs for type checkers.
__all__ = [name for name in vars() if "a" <= name[0] <= "z" and name != "annotations"]
