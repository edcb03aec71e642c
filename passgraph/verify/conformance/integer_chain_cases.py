"""Chains of integer operations on special values, against Python's own integers.

A compiler may assume that a signed operation does not overflow, or that `abs` is never negative. Each operation then
gives the right result alone, and the next one the wrong result. So every operation here feeds every other one, and
those feed comparisons, clamps, indices and loops.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from functools import partial
from itertools import product

import numpy as np
from numpy.typing import NDArray

from passgraph.verify.conformance.case import Case, graph_of

GROUP = "language"
#: Range ends, shift distances around 32, divisors, and neighbors of powers of two.
VALUES = (
    -(2**31), -(2**31) + 1, -(2**30), -65536, -33, -32, -7, -1, 0, 1, 3, 7, 31, 32, 65535, 2**30, 2**31 - 2, 2**31 - 1,
)  # fmt: skip
TABLE = (11, -13, 17, -19, 23, -29, 31, -37)
Step = Callable[[int, int], int]


def _wrapped(value: int) -> int:
    return (value + 2**31) % 2**32 - 2**31


def _quotient(a: int, b: int) -> int:
    return 0 if b == 0 else abs(a) // abs(b) * (1 if (a < 0) == (b < 0) else -1)


def _clamped(a: int, low: int, high: int) -> int:
    return min(max(a, low), high)


def _sign(a: int) -> int:
    return (a > 0) - (a < 0)


def _field(a: int, offset: int, bits: int) -> int:
    value = a >> offset & (1 << bits) - 1
    return value - (1 << bits) if value >> bits - 1 else value


def _trips(start: int, end: int, step: int) -> int:
    return sum(range(start, end, step)) + len(range(start, end, step))


#: Expressions of ints a and b, and their values in Python.
STEPS: dict[str, Step] = {
    "abs(a)": lambda a, b: abs(a),
    "-a": lambda a, b: -a,
    "~a": lambda a, b: ~a,
    "a + b": lambda a, b: a + b,
    "a - b": lambda a, b: a - b,
    "a * b": lambda a, b: a * b,
    "a // b": lambda a, b: 0 if b == 0 else a // b,
    "a % b": lambda a, b: 0 if b == 0 else a % b,
    "quotient(a, b)": _quotient,
    "remainder(a, b)": lambda a, b: 0 if b == 0 else a - _quotient(a, b) * b,
    "a << b": lambda a, b: a << (b & 31),
    "a >> b": lambda a, b: a >> (b & 31),
    "a & b": lambda a, b: a & b,
    "a ^ b": lambda a, b: a ^ b,
    "min(a, b)": min,
    "max(a, b)": max,
    "clamp(a, b, -b)": lambda a, b: _clamped(a, b, _wrapped(-b)),
    "sign(a)": lambda a, b: _sign(a),
    "bitfield_extract(a, 28, 4)": lambda a, b: _field(a, 28, 4),
    "bit_count(a)": lambda a, b: (a & 2**32 - 1).bit_count(),
    "int(float(a & 0x3FFFFF) * 1024.0)": lambda a, b: min((a & 0x3FFFFF) * 1024, 2**31 - 1),
    "int(float(a >> 8) * 1024.0)": lambda a, b: _clamped((a >> 8) * 1024, -(2**31), 2**31 - 1),
    "int(abs(uint(a)) >> 1)": lambda a, b: (a % 2**32) >> 1,
}
#: Operations that overflow; a short run tries these.
QUICK = ("abs(a)", "a // b")
#: Uses of a result, and the number that each adds to the sum.
USES: dict[str, Step] = {
    "(1 if r < 0 else 2)": lambda r, b: 1 if r < 0 else 2,
    "(3 if r >= 0 else 5)": lambda r, b: 3 if r >= 0 else 5,
    "clamp(r, -5, 5)": lambda r, b: _clamped(r, -5, 5),
    "min(r, -1)": lambda r, b: min(r, -1),
    "max(r, 0)": lambda r, b: max(r, 0),
    "r // 3": lambda r, b: r // 3,
    "r % 7": lambda r, b: r % 7,
    "(r >> 31)": lambda r, b: r >> 31,
    "TABLE[clamp(r, -5, 5)]": lambda r, b: TABLE[_clamped(r, 0, 5)],
    "int(given[clamp(r, -5, 3)])": lambda r, b: TABLE[_clamped(r, 0, 3)],
    "int(given[r])": lambda r, b: TABLE[_clamped(r, 0, 7)],
}
#: Loops over a result, and their trip counts.
LOOPS: dict[str, Step] = {
    "clamp(r, -3, 4), 5": lambda r, b: _trips(_clamped(r, -3, 4), 5, 1),
    "0, clamp(r, -2, 6), 2": lambda r, b: _trips(0, _clamped(r, -2, 6), 2),
}
_A = re.compile(r"\ba\b")
HALVES = """
def halves(a: uint) -> vec4:
    return vec4(float(a & 0xFFFF), float(a >> 16), 0.0, 1.0)
"""


def kernel_text(first: str) -> str:
    """Return a kernel that passes the result of one operation to every other one, and sums the uses of their
    results."""
    lines = [f"TABLE = {TABLE}", HALVES, "def run(color: Image, given: Array[float, 8]) -> vec4:"]
    lines += ["    c = color[0, 0]", "    x = int(c.x) << 16 | int(c.y)", "    b = int(c.z) << 16 | int(c.w)"]
    lines += [f"    a = {re.sub(_A, 'x', first)}", "    total = uint(0)"]
    for second in STEPS:
        lines.append(f"    r = {second}")
        lines += [f"    total = total * 31 + uint({use})" for use in USES]
        for loop in LOOPS:
            lines += ["    count = 0", f"    for i in range({loop}):", "        count += i + 1"]
            lines.append("    total = total * 31 + uint(count)")
    return "\n".join([*lines, "    return halves(total)", ""])


def total(first: str, x: int, b: int) -> int:
    """Compute the kernel in Python's own integers."""
    a, result = _wrapped(STEPS[first](x, b)), 0
    for second in STEPS.values():
        r = _wrapped(second(a, b))
        for use in (*USES.values(), *LOOPS.values()):
            result = (result * 31 + use(r, b)) % 2**32
    return result


def totals(first: str) -> NDArray[np.float32]:
    """Compute what the kernel stores for each pair of values."""
    sums = np.array([[total(first, x, b) for b in VALUES] for x in VALUES], np.int64)
    low, high = sums & 0xFFFF, sums >> 16
    return np.stack([low, high, np.zeros_like(low), np.ones_like(low)], axis=-1).astype(np.float32)


def _halves_of(values: NDArray[np.int64]) -> NDArray[np.float32]:
    return np.stack([values >> 16, values & 0xFFFF], axis=-1).astype(np.float32)


def cases() -> Iterator[Case]:
    """Yield a case for each operation that comes first."""
    side = len(VALUES)
    pairs = np.array(list(product(VALUES, VALUES)), np.int64).reshape(side, side, 2)
    color = np.concatenate([_halves_of(pairs[..., 0]), _halves_of(pairs[..., 1])], axis=-1)
    given = tuple(float(value) for value in TABLE)
    for first in STEPS:
        make, exact = partial(graph_of, kernel_text(first), given=given), {"result0": partial(totals, first)}
        frames = ({"color": color},)
        yield Case(GROUP, f"chains after {first}", make, (side, side), frames, exact=exact, quick=first in QUICK)
