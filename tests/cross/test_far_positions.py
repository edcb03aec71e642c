"""Positions far outside a picture, of texels and of bilinear samples: every border rule on every backend.

What is right follows from exact whole numbers here, not from the reference.
"""

from __future__ import annotations

import math
from typing import Literal, get_args

import numpy as np
import pytest
from numpy.typing import NDArray

import passgraph as pg
from passgraph.backends.base import Backend

Border = Literal["clamp", "zero", "repeat", "mirror", "reflect-101"]
BORDERS: tuple[Border, ...] = get_args(Border)
#: Widths of pictures that are read: powers of two, whose texel's width is exact, and others.
WIDTHS = (8, 7, 1)
#: Where a position counts as: docs/kernels.md.
FARTHEST = 2**30

#: One bit pattern an int; the second half of its bits in the second channel.
TEXEL = """
def k(places: Image, c: Image) -> vec4:
    p = places[0, 0]
    at = int(p.x) * 65536 + int(p.y)
    return vec4(c.texel(ivec2(at, 0)).x, c.texel(ivec2(0, at)).x, c.texel(ivec2(at, at)).y, c.texel(ivec2(at, 1)).w)
"""
SAMPLE = """
def k(places: Image, c: Image) -> vec4:
    p = places[0, 0]
    return vec4(c.sample(vec2(p.x, p.y)).x, c.sample(vec2(p.y, p.x)).x, c.sample(vec2(p.x / p.z, p.y)).x, 0.0)
"""
INTS = (
    0, 5, -1, 2**21, -(2**21), 2**24 + 1, 2**30, -(2**30) - 1, 2147483392, 2147483584, 2**31 - 1, -(2**31), -(2**31) + 1
)  # fmt: skip
#: uv: beyond 2^31 texels (2.2e6 is what a projective division reached in a picture 1024 wide), and not finite.
UVS = np.float32([2.2e6 * 1024, -2.2e6 * 1024, 4e8, -4e8, 3e38, -3e38, 1e20, -1e20, np.inf, -np.inf])


def picture(width: int) -> NDArray[np.float32]:
    """(width, width, 4), no zeros, no two alike."""
    return (1 + np.arange(width * width * 4, dtype=np.float32)).reshape(width, width, 4)


def inside(border: Border, at: int, width: int) -> int | None:
    """The row or column that is read, None where 0 is."""
    if border == "clamp":
        return min(max(at, 0), width - 1)
    if border == "zero":
        return at if 0 <= at < width else None
    if border == "reflect-101":
        return 0 if width == 1 else width - 1 - abs(at % (2 * width - 2) - (width - 1))
    m = at % (width if border == "repeat" else 2 * width)
    return m if m < width else 2 * width - 1 - m


def read(c: NDArray[np.float32], border: Border, x: int, y: int, channel: int) -> float:
    column, row = (inside(border, at, len(c)) for at in (x, y))
    return 0.0 if column is None or row is None else float(c[row, column, channel])


def run(device: Backend, text: str, places: NDArray[np.float32], c: NDArray[np.float32], border: Border) -> object:
    kernel = pg.kernel(source=text)
    out = kernel(pg.Input("places"), pg.Input("c").border(border), into=pg.target("o", "rgba32f"))
    with pg.compile(out, backend=device, non_finite="keep") as program, np.errstate(all="ignore"):
        return program(places=places, c=c)["o"][0]


@pytest.mark.sampled
@pytest.mark.parametrize("border", BORDERS)
@pytest.mark.parametrize("width", WIDTHS)
def test_texels_at_every_int(device: Backend, border: Border, width: int) -> None:
    places = np.zeros((1, len(INTS), 4), np.float32)
    places[0, :, 0], places[0, :, 1] = [i >> 16 for i in INTS], [i & 0xFFFF for i in INTS]
    c = picture(width)
    want = [
        [read(c, border, i, 0, 0), read(c, border, 0, i, 0), read(c, border, i, i, 1), read(c, border, i, 1, 3)]
        for i in INTS
    ]
    np.testing.assert_array_equal(run(device, TEXEL, places, c, border), np.float32(want))


@pytest.mark.sampled
@pytest.mark.parametrize("border", BORDERS)
@pytest.mark.parametrize("width", WIDTHS)
def test_samples_beyond_all_ints_read_one_texel(device: Backend, border: Border, width: int) -> None:
    """Out there float32 has no fractions, so no two texels are mixed."""
    middle = np.float32(0.5 / width)
    places = np.zeros((1, len(UVS), 4), np.float32)
    places[0, :, 0], places[0, :, 1], places[0, :, 2] = UVS, middle, np.where(np.arange(len(UVS)) % 2, 1e-10, -1e-10)
    c = picture(width)
    want = []
    for u, _, divisor, _ in places[0]:
        at = int(math.copysign(FARTHEST, u))
        back = int(math.copysign(at, u * math.copysign(1, divisor)))
        want.append([read(c, border, at, 0, 0), read(c, border, 0, at, 0), read(c, border, back, 0, 0), 0.0])
    np.testing.assert_allclose(run(device, SAMPLE, places, c, border), np.float32(want), rtol=1e-6)


@pytest.mark.sampled
@pytest.mark.parametrize("border", BORDERS)
def test_a_sample_at_nan_is_nan(device: Backend, border: Border) -> None:
    places = np.full((1, 1, 4), np.nan, np.float32)
    got = run(device, "def k(places: Image, c: Image) -> vec4: return c.sample(places[0, 0].xy)", places,
              picture(7), border)  # fmt: skip
    assert np.isnan(got).all()
