"""Every row of the operations table on every backend against the reference, special values included.

The bound is the row's own (units in the last place, and an absolute part): there is no tolerance in this file.
"""

from __future__ import annotations

import numpy as np
import pytest

import passgraph as pg
from passgraph.language.operations import OPERATIONS, Operation

#: Zeros, ones, halves, range ends, tiny and huge numbers of either sign, then ordinary ones.
SPECIAL = [
    0.0,
    1.0,
    0.5,
    1.5,
    2.5,
    3.5,
    1e-3,
    1e-20,
    1.17549435e-38,
    1e20,
    3e38,
    0.1,
    0.3,
    0.7,
    2.0,
    3.0,
    7.0,
    100.0,
    255.0,
    8191.0,
]
NOT_FINITE = [np.inf, -np.inf, np.nan]
#: Below this results may be flushed to zero (denormals).
SMALLEST_NORMAL = 2.0**-126

INFIX = {
    "add": "+", "sub": "-", "mul": "*", "div": "/", "floor_divide": "//", "float_floor_divide": "//",
    "int_mod": "%", "mod": "%",
    "less": "<", "less_equal": "<=", "greater": ">", "greater_equal": ">=", "equal": "==", "not_equal": "!=",
    "logical_and": "and", "logical_or": "or", "bit_and": "&", "bit_or": "|", "bit_xor": "^",
    "shift_left": "<<", "shift_right": ">>",
}  # fmt: skip
PREFIX = {"neg": "-{0}", "logical_not": "not {0}", "bit_not": "~{0}", "to_float": "float({0})", "to_int": "int({0})",
          "atan2": "atan({0}, {1})", "outer": "outer({0}, {1})"}  # fmt: skip

#: Documented domains: (operand index, low, high).
DOMAINS: dict[str, list[tuple[int, float, float]]] = {
    "sqrt": [(0, 0, 3.4e38)], "inversesqrt": [(0, 1e-37, 3.4e38)], "log": [(0, 0, 3.4e38)], "log2": [(0, 0, 3.4e38)],
    "sin": [(0, -8192, 8192)], "cos": [(0, -8192, 8192)], "tan": [(0, -8192, 8192)],
    "asin": [(0, -1, 1)], "acos": [(0, -1, 1)],
    "pow": [(0, 0, 3.4e38)], "div": [(1, 2**-126, 2**126)],
}  # fmt: skip
#: Operations that divide, whose bound is stated away from quotients that round to a neighbouring whole number.
FLOOR_OF_QUOTIENT = {"mod", "float_floor_divide"}


def values(finite_only: bool) -> np.ndarray:
    random = np.random.default_rng(7)
    ordinary = np.concatenate([random.uniform(-4, 4, 12), random.uniform(-1000, 1000, 6), random.uniform(0, 1, 3)])
    listed = [*SPECIAL, *(-v for v in SPECIAL), *ordinary, *([] if finite_only else NOT_FINITE)]
    return np.array(listed, np.float32)


def grid(finite_only: bool) -> tuple[np.ndarray, np.ndarray]:
    """Two pictures that pair every value with every other one."""
    v = values(finite_only)
    a, b = np.meshgrid(v, v, indexing="ij")
    rolled = [np.roll(x, k, axis=0) for x in (a, b) for k in range(4)]
    return np.stack(rolled[:4], -1).astype(np.float32), np.stack(rolled[4:], -1).astype(np.float32)


def scalar_kernel(row: Operation) -> str:
    """Channel 0 of both pictures through an operation on scalars."""
    letters, result = (part.split() for part in row.signature.split("->"))
    integer = "I" in letters
    boolean = "B" in letters
    operands = []
    for index, _ in enumerate(letters):
        source = ("a", "b", "a")[index]
        channel = ("r", "r", "g")[index]
        text = f"{source}[0, 0].{channel}"
        if integer or letters[index] == "i":
            text = f"bits_from_float({text})"
        if boolean:
            text = f"({text} > 0.5)"
        operands.append(text)
    call = expression(row, operands)
    return f"def probe(a: Image, b: Image) -> vec4:\n    x = {call}\n    return {as_vec4('x', result[0], integer)}\n"


def expression(row: Operation, operands: list[str]) -> str:
    if row.name in INFIX:
        return f"({operands[0]} {INFIX[row.name]} {operands[1]})"
    if row.name in PREFIX:
        return PREFIX[row.name].format(*operands)
    return f"{row.name}({', '.join(operands)})"


def as_vec4(name: str, result: str, integer: bool) -> str:
    if result in ("B", "b"):
        return f"vec4(float({name}), 0.0, 0.0, 0.0)"
    if result in ("I", "i") or (integer and result == "N"):
        return f"vec4(float({name} & 0xFFFF), float(({name} >> 16) & 0xFFFF), 0.0, 0.0)"
    return f"vec4({name}, 0.0, 0.0, 0.0)"


SCALAR_ROWS = [
    row for row in OPERATIONS.values() if row.kind != "expanded" and not {"V", "M", "v3"} & set(row.signature.split())
]


def in_domain(row: Operation, a: np.ndarray, b: np.ndarray) -> np.ndarray:
    inside = np.ones(a.shape[:2], bool)
    for index, low, high in DOMAINS.get(row.name, []):
        x = np.abs((a, b)[index][..., 0]) if row.name == "div" else (a, b)[index][..., 0]
        inside &= (x >= low) & (x <= high)
    if row.name in ("smoothstep", "mix"):
        # Differences and products in between must neither overflow nor underflow.
        for x in (a[..., 0], b[..., 0], a[..., 1]):
            inside &= (x == 0) | ((np.abs(x) > 1e-18) & (np.abs(x) < 1e18))
    if row.name in FLOOR_OF_QUOTIENT:
        with np.errstate(all="ignore"):
            quotient = a[..., 0].astype(np.float64) / b[..., 0]
            inside &= np.abs(quotient) < 1e4
            inside &= np.abs(quotient - np.rint(quotient)) > 1e-3
    return inside


def distance_bound(reference: np.ndarray, row: Operation) -> np.ndarray:
    """The row's bound as a distance: ulps of float32 at the reference's magnitude, half an ulp for storing it."""
    magnitude = np.abs(reference).astype(np.float32)
    with np.errstate(all="ignore"):
        spacing = np.spacing(np.maximum(magnitude, np.float32(SMALLEST_NORMAL))).astype(np.float64)
    return (row.ulp + 0.5) * spacing + row.absolute + SMALLEST_NORMAL


def run(text: str, backend: str, a: np.ndarray, b: np.ndarray) -> np.ndarray:
    kernel = pg.kernel(source=text)
    out = kernel(pg.Input("a"), pg.Input("b"), into=pg.target("out", "rgba32f"))
    with pg.compile(out, backend=backend, non_finite="keep") as program:
        return program(a=a, b=b)["out"]


def terms(row: Operation, a: np.ndarray, b: np.ndarray, expected: np.ndarray) -> np.ndarray:
    """What the ulps are counted of: the result, or the larger of two terms that cancel (mix, mod)."""
    if row.name == "mod":
        return np.maximum(np.abs(expected), np.abs(a[..., :1]).astype(np.float64))
    if row.name != "mix":
        return expected
    x, y, t = (v.astype(np.float64) for v in (a[..., :1], b[..., :1], a[..., 1:2]))
    return np.maximum(np.abs(x * (1 - t)), np.abs(y * t)) * np.ones(4)


def check(row: Operation, text: str, backend: str, a: np.ndarray, b: np.ndarray, inside: np.ndarray) -> None:
    expected, got = (
        run(text, "reference", a, b).astype(np.float64),
        run(text, backend, a, b).astype(np.float64),
    )
    with np.errstate(all="ignore"):
        error = np.abs(got - expected)
        agree = (
            (got == expected)
            | (np.isnan(got) & np.isnan(expected))
            | (error <= distance_bound(terms(row, a, b, expected), row))
        )
        # A result within its bound of the largest float may overflow.
        huge = np.abs(expected) > 3.4e38
    agree |= huge & (np.abs(got) > 3.4e38)
    wrong = inside[..., None] & ~agree
    assert inside.mean() > 0.05, "too little of the grid is inside the domain: the check would be empty"
    if wrong.any():
        y, x, c = np.argwhere(wrong)[0]
        pytest.fail(
            f"{row.name} on {backend}: {wrong.any(axis=-1).sum()} pixels out of bound; first a={a[y, x]} b={b[y, x]}: "
            f"expected {expected[y, x, c]!r}, got {got[y, x, c]!r}, bound {distance_bound(expected, row)[y, x, c]:.3g}"
        )


@pytest.mark.parametrize("row", SCALAR_ROWS, ids=lambda row: row.name)
def test_scalar_operation_is_within_its_bound(row: Operation, backend_name: str) -> None:
    a, b = grid(finite_only=False)
    special = ~(np.isfinite(a[..., 0]) & np.isfinite(b[..., 0]))
    # NaN into min, max and what is built on them is a checked condition of the language, not a value.
    inside = in_domain(row, a, b)
    if row.name in (
        "mod",
        "float_floor_divide",
        "smoothstep",
        "mix",
        "atan2",
        "pow",
        "fract",
        "floor_divide",
    ):
        inside &= ~special
    check(row, scalar_kernel(row), backend_name, a, b, inside)


VECTOR: dict[str, str] = {
    "dot": "dot({a}, {b})", "cross": "cross({a}.xyz, {b}.xyz)", "length": "length({a}.xyz)",
    "distance": "distance({a}, {b})", "normalize": "normalize({a}.xyz)",
    "faceforward": "faceforward({a}, {b}, {a}.yxwz)", "reflect": "reflect({a}.xyz, normalize({b}.xyz))",
    "refract": "refract(normalize({a}.xyz), normalize({b}.xyz), 0.7)", "any": "any({a} > {b})",
    "all": "all({a} > {b})", "matmul": "mat3({a}.xyz, {b}.xyz, {a}.yzw) * {b}.xyz",
    "transpose": "transpose(mat2({a}))[1]", "determinant": "determinant(mat2({a}))",
    "inverse": "inverse(mat2({a}) + mat2(9.0))[0]", "outer": "outer({a}.xyz, {b}.xyz)[2]",
}  # fmt: skip


def test_every_row_of_the_table_is_covered() -> None:
    assert {row.name for row in SCALAR_ROWS} | set(VECTOR) == set(OPERATIONS)


@pytest.mark.parametrize("name", VECTOR)
def test_vector_operation_is_within_its_bound(name: str, backend_name: str) -> None:
    random = np.random.default_rng(3)
    a, b = (random.uniform(0.25, 3.0, (48, 64, 4)).astype(np.float32) for _ in range(2))
    a[:8] *= -1
    b[::3, ::5] *= -1
    row = OPERATIONS[name]
    text = VECTOR[name].format(a="a[0, 0]", b="b[0, 0]")
    kernel = f"def probe(a: Image, b: Image) -> vec4:\n    x = {text}\n    return {_padded(name)}\n"
    expected, got = (run(kernel, backend, a, b).astype(np.float64) for backend in ("reference", backend_name))
    # Sums cancel: the bound counts ulps of the largest term, which inputs of magnitude at most 3 bound by 64.
    scale = 64.0 if name not in ("normalize", "faceforward", "any", "all", "transpose") else 1.0
    bound = (row.ulp + 0.5) * np.spacing(np.float32(scale))
    assert np.abs(got - expected).max() <= bound
    assert np.isfinite(expected).all()


def _padded(name: str) -> str:
    if name in ("cross", "normalize", "reflect", "refract", "matmul", "outer"):
        return "vec4(x, 0.0)"
    if name in ("transpose", "inverse"):
        return "vec4(x, 0.0, 0.0)"
    if name in ("any", "all"):
        return "vec4(float(x), 0.0, 0.0, 0.0)"
    return "x" if name == "faceforward" else "vec4(x, 0.0, 0.0, 0.0)"
