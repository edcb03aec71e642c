"""The interpreter against Python itself and against the documented meaning of every operation."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

import passgraph as pg
from passgraph.backends.reference.interpreter import KINDS, NumberDomain
from passgraph.language.operations import OPERATIONS

NUMBERS = [row.name for row in OPERATIONS.values() if row.kind != "expanded"]


def lane(value: object, letter: str = "") -> np.ndarray:
    """One value as the reference holds it; the letter of a signature tells uints from ints."""
    kind = "bool" if isinstance(value, bool) else "int" if isinstance(value, int) else "float"
    return np.asarray([value], KINDS["uint" if letter in ("U", "u") and kind == "int" else kind])


@pytest.mark.parametrize("name", NUMBERS)
def test_an_operation_means_what_its_row_says(name: str) -> None:
    row = OPERATIONS[name]
    for *arguments, expected in row.examples:
        with np.errstate(all="ignore"):
            result = NumberDomain().apply(name, [lane(*pair) for pair in zip(arguments, row.operands, strict=True)])
            meant = lane(expected, row.result)
            assert result.dtype == meant.dtype, arguments
            # Float64 goes on where float32 ends.
            result = result.astype(np.float32) if np.isinf(expected) else result
        np.testing.assert_allclose(result, meant, rtol=1e-15, atol=1e-15, err_msg=f"{name}{arguments}")


@pytest.mark.parametrize("name", sorted(set(OPERATIONS) - set(NUMBERS)))
def test_a_vector_operation_means_what_its_row_says(name: str) -> None:
    for *arguments, expected in OPERATIONS[name].examples:
        kind = np.bool_ if OPERATIONS[name].operands == ("B",) else np.float64
        result = NumberDomain().apply(name, [np.asarray([a], kind) for a in arguments])
        np.testing.assert_allclose(result, np.asarray([expected], np.float64), rtol=1e-15, err_msg=f"{name}{arguments}")


def test_any_and_all_look_at_every_component() -> None:
    flags = np.array([[True, False], [True, True], [False, False]])
    assert NumberDomain().apply("any", [flags]).tolist() == [True, True, False]
    assert NumberDomain().apply("all", [flags]).tolist() == [False, True, False]


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


def test_a_constant_specializes_a_loop() -> None:
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
