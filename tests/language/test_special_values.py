"""What operations make of zeros, infinities, NaN, the ends of int and bools."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from running import run

NAN, INF = float("nan"), float("inf")
SPECIAL: list[tuple[str, float, float, float]] = [
    # expression of x and y, x, y, what comes out
    ("min(x, y)", NAN, 1, NAN),
    ("min(x, y)", 1, NAN, 1),
    ("max(x, y)", NAN, 1, NAN),
    ("max(x, y)", 1, NAN, 1),
    ("x / y", 1, 0, INF),
    ("x / y", 0, 0, NAN),
    ("sqrt(x)", -1, 0, NAN),
    ("round(x)", 2.5, 0, 2),
    ("round(x)", -3.5, 0, -4),
    ("round(x)", 0.5, 0, 0),
    ("trunc(x)", -1.5, 0, -1),
    ("fract(x)", -1e-9, 0, np.nextafter(np.float32(1), np.float32(0))),
    ("mod(x, y)", -1, 3, 2),
    ("mod(x, y)", 1, -3, -2),
    ("sign(x)", NAN, 0, 0),
    ("sign(x)", -0.0, 0, 0),
    ("float(sign(int(x)))", -7, 0, -1),
    ("float(clamp(int(x), -3, 4))", -7, 0, -3),
    ("saturate(x)", INF, 0, 1),
    ("saturate(x)", -INF, 0, 0),
    ("float(int(x))", 2.7, 0, 2),
    ("float(int(x))", -2.7, 0, -2),
    ("float(int(x))", NAN, 0, 0),
    ("float(int(x))", 3e9, 0, 2.0**31),
    ("float(int(x))", -INF, 0, -(2.0**31)),
    ("float(int(x) // int(y))", -7, 2, -4),
    ("float(int(x) % int(y))", -7, 2, 1),
    ("float(int(x) % int(y))", 7, -2, -1),
    ("float(int(x) // int(y))", 7, 0, 0),
    ("float(int(x) % int(y))", 7, 0, 0),
    ("float(1 << int(x))", 33, 0, 2),
    ("float(-8 >> int(x))", 1, 0, -4),
    ("float(int(x) * int(y))", 65536, 65536, 0),
    ("float(abs(-2147483648 + int(x)))", 0, 0, -(2.0**31)),
    ("smoothstep(x, x, y)", 1, 2, 1),
    ("smoothstep(x, x, y)", 1, 0, 0),
    ("exp2(x)", 200, 0, INF),
    ("exp2(x)", -200, 0, 0),
    ("exp2(x)", NAN, 0, NAN),
    ("exp(x)", INF, 0, INF),
    ("exp(x)", -INF, 0, 0),
    ("log(x)", 0, 0, -INF),
    ("log2(x)", 0, 0, -INF),
    ("log(x)", -1, 0, NAN),
    ("log(x)", INF, 0, INF),
    ("log2(x)", 1, 0, 0),
    ("log2(x)", 2.0**-149, 0, -149),
    ("pow(x, y)", 0, 0, 1),
    ("pow(x, y)", 0, 2, 0),
    ("pow(x, y)", 0, -1, INF),
    ("pow(x, y)", 1, INF, 1),
    ("pow(x, y)", 2, -INF, 0),
    ("pow(x, y)", 4, 3e38, INF),
    ("pow(x, y)", -8, 2, 64),
    ("pow(x, y)", -8, 0.5, NAN),
    ("pow(x, y)", INF, -1, 0),
    ("pow(x, y)", NAN, 0, 1),
    ("pow(x, y)", 2, NAN, NAN),
    ("x**2", -3, 0, 9),
    ("x**-1", 4, 0, 0.25),
    ("x**0", NAN, 0, 1),
    ("sin(x)", INF, 0, NAN),
    ("cos(x)", NAN, 0, NAN),
    ("tan(x)", 0, 0, 0),
    ("atan(x)", INF, 0, np.pi / 2),
    ("atan(x, y)", 0, 0, 0),
    ("atan(x, y)", 0, -1, np.pi),
    ("atan(x, y)", -0.0, -1, np.pi),
    ("atan(x, y)", INF, -INF, 0.75 * np.pi),
    ("atan(x, y)", NAN, 1, NAN),
    ("asin(x)", 2, 0, NAN),
    ("acos(x)", 1, 0, 0),
    ("acos(x)", -1, 0, np.pi),
    ("tanh(x)", INF, 0, 1),
    ("cosh(x)", -INF, 0, INF),
    ("sinh(x)", -INF, 0, -INF),
    ("length(normalize(vec2(x, y)))", 0, 0, 0),
    ("1.0 if isnan(x) else 0.0", NAN, 0, 1),
    ("1.0 if isinf(x) else 0.0", -INF, 0, 1),
    ("1.0 if x == x else 0.0", NAN, 0, 0),
    ("determinant(inverse(mat2(x, y, x, y)))", 1, 2, NAN),
    ("float(bits_from_float(x))", 1, 0, 0x3F800000),
    ("float_from_bits(int(x))", 0, 0, 0),
    ("float(~int(x))", 5, 0, -6),
    ("float(int(x) & 12 | 3 ^ int(y))", 10, 1, 10),
]


@pytest.mark.parametrize(("expression", "x", "y", "want"), SPECIAL)
def test_special_values(expression: str, x: float, y: float, want: float) -> None:
    for simplify in (True, False):
        got = run(expression, np.float32([x]), np.float32([y]), simplify=simplify)
        np.testing.assert_allclose(got, [np.float32(want)], rtol=1e-6)
    # Folded from literals it is the same.
    literal = {INF: "3e38 * 9.0", -INF: "3e38 * -9.0"}
    given = [literal.get(v, repr(float(v))) if v == v else "0.0 / 0.0" for v in (x, y)]
    text = expression.replace("exp", "EXP").replace("max", "MAX").replace("mix", "MIX")
    text = text.replace("x", f"({given[0]})").replace("y", f"({given[1]})")
    text = text.replace("EXP", "exp").replace("MAX", "max").replace("MIX", "mix")
    np.testing.assert_allclose(run(text, np.float32([0])), [np.float32(want)], rtol=1e-6)


def test_clamp_is_min_of_max_with_bounds_reversed_too() -> None:
    np.testing.assert_array_equal(run("clamp(x, y, z)", *np.float32([[5, 5], [9, 3], [1, 4]])), [1, 4])


def test_ints_wrap_at_32_bits() -> None:
    """Sums, differences and products of every pair of hard ints, compared with Python's integers."""
    hard = [0, 1, -1, 2, 3, 7, 31, 32, 65535, 65536, 2**30, 2**31 - 1, -(2**31), -(2**31) + 1, 123456789]
    a, b = (np.array(v, np.int32).view(np.float32) for v in zip(*[(p, q) for p in hard for q in hard], strict=True))

    def wrap(v: int) -> int:
        return (v + 2**31) % 2**32 - 2**31

    meanings: dict[str, Callable[[int, int], int]] = {
        "+": lambda p, q: p + q,
        "-": lambda p, q: p - q,
        "*": lambda p, q: p * q,
        "&": lambda p, q: p & q,
        "|": lambda p, q: p | q,
        "^": lambda p, q: p ^ q,
        "//": lambda p, q: p // q if q else 0,
        "%": lambda p, q: p % q if q else 0,
        "<<": lambda p, q: p << (q & 31),
        ">>": lambda p, q: p >> (q & 31),
    }
    for sign, meaning in meanings.items():
        text = f"float_from_bits(bits_from_float(x) {sign} bits_from_float(y))"
        got = run(text, a, b).view(np.int32)
        want = [wrap(meaning(p, q)) for p in hard for q in hard]
        np.testing.assert_array_equal(got, want, err_msg=sign)


@pytest.mark.parametrize("sign", ["<", "<=", ">", ">=", "==", "!="])
def test_comparisons_are_false_with_nan_but_not_equal(sign: str) -> None:
    values = np.float32([-1, -0.0, 0, 1, np.inf, -np.inf, np.nan])
    a, b = (v.ravel() for v in np.meshgrid(values, values))
    want = eval(f"a {sign} b")
    np.testing.assert_array_equal(run(f"1.0 if x {sign} y else 0.0", a, b), want)
    np.testing.assert_array_equal(run(f"0.0 if not (x {sign} y) else 1.0", a, b), want)


def test_logic_and_vectors_of_bools() -> None:
    a, b = np.float32([0, 0, 1, 1]), np.float32([0, 1, 0, 1])
    for text, want in {
        "x > 0.0 and y > 0.0": [0, 0, 0, 1],
        "x > 0.0 or y > 0.0": [0, 1, 1, 1],
        "not x > 0.0": [1, 1, 0, 0],
        "any(greater(vec2(x, y), vec2(0.5)))": [0, 1, 1, 1],
        "all(greater(vec2(x, y), vec2(0.5)))": [0, 0, 0, 1],
        "(x > 0.5) == (y > 0.5)": [1, 0, 0, 1],
        "bool(x) != bool(y)": [0, 1, 1, 0],
        "-0.5 < x < y": [0, 1, 0, 0],
    }.items():
        np.testing.assert_array_equal(run(f"1.0 if {text} else 0.0", a, b), want, err_msg=text)
    np.testing.assert_array_equal(
        run("select(less(vec2(x, y), vec2(0.5)), vec2(7, 8), vec2(x, y))", a, b, result="vec2"),
        np.stack([np.where(a < 0.5, 7, a), np.where(b < 0.5, 8, b)], -1),
    )
