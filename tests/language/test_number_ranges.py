"""Operations over all of float32, against float64, ``fmod`` and exact fractions (not against the table's reference)."""

from __future__ import annotations

import math
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from running import lowered, run, run_program

import passgraph as pg
from passgraph.backends.registry import open_backend
from passgraph.errors import GraphError
from tests.conftest import require

Numbers = NDArray[np.float32]
DEVICES = ("reference", "numpy", "gl", "opencl", "webgpu")
LARGEST = float(np.finfo(np.float32).max)


def spread(count: int, low: float, high: float, seed: int) -> Numbers:
    """Either sign, exponents of two from low to high."""
    random = np.random.default_rng(seed)
    sizes = np.ldexp(random.uniform(1, 2, count), random.integers(int(low), int(high), count))
    return np.float32(random.choice([-1, 1], count) * sizes)


def computed(backend: str, expression: str, *columns: Numbers) -> NDArray[np.float32]:
    """(values, 4): an expression that gives a vec4, of the channels x y z w of a picture."""
    if backend != "reference":
        require(backend)
    picture = np.zeros((64, -(-len(columns[0]) // 64), 4), np.float32)
    for channel, column in enumerate(columns):
        picture[..., channel].flat[: len(column)] = column
    text = f"def k(c: Image) -> vec4:\n    p = c[0, 0]\n    x, y, z, w = p.x, p.y, p.z, p.w\n    return {expression}\n"
    target = pg.kernel(source=text)(pg.Input("c"), into=pg.target("o", "rgba32f"))
    with open_backend(backend) as device, pg.compile(target, backend=device, non_finite="keep") as program:
        result = program(c=picture)["o"]
    return result.reshape(-1, 4)[: len(columns[0])]


def ulps(got: NDArray[Any], want: NDArray[Any]) -> NDArray[np.float64]:
    """Distance in units of float32 at what is right; what is not normal may be 0."""
    with np.errstate(all="ignore"):
        unit = np.spacing(np.maximum(np.abs(want), 2.0**-126).astype(np.float32)).astype(np.float64)
        away = np.abs(got.astype(np.float64) - want) / unit
        both = (np.abs(got) < 2.0**-126) & (np.abs(want) < 2.0**-126)
        infinite = (np.abs(want) > LARGEST) & (np.abs(got) >= LARGEST) & (np.sign(got) == np.sign(want))
    return np.where(both | infinite, 0.0, away)


# Lengths


@pytest.mark.parametrize("backend", DEVICES)
@pytest.mark.parametrize("size", [2, 3, 4])
def test_length_and_normalize_take_every_number(backend: str, size: int) -> None:
    columns = [spread(4096, -126, 127, seed) for seed in range(4)]
    # Components of one size too, and the largest and smallest of all.
    scale = np.ldexp(1.0, np.random.default_rng(9).integers(-120, 120, 2048))
    for column in columns:
        column[:2048] = np.float32(
            np.float64(column[:2048] / np.exp2(np.floor(np.log2(np.abs(column[:2048]))))) * scale
        )
    for k, corner in enumerate((2e19, 3.4e38, 1e-19, 1e-30, 2.0**-126, 1.0)):
        for column in columns:
            column[k] = corner
    vector = f"vec{size}({', '.join('xyzw'[:size])})"
    wide = np.stack([c.astype(np.float64) for c in columns[:size]], -1)
    length = np.sqrt((wide * wide).sum(-1))
    got = computed(backend, f"vec4(length({vector}), distance({vector}, vec{size}(0.0)), 0.0, 0.0)", *columns)
    assert ulps(got[:, 0], length).max() <= 5
    assert ulps(got[:, 1], length).max() <= 6
    padded = f"vec4(normalize({vector}){', 0.0' * (4 - size)})"
    units = computed(backend, padded, *columns)[:, :size]
    assert ulps(units, wide / length[:, None]).max() <= 8


def test_a_vector_of_zeros_is_zero_and_infinite_ones_are_infinite_or_nan() -> None:
    inf, nan = math.inf, math.nan
    x, y = np.float32([0, inf, inf, nan, -inf, 1]), np.float32([0, 1, 0, 1, inf, nan])
    np.testing.assert_array_equal(run("length(vec2(x, y))", x, y), np.float32([0, inf, inf, nan, inf, nan]))
    unit = run("normalize(vec2(x, y))", x, y, result="vec2")
    np.testing.assert_array_equal(unit, np.float32([[0, 0], [nan, 0], [nan, 0], [nan, nan], [nan, nan], [nan, nan]]))


def test_ordinary_vectors_give_the_same_bits_as_without_the_power_of_two() -> None:
    columns = [spread(20000, -30, 30, seed) for seed in range(4)]
    x, y, z, _ = columns
    plain = np.sqrt((x * x + y * y) + z * z)
    np.testing.assert_array_equal(run("length(vec3(x, y, z))", *columns), plain)
    np.testing.assert_array_equal(run("normalize(vec3(x, y, z)).y", *columns), y / plain)


# Inverses


@pytest.mark.parametrize("backend", DEVICES)
@pytest.mark.parametrize("size", [2, 3, 4])
def test_inverse_takes_columns_of_any_size(backend: str, size: int) -> None:
    """Two columns of a scale each; the rest of the matrix is well-conditioned and known."""
    random = np.random.default_rng(4)
    count = 512
    base = np.eye(size) * 2 + np.linspace(-0.4, 0.5, size * size).reshape(size, size)  # [row, column]
    scales = np.ldexp(1.0, random.integers(-60, 60, (count, 2)))
    scales[:4] = [[2.0**-100, 2.0**-100], [2.0**100, 2.0**100], [2.0**100, 2.0**-100], [1.0, 1.0]]
    x, y = (np.float32(scales[:, k]) for k in (0, 1))
    columns = ", ".join(
        f"vec{size}({', '.join(repr(float(np.float32(base[row, column]))) for row in range(size))})"
        f" * {'xy'[column % 2]}"
        for column in range(size)
    )
    single = base.astype(np.float32).astype(np.float64)
    plain = np.linalg.inv(single)  # [row, column]; row j of the inverse is divided by the scale of column j
    for row in (0, 1):
        padded = "".join(", 0.0" for _ in range(4 - size))
        cells = ", ".join(f"m[{column}][{row}]" for column in range(size))
        got = (
            computed(backend, f"vec4({cells}{padded})", x, y) if False else _row(backend, columns, cells + padded, x, y)
        )
        want = plain[row][None, :] / scales[:, row, None]
        assert (np.abs(got[:, :size] - want) <= 64 * 2.0**-23 * np.abs(plain).max() / scales[:, row, None]).all()


def _row(backend: str, columns: str, cells: str, x: Numbers, y: Numbers) -> NDArray[np.float32]:
    size = columns.count("vec")
    if backend != "reference":
        require(backend)
    picture = np.zeros((1, len(x), 4), np.float32)
    picture[0, :, 0], picture[0, :, 1] = x, y
    body = f"    x, y = c[0, 0].x, c[0, 0].y\n    m = inverse(mat{size}({columns}))\n    return vec4({cells})\n"
    target = pg.kernel(source=f"def k(c: Image) -> vec4:\n{body}")(pg.Input("c"), into=pg.target("o", "rgba32f"))
    with open_backend(backend) as device, pg.compile(target, backend=device) as program:
        return program(c=picture)["o"][0]


# Angles


@pytest.mark.parametrize("backend", DEVICES)
def test_sines_of_huge_angles_are_sines_of_some_angle(backend: str) -> None:
    x = np.concatenate([spread(4000, 13, 128, 3), np.float32([1e20, -1e20, LARGEST, -LARGEST, 8192.5, 1e5])])
    got = computed(backend, "vec4(sin(x), cos(x), tan(x), 0.0)", x)
    assert np.isfinite(got[:, :2]).all()
    assert np.abs(got[:, :2]).max() <= 1 + 2.0**-22
    assert not np.isnan(got).any()
    infinite = computed(backend, "vec4(sin(x), cos(x), tan(x), 0.0)", np.float32([math.inf, -math.inf, math.nan]))
    assert np.isnan(infinite[:, :3]).all()


@pytest.mark.parametrize("backend", ["numpy", "gl", "opencl", "webgpu"])
def test_sines_keep_their_bound_up_to_the_end_of_their_domain(backend: str) -> None:
    x = np.float32(np.random.default_rng(2).uniform(-8192, 8192, 8192))
    got = computed(backend, "vec4(sin(x), cos(x), 0.0, 0.0)", x)
    for column, exact in zip(got.T, (np.sin(x.astype(np.float64)), np.cos(x.astype(np.float64)))):  # noqa: B905
        assert (np.abs(column - exact) <= 4 * np.spacing(np.abs(exact).astype(np.float32)) + 2.0**-22).all()


def test_check_finite_lets_huge_angles_pass_and_names_an_overflow() -> None:
    picture = np.full((2, 2, 4), 1e20, np.float32)
    for text, fine in (("sin(c[0, 0]) + normalize(c[0, 0])", True), ("c[0, 0] * c[0, 0]", False)):
        made = pg.kernel(source=f"def k(c: Image) -> vec4: return {text}")(
            pg.Input("c"), into=pg.target("o", "rgba32f")
        )
        with pg.compile(made, check_finite=True) as program:
            if fine:
                program(c=picture)
            else:
                with pytest.raises(GraphError, match="makes values that are not finite"):
                    program(c=picture)


# Rests of divisions


def exact_rest(x: float, y: float) -> Fraction:
    a, b = Fraction(x), Fraction(y)
    return a - b * (a // b)


def pairs(count: int, seed: int) -> tuple[Numbers, Numbers]:
    """Quotients below 2^20, a third of them whole or beside a whole number; divisors from 2^-60 to 2^60."""
    random = np.random.default_rng(seed)
    y = spread(count, -60, 60, seed)
    with np.errstate(over="ignore"):
        x = np.float32(np.float64(spread(count, -30, 19, seed + 1)) * y)
        third = count // 3
        x[:third] = np.float32(random.integers(-1000, 1000, third)) * y[:third]
        x[: third // 2] = np.nextafter(x[: third // 2], np.float32(random.choice([-np.inf, np.inf], third // 2)))
    return x, y


def in_order(x: Numbers, y: Numbers, got: Numbers) -> None:
    """The sign of y, and below it."""
    bad = np.flatnonzero(~((np.abs(got) < np.abs(y)) & ((got == 0) | (np.sign(got) == np.sign(y)))))
    assert len(bad) == 0, [(x[i], y[i], got[i]) for i in bad[:5]]


def test_mod_is_the_exact_rest() -> None:
    """A million pairs against ``math.fmod``, which is exact; a thousand of them against fractions."""
    x, y = pairs(1_000_000, 5)
    got = run("mod(x, y)", x, y)
    in_order(x, y, got)
    wide_x, wide_y = x.astype(np.float64), y.astype(np.float64)
    rest = np.fmod(wide_x, wide_y)
    exact = np.where((rest != 0) & ((rest < 0) != (wide_y < 0)), rest + wide_y, rest)
    same = (rest == 0) | ((rest < 0) == (wide_y < 0))
    np.testing.assert_array_equal(got[same], exact[same])
    assert (np.abs(got - exact) <= np.spacing(np.abs(exact).astype(np.float32))).all()
    for a, b, r in list(zip(x.tolist(), y.tolist(), got.tolist(), strict=True))[:1000]:
        assert abs(Fraction(r) - exact_rest(a, b)) <= Fraction(float(np.spacing(np.float32(abs(r) or 1e-30))))


@pytest.mark.parametrize("backend", ["numpy", "gl", "opencl", "webgpu"])
def test_mod_is_the_exact_rest_on_devices(backend: str) -> None:
    x, y = pairs(16384, 8)
    keep = np.abs(x) > 2.0**-80
    x, y = x[keep], y[keep]
    got = computed(backend, "vec4(mod(x, y), x % y, 0.0, 0.0)", x, y)
    np.testing.assert_array_equal(got[:, 0], got[:, 1])
    in_order(x, y, got[:, 0])
    np.testing.assert_array_equal(got[:, 0], run("mod(x, y)", x, y))


@pytest.mark.parametrize("backend", DEVICES)
def test_mod_of_any_pair_has_the_sign_of_the_divisor_and_is_smaller(backend: str) -> None:
    x, y = spread(16384, -99, 99, 1), spread(16384, -26, 26, 2)
    in_order(x, y, computed(backend, "vec4(mod(x, y))", x, y)[:, 0])


@pytest.mark.parametrize(
    ("x", "y", "want"),
    [
        (-1e-10, 1.0, np.nextafter(np.float32(1), np.float32(0))), (1e-10, -1.0, -np.nextafter(np.float32(1), 0)),
        (-0.0, 3.0, 0.0), (6.0, 3.0, 0.0), (-6.0, 3.0, 0.0), (5.0, -3.0, -1.0), (-5.0, 3.0, 1.0), (1.0, 0.0, math.nan),
        (math.inf, 2.0, math.nan), (1.0, math.inf, math.nan), (math.nan, 1.0, math.nan), (0.0, 0.0, math.nan),
        (1.0, np.float32(0.1), np.fmod(np.float64(1), np.float64(np.float32(0.1)))),
    ],
)  # fmt: skip
def test_special_rests(x: float, y: float, want: float) -> None:
    for simplify in (True, False):
        got = run("mod(x, y)", np.float32([x]), np.float32([y]), simplify=simplify)
        np.testing.assert_allclose(got, [np.float32(want)], rtol=1e-7)


# Steps


@pytest.mark.parametrize("backend", DEVICES)
def test_smoothstep_takes_all_finite_edges(backend: str) -> None:
    low = np.float32([-3e38, -LARGEST, 3e38, -3e38, 0.0, -1.0, 1e-30])
    high = np.float32([3e38, LARGEST, -3e38, 0.0, 3e38, 1.0, 3e-30])
    x = np.float32([0.0, 1e38, 1e38, -1e38, 1e38, 0.25, 2e-30])
    a, b, at = (v.astype(np.float64) for v in (low, high, x))
    t = np.clip((at - a) / (b - a), 0, 1)
    got = computed(backend, "vec4(smoothstep(x, y, z))", low, high, x)[:, 0]
    np.testing.assert_allclose(got, t * t * (3 - 2 * t), rtol=1e-6)


def test_nothing_is_computed_for_numbers_that_are_known() -> None:
    """Literal edges leave one more product than the plain formula; lengths of literals none."""
    program = lowered("return length(vec3(3.0, 4.0, 12.0)) + mod(-1.0, 3.0)")
    assert program.body == ()
    np.testing.assert_array_equal(run_program(program)[0], [15.0])
