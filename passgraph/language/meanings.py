"""Reference functions of the operations: on float64, int64, uint32 or bool arrays, batch on axis 0, then components."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from passgraph.language.symbols import UINT_MAX

Values = NDArray[Any]

INT_MIN, INT_MAX = -(2**31), 2**31 - 1
#: The largest float32 below one: the upper limit of fract.
BELOW_ONE = float(np.nextafter(np.float32(1), np.float32(0)))


def wrap32(values: Values) -> Values:
    """Wrap to 32 bits in two's complement, as int arithmetic overflows."""
    return ((np.asarray(values, np.int64) + 2**31) & 0xFFFFFFFF) - 2**31


def is_int(values: Values) -> bool:
    """Return True for ints, which must be wrapped; uints are held as uint32, which wraps by itself."""
    return bool(np.asarray(values).dtype.kind == "i")


def is_whole(values: Values) -> bool:
    """Return True for ints or uints."""
    return bool(np.asarray(values).dtype.kind in "iu")


def int_of_bits(number: int) -> int:
    """Return the int with the bits of an integer from -2147483648 to 4294967295."""
    return number if number <= INT_MAX else number - 2**32


def uint_of_bits(number: int) -> int:
    """Return the uint with the bits of an integer from -2147483648 to 4294967295."""
    return number & UINT_MAX


def wrapped(values: Values) -> Values:
    return wrap32(values) if is_int(values) else np.asarray(values)


def arith(function: Callable[[Values, Values], Values]) -> Callable[[Values, Values], Values]:
    return lambda a, b: wrapped(function(a, b))


def floor_divide(a: Values, b: Values) -> Values:
    if is_whole(a):
        return wrapped(np.where(b == 0, 0, a // np.where(b == 0, 1, b)).astype(a.dtype))
    return np.asarray(np.floor(a / b))


def modulo(a: Values, b: Values) -> Values:
    if is_whole(a):
        return wrapped(np.where(b == 0, 0, a % np.where(b == 0, 1, b)).astype(a.dtype))
    defined = np.isfinite(a) & np.isfinite(b) & (b != 0)
    rest = np.mod(np.where(defined, a, 0.0), np.where(defined, b, 1.0))
    # A tiny negative number plus b may round to b itself, which is no remainder.
    largest = np.nextafter(np.abs(np.asarray(b)).astype(np.float32), np.float32(0)).astype(np.float64)
    rest = np.copysign(np.minimum(np.abs(rest), largest), rest)
    return np.where(defined, rest, np.nan)


def to_int(a: Values) -> Values:
    a = np.asarray(a)
    if a.dtype.kind == "u":
        return a.astype(np.int32).astype(np.int64)
    if a.dtype.kind != "f":
        return a.astype(np.int64)
    clean = np.where(np.isnan(a), 0.0, a)
    return np.asarray(np.trunc(np.clip(clean, INT_MIN, INT_MAX)).astype(np.int64))


def to_uint(a: Values) -> Values:
    a = np.asarray(a)
    if a.dtype.kind != "f":
        return a.astype(np.uint32)
    clean = np.where(np.isnan(a), 0.0, a)
    return np.asarray(np.trunc(np.clip(clean, 0, UINT_MAX)).astype(np.uint32))


def minimum(a: Values, b: Values) -> Values:
    return np.where(b < a, b, a)


def maximum(a: Values, b: Values) -> Values:
    return np.where(a < b, b, a)


def normalize(v: Values) -> Values:
    # Squares of float32 numbers never leave the range of float64.
    size = np.sqrt(np.sum(v * v, axis=-1, keepdims=True))
    return np.where(size > 0, v / np.where(size > 0, size, 1), np.where(np.isnan(size), size, 0.0))


def smoothstep(low: Values, high: Values, x: Values) -> Values:
    width = high - low
    t = np.where(width == 0, np.where(x < low, 0.0, 1.0), (x - low) / np.where(width == 0, 1.0, width))
    t = minimum(maximum(t, np.zeros_like(t)), np.ones_like(t))
    return np.asarray(t * t * (3 - 2 * t))


def dot(a: Values, b: Values) -> Values:
    return np.asarray(np.sum(a * b, axis=-1))


def power(x: Values, y: Values) -> Values:
    """Raise to a power; of a negative x only integer powers. Zero has no sign, so its negative powers have none."""
    missing = np.isnan(y) | ((x < 0) & (np.floor(y) != y))
    return np.where(missing, np.nan, np.power(np.where(missing, 1.0, x + 0.0), np.where(missing, 1.0, y)))


def refract(incident: Values, normal: Values, ratio: Values) -> Values:
    cosine = dot(normal, incident)
    k = 1 - ratio * ratio * (1 - cosine * cosine)
    bent = ratio[..., None] * incident - (ratio * cosine + np.sqrt(np.maximum(k, 0)))[..., None] * normal
    return np.where((k < 0)[..., None], 0.0, bent)


def matmul(a: Values, b: Values) -> Values:
    """Multiply matrices with columns on axis -2: M*v, v*M and M*N as in GLSL."""
    if a.ndim == 3 and b.ndim == 3:
        return np.asarray(np.einsum("ncr,nkc->nkr", a, b))
    if a.ndim == 3:
        return np.asarray(np.einsum("ncr,nc->nr", a, b))
    return np.asarray(np.einsum("nr,ncr->nc", a, b))


def shift(function: Callable[[Values, Values], Values]) -> Callable[[Values, Values], Values]:
    return lambda a, b: wrapped(function(a, b & 31))


def float_bits(a: Values) -> Values:
    return np.asarray(a).astype(np.float32).view(np.int32).astype(np.int64)


def bits_float(a: Values) -> Values:
    return np.asarray(a).astype(np.int32).view(np.float32).astype(np.float64)


def inverse(m: Values) -> Values:
    with np.errstate(all="ignore"):
        determinant = np.linalg.det(m)
        safe = np.where((determinant == 0)[:, None, None], np.eye(m.shape[-1]), m)
        return np.where((determinant == 0)[:, None, None], np.nan, np.linalg.inv(safe))


def negative(a: Values) -> Values:
    return wrapped(-a)


def magnitude(a: Values) -> Values:
    return wrapped(np.abs(a))


def to_float(a: Values) -> Values:
    return np.asarray(a).astype(np.float64)


def sign(a: Values) -> Values:
    return np.where(a > 0, 1, np.where(a < 0, -1, 0)).astype(a.dtype)


def clamp(x: Values, low: Values, high: Values) -> Values:
    return minimum(maximum(x, low), high)


def saturate(x: Values) -> Values:
    return clamp(x, np.zeros_like(x), np.ones_like(x))


def fract(x: Values) -> Values:
    return minimum(x - np.floor(x), np.full_like(x, BELOW_ONE))


def inversesqrt(x: Values) -> Values:
    return np.asarray(1 / np.sqrt(x))


def step(edge: Values, x: Values) -> Values:
    return np.where(x < edge, 0.0, 1.0)


def mix(x: Values, y: Values, a: Values) -> Values:
    return np.asarray(x * (1 - a) + y * a)


def angle(y: Values, x: Values) -> Values:
    return np.where((x == 0) & (y == 0), 0.0, np.arctan2(y + 0.0, x))


def length(v: Values) -> Values:
    return np.asarray(np.sqrt(dot(v, v)))


def distance(a: Values, b: Values) -> Values:
    return length(a - b)


def faceforward(n: Values, incident: Values, reference: Values) -> Values:
    return np.where((dot(reference, incident) < 0)[..., None], n, -n)


def reflect(incident: Values, normal: Values) -> Values:
    return np.asarray(incident - 2 * dot(normal, incident)[..., None] * normal)


def any_of(v: Values) -> Values:
    return np.asarray(np.any(v, axis=-1))


def all_of(v: Values) -> Values:
    return np.asarray(np.all(v, axis=-1))


def transpose(m: Values) -> Values:
    return np.swapaxes(m, -1, -2)


def outer(a: Values, b: Values) -> Values:
    return np.asarray(np.einsum("nr,nc->ncr", a, b))


def fma(a: Values, b: Values, c: Values) -> Values:
    return np.asarray(a * b + c)


def ldexp(x: Values, n: Values) -> Values:
    # Beyond, every float32 is 0 or infinite; the clamp keeps the computation exact.
    return np.ldexp(x, np.clip(n, -400, 400).astype(np.int32))


def quotient(a: Values, b: Values) -> Values:
    """Divide toward zero."""
    size = np.abs(a) // np.where(b == 0, 1, np.abs(b))
    return wrap32(np.where(b == 0, 0, np.where((a < 0) != (b < 0), -size, size)))


def remainder(a: Values, b: Values) -> Values:
    return wrap32(np.where(b == 0, 0, a - quotient(a, b) * b))


def bits_of(a: Values) -> Values:
    """Return the 32 bits of each integer, the lowest first, on a last axis."""
    return (np.asarray(a).astype(np.int64)[..., None] >> np.arange(32)) & 1


def of_bits(bits: Values, like: Values) -> Values:
    """Return 32-bit integers, as ints or uints."""
    number = np.sum(bits.astype(np.int64) << np.arange(32), axis=-1)
    return number.astype(np.uint32) if np.asarray(like).dtype.kind == "u" else wrap32(number)


def bit_count(a: Values) -> Values:
    return np.asarray(np.sum(bits_of(a), axis=-1))


def find_lsb(a: Values) -> Values:
    bits = bits_of(a)
    return np.where(np.any(bits, axis=-1), np.argmax(bits, axis=-1), -1)


def find_msb(a: Values) -> Values:
    """Return the highest set bit; of a negative int, the highest bit that is 0."""
    bits = bits_of(np.where(np.asarray(a) < 0, ~np.asarray(a), a))
    return np.where(np.any(bits, axis=-1), 31 - np.argmax(bits[..., ::-1], axis=-1), -1)


def bitfield_reverse(a: Values) -> Values:
    return of_bits(bits_of(a)[..., ::-1], a)


def field(offset: Values, bits: Values) -> tuple[Values, Values]:
    """Return the offset and length of a bit field, clamped to 32 bits."""
    start = np.clip(offset, 0, 31)
    return start, np.clip(bits, 0, 32 - start)


def bitfield_extract(a: Values, offset: Values, bits: Values) -> Values:
    start, count = field(offset, bits)
    places = np.arange(32)
    highest = (start + count - 1)[..., None]
    signed = np.asarray(a).dtype.kind == "i"
    # Extension of a field: with its highest bit for ints, with zeros for uints.
    extracted = np.take_along_axis(bits_of(a), np.clip(np.minimum(places + start[..., None], highest), 0, 31), axis=-1)
    kept = (count > 0)[..., None] & (signed | (places < count[..., None]))
    return of_bits(np.where(kept, extracted, 0), a)


def bitfield_insert(a: Values, insert: Values, offset: Values, bits: Values) -> Values:
    start, count = field(offset, bits)
    places = np.arange(32) - start[..., None]
    inside = (places >= 0) & (places < count[..., None])
    inserted = np.take_along_axis(bits_of(insert), np.clip(places, 0, 31), axis=-1)
    return of_bits(np.where(inside, inserted, bits_of(a)), a)


def half_bits(x: Values) -> Values:
    with np.errstate(over="ignore"):
        return np.asarray(x).astype(np.float16).view(np.uint16).astype(np.uint32)


def float_of_half(bits: Values) -> Values:
    return np.asarray(bits).astype(np.uint16).view(np.float16).astype(np.float64)
