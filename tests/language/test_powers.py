"""``pow`` by rule: of a negative base the whole powers, of an exponent written, folded, given or computed.

Held against long double, which shares nothing with the table's reference.
"""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from running import lowered, run

import passgraph as pg
from passgraph.backends.registry import open_backend
from passgraph.language import scalar as s

Numbers = NDArray[np.float32]

NAN, INF = float("nan"), float("inf")
BASES = np.float32([-2, -1, -0.5, -1e-3, -37.25, -1e15, -3e38, -1e-30, -0.0, 0.0, 2, 0.75, 1e-15, 1e15, -INF, INF, NAN])
EXPONENTS = np.float32(
    [0, 1, 2, 3, 4, 5, 7, 8, 9, 16, 17, 100, 101, -1, -2, -3, -4, -9, 0.5, -0.5, 2.5, 1 / 3, 16777215, 16777216,
     8388609, -8388609, 3e38, 1e-40, INF, -INF, NAN]
)  # fmt: skip


def meant(x: Numbers, y: Numbers) -> NDArray[np.longdouble]:
    """The rules of docs/kernels.md over long double."""
    wide_x, wide_y = x.astype(np.longdouble) + 0, y.astype(np.longdouble)
    with np.errstate(all="ignore"):
        made = np.power(wide_x, wide_y)
        made = np.where((x < 0) & (np.floor(y) != y), np.nan, made)
        return np.where(np.isnan(y), np.nan, made)


def agrees(got: Numbers, want: NDArray[np.longdouble], x: Numbers, y: Numbers) -> NDArray[np.bool_]:
    """Within the row's 16 units; numbers below the normal ones may be 0, an odd negative power of 0 has either sign."""
    with np.errstate(all="ignore"):
        unit = np.maximum(np.spacing(np.abs(want).astype(np.float32)).astype(np.longdouble), 2.0**-126 / 16)
        near = np.abs(got - want) <= 16 * unit
        limit = np.isinf(want) & ((got == want) | ((x == 0) & np.isinf(got)))
        # Rounded to float32 the true power is infinite.
        far = np.isfinite(want) & np.isinf(want.astype(np.float32)) & (np.sign(got) == np.sign(want)) & np.isinf(got)
    return np.where(np.isnan(want), np.isnan(got), near | limit | far)


def checked(got: Numbers, x: Numbers, y: Numbers, what: str) -> None:
    want = meant(x, y)
    bad = np.flatnonzero(~agrees(got, want, x, y))
    assert len(bad) == 0, f"{what}: (x, y, got, want) {[(x[i], y[i], got[i], want[i]) for i in bad[:5]]}"


PAIRS = tuple(np.ascontiguousarray(v.ravel()) for v in np.meshgrid(BASES, EXPONENTS))


def test_computed_exponents_are_tested_for_being_whole() -> None:
    for simplify in (True, False):
        checked(run("pow(x, y)", *PAIRS, simplify=simplify), *PAIRS, f"simplify={simplify}")


@pytest.mark.parametrize("exponent", [float(y) for y in EXPONENTS if np.isfinite(y)])
@pytest.mark.parametrize("spelling", ["{0!r}", "({0!r} + 1.0) - 1.0", "x**({0!r})"], ids=["written", "folded", "infix"])
def test_known_exponents(exponent: float, spelling: str) -> None:
    y = np.full_like(BASES, np.float32(exponent))
    known = float(y[0])
    if spelling.startswith("("):
        y = np.full_like(BASES, (np.float32(known) + np.float32(1)) - np.float32(1))
    text = spelling.format(known)
    checked(run(text if "**" in text else f"pow(x, {text})", BASES), BASES, y, text)


@pytest.mark.parametrize("backend", ["reference", "numpy", "gl", "opencl", "webgpu"])
@pytest.mark.parametrize("spelling", ["pow(c[0, 0].x, c[0, 0].y)", "pow(c[0, 0].x, p)", "pow(c[0, 0].x, 2.0)"])
def test_every_backend_follows_the_rule(backend: str, spelling: str) -> None:
    x, y = (v[np.isfinite(v)] for v in (BASES, EXPONENTS))
    # OpenGL and OpenCL may flush what is not normal, the exponent too.
    x, y = (np.ascontiguousarray(v.ravel()) for v in np.meshgrid(x, y[np.abs(y) != np.float32(1e-40)]))
    picture = np.zeros((1, len(x), 4), np.float32)
    picture[0, :, 0], picture[0, :, 1] = x, y
    kernel = pg.kernel(source=f"def k(c: Image, p: float = 2.0) -> vec4: return vec4({spelling})")
    target = kernel(pg.Input("c"), into=pg.target("o", "rgba32f"))
    with open_backend(backend) as device, pg.compile(target, backend=device) as program:
        got = program(c=picture)["o"][0, :, 0]
    checked(got, x, y if "y)" in spelling else np.full_like(x, 2), spelling)


def count(text: str) -> int:
    return sum(1 for i in s.walk(lowered(f"return {text}").body) if isinstance(i, (s.Op, s.Choose)))


def test_what_is_known_of_the_exponent_costs_nothing() -> None:
    """A whole one is a product, a fractional one leaves nothing of the tests for wholeness and sign."""
    assert count("pow(x, 2.0)") == 1
    assert count("pow(x, 5.0)") == 3
    assert count("pow(x, -2.0)") == 2
    assert count("pow(x, 0.0)") == 0
    fractional = lowered("return pow(x, 2.4)").body
    assert not [i for i in s.walk(fractional) if isinstance(i, s.Op) and i.operation in ("abs", "floor", "logical_and")]
