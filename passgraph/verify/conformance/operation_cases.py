"""Operations of the table on special values, as scalars, vectors and ints.

A kernel evaluates a picture of all pairs of values from a list.  The oracle allows anything outside an operation's
documented domain, so lists are mapped into it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from passgraph.language import operation
from passgraph.language.operation import Domain
from passgraph.language.operations import OPERATIONS, Operation
from passgraph.verify.compare import MOST_AMBIGUOUS
from passgraph.verify.conformance.case import Case, graph_of

GROUP = "operations"
Values = NDArray[np.float32]

#: Zeros, ones, halves, range ends, denormals, tiny and huge numbers; used with both signs, and with non-finite numbers.
SPECIAL = (
    0.0, 1.0, 0.5, 1.5, 2.5, 3.5, 1e-3, 1e-20, 2.0**-126, 2.0**-127, 1e-45, 1e20, 3.4028235e38, 0.1, 0.3, 0.7, 2.0,
    3.0, 7.0, 100.0, 255.0, 8191.0, 0.99999994, 1.0000001, 8388607.5, 16777216.0, 2147483648.0,
)  # fmt: skip
NOT_FINITE = (np.inf, -np.inf, np.nan)
#: Range ends, powers of two and their neighbors, shift distances at and beyond 32, divisors, a uint whose conversion to
#: float rounds up by its last bit, and the bits of an infinite binary16.
INTS = (
    0, 1, 2, 3, 5, 7, 30, 31, 32, 33, 63, 64, 255, 256, 32767, 32768, 65535, 65536, 8388607, 16777217, 123456789,
    2**30, 2**31 - 2, 2**31 - 1, -1, -2, -3, -5, -7, -31, -32, -33, -255, -256, -65536, -16777217, -(2**30),
    -(2**31) + 1, -(2**31), -(2**31) + 129, 0x7C00,
)  # fmt: skip

#: An operation leaves up to four of the 64 values open: denormals, which may count as 0, or values whose result is
#: infinite, and infinities.  A pixel holds four values, so it may contain one in a quarter of the pixels, in addition
#: to the default limit.
OPEN_SHARE = 4 * 4 / 64 + MOST_AMBIGUOUS

#: Vectors and matrices: expressions of two vec4 ``p`` and ``q`` with a vec4 result; all sizes occur.
VECTOR = {
    "dot": "vec4(dot(p.xy, q.xy), dot(p.xyz, q.xyz), dot(p, q), 0.0)",
    "cross": "vec4(cross(p.xyz, q.xyz), 0.0)",
    "length": "vec4(length(p.xy), length(p.xyz), length(p), length(q))",
    "distance": "vec4(distance(p.xy, q.xy), distance(p.xyz, q.xyz), distance(p, q), 0.0)",
    "normalize": "normalize(p) + vec4(0.0, normalize(q.xyz))",
    "faceforward": "faceforward(p, q, p.yxwz)",
    "reflect": "reflect(p, normalize(q))",
    "refract": "vec4(refract(normalize(p.xyz), normalize(q.xyz), 0.7), 0.0)",
    "any": "vec4(float(any(p.xy > q.xy)), float(any(p.xyz > q.xyz)), float(any(p > q)), 0.0)",
    "all": "vec4(float(all(p.xy > q.xy)), float(all(p.xyz > q.xyz)), float(all(p > q)), 0.0)",
    "matmul": "mat4(p, q, p.yzwx, q.zwxy) * p + vec4(mat3(p.xyz, q.xyz, p.yzw) * q.xyz, 0.0)",
    "transpose": "transpose(mat4(p, q, p.yzwx, q.zwxy))[1]",
    "determinant": "vec4(determinant(mat2(p)), determinant(mat3(p.xyz, q.xyz, p.yzw)), determinant(mat2(q)), 0.0)",
    "inverse": "vec4(inverse((mat2(p) + mat2(9.0)) * 1e25)[0], inverse((mat2(q) + mat2(9.0)) * 1e-25)[1])",
    "outer": "outer(p, q)[2]",
}


def _unit(v: Values) -> Values:
    """Map into [-1, 1]."""
    with np.errstate(all="ignore"):
        return np.where(np.abs(v) > 1, np.float32(1) / v, v)


def _angle(v: Values) -> Values:
    with np.errstate(invalid="ignore"):
        return np.where(np.abs(v) > 8192, np.sign(v) * (np.abs(v) % 8192), v)


def _moderate(v: Values) -> Values:
    """Map to sizes with quotients, products and squares in float32's range: 2^-20 to 2^20, and zero."""
    size = np.abs(v)
    clipped = np.sign(v) * np.clip(size, 2.0**-20, 2.0**20)
    return np.where(np.isfinite(v), np.where(size == 0, 0.0, clipped), 1.25).astype(np.float32)


def _small(v: Values) -> Values:
    """Map to exponents from -20 to 20."""
    return np.where(np.isfinite(v), np.clip(v, -20, 20), 3.0).astype(np.float32)


def _dividends(v: Values) -> Values:
    """Map to dividends: zero, and numbers whose quotient by :func:`_divisors` is not near a whole number."""
    return (1000.0 * np.sin(np.arange(len(v)))).astype(np.float32)


def _divisors(v: Values) -> Values:
    """Map to ±0.5 to ±8."""
    turned = np.cos(7.0 * np.arange(len(v)))
    return np.asarray(np.sign(turned) * (0.5 + 7.5 * np.abs(turned)), np.float32)


def _divisible(v: Values) -> Values:
    """Map to documented divisors, 2^-126 to 2^126; keep zero, infinity and NaN."""
    size = np.abs(v)
    inside = (size >= 2.0**-126) & (size <= 2.0**126)
    return np.where(inside | (size == 0) | ~np.isfinite(v), v, np.float32(-0.375))


def _exponents(v: Values) -> Values:
    """Map to exponents of powers in float32's range: -80 to 80, infinity and NaN."""
    with np.errstate(invalid="ignore"):
        return np.where(np.isfinite(v) & (np.abs(v) > 80), np.sign(v) * (np.abs(v) % 80), v)


def _known_bits(v: Values) -> Values:
    """Replace NaN, zeros and denormals, whose bits differ between backends."""
    return np.where(np.isnan(v) | (np.abs(v) < 2.0**-126), np.float32(0.75), v)


def _folded(domain: Domain) -> Callable[[Values], Values]:
    """Return a function that maps numbers into a domain: wraps large ones, raises small ones, then clamps to the
    ends."""

    def mapped(v: Values) -> Values:
        v = np.abs(v) if domain.low >= 0 else v
        size = np.abs(v)
        high = max(abs(domain.low), abs(domain.high))
        with np.errstate(invalid="ignore"):
            inside = np.where(np.isfinite(v) & (size > high), np.sign(v) * (size % high), v)
        nearest = np.copysign(np.float32(domain.least), inside)
        small = (np.abs(inside) < domain.least) & ((inside != 0) | (not domain.zero))
        return np.asarray(np.clip(np.where(small, nearest, inside), domain.low, domain.high), np.float32)

    return mapped


#: Domain → function that maps the list into it; other domains use :func:`_folded`.
MAPPINGS: dict[Domain, Callable[[Values], Values]] = {
    operation.ANY: np.asarray,
    operation.NOT_NEGATIVE: np.abs,
    operation.FROM_ONE: lambda v: np.where(np.abs(v) < 1, 1 + np.abs(v), np.abs(v)),
    operation.UNIT: _unit,
    operation.ANGLE: _angle,
    operation.EXPONENT: _exponents,
    operation.POWER: _small,
    operation.MODERATE: _moderate,
    operation.MODERATE_NOT_ZERO: lambda v: np.where(v == 0, np.float32(0.375), _moderate(v)),
    operation.DIVISOR: _divisible,
    operation.POSITIVE: lambda v: np.abs(_known_bits(_divisible(v))),
    operation.KNOWN_BITS: _known_bits,
    operation.HALVES: lambda v: _known_bits(np.where(np.abs(v) < 8, np.float32(2.0**-14) * v, v)),
    operation.DIVIDEND: _dividends,
    operation.SMALL_DIVISOR: _divisors,
}


def into(domain: Domain, v: Values) -> Values:
    """Map a list of numbers into a domain."""
    return MAPPINGS.get(domain, _folded(domain))(v)


def floats() -> Values:
    """Return 64 values: special ones of both signs, non-finite and ordinary ones."""
    random = np.random.default_rng(7)
    listed = [*SPECIAL, *(-v for v in SPECIAL), *NOT_FINITE]
    return np.array([*listed, *random.uniform(-4, 4, 64 - len(listed))], np.float32)


def pairs(v: NDArray[Any]) -> tuple[NDArray[Any], NDArray[Any]]:
    """Return two pictures (n, n, 4) with all pairs of the values; channels hold the rotated list."""
    rolled = [np.roll(v, 5 * k) for k in range(4)]
    first = [np.repeat(r[:, None], len(v), axis=1) for r in rolled]
    second = [np.repeat(r[None, :], len(v), axis=0) for r in rolled]
    return np.stack(first, -1), np.stack(second, -1)


def cases() -> Iterator[Case]:
    """Yield the cases of each operation: floats, ints and uints as its signature allows."""
    for row in OPERATIONS.values():
        letters = set(row.operands)
        if row.name in VECTOR:
            yield _vectors(row)
            continue
        if letters & {"N", "G", "f"}:
            yield _floats(row)
        if not letters & {"G", "U", "f", "B"}:
            yield _integer_case(row, "int")
        if "U" in letters or (letters & {"N", "I"} and not row.unsigned):
            yield _integer_case(row, "uint")
        if letters == {"B"} or (row.converts and "N" in letters):
            yield _bools(row)
        if row.name == "pow":
            yield _known_powers()


def call(row: Operation, operands: list[str], vector: bool) -> str:
    """Return the call of an operation as source text; vector comparisons are functions, since operators return one
    bool."""
    return row.as_written(*operands, by_name=vector and row.result == "B")


def _result(row: Operation, kind: str = "float") -> str:
    """Return the kind of number that a row gives, for operands of a kind if it takes several: "float", "int", "uint",
    "bool"."""
    kinds = {"B": "bool", "b": "bool", "S": "int", "i": "int", "U": "uint", "N": kind, "I": kind}
    return kinds.get(row.result, "float")


#: Number type → prefix of its vector types.
_VECTORS = {"float": "vec", "int": "ivec", "uint": "uvec", "bool": "bvec"}


#: Exponents known at compile time: they become products, reciprocals, or a general power.
KNOWN_POWERS = (2.0, 3.0, -1.0, -2.0, 7.0, 8.0, -3.0, 9.0, 0.5, 4.0, 5.0, 6.0)


def _known_powers() -> Case:
    a, b = pairs(np.clip(_moderate(floats()), -100.0, 100.0))
    powers = [", ".join(f"pow(x, {y})" for y in KNOWN_POWERS[k : k + 4]) for k in range(0, len(KNOWN_POWERS), 4)]
    shown = ", ".join(f"vec4({part})" for part in powers)
    head = "def probe(a: Image, b: Image) -> tuple[vec4, vec4, vec4]:\n    x = a[0, 0].x\n"
    return _case("pow of known exponents", f"{head}    return {shown}\n", a, b)


def _case(name: str, text: str, a: NDArray[Any], b: NDArray[Any]) -> Case:
    height, width = a.shape[:2]
    frame = {"a": a.astype(np.float32), "b": b.astype(np.float32)}
    graph = partial(graph_of, text)
    return Case(GROUP, name, graph, (width, height), (frame,), most_ambiguous=OPEN_SHARE)


def _floats(row: Operation) -> Case:
    """Build the case of a four-component vector and a scalar."""
    count = len(row.operands)
    v = floats()
    (a, _), (_, b) = (pairs(into(row.domain_of(operand), v)) for operand in (0, 1))
    vectors, scalars = ["p", "q", "p.yzwx"][:count], ["p.x", "q.x", "p.y"][:count]
    for i, letter in enumerate(row.operands):
        if letter == "S":
            vectors[i], scalars[i] = f"ivec4({vectors[i]})", f"int({scalars[i]})"
    kind = _result(row)
    if row.operands == ("f",):
        vector = "ivec4({})".format(", ".join(call(row, [f"p.{c}"], False) for c in "xyzw"))
    else:
        vector = _converted(row, f"{_VECTORS[kind]}4", vectors)
    lines = [f"    u = {vector}", f"    v = {call(row, scalars, False)}"]
    text = _kernel("    p = a[0, 0]\n    q = b[0, 0]\n", lines, kind)
    return _case(row.name, text, a, b)


def _converted(row: Operation, type_: str, vectors: list[str]) -> str:
    """Return an operation on vectors; a conversion is the name of its vector type."""
    return f"{type_}({vectors[0]})" if row.converts else call(row, vectors, True)


def _kernel(head: str, lines: list[str], kind: str) -> str:
    """Return a kernel that stores results exactly: ints as their lower and upper halves."""
    body = "\n".join(lines)
    if kind in ("int", "uint"):
        halves = "vec4(u & 0xFFFF), vec4((u >> 16) & 0xFFFF), vec4(v & 0xFFFF, (v >> 16) & 0xFFFF, 0.0, 0.0)"
        return f"def probe(a: Image, b: Image) -> tuple[vec4, vec4, vec4]:\n{head}{body}\n    return {halves}\n"
    shown = "vec4(u), vec4(float(v), 0.0, 0.0, 0.0)"
    return f"def probe(a: Image, b: Image) -> tuple[vec4, vec4]:\n{head}{body}\n    return {shown}\n"


def _integer_case(row: Operation, given: str) -> Case:
    """Build the case of ints, or of uints with the same bits.

    An int is passed as two halves, which float32 holds exactly: upper in the first channel, lower in the second."""
    v = np.array(INTS, np.int64)
    count = len(row.operands)
    first, second = pairs(v)
    a, b = (
        np.stack([x[..., 0] >> 16, x[..., 0] & 0xFFFF, x[..., 1] >> 16, x[..., 1] & 0xFFFF], -1)
        for x in (first, second)
    )
    head = "".join(
        f"    {name} = ivec2(int({source}.x), int({source}.z)) * 65536 + ivec2(int({source}.y), int({source}.w))\n"
        for name, source in (("p", "a[0, 0]"), ("q", "b[0, 0]"))
    )
    kind = _result(row, given)
    vectors, scalars = ["p", "q", "p.yx", "q.yx"][:count], ["p.x", "q.x", "p.y", "q.y"][:count]
    if row.operands == ("i",) or row.converts:
        scalars = ["q.x"]
    for i, letter in enumerate(row.operands):
        if letter == "S" and count > 2:  # bit positions, some out of range
            vectors[i], scalars[i] = f"({vectors[i]} % 41 - 4)", f"({scalars[i]} % 41 - 4)"
        elif letter != "S" and given == "uint":
            vectors[i], scalars[i] = f"uvec2({vectors[i]})", f"uint({scalars[i]})"
    scalar = call(row, scalars, False)
    if row.operands == ("i",):
        vector = f"vec2({call(row, ['p.x'], False)}, {call(row, ['p.y'], False)})"
    else:
        vector = _converted(row, f"{_VECTORS[kind]}2", vectors)
    lines = [f"    w = {vector}", f"    v = {scalar}"]
    filled = {"bool": "vec4(float(w.x), float(w.y), 0.0, 0.0)", "float": "vec4(w, 0.0, 0.0)"}
    wide = filled.get(kind, f"{_VECTORS[kind]}4(w, w)")
    text = _kernel(head, [*lines, f"    u = {wide}"], kind)
    return _case(f"{row.name} of {given}s", text, a, b)


def _bools(row: Operation) -> Case:
    v = np.array([0.0, 1.0], np.float32)
    a, b = pairs(np.tile(v, 4))
    scalar = call(row, ["p.x", "q.y"][: len(row.operands)], False)
    head = "    p = a[0, 0] > vec4(0.5)\n    q = b[0, 0] > vec4(0.5)\n"
    text = f"def probe(a: Image, b: Image) -> vec4:\n{head}    v = {scalar}\n    return vec4(float(v), 0.0, 0.0, 0.0)\n"
    return _case(f"{row.name} of bools", text, a, b)


def _vectors(row: Operation) -> Case:
    """Build the case of vectors: ordinary numbers, some zero or equal vectors; huge and tiny ones where no square is a
    result."""
    random = np.random.default_rng(3)
    a, b = (random.uniform(-3.0, 3.0, (48, 64, 4)) for _ in range(2))
    a[0], b[1] = 0.0, 0.0
    a[2] = b[2]
    a[3, :, 1:], b[4, :, :3] = 0.0, 0.0
    if row.name in ("length", "distance", "normalize"):
        scales = np.ldexp(1.0, np.arange(-120, 120, 240 // 16))[:, None, None]
        a[16:32] *= scales
        b[16:32] *= scales
        a[32:40, :, :2] *= 2.0**40
        b[32:40, :, 1:] *= 2.0**-40
    text = f"def probe(a: Image, b: Image) -> vec4:\n    p = a[0, 0]\n    q = b[0, 0]\n    return {VECTOR[row.name]}\n"
    return _case(row.name, text, a, b)
