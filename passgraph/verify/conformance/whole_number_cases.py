"""Uints in kernels, and packing: exact whole numbers, compared with Python's integers and NumPy's formats."""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from passgraph.verify.conformance.case import Case, graph_of

GROUP = "language"
SIZE = (29, 13)
SEED, STEPS, SCALE = 0xDEADBEEF, (1, 0x80000000, 4000000000), 0xFFFFFFFE
_M = 2**32

#: Each result is a uint, stored as two halves that float32 holds exactly.
HALVES = """
def halves(a: uint, b: uint) -> vec4:
    return vec4(float(a & 0xFFFF), float(a >> 16), float(b & 0xFFFF), float(b >> 16))
"""
UINTS = (
    """
TABLE = (0x9E3779B9, 1, 0x80000000, 77)
"""
    + HALVES
    + """
def run(color: Image, seed: uint, steps: Array[uint, 3], scale: Const[uint]) -> tuple[vec4, vec4, vec4]:
    p = uvec2(pixel())
    hash = (p.x * 747796405 + 0xAC564B05) ^ seed
    hash = ((hash >> ((hash >> 28) + 4)) ^ hash) * 277803737
    hash = (hash >> 22) ^ hash
    mine = [hash, uint(5), p.y, seed]
    mine[pixel().x % 4] += uint(TABLE[pixel().y % 4])
    step = steps[pixel().x % 3]
    total = uint(0)
    for i in range(4):
        total = total * 31 + mine[i]
        if total > scale - step:
            total -= p.x + 1
    return halves(hash // (step + p.y), hash % (p.x * 268435456 + p.y + 1)), halves(total, min(hash, step) - max(
        hash, scale)), halves(-hash, ~(hash << p.y) | (p.x & 1 if hash >= step and scale > 5 else p.y))
"""
)


def _hash(x: int) -> int:
    state = ((x * 747796405 + 0xAC564B05) % _M) ^ SEED
    state = (((state >> ((state >> 28) + 4)) ^ state) * 277803737) % _M
    return (state >> 22) ^ state


def _uints(x: int, y: int) -> tuple[tuple[int, int], ...]:
    """Compute the kernel in Python integers."""
    state = _hash(x)
    mine = [state, 5, y, SEED]
    mine[x % 4] = (mine[x % 4] + (0x9E3779B9, 1, 0x80000000, 77)[y % 4]) % _M
    step, total = STEPS[x % 3], 0
    for one in mine:
        total = (total * 31 + one) % _M
        if total > (SCALE - step) % _M:
            total = (total - x - 1) % _M
    turned = ~((state << y) % _M) % _M
    return (
        (state // ((step + y) % _M), state % (x * 268435456 % _M + y + 1)),
        (total, (min(state, step) - max(state, SCALE)) % _M),
        (-state % _M, turned | (x & 1 if state >= step else y)),
    )


#: Kernel of a vec4 near and beyond -1 to 1 → a function that returns the bytes it packs to.
PACKS: dict[str, tuple[str, Callable[[NDArray[np.float32]], bytes]]] = {
    "unorm4x8": ("v", lambda v: np.rint(np.clip(v, 0, 1) * np.float32(255)).astype("<u1").tobytes()),
    "snorm4x8": ("v", lambda v: np.rint(np.clip(v, -1, 1) * np.float32(127)).astype("<i1").tobytes()),
    "unorm2x16": ("v.xy", lambda v: np.rint(np.clip(v[:2], 0, 1) * np.float32(65535)).astype("<u2").tobytes()),
    "snorm2x16": ("v.xy", lambda v: np.rint(np.clip(v[:2], -1, 1) * np.float32(32767)).astype("<i2").tobytes()),
    "half2x16": ("v.xy", lambda v: v[:2].astype("<f2").tobytes()),
}


def _packed(name: str) -> str:
    back = "unpack_{0}(bits)" if name.endswith("8") else "vec4(unpack_{0}(bits), 0.0, 0.0)"
    return f"""{HALVES}
def run(color: Image) -> tuple[vec4, vec4]:
    v = color[0, 0]
    bits = pack_{name}({PACKS[name][0]})
    return halves(bits, pack_{name}(unpack_{name}(bits))), {back.format(name)}
"""


def _numbers() -> NDArray[np.float32]:
    """Return steps of each format and halves between them, range ends and numbers beyond; multiples of 2^-16."""
    random = np.random.default_rng(4)
    numbers = random.integers(-70000, 70000, (SIZE[1], SIZE[0], 4)) / 65536
    numbers[0] = random.choice([0.25, -0.5, 1.0, -1.0, 1.5, -1.5, 0.0625, 2.0**-15], numbers[0].shape)
    for scale in (65535, 32767):
        # In float32 some products round to an exact half, where the reference in float64 rounds the other way.
        numbers[np.rint(np.float32(numbers) * np.float32(scale)) != np.rint(numbers * scale)] = 0.5
    return numbers.astype(np.float32)


def _halves(pairs: NDArray[Any]) -> NDArray[np.float32]:
    a, b = pairs[..., 0], pairs[..., 1]
    return np.stack([a & 0xFFFF, a >> 16, b & 0xFFFF, b >> 16], axis=-1).astype(np.float32)


def cases() -> Iterator[Case]:
    """Yield each kernel with its expected result."""
    frame = {"color": _numbers()}
    results = np.array([[_uints(x, y) for x in range(SIZE[0])] for y in range(SIZE[1])], np.int64)
    exact = {f"result{k}": _halves(results[:, :, k]) for k in range(3)}
    values: dict[str, Any] = {"seed": SEED, "steps": STEPS, "scale": SCALE}
    yield Case(GROUP, "uints", partial(graph_of, UINTS, **values), SIZE, (frame,), exact=exact)
    for name, (_, pack) in PACKS.items():
        bits = np.array([[struct.unpack("<I", pack(v))[0] for v in row] for row in frame["color"]], np.int64)
        known = {"result0": _halves(np.stack([bits, bits], axis=-1))}
        yield Case(GROUP, f"packing as {name}", partial(graph_of, _packed(name)), SIZE, (frame,), exact=known)
