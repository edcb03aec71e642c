"""What operations mean: every row of the table within its bound."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray
from running import Column, lowered, run, run_program

from passgraph.language.operations import OPERATIONS

SAMPLES = 200_000
rng = np.random.default_rng(20240229)
Long = np.longdouble


def uniform(low: float, high: float, count: int = SAMPLES) -> Column:
    return rng.uniform(low, high, count).astype(np.float32)


def spread(low: float, high: float, count: int = SAMPLES, signed: bool = True) -> Column:
    """Magnitudes 2**low to 2**high, evenly by exponent."""
    values = np.exp2(rng.uniform(low, high, count))
    return (values * rng.choice([-1, 1], count) if signed else values).astype(np.float32)


def near(centre: float, count: int = SAMPLES) -> Column:
    """Values around a point, the nearer the denser."""
    return (np.float32(centre) + spread(-23, -1, count)).astype(np.float32)


def distance_ulp(got: Column, exact: Column, absolute: float = 0.0, scale: Column | None = None) -> Column:
    """|got - exact| in float32 ulps of the exact value (or of ``scale``), after an absolute allowance."""
    size = np.abs(exact if scale is None else scale).astype(Long)
    ulp = np.exp2(np.floor(np.log2(np.maximum(size, Long(2.0**-126)))) - 23)
    error = np.maximum(np.abs(got.astype(Long) - exact.astype(Long)) - absolute, 0)
    # Values beyond the largest float32 may come out infinite.
    over = np.isinf(got) & (np.abs(exact) > 3.4028e38) & (np.sign(got) == np.sign(exact))
    return np.where(over | (got == exact), 0, error / ulp)


def check(name: str, got: Column, exact: Column, scale: Column | None = None) -> float:
    row = OPERATIONS[name]
    with np.errstate(all="ignore"):
        error = distance_ulp(got, exact, row.absolute, scale)
    worst = int(np.argmax(np.nan_to_num(error, nan=np.inf)))
    assert error[worst] <= row.ulp, (
        f"{name}: {error[worst]:.2f} ulp at sample {worst}: {got[worst]}, not {exact[worst]}"
    )
    return float(error[worst])


def ordinary(name: str) -> list[Column]:
    """Samples of a row's one operand: where made-up kernels use it, and of any size on its domain."""
    row = OPERATIONS[name]
    domain = row.domain_of(0)
    (low, high), wide = row.ordinary(0), spread(-30, 30)
    sizes = np.abs(wide) if domain.low >= 0 else wide
    return [uniform(low, high), sizes[(sizes >= domain.low) & (sizes <= domain.high)]]


# Functions of one variable whose hard places are known: exact meaning in long double, samples on the documented domain.
ONE: dict[str, tuple[Callable[..., Column], list[Column]]] = {
    "exp2": (np.exp2, [uniform(-149, 128), spread(-30, 2), np.arange(-149, 128, dtype=np.float32)]),
    "exp": (np.exp, [uniform(-103, 88.7), spread(-30, 2)]),
    "log2": (np.log2, [spread(-149, 127.9, signed=False), uniform(0.5, 2), near(1)]),
    "log": (np.log, [spread(-149, 127.9, signed=False), uniform(0.5, 2), near(1)]),
    "sin": (np.sin, [uniform(-8192, 8192), uniform(-4, 4), spread(-40, 13)]),
    "cos": (np.cos, [uniform(-8192, 8192), uniform(-4, 4), spread(-40, 13)]),
    "tan": (np.tan, [uniform(-8192, 8192), uniform(-4, 4), spread(-40, 13)]),
    "asin": (np.arcsin, [uniform(-1, 1), spread(-40, 0), 1 - np.abs(near(0)), np.abs(near(0)) - 1]),
    "acos": (np.arccos, [uniform(-1, 1), spread(-40, 0), 1 - np.abs(near(0)), np.abs(near(0)) - 1]),
    "atan": (np.arctan, [uniform(-4, 4), spread(-126, 127)]),
    "sinh": (np.sinh, [uniform(-89, 89), spread(-120, 6.4)]),
    "cosh": (np.cosh, [uniform(-89, 89), spread(-120, 6.4)]),
    "log10": (np.log10, [spread(-149, 127.9, signed=False), uniform(0.5, 2), near(1)]),
    "asinh": (np.arcsinh, [spread(-120, 127), uniform(0.4, 0.6), uniform(1400, 1600)]),
    "acosh": (np.arccosh, [1 + np.abs(near(0)), 1 + spread(-20, 126, signed=False), uniform(1.4, 1.6)]),
    "atanh": (np.arctanh, [uniform(-1, 1), spread(-40, -0.01), 1 - np.abs(near(0)) / 2]),
    "tanh": (np.tanh, [uniform(-20, 20), spread(-120, 100)]),
    "sqrt": (np.sqrt, [spread(-126, 127.9, signed=False)]),
    "inversesqrt": (lambda x: 1 / np.sqrt(x), [spread(-126, 127.9, signed=False)]),
    "radians": (lambda x: x * Long(np.pi) / 180, [spread(-100, 100)]),
    "degrees": (lambda x: x * 180 / Long(np.pi), [spread(-100, 100)]),
    "fract": (lambda x: x - np.floor(x), [spread(-30, 22), uniform(-4, 4)]),
}


@pytest.mark.sampled
@pytest.mark.parametrize("name", [row.name for row in OPERATIONS.values() if row.of_numbers and len(row.operands) == 1])
def test_functions_of_one_variable_keep_their_bound(name: str) -> None:
    row = OPERATIONS[name]
    exact, samples = ONE.get(name, (row.reference, []))
    for x in [*samples, *ordinary(name)]:
        with np.errstate(all="ignore"):
            want = exact(x.astype(Long))
        check(name, run(row.as_written("x"), x), want)


#: Functions of several variables, and others that need more said: expression, meaning, the magnitude whose ulps
#: count, samples.  Of several that are not here operands are ordinary, and the row's meaning is the meaning.
BIG, SMALL = spread(-20, 20), uniform(-4, 4)
Meaning = Callable[..., Column]
SEVERAL: dict[str, tuple[str, Meaning, Meaning | None, list[tuple[Column, ...]]]] = {
    "pow": (
        "pow(x, y)",
        np.power,
        None,
        [
            (spread(-126, 127.9, signed=False), uniform(-1.1, 1.1)),
            (spread(-10, 10, signed=False), uniform(-12, 12)),
            (near(1), spread(-3, 20)),
            (uniform(0, 1), uniform(0, 5)),
            (uniform(0.66, 1.4), uniform(-300, 300)),
        ],
    ),
    "atan2": (
        "atan(x, y)",
        np.arctan2,
        None,
        [(uniform(-4, 4), uniform(-4, 4)), (spread(-20, 20), spread(-20, 20))],
    ),
    "add": ("x + y", np.add, None, [(BIG, uniform(-9, 9))]),
    "sub": ("x - y", np.subtract, None, [(BIG, uniform(-9, 9))]),
    "mul": ("x * y", np.multiply, None, [(spread(-60, 60), spread(-60, 60))]),
    "div": ("x / y", np.divide, None, [(spread(-60, 60), spread(-60, 60))]),
    "mod": (
        "mod(x, y)",
        lambda x, y: x - y * np.floor(x / y),
        lambda x, y: np.maximum(np.abs(x), np.abs(y)),
        [(uniform(-99, 99), uniform(0.5, 4))],
    ),
    "float_floor_divide": (
        "x // y",
        lambda x, y: np.floor(x / y),
        None,
        [(uniform(-99, 99), uniform(0.5, 4))],
    ),
    "mix": (
        "mix(x, y, z)",
        lambda x, y, a: x * (1 - a) + y * a,
        lambda x, y, a: np.maximum(np.abs(x * (1 - a)), np.abs(y * a)),
        [(BIG, spread(-20, 20), uniform(0, 1))],
    ),
    "fma": (
        "fma(x, y, z)",
        lambda a, b, c: a * b + c,
        lambda a, b, c: np.maximum(np.abs(a * b), np.abs(c)),
        [(BIG, spread(-20, 20), spread(-20, 20)), (SMALL, SMALL, uniform(-16, 16))],
    ),
    "smoothstep": (
        "smoothstep(x, y, z)",
        lambda a, b, x: OPERATIONS["smoothstep"].reference(a, b, x),
        None,
        [(uniform(-4, 0), uniform(0.5, 4), uniform(-4, 4))],
    ),
    "step": (
        "step(x, y)",
        lambda e, x: np.where(x < e, 0.0, 1.0),
        None,
        [(SMALL, uniform(-4, 4)), (SMALL, SMALL)],
    ),
    "clamp": ("clamp(x, -1.0, 2.0)", lambda x: np.clip(x, -1, 2), None, [(SMALL,)]),
    "saturate": ("saturate(x)", lambda x: np.clip(x, 0, 1), None, [(SMALL,)]),
    "sign": ("sign(x)", np.sign, None, [(SMALL,), (np.zeros(2, np.float32),)]),
    "min": ("min(x, y)", np.minimum, None, [(SMALL, uniform(-4, 4))]),
    "max": ("max(x, y)", np.maximum, None, [(SMALL, uniform(-4, 4))]),
    "abs": ("abs(x)", np.abs, None, [(BIG,)]),
    "neg": ("-x", np.negative, None, [(BIG,)]),
    "floor": ("floor(x)", np.floor, None, [(BIG,)]),
    "ceil": ("ceil(x)", np.ceil, None, [(BIG,)]),
    "trunc": ("trunc(x)", np.trunc, None, [(BIG,)]),
    "round": ("round(x)", np.rint, None, [(BIG,)]),
}


def of_several(name: str) -> tuple[str, Meaning, Meaning | None, list[tuple[Column, ...]]]:
    row = OPERATIONS[name]
    columns = tuple(uniform(*row.ordinary(operand)) for operand in range(len(row.operands)))
    return row.as_written(*"xyz"[: len(columns)]), row.reference, None, [columns]


@pytest.mark.sampled
@pytest.mark.parametrize(
    "name", {**SEVERAL, **{r.name: 1 for r in OPERATIONS.values() if r.of_numbers and len(r.operands) > 1}}
)
def test_functions_of_several_variables_keep_their_bound(name: str) -> None:
    expression, exact, scale, samples = SEVERAL.get(name) or of_several(name)
    for columns in samples:
        wide = [c.astype(Long) for c in columns]
        with np.errstate(all="ignore"):
            want = exact(*wide)
        got = run(expression, *columns)
        if name in ("mod", "float_floor_divide"):
            # Where x / y rounds to a whole number that it does not reach, either neighbour may come out.
            quotient = wide[0] / wide[1]
            clear = np.abs(quotient - np.rint(quotient)) > 2.0**-20 * np.maximum(np.abs(quotient), 1)
            got, want, wide = got[clear], want[clear], [w[clear] for w in wide]
        check(name, got, want, None if scale is None else scale(*wide))


VECTORS: dict[str, tuple[str, str, Callable[..., Column] | None]] = {
    # expression over a = vec3(x, y, z), b = vec3(w, x, y); result type; the magnitude whose ulps count
    "dot": ("dot(a, b)", "float", lambda a, b: np.sum(np.abs(a * b), -1)),
    "cross": (
        "cross(a, b)",
        "vec3",
        lambda a, b: np.sum(np.abs(a), -1, keepdims=True) * np.abs(b).max(-1, keepdims=True),
    ),
    "length": ("length(a)", "float", None),
    "distance": ("distance(a, b)", "float", None),
    "normalize": ("normalize(a)", "vec3", None),
    "reflect": ("reflect(a, normalize(b))", "vec3", lambda a, b: 3 * np.abs(a).max(-1, keepdims=True)),
    "refract": ("refract(normalize(a), normalize(b), 0.7)", "vec3", lambda a, b: np.ones_like(a)),
    "faceforward": ("faceforward(a, b, a)", "vec3", None),
}


@pytest.mark.parametrize("name", VECTORS)
def test_vector_operations_keep_their_bound(name: str) -> None:
    expression, result, scale = VECTORS[name]
    columns = [uniform(-4, 4, 50_000) for _ in range(4)]
    x, y, z, w = (c.astype(np.float64) for c in columns)
    a, b = np.stack([x, y, z], -1), np.stack([w, x, y], -1)

    def unit(v: Column) -> Column:
        return OPERATIONS["normalize"].reference(v)

    arguments = {
        "dot": (a, b),
        "cross": (a, b),
        "length": (a,),
        "distance": (a, b),
        "normalize": (a,),
        "reflect": (a, unit(b)),
        "refract": (unit(a), unit(b), np.full(len(a), 0.7)),
        "faceforward": (a, b, a),
    }[name]
    exact = OPERATIONS[name].reference(*arguments)
    got = run_with_vectors(expression, result, columns)
    if name == "refract":  # the edge of total reflection is a jump
        cosine = np.sum(arguments[0] * arguments[1], -1)
        clear = np.abs(1 - 0.49 * (1 - cosine * cosine)) > 1e-3
        got, exact, a, b = got[clear], exact[clear], a[clear], b[clear]
    check(
        name,
        got.ravel(),
        exact.ravel(),
        None if scale is None else np.broadcast_to(scale(a, b), exact.shape).ravel(),
    )


def run_with_vectors(expression: str, result: str, columns: list[Column]) -> Column:
    body = f"a, b = vec3(x, y, z), vec3(w, x, y)\nreturn {expression}"
    values = run_program(lowered(body, result), *columns)
    return values[0] if len(values) == 1 else np.stack(values, axis=-1)


@pytest.mark.parametrize("size", [2, 3, 4])
def test_matrix_operations_agree_with_numpy(size: int) -> None:
    """Products, transpose, determinant and inverse of matrices that are not nearly singular."""
    columns = [uniform(0.5, 1.5, 500) for _ in range(4)]
    numbers = [
        f"{'xyzw'[(i * 7) % 4]} * {((i * 5) % 7 - 3) / 4} + {3.0 if i % (size + 1) == 0 else 0.25}"
        for i in range(size**2)
    ]
    body = f"m = mat{size}({', '.join(numbers)})\n"
    wide = [c.astype(np.float64) for c in columns]
    flat = [
        wide[(i * 7) % 4] * (((i * 5) % 7 - 3) / 4) + (3.0 if i % (size + 1) == 0 else 0.25) for i in range(size**2)
    ]
    m = np.stack(flat, -1).reshape(-1, size, size)  # [lane, column, row]
    v = np.stack(wide[:size], -1)
    vector = f"vec{size}({', '.join('xyzw'[:size])})"
    for text, want in {
        f"m * {vector}": OPERATIONS["matmul"].reference(m, v),
        f"{vector} * m": OPERATIONS["matmul"].reference(v, m),
        f"(m * m)[{size - 1}]": OPERATIONS["matmul"].reference(m, m)[:, size - 1],
        "transpose(m)[0]": m[:, :, 0],
        "inverse(m)[1]": np.linalg.inv(m)[:, 1],
        "(m + m * 2.0 - m / 2.0)[1]": 2.5 * m[:, 1],
        f"outer({vector}, m[0])[1]": v * m[:, 0, 1][:, None],
    }.items():
        got = np.stack(run_program(lowered(body + f"return {text}", f"vec{size}"), *columns), -1)
        np.testing.assert_allclose(got, want, rtol=2e-5, atol=2e-5, err_msg=text)
    got = run_program(lowered(body + "return determinant(m)"), *columns)[0]
    np.testing.assert_allclose(got, np.linalg.det(m), rtol=2e-5)


# Storing


def stored(function: str, values: Column, *numbers: float) -> Column:
    return run("x", values, stores=((((function, *numbers),), ()),))


def test_halves_are_rounded_as_numpy_rounds_them() -> None:
    """All halves, all midpoints between them, and what lies just beside a midpoint."""
    halves = np.arange(65536, dtype=np.uint16).view(np.float16)
    finite = np.sort(halves[np.isfinite(halves)].astype(np.float32))
    middle = ((finite[1:].astype(np.float64) + finite[:-1]) / 2).astype(np.float32)
    values = np.concatenate(
        [
            halves.astype(np.float32),
            middle,
            np.nextafter(middle, np.float32(np.inf)),
            np.nextafter(middle, np.float32(-np.inf)),
            np.float32([65519.99, 65520, 1e30, np.inf, -np.inf, np.nan, 1e-45]),
            spread(-40, 20),
        ]
    )
    with np.errstate(over="ignore"):
        want = values.astype(np.float16).astype(np.float32)
    got = stored("quantize_half", values)
    np.testing.assert_array_equal(got, want)
    numbers = ~np.isnan(want)
    np.testing.assert_array_equal(np.signbit(got)[numbers], np.signbit(want)[numbers])


@pytest.mark.parametrize("steps", [255, 65535])
def test_the_nearest_step_is_stored(steps: int) -> None:
    fractions = np.arange(steps + 1) / steps
    values = np.concatenate([uniform(-0.5, 1.5), fractions.astype(np.float32)])
    scaled = np.clip(values, np.float32(0), np.float32(1)) * np.float32(steps)
    np.testing.assert_array_equal(stored("quantize", values, steps), np.rint(scaled) / np.float32(steps))
    special = np.float32([np.nan, np.inf, -np.inf, -0.0])
    np.testing.assert_array_equal(stored("quantize", special, steps), [0, 1, 0, 0])


def test_srgb_round_trips_and_follows_its_standard() -> None:
    x = uniform(0, 1)
    wide = x.astype(np.float64)
    encoded = np.where(wide <= 0.0031308, 12.92 * wide, 1.055 * wide ** (1 / 2.4) - 0.055)
    np.testing.assert_allclose(stored("encode_srgb", x), encoded, rtol=0, atol=2e-7)
    decoded = np.where(wide <= 0.04045, wide / 12.92, ((wide + 0.055) / 1.055) ** 2.4)
    np.testing.assert_allclose(stored("decode_srgb", x), decoded, rtol=1e-6, atol=1e-9)
    bytes_ = (np.arange(256) / 255).astype(np.float32)
    linear = stored("decode_srgb", bytes_)
    np.testing.assert_array_equal(np.rint(stored("encode_srgb", linear) * 255), np.arange(256))
    assert stored("encode_srgb", np.float32([np.nan]))[0] == 0


# The table itself


def test_every_row_is_tested_or_has_no_rounding() -> None:
    """Rows of numbers appear above by themselves; one of vectors that has a bound must be added."""
    matrices = {"matmul", "transpose", "determinant", "inverse", "outer"}
    whole = {"to_float", "float_from_uint", "ldexp"}  # in test_whole_numbers.py
    tested = {row.name for row in OPERATIONS.values() if row.of_numbers} | {*VECTORS, *matrices, *whole}
    assert {name for name in set(OPERATIONS) - tested if OPERATIONS[name].ulp} == set()


@pytest.mark.parametrize("name", ["pow", "min", "max", "atan2", "step", "smoothstep"])
def test_ordinary_operands_keep_the_bound_of_rows_that_say_more(name: str) -> None:
    """What a row of several numbers is held to where nothing more is said of it."""
    expression, exact, _, (columns,) = of_several(name)
    check(name, run(expression, *columns), exact(*(c.astype(Long) for c in columns)))


def test_reference_and_kernel_agree_on_every_row_of_one_kind() -> None:
    """The table's float64 meaning beside the float32 program, on small exact numbers."""
    x = np.float32([-2, -1, -0.5, 0.25, 0.5, 1, 2])
    for name in ("floor", "ceil", "trunc", "round", "abs", "sign", "saturate", "fract"):
        want: NDArray[np.float64] = OPERATIONS[name].reference(x.astype(np.float64))
        np.testing.assert_array_equal(run(f"{name}(x)", x), want, err_msg=name)
