"""Mistakes in uints, bits and packing: what the prelude and the library say of them, and how programs hold them."""

from __future__ import annotations

from tests.mutation.mutant import Mutant


def _row(function: str, old: str, new: str, *names: str, backend: str = "numpy") -> Mutant:
    return Mutant(function, old, new, backend, tuple(f"operations/{name}" for name in names or (function,)))


MUTANTS = (
    _row("less_uint", "(a ^ -2147483648) < (b", "a < (b"),
    _row("shift_right_uint", "(31 - (b & 31))) << 1", "(31 - (b & 31)))", backend="gl"),
    _row("floor_divide_uint", "uint(a - double * b >= b)", "uint(a - double * b > b)"),
    _row("floor_divide_uint", "uint(divisor < 0 and a >= b)", "uint(a >= b)", backend="opencl"),
    _row("int_mod_uint", "if b != 0 else uint(0)", "", backend="gl"),
    _row("float_from_uint", "float(half) * 2.0", "float(half)"),
    _row("uint_from_float", "max(x, 0.0)", "x", "uint_from_float"),
    _row("uint_from_float", "x - 2147483648.0 if large else", "x if large else", backend="gl"),
    _row("quotient", "and b != 0 and", "and", "quotient of ints"),
    _row("remainder", "(floored ^ a) < 0", "floored < 0", "remainder of ints", backend="opencl"),
    _row("find_lsb", "if a != 0 else -1", "", "find_lsb of ints"),
    _row("find_msb", "a ^ (a >> 31)", "a", "find_msb of ints", backend="gl"),
    _row("bitfield_extract_uint", "if count > 0 else uint(0)", ""),
    _row("bitfield_insert", "if count < 32 else -1", "", "bitfield_insert of ints"),
    _row("half_bits", "if size < 0x38800000", "if size < 0x38000000", "half_bits"),
    _row("float_of_half", "size >= 0x7C00", "size > 0x7C00", "float_of_half of uints"),
    _row("ldexp", "(exponent - 2 * third + 127)", "(third + 127)", "ldexp"),
    _row("acosh", "near if z < 0.5 else large", "large", "acosh", backend="gl"),
    _row("isfinite", "<= 3.4028234663852886e38", "< 3.4028234663852886e38", "isfinite"),
    Mutant("literal", "element_of(type_) is UINT", "False", "numpy", ("language/uints",)),
    Mutant("apply", "if row.unsigned and", "if False and", "numpy", ("language/uints",)),
)
