"""Cases of the language except operations: loops, branches, tables, arrays, parameters, neighborhoods.

Pictures and parameters hold small whole numbers, so every sum and result is exact.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

import passgraph as pg
from passgraph.verify.conformance import control_cases, integer_chain_cases, whole_number_cases
from passgraph.verify.conformance.case import Case, Picture, graph_of, whole_numbers

GROUP = "language"
SIZE = (23, 17)
#: Wider than a work-group of 128, and more than the 16,384 pixels that one thread computes at a time.
WIDE = (301, 61)
#: Name → kernel, and a function that computes its result from the picture (h, w, 4) and its columns and rows.
KERNELS: dict[str, tuple[str, Callable[[Picture, NDArray[Any], NDArray[Any]], NDArray[Any]]]] = {
    "a table": (
        """
TABLE = (3.0, 1.0, 4.0, 1.0, 5.0, 9.0, 2.0)
STEPS = ((1, 0), (0, 1), (2, 3))

def run(color: Image) -> vec4:
    step = STEPS[pixel().y % 3]
    return color[0, 0] * TABLE[pixel().x % 7] + vec4(vec2(step), TABLE[pixel().x], TABLE[-1 - pixel().x])
""",
        lambda a, x, y: _table(a, x, y),
    ),
    "channels apart": (
        """
def run(color: Image) -> vec4:
    return vec4(color[1, 0].g, color[1, 0].g, color[1, 0].b, color[1, 0].a) - color[-1, 0]
""",
        lambda a, x, y: _at(a, 1, 0)[..., [1, 1, 2, 3]] - _at(a, -1, 0),
    ),
}

#: Parameters of every type, so that each has another offset in the block.
PARAMETERS = """
def run(color: Image, one: float, few: Array[float, 5], flag: bool, whole: int, turn: mat3, many: Array[float, 300],
        steps: Array[int, 6], by: vec3, pairs: Array[vec2, 3]) -> tuple[vec4, vec4, vec4]:
    x = pixel().x
    first = vec4(one, few[x % 5], many[x * 13], float(steps[x % 6]))
    second = vec4(turn * by, pairs[x % 3].y)
    third = vec4(many[257], many[299], float(whole) if flag else -1.0, few[3])
    return first + color[0, 0], second, third
"""

#: Expressions that optimization must not change: differences both ways, signed zeros, infinities and NaN.
IDENTITIES = """
def run(a: Image, b: Image) -> tuple[vec4, vec4, vec4]:
    p = a[0, 0]
    q = b[0, 0]
    first = vec4(p.x - q.x, q.x - p.x, 0.0 - p.y, p.y - 0.0)
    second = vec4(p.z * 0.0, p.z * 1.0, p.z / 1.0, 1.0 if p.z != p.z else 0.0)
    return first, second, vec4(p.w == p.w) * vec4(1.0 / (0.0 - abs(q.y) * 0.0 - 1.0), 3.0, 5.0, 7.0)
"""

#: Operations that compilers combine as if numbers were real and finite.
COMBINED = """
def run(a: Image, b: Image) -> tuple[vec4, vec4]:
    x, y, z = a[0, 0].x, b[0, 0].y, 1.0 - b[0, 0].x
    first = vec4((x + y) - x, x - x, x * y + x * 3.0, x * z + y * (1.0 - z))
    root = sqrt(abs(x))
    return first, vec4(root * root, (x * 1e30) * 1e-30, x / x, -x + (x + z))
"""

#: Zeros in the text, which shader compilers tend to fold, zeros that a condition chooses, and those of unrolled loops.
ZEROS = """
def run(a: Image, b: Image) -> tuple[vec4, vec4, vec4, vec4]:
    x, y = a[0, 0].x, b[0, 0].y
    first = vec4(0.0 / x, 1.0 - 0.0 / x, 0.0 // x, 0.0 * x)
    second = vec4(2.0, pow(x, 0.0), min(0.0 / x, 1.0), 1.0 if 0.0 / x == 0.0 else 2.0)
    mask = float(b[0, 0].x < 1.0)
    sign = -1.0 if y > 2.0 else 0.0
    third = vec4(mask * x, (1.0 - mask) * x, mask * 0.5 * x, sign * x)
    return first, second, third, vec4(x * y * mask, y + mask * (x - y), float(int(mask) * 2 - 1 < 0) * x, mask / x)
"""
UNROLLED_ZEROS = """
TABLE = (0.0, 1.0, 2.0)

def run(a: Image, b: Image) -> tuple[vec4, vec4]:
    x, total, product, quotient = a[0, 0].x, vec4(0), 0.0, 0.0
    for i in range(3):
        if b[0, 0].x > 1e38:
            break
        total += vec4(float(i) / x, float(i) * x, TABLE[i] / x, TABLE[i] * x)
        product, quotient = product * x, quotient / x
    return total, vec4(product, quotient, 0.0, 1.0)
"""


def _at(a: Picture, dx: int, dy: int) -> Picture:
    """``image[dx, dy]`` under the rule "clamp"."""
    rows = np.clip(np.arange(a.shape[0]) + dy, 0, a.shape[0] - 1)
    columns = np.clip(np.arange(a.shape[1]) + dx, 0, a.shape[1] - 1)
    moved: Picture = a[rows][:, columns]
    return moved


def _table(a: Picture, x: NDArray[Any], y: NDArray[Any]) -> NDArray[Any]:
    table, steps = np.array([3, 1, 4, 1, 5, 9, 2]), np.array([(1, 0), (0, 1), (2, 3)])
    # An index out of range reads the nearest end.
    rest = [steps[y % 3], table[np.minimum(x, 6)][..., None], np.broadcast_to(table[0], (*x.shape, 1))]
    return np.asarray(a * table[x % 7][..., None] + np.concatenate(rest, axis=-1))


def cases() -> Iterator[Case]:
    """Yield each kernel with its expected result."""
    y, x = np.mgrid[0 : SIZE[1], 0 : SIZE[0]]
    for name, (text, expected) in KERNELS.items():
        result = np.asarray(expected(whole_numbers(SIZE, 9), x, y), np.float32)
        yield Case(
            GROUP, name, partial(graph_of, text), SIZE, ({"color": whole_numbers(SIZE, 9)},), exact={"result0": result}
        )
    yield from control_cases.cases()
    yield _parameters(x)
    yield from whole_number_cases.cases()
    yield from integer_chain_cases.cases()
    yield from _stores()
    yield Case(GROUP, "identities", partial(graph_of, IDENTITIES), (64, 8), (_specials(),))
    yield Case(GROUP, "combined", partial(graph_of, COMBINED), (64, 8), (_specials(),), most_ambiguous=0.1)
    yield Case(GROUP, "written zeros", partial(graph_of, ZEROS), (64, 8), (_specials(),), most_ambiguous=0.3)
    yield Case(GROUP, "unrolled zeros", partial(graph_of, UNROLLED_ZEROS), (64, 8), (_specials(),), most_ambiguous=0.3)
    for border in PADS:
        frames = ({"color": whole_numbers(WIDE, 9)},)
        exact = {"result0": _blur(whole_numbers(WIDE, 9), border)}
        yield Case(GROUP, f"a wide neighbourhood, {border}", partial(_wide, border), WIDE, frames, exact=exact)


def _parameters(x: NDArray[Any]) -> Case:
    few, many, steps = 10.0 + np.arange(5), 100.0 + np.arange(300), (7, -8, 9, -10, 11, -12)
    turn, by, pairs = np.arange(9.0).reshape(3, 3), np.array([1.0, 2.0, 4.0]), np.arange(6.0).reshape(3, 2)
    graph = partial(
        graph_of,
        PARAMETERS,
        one=5.0,
        few=few,
        flag=True,
        whole=41,
        turn=turn,
        many=many,
        steps=steps,
        by=by,
        pairs=pairs,
    )
    one = np.full(x.shape, 5.0)
    first = np.stack([one, few[x % 5], many[np.minimum(x * 13, 299)], np.array(steps)[x % 6]], -1) + whole_numbers(
        SIZE, 9
    )
    turned = np.broadcast_to(turn @ by, (*x.shape, 3))
    second = np.concatenate([turned, pairs[x % 3][..., 1:]], -1)
    third = np.broadcast_to([many[257], many[299], 41.0, few[3]], (*x.shape, 4))
    exact = {f"result{k}": np.asarray(v, np.float32) for k, v in enumerate((first, second, third))}
    return Case(GROUP, "parameters of every kind", graph, SIZE, ({"color": whole_numbers(SIZE, 9)},), exact=exact)


#: Numbers to round: halves of steps, range ends, numbers beyond them, and non-finite ones.
STORED = (
    0.0, 1.0, 0.5, 0.25, 0.1, 0.999, 2.0, 2049.0, 2051.0, 2.0**-14, 1.0 + 2.0**-11, 1.0 + 3 * 2.0**-11, 2.0**-25,
    3 * 2.0**-25, 5 * 2.0**-25, 2.0**-14 - 2.0**-25, 2.0**-26, 65504.0, 65519.0, 65520.0, 65536.0, 1e30, np.inf, np.nan,
)  # fmt: skip


def _stores() -> Iterator[Case]:
    """Test rounding in kernels that store; NaN becomes 0 in formats without NaN."""
    values = np.array([*STORED, *(-v for v in STORED)], np.float32)
    picture = np.broadcast_to(values[None, :, None], (3, len(values), 1)).copy()
    # Inputs must be finite, so the numbers are passed as their bits, in two halves.
    bits = picture.view(np.int32)
    frame = {"bits": np.concatenate([bits >> 16, bits & 0xFFFF], axis=-1).astype(np.float32)}
    with np.errstate(over="ignore"):
        known = {"r16f": picture.astype(np.float16).astype(np.float32)}
    for form, steps in (("r8", 255), ("r16", 65535)):
        inside = np.clip(np.nan_to_num(picture, nan=0.0, posinf=1.0), 0, 1)
        known[form] = (np.rint(inside * np.float32(steps)) / np.float32(steps)).astype(np.float32)
    for form, expected in known.items():
        graph = partial(_stored, form)
        yield Case(
            GROUP, f"stored in {form}", graph, (len(values), 3), (frame,), exact={"stored": expected, "read": expected}
        )


def _stored(form: str) -> Mapping[str, pg.Target]:
    text = "def run(bits: Image) -> float: return float_from_bits(int(bits[0, 0].r) * 65536 + int(bits[0, 0].g))"
    kernel, copy = pg.kernel(source=text), pg.kernel(source="def copy(a: Image) -> float: return a[0, 0].r")
    bits = pg.Input("bits")
    # A target that is only read at the same pixel is fused, and never stored.
    stored, between = (kernel(bits, into=pg.target(name, form), name=name) for name in ("stored", "between"))
    return {"stored": stored, "read": copy(between, into=pg.target("read", "r32f"))}


def _specials() -> Mapping[str, Picture]:
    values = np.array([0.0, -0.0, 1.0, -2.5, np.inf, -np.inf, np.nan, 3e38], np.float32)
    a = np.broadcast_to(np.tile(values, 8)[None, :, None], (8, 64, 4))
    b = np.broadcast_to(values[:, None, None], (8, 64, 4))
    return {"a": a.copy(), "b": b.copy()}


WIDE_TEXT = """
def run(color: Image) -> vec4:
    total = color[0, 0] * 3.0
    for i in range(-2, 3):
        total += color[i, 1] * float(i + 4) + color[1, i] * float(2 - i) + color[i, i - 1]
    return total
"""


#: Border rule → NumPy's padding mode.
PADS = {"clamp": "edge", "zero": "constant", "repeat": "wrap", "mirror": "symmetric", "reflect-101": "reflect"}


def _wide(border: str) -> Mapping[str, pg.Target]:
    kernel = pg.kernel(source=WIDE_TEXT)
    return {"result0": kernel(pg.Input("color").border(border), into=pg.target("result0", "rgba32f"))}


def _blur(a: Picture, border: str) -> Picture:
    """Compute WIDE_TEXT with the border as padding."""
    padded = np.pad(a, ((3, 3), (3, 3), (0, 0)), PADS[border])  # type: ignore[call-overload]

    def at(dx: int, dy: int) -> NDArray[Any]:
        moved: NDArray[Any] = padded[3 + dy : 3 + dy + a.shape[0], 3 + dx : 3 + dx + a.shape[1]]
        return moved

    total = a * 3.0
    for i in range(-2, 3):
        total = total + at(i, 1) * (i + 4) + at(1, i) * (2 - i) + at(i, i - 1)
    return np.asarray(total, np.float32)
