"""Numbers below 2^-126, which a device may count as 0: what each backend makes of them."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

import passgraph as pg
from tests.conftest import require

KERNEL = """
def small(p: Image) -> tuple[vec4, vec4]:
    x, y = p[0, 0].x, p[0, 0].y
    m, e = frexp(x)
    return vec4(m, float(e), saturate(x), smoothstep(0.0, y, x)), vec4(min(x, y), max(x, y), clamp(x, 0.0, y), sign(x))
"""
RANDOM = np.random.default_rng(47)
X, Y = (np.exp2(RANDOM.uniform(-149, -126.01, 500)).astype(np.float32) for _ in range(2))
X *= RANDOM.choice(np.float32([-1, 1]), 500)


def computed(backend: str) -> NDArray[np.float32]:
    picture = np.zeros((1, len(X), 4), np.float32)
    picture[0, :, 0], picture[0, :, 1] = X, Y
    into = (pg.target("a", "rgba32f"), pg.target("b", "rgba32f"))
    made = pg.kernel(source=KERNEL)(pg.Input("p"), into=into)
    with pg.compile(list(made), backend=backend) as program:
        results = program(p=picture)
        return np.concatenate([results["a"][0], results["b"][0]], -1).T


@pytest.mark.parametrize("backend", ["reference", "numpy", "gl", "opencl", "webgpu"])
def test_frexp_scales_numbers_that_float32_does_not(backend: str) -> None:
    require(backend)
    mantissa, exponent = computed(backend)[:2]
    assert np.array_equal([mantissa, exponent], np.frexp(X))


@pytest.mark.parametrize("backend", ["reference", "numpy"])
def test_a_processor_compares_small_numbers_as_they_are(backend: str) -> None:
    _, _, saturated, _, lower, upper, clamped, sign = computed(backend)
    assert np.array_equal(lower, np.minimum(X, Y))
    assert np.array_equal(upper, np.maximum(X, Y))
    assert np.array_equal(saturated, np.clip(X, 0, 1))
    assert np.array_equal(clamped, np.clip(X, 0, Y))
    assert np.array_equal(sign, np.sign(X))


@pytest.mark.parametrize("backend", ["gl", "opencl", "webgpu"])
def test_a_device_gives_one_of_the_numbers_that_it_compares(backend: str) -> None:
    """As the page on kernels says of numbers below 2^-126."""
    require(backend)
    _, _, saturated, smooth, lower, upper, clamped, sign = np.where(computed(backend) == 0, 0, computed(backend))
    for result, allowed in ((lower, (X, Y)), (upper, (X, Y)), (saturated, (X,)), (clamped, (X, Y))):
        assert np.logical_or.reduce([result == 0, *(result == one for one in allowed)]).all()
    assert ((smooth >= 0) & (smooth <= 1)).all()
    assert np.isin(sign, [-1, 0, 1]).all()
