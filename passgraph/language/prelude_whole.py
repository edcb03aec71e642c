"""Scalar functions of whole numbers, written in the kernel language: like :mod:`.prelude`, parsed and never run.

Programs hold a uint as the int with the same bits.  So a function may take a uint's bits as an int, where it is about
them, or as a uint, where it says what it computes.
"""

# mypy: disable-error-code="no-any-return"
from __future__ import annotations

from passgraph.language.symbols import uint

# Uints.  A comparison of uints is one of ints whose highest bits are turned over.


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
    # The ones that come from above, as many as the distance, are taken away.
    return (a >> b) & ~((-1 << (31 - (b & 31))) << 1)


def floor_divide_uint(a: uint, b: uint) -> uint:
    # A divisor whose highest bit is set goes into nothing twice.
    divisor = int(b)
    # Of half of a, an int: twice that quotient is the wanted one, or one less.
    double = uint(int(a >> 1) // divisor) << 1
    quotient = double + uint(a - double * b >= b)
    return quotient if divisor > 0 else uint(divisor < 0 and a >= b)


def int_mod_uint(a: uint, b: uint) -> uint:
    return a - (a // b) * b if b != 0 else uint(0)


def float_from_uint(a: int) -> float:
    # Half of a large one is an int; its lowest bit stays set where a bit is lost, so that it rounds like the whole.
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
