"""The interpreter against Python itself and against the documented meaning of every operation."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest

import passgraph as pg
from passgraph.backends.reference.number_domain import KINDS, NumberDomain
from passgraph.language.operations import BELOW_ONE, INT_MAX, INT_MIN, OPERATIONS

INF, NAN = math.inf, math.nan

#: Operation → rows of (arguments…, result), in scalars; what its documentation says about the hard values.
SPECIAL: dict[str, list[tuple[object, ...]]] = {
    "add": [(1.5, 2.0, 3.5), (INT_MAX, 1, INT_MIN), (INF, -INF, NAN)],
    "sub": [(1.5, 2.0, -0.5), (INT_MIN, 1, INT_MAX)],
    "mul": [(1.5, 2.0, 3.0), (65536, 65536, 0), (0.0, INF, NAN)],
    "div": [(1.0, 4.0, 0.25), (1.0, 0.0, INF), (-1.0, 0.0, -INF), (0.0, 0.0, NAN)],
    "neg": [(1.5, -1.5), (INT_MIN, INT_MIN)],
    "floor_divide": [(7, -2, -4), (-7, 2, -4), (5, 0, 0), (INT_MIN, -1, INT_MIN)],
    "int_mod": [(7, -2, -1), (-7, 2, 1), (5, 0, 0), (INT_MIN, -1, 0)],
    "min": [(2.0, 1.0, 1.0), (1.0, NAN, 1.0), (NAN, 1.0, NAN), (-3, 2, -3)],
    "max": [(2.0, 1.0, 2.0), (1.0, NAN, 1.0), (NAN, 1.0, NAN), (-3, 2, 2)],
    "abs": [(-2.5, 2.5), (INT_MIN, INT_MIN), (-INF, INF)],
    "floor": [(-0.5, -1.0), (2.0, 2.0), (INF, INF)],
    "ceil": [(-0.5, 0.0), (2.1, 3.0)],
    "trunc": [(-1.9, -1.0), (1.9, 1.0)],
    "round": [(0.5, 0.0), (1.5, 2.0), (2.5, 2.0), (-0.5, 0.0)],
    "sqrt": [(9.0, 3.0), (0.0, 0.0), (INF, INF)],
    "less": [(1.0, 2.0, True), (NAN, 1.0, False), (2, 2, False)],
    "less_equal": [(1.0, 1.0, True), (NAN, NAN, False), (3, 2, False)],
    "greater": [(2.0, 1.0, True), (1.0, NAN, False), (2, 2, False)],
    "greater_equal": [(1.0, 1.0, True), (NAN, NAN, False), (2, 3, False)],
    "equal": [(0.0, -0.0, True), (NAN, NAN, False), (2, 2, True)],
    "not_equal": [(0.0, -0.0, False), (NAN, NAN, True), (2, 2, False)],
    "logical_and": [(True, False, False), (True, True, True)],
    "logical_or": [(True, False, True), (False, False, False)],
    "logical_not": [(True, False), (False, True)],
    "isnan": [(NAN, True), (INF, False), (1.0, False)],
    "isinf": [(-INF, True), (NAN, False), (1.0, False)],
    "bit_and": [(12, 10, 8), (-1, 7, 7)],
    "bit_or": [(12, 10, 14)],
    "bit_xor": [(12, 10, 6), (-1, 0, -1)],
    "bit_not": [(0, -1), (INT_MAX, INT_MIN)],
    "shift_left": [(1, 31, INT_MIN), (1, 33, 2), (3, 31, INT_MIN)],
    "shift_right": [(INT_MIN, 31, -1), (8, 35, 1)],
    "bits_from_float": [(1.0, 0x3F800000), (-0.0, INT_MIN), (INF, 0x7F800000)],
    "float_from_bits": [(0x3F800000, 1.0), (0x7F800000, INF), (INT_MIN, -0.0)],
    "to_float": [(3, 3.0), (True, 1.0), (INT_MIN, -2147483648.0)],
    "to_int": [(-1.9, -1), (1e20, INT_MAX), (-1e20, INT_MIN), (NAN, 0), (INF, INT_MAX), (True, 1)],
    "sign": [(-3.0, -1.0), (0.0, 0.0), (NAN, 0.0), (5, 1)],
    "clamp": [(5.0, 0.0, 1.0, 1.0), (-5, 0, 3, 0), (0.5, 2.0, 1.0, 1.0)],
    "saturate": [(2.0, 1.0), (-INF, 0.0), (INF, 1.0), (0.25, 0.25)],
    "fract": [(1.25, 0.25), (-0.25, 0.75), (-1e-30, BELOW_ONE)],
    "mod": [(-1.0, 3.0, 2.0), (1.0, -3.0, -2.0), (5.5, 2.0, 1.5)],
    "inversesqrt": [(4.0, 0.5), (0.0, INF)],
    "step": [(1.0, 1.0, 1.0), (1.0, 0.5, 0.0)],
    "smoothstep": [(0.0, 1.0, 0.5, 0.5), (0.0, 1.0, 2.0, 1.0), (1.0, 1.0, 1.0, 1.0), (1.0, 1.0, 0.0, 0.0)],
    "mix": [(1.0, 3.0, 0.5, 2.0), (1.0, 3.0, 1.0, 3.0)],
    "exp2": [(3.0, 8.0), (-INF, 0.0)],
    "exp": [(0.0, 1.0), (1.0, math.e)],
    "log2": [(8.0, 3.0), (0.0, -INF)],
    "log": [(math.e, 1.0), (0.0, -INF)],
    "pow": [(2.0, 0.5, math.sqrt(2)), (0.0, 0.0, 1.0), (0.0, 2.0, 0.0), (NAN, 0.0, 1.0)],
    "sin": [(math.pi / 6, 0.5), (0.0, 0.0)],
    "cos": [(math.pi / 3, 0.5), (0.0, 1.0)],
    "tan": [(math.pi / 4, 1.0)],
    "asin": [(0.5, math.pi / 6), (1.0, math.pi / 2)],
    "acos": [(0.5, math.pi / 3), (-1.0, math.pi)],
    "atan": [(1.0, math.pi / 4), (-INF, -math.pi / 2)],
    "atan2": [(1.0, -1.0, 3 * math.pi / 4), (0.0, 0.0, 0.0), (-1.0, 0.0, -math.pi / 2), (-0.0, -0.0, 0.0)],
    "sinh": [(1.0, math.sinh(1))],
    "cosh": [(1.0, math.cosh(1))],
    "tanh": [(1.0, math.tanh(1)), (INF, 1.0)],
    "radians": [(180.0, math.pi)],
    "degrees": [(math.pi, 180.0)],
    "float_floor_divide": [(-7.0, 2.0, -4.0), (7.5, 2.0, 3.0)],
}  # fmt: skip


def lane(value: object) -> np.ndarray:
    kind = "bool" if isinstance(value, bool) else "int" if isinstance(value, int) else "float"
    return np.asarray([value], KINDS[kind])


@pytest.mark.parametrize("name", SPECIAL)
def test_an_operation_means_what_its_row_says(name: str) -> None:
    for *arguments, expected in SPECIAL[name]:
        with np.errstate(all="ignore"):
            result = NumberDomain().apply(name, [lane(a) for a in arguments])
        assert result.dtype == lane(expected).dtype, arguments
        np.testing.assert_allclose(result, lane(expected), rtol=1e-15, atol=1e-15, err_msg=f"{name}{arguments}")


VECTORS: list[tuple[str, list[object], object]] = [
    ("dot", [(1, 2, 3), (4, 5, 6)], 32),
    ("cross", [(1, 0, 0), (0, 1, 0)], (0, 0, 1)),
    ("length", [(3, 4)], 5),
    ("distance", [(1, 1), (4, 5)], 5),
    ("normalize", [(0, 3, 4)], (0, 0.6, 0.8)),
    ("normalize", [(0, 0, 0)], (0, 0, 0)),
    ("faceforward", [(0, 1), (0, -1), (0, 1)], (0, 1)),
    ("faceforward", [(0, 1), (0, 1), (0, 1)], (0, -1)),
    ("reflect", [(1, -1), (0, 1)], (1, 1)),
    ("refract", [(0, -1), (0, 1), 0.5], (0, -1)),
    ("refract", [(1, 0), (0, 1), 2.0], (0, 0)),
    ("transpose", [((1, 2), (3, 4))], ((1, 3), (2, 4))),
    ("determinant", [((1, 2), (3, 4))], -2),
    ("inverse", [((2, 0), (0, 4))], ((0.5, 0), (0, 0.25))),
    ("inverse", [((1, 2), (2, 4))], ((NAN, NAN), (NAN, NAN))),
    ("outer", [(1, 2), (3, 4)], ((3, 6), (4, 8))),
    ("matmul", [((1, 2), (3, 4)), (5, 6)], (23, 34)),  # columns (1, 2) and (3, 4)
    ("matmul", [(5, 6), ((1, 2), (3, 4))], (17, 39)),
    ("matmul", [((1, 2), (3, 4)), ((0, 1), (1, 0))], ((3, 4), (1, 2))),
]


@pytest.mark.parametrize(("name", "arguments", "expected"), VECTORS)
def test_a_vector_operation_means_what_its_row_says(name: str, arguments: list[object], expected: object) -> None:
    lanes = [np.asarray([a], np.float64) for a in arguments]
    result = NumberDomain().apply(name, lanes)
    np.testing.assert_allclose(result, np.asarray([expected], np.float64), rtol=1e-15)


def test_any_and_all_look_at_every_component() -> None:
    flags = np.array([[True, False], [True, True], [False, False]])
    assert NumberDomain().apply("any", [flags]).tolist() == [True, True, False]
    assert NumberDomain().apply("all", [flags]).tolist() == [False, True, False]


def test_every_row_of_the_table_is_here() -> None:
    assert {*SPECIAL, *(name for name, *_ in VECTORS), "any", "all"} == set(OPERATIONS)


#: Functions that are Python and kernel language at once; ints, so that both must agree exactly.
WALKS = {
    "break and continue": """
def walk(x: int, y: int) -> int:
    total = 0
    for i in range(12):
        if i * x > 17:
            break
        if (i + y) % 3 == 0:
            continue
        total += i * i
    return total
""",
    "return from a loop in a loop": """
def walk(x: int, y: int) -> int:
    found = -1
    for i in range(6):
        for j in range(5, -1, -1):
            if i * 2 + j == x + y:
                return i * 10 + j
            if j < i:
                break
            found = found + j - i
        if found > 9 + y:
            continue
        found += 1
    return found
""",
    "returns in branches": """
def walk(x: int, y: int) -> int:
    if x < 2:
        if y > 3:
            return 100 + y
        x = x + 7
    elif x == 4:
        return -y
    else:
        y -= x
    z = 1
    if y < 0:
        z = 2 if x > 5 else 3
    return x * 10 + y + z
""",
    "bounds that depend on the loop around": """
def walk(x: int, y: int) -> int:
    total = 0
    for i in range(4):
        for j in range(i, 6, 2):
            if x > j:
                continue
            total += i * j + y
    return total
""",
    "whole division and remainders of negatives": """
def walk(x: int, y: int) -> int:
    a = (x - 4) * 7
    b = y - 2
    q = 0
    if b != 0:
        q = a // b * 100 + a % b
    return q + (a << 2) + (a >> 1) + (a ^ b)
""",
}


@pytest.mark.parametrize("title", WALKS)
def test_control_flow_is_that_of_python(title: str) -> None:
    names: dict[str, Callable[[int, int], int]] = {}
    exec(WALKS[title], names)  # type: ignore[arg-type]
    text = WALKS[title] + "\ndef field() -> float: return float(walk(pixel().x, pixel().y))\n"
    out = pg.kernel(source=text, name="field")(into=pg.target("out", "r32f", (9, 7)))
    with pg.compile(out, backend="reference", size=(9, 7)) as program:
        got = program()["out"][..., 0]
    expected = [[names["walk"](x, y) for x in range(9)] for y in range(7)]
    np.testing.assert_array_equal(got, expected)


def test_an_index_is_clamped_and_an_insert_outside_changes_nothing() -> None:
    text = """
def field() -> vec4:
    i = pixel().x - 2
    values = [1.0, 2.0, 3.0]
    read = values[i]
    values[i] = 9.0
    v = vec2(5.0, 6.0)
    v[i] = 0.0
    return vec4(read, values[0] + values[1] + values[2], v)
"""
    out = pg.kernel(source=text)(into=pg.target("out", "rgba32f", (7, 1)))
    with pg.compile(out, backend="reference", size=(7, 1)) as program:
        got = program()["out"][0]
    for x in range(7):
        i = x - 2
        values, v = [1.0, 2.0, 3.0], [5.0, 6.0]
        read = values[min(max(i, 0), 2)]
        if 0 <= i < 3:
            values[i] = 9.0
        if 0 <= i < 2:
            v[i] = 0.0
        assert got[x].tolist() == [read, sum(values), *v]


def test_a_constant_specialises_a_loop() -> None:
    text = (
        "def ramp(n: Const[int] = 3) -> float:\n    t = 0.0\n    for i in range(n):\n        t += 1.5\n    return t\n"
    )
    kernel = pg.kernel(source=text)
    outs = [kernel(into=pg.target("default", "r32f")), kernel(n=5, into=pg.target("five", "r32f"))]
    with pg.compile(outs, backend="reference", size=(2, 1)) as program:
        result = program()
    assert (result["default"][0, 0, 0], result["five"][0, 0, 0]) == (4.5, 7.5)


def test_a_pass_larger_than_one_batch_has_no_seams() -> None:
    width, height = 517, 301  # more pixels than are computed at once, and no multiple of anything
    out = pg.kernel(source="def where() -> vec2: return vec2(pixel())")(into=pg.target("out", "rg32f"))
    with pg.compile(out, backend="reference", size=(width, height)) as program:
        got = program()["out"]
    expected = np.stack(np.meshgrid(np.arange(width), np.arange(height)), axis=-1)
    np.testing.assert_array_equal(got, expected)


def test_missing_channels_read_as_zero_zero_one() -> None:
    kernel = pg.kernel(source="def read(c: Image) -> vec4: return c.texel(ivec2(-1, 0))")
    for channels in (1, 2, 3, 4):
        out = kernel(pg.Input("frame", border="zero"), into=pg.target("out", "rgba32f", (1, 1)))
        with pg.compile(out, backend="reference", size=(1, 1)) as program:
            got = program(frame=np.ones((1, 1, channels), np.float32))["out"][0, 0]
        assert got.tolist() == [0, 0, 0, 1 if channels < 4 else 0]


def test_nan_in_a_unorm_target_is_zero() -> None:
    text = "def bad(zero: float) -> vec4: return vec4(zero / zero, 2.0, -1.0, 0.5)"
    out = pg.kernel(source=text)(zero=0.0, into=pg.target("out", "rgba8"))
    with pg.compile(out, backend="reference", size=(1, 1)) as program:
        got = program()["out"][0, 0]
    np.testing.assert_array_equal(got, np.float32([0, 1, 0, 128 / 255]))
