"""Scalar functions of integers, written in the kernel language: like :mod:`.prelude`, parsed and never run.

Programs store a uint as the int with the same bits.  So a function may take a uint's bits as an int, for bit
operations, or as a uint, for arithmetic.
"""

# mypy: disable-error-code="no-any-return"
from __future__ import annotations

from passgraph.language.prelude import quantize_half
from passgraph.language.primitives import bits_from_float, float_from_bits
from passgraph.language.symbols import uint

# Uints.  A comparison of uints is one of ints with flipped highest bits.


def less_uint(a: int, b: int) -> bool:
    return (a ^ -2147483648) < (b ^ -2147483648)


def less_equal_uint(a: int, b: int) -> bool:
    return (a ^ -2147483648) <= (b ^ -2147483648)


def greater_uint(a: int, b: int) -> bool:
    return (a ^ -2147483648) > (b ^ -2147483648)


def greater_equal_uint(a: int, b: int) -> bool:
    return (a ^ -2147483648) >= (b ^ -2147483648)


def min_uint(a: uint, b: uint) -> uint:
    return b if b < a else a


def max_uint(a: uint, b: uint) -> uint:
    return b if a < b else a


def abs_uint(a: uint) -> uint:
    return a


def sign_uint(a: uint) -> uint:
    return uint(a != 0)


def clamp_uint(x: uint, low: uint, high: uint) -> uint:
    return min(max(x, low), high)


def shift_right_uint(a: int, b: int) -> int:
    # Clear the sign bits shifted in, as many as the distance.
    return (a >> b) & ~((-1 << (31 - (b & 31))) << 1)


def floor_divide_uint(a: uint, b: uint) -> uint:
    # The quotient by a divisor with its highest bit set is at most 1.
    divisor = int(b)
    # Divide half of a, an int: twice that quotient is the result, or one less.
    double = uint(int(a >> 1) // divisor) << 1
    quotient = double + uint(a - double * b >= b)
    return quotient if divisor > 0 else uint(divisor < 0 and a >= b)


def int_mod_uint(a: uint, b: uint) -> uint:
    return a - (a // b) * b if b != 0 else uint(0)


def float_from_uint(a: int) -> float:
    # Half of a large one is an int; its lowest bit stays set if a bit is lost, so that it rounds like the whole.
    half = ((a >> 1) & 0x7FFFFFFF) | (a & 1)
    return float(a) if a >= 0 else float(half) * 2.0


def uint_from_float(x: float) -> int:
    large = x >= 2147483648.0
    below = int(x - 2147483648.0 if large else max(x, 0.0))
    return below ^ -2147483648 if large else below


def uint_from_int(a: int) -> int:
    return a


def int_from_uint(a: int) -> int:
    return a


# Quotients toward zero: floored ones are one less if negative and inexact.


def quotient(a: int, b: int) -> int:
    floored = a // b
    return floored + 1 if a - floored * b != 0 and b != 0 and (a ^ b) < 0 else floored


def remainder(a: int, b: int) -> int:
    floored = a % b
    return floored - b if floored != 0 and (floored ^ a) < 0 else floored


# Bits.  Counting and reversing by halves: H. S. Warren, Hacker's Delight, 2nd edition 2012, 5-1 and 7-1.


def bit_count(a: int) -> int:
    pairs = a - ((a >> 1) & 0x55555555)
    fours = (pairs & 0x33333333) + ((pairs >> 2) & 0x33333333)
    bytes_ = (fours + (fours >> 4)) & 0x0F0F0F0F
    return (bytes_ * 0x01010101) >> 24


def find_lsb(a: int) -> int:
    return bit_count((a & -a) - 1) if a != 0 else -1


def find_msb_uint(a: uint) -> int:
    a |= a >> 1
    a |= a >> 2
    a |= a >> 4
    a |= a >> 8
    a |= a >> 16
    return bit_count(int(a)) - 1


def find_msb(a: int) -> int:
    return find_msb_uint(uint(a ^ (a >> 31)))


def bitfield_reverse(a: uint) -> uint:
    a = ((a >> 1) & 0x55555555) | ((a & 0x55555555) << 1)
    a = ((a >> 2) & 0x33333333) | ((a & 0x33333333) << 2)
    a = ((a >> 4) & 0x0F0F0F0F) | ((a & 0x0F0F0F0F) << 4)
    a = ((a >> 8) & 0x00FF00FF) | ((a & 0x00FF00FF) << 8)
    return (a >> 16) | (a << 16)


def bitfield_extract(a: int, offset: int, bits: int) -> int:
    start = min(max(offset, 0), 31)
    count = min(max(bits, 0), 32 - start)
    return (a << (32 - start - count)) >> (32 - count) if count > 0 else 0


def bitfield_extract_uint(a: uint, offset: int, bits: int) -> uint:
    start = min(max(offset, 0), 31)
    count = min(max(bits, 0), 32 - start)
    return (a << uint(32 - start - count)) >> uint(32 - count) if count > 0 else uint(0)


def bitfield_insert(a: int, insert: int, offset: int, bits: int) -> int:
    start = min(max(offset, 0), 31)
    count = min(max(bits, 0), 32 - start)
    ones = (1 << count) - 1 if count < 32 else -1
    return (a & ~(ones << start)) | ((insert & ones) << start)


def half_bits(x: float) -> int:
    bits = bits_from_float(quantize_half(x))
    size = bits & 0x7FFFFFFF
    # Exponents of halves are 112 less; numbers below 2**-14 are multiples of 2**-24; NaN keeps its highest bits.
    tiny = int(float_from_bits(size) * 16777216.0)
    normal = (size - 0x38000000) >> 13
    special = 0x7C00 | ((size >> 13) & 0x3FF)
    number = special if size >= 0x7F800000 else (tiny if size < 0x38800000 else normal)
    return number | ((bits >> 16) & 0x8000)


def float_of_half(bits: int) -> float:
    size = bits & 0x7FFF
    tiny = float(size) * 5.9604644775390625e-8
    normal = float_from_bits((size << 13) + 0x38000000)
    special = float_from_bits(0x7F800000 | (size << 13))
    number = special if size >= 0x7C00 else (tiny if size < 0x400 else normal)
    return -number if (bits & 0x8000) != 0 else number
