"""What pixel passes compute on every backend, against NumPy, Python and numbers that are known."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import passgraph as pg
from passgraph.backends.base import Backend
from passgraph.language import Image, vec3
from passgraph.language.borders import border_place

INT_MIN, INT_MAX = -(2**31), 2**31 - 1
Picture = NDArray[np.float32]


def noise(width: int, height: int, channels: int = 4) -> Picture:
    return np.random.default_rng(3).random((height, width, channels), np.float32)


def run(
    device: Backend, text: str, picture: Picture, border: str = "clamp", format_: str = "rgba32f", **values: Any
) -> Picture:
    """The result of a kernel with one image parameter."""
    kernel = pg.kernel(source=text)
    letters = "rgba"[: picture.shape[2]] if picture.shape[2] > 1 else "r"
    source = pg.Input("frame", f"{letters}32f", border=border)
    with pg.compile(kernel(source, into=pg.target("out", format_), **values), device, non_finite="keep") as program:
        return np.array(program(frame=picture)["out"])


PAD = {"clamp": "edge", "zero": "constant", "repeat": "wrap", "mirror": "symmetric", "reflect-101": "reflect"}


@pytest.mark.sampled
@pytest.mark.parametrize("size", [(1, 1), (3, 2), (130, 5), (300, 9)])
@pytest.mark.parametrize("border", list(PAD))
def test_neighbours_outside_follow_the_border_rule(device: Backend, border: str, size: tuple[int, int]) -> None:
    """Sums of exact values, at sizes with and without an inner block."""
    picture = np.rint(noise(*size) * 64).astype(np.float32)
    text = "def box(c: Image) -> vec4: return c[-1, 0] + c[2, 0] + c[0, -2] + c[0, 1]"
    padded = np.pad(picture, ((2, 2), (2, 2), (0, 0)), mode=PAD[border])  # type: ignore[call-overload]
    width, height = size
    expected = sum(
        padded[2 + dy : 2 + dy + height, 2 + dx : 2 + dx + width] for dx, dy in ((-1, 0), (2, 0), (0, -2), (0, 1))
    )
    np.testing.assert_array_equal(run(device, text, picture, border), expected)


def test_absolute_texels_take_any_coordinate(device: Backend) -> None:
    picture = noise(5, 4)
    text = "def far(c: Image) -> vec4: return c.texel(ivec2(-2000000000, 2000000000) + pixel() * 0)"
    np.testing.assert_array_equal(run(device, text, picture), np.broadcast_to(picture[3, 0], picture.shape))


def test_missing_channels_read_0_0_1(device: Backend) -> None:
    got = run(device, "def whole(c: Image) -> vec4: return c[0, 0]", np.full((2, 2, 1), 0.5, np.float32))
    np.testing.assert_array_equal(got, np.broadcast_to(np.float32([0.5, 0, 0, 1]), (2, 2, 4)))


def test_pixel_and_size_are_those_of_the_picture(device: Backend) -> None:
    text = "def where(c: Image) -> vec4: return vec4(vec2(pixel()), vec2(output_size() + c.size))"
    got = run(device, text, noise(200, 3))
    rows, columns = np.mgrid[0:3, 0:200]
    np.testing.assert_array_equal(got[..., 0], columns)
    np.testing.assert_array_equal(got[..., 1], rows)
    np.testing.assert_array_equal(got[0, 0, 2:], [400, 6])


@pytest.mark.parametrize("format_", ["rgba8", "rgba16", "rgba16f", "rgba32f", "rgba8_srgb"])
def test_what_is_stored_is_read_back_the_same(device: Backend, format_: str) -> None:
    """A second pass sees what the first one's target holds; textures decode whole numbers within an ULP."""
    store = pg.kernel(source="def store(c: Image) -> vec4: return c[0, 0] * 1.2 - 0.1")
    double = pg.kernel(source="def load(c: Image) -> vec4: return c[1, 0]")
    first = store(pg.Input("frame", "rgba32f"), into=pg.target("first", format_))
    second = double(first, into=pg.target("second", "rgba32f"))
    with pg.compile([first, second], backend=device) as program:
        result = program(frame=noise(140, 3))
    expected = result["first"]
    if format_.endswith("srgb"):
        # Kernels read linear values.
        rgb = expected[..., :3].astype(np.float64)
        expected = expected.copy()
        expected[..., :3] = np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)
        np.testing.assert_allclose(result["second"][:, :-1], expected[:, 1:], rtol=1e-5)
    else:
        by_texture = device.name in ("gl", "webgpu")
        np.testing.assert_allclose(result["second"][:, :-1], expected[:, 1:], rtol=2.0**-22 if by_texture else 0.0)


def test_halves_are_rounded_to_nearest_even(device: Backend) -> None:
    special = [
        0.0,
        -0.0,
        1e-8,
        5.9e-8,
        6.1e-5,
        0.1,
        1 / 3,
        2049.0,
        2051.0,
        65504.0,
        65519.9,
        65520.0,
        np.inf,
        -np.inf,
    ]
    picture = np.array(special, np.float32).reshape(1, -1, 1)
    got = run(device, "def copy(c: Image) -> float: return c[0, 0].r", picture, format_="r16f")
    with np.errstate(over="ignore"):
        np.testing.assert_array_equal(got, picture.astype(np.float16).astype(np.float32))


def test_nan_passes_through_a_half_target(device: Backend) -> None:
    picture = np.full((1, 1, 1), np.nan, np.float32)
    assert np.isnan(run(device, "def copy(c: Image) -> float: return c[0, 0].r", picture, format_="r16f")).all()


def ints(device: Backend, expression: str, a: list[int], b: list[int]) -> list[int]:
    """An int expression of ``a`` and ``b`` for each pair; values travel as bits."""
    pairs = np.array([a, b], np.int64).astype(np.uint32).astype(np.int64)
    halves = np.stack([pairs[0] >> 16, pairs[0] & 0xFFFF, pairs[1] >> 16, pairs[1] & 0xFFFF], axis=-1)
    text = f"""
def whole(c: Image) -> vec4:
    t = c[0, 0]
    a = (int(t.r) << 16) | int(t.g)
    b = (int(t.b) << 16) | int(t.a)
    r = {expression}
    return vec4(float((r >> 16) & 65535), float(r & 65535), 0.0, 0.0)
"""
    got = run(device, text, halves.reshape(1, -1, 4).astype(np.float32)).astype(np.int64)[0]
    return ((got[:, 0] << 16) | got[:, 1]).astype(np.uint32).astype(np.int32).tolist()  # type: ignore[no-any-return]


A = [7, -7, 7, -7, 5, INT_MIN, INT_MAX, INT_MIN, 0]


B = [3, 3, -3, -3, 0, -1, 2, 5, -4]


@pytest.mark.parametrize(
    ("expression", "meaning"),
    [
        ("a // b", lambda a, b: a // b if b else 0),
        ("a % b", lambda a, b: a % b if b else 0),
        ("a + b", lambda a, b: a + b),
        ("a - b", lambda a, b: a - b),
        ("a * b", lambda a, b: a * b),
        ("-a", lambda a, b: -a),
        ("abs(a)", lambda a, b: abs(a)),
        ("a << b", lambda a, b: a << (b & 31)),
        ("a >> b", lambda a, b: a >> (b & 31)),
    ],
)
def test_ints_are_pythons_in_32_bits(device: Backend, expression: str, meaning: object) -> None:
    expected = [(meaning(a, b) + 2**31) % 2**32 - 2**31 for a, b in zip(A, B, strict=True)]  # type: ignore[operator]
    assert ints(device, expression, A, B) == expected


def test_floats_become_ints_saturated_and_nan_0(device: Backend) -> None:
    special = np.array([1.9, -1.9, 3e9, -3e9, np.inf, -np.inf, np.nan, 2147483520.0], np.float32)
    text = """
def whole(c: Image) -> vec4:
    n = int(c[0, 0].r)
    return vec4(float(n >> 16), float(n & 65535), 0.0, 0.0)
"""
    got = run(device, text, special.reshape(1, -1, 1)).astype(np.int64)[0]
    expected = [1, -1, INT_MAX, INT_MIN, INT_MAX, INT_MIN, 0, 2147483520]
    assert (got[:, 0] * 65536 + got[:, 1]).tolist() == expected


def test_nan_and_infinity_are_told_apart(device: Backend) -> None:
    picture = np.array([0, np.nan, np.inf, -np.inf, 3e38], np.float32).reshape(1, -1, 1)
    text = """
def tell(c: Image) -> vec2:
    x = c[0, 0].r
    return vec2(1.0 if isnan(x) else 0.0, 1.0 if isinf(x) else 0.0)
"""
    got = run(device, text, picture, format_="rg32f")
    assert got[0].tolist() == [[0, 0], [1, 0], [0, 1], [0, 1], [0, 0]]


def test_division_by_zero_is_that_of_ieee_754(device: Backend) -> None:
    picture = np.array([1, -1, 0], np.float32).reshape(1, -1, 1)
    got = run(device, "def d(c: Image) -> float: return c[0, 0].r / (c[0, 0].r * 0.0)", picture, format_="r32f")[
        0, :, 0
    ]
    assert got[0] == np.inf
    assert got[1] == np.inf
    assert np.isnan(got[2])


def test_branches_and_loops_with_breaks(device: Backend) -> None:
    text = """
def count(c: Image) -> float:
    x = c[0, 0].r
    n = 0
    for i in range(100):
        if float(i) > x:
            break
        n = n + i
    return float(n)
"""
    picture = np.arange(40, dtype=np.float32).reshape(1, 40, 1)
    got = run(device, text, picture, format_="r32f")
    assert got[0, :, 0].tolist() == [sum(range(k + 1)) for k in range(40)]


def test_tables_are_read_by_computed_index(device: Backend) -> None:
    text = "T = (3.0, 1.0, 4.0, 1.5)\ndef look(c: Image) -> float: return T[int(c[0, 0].r)]"
    got = run(device, text, np.array([[[2], [0], [3], [9]]], np.float32), format_="r32f")
    assert got[0, :, 0].tolist() == [4, 3, 1.5, 1.5]


@pg.kernel
def split(c: Image) -> tuple[vec3, float]:
    return c[0, 0].rgb, c[0, 0].a


def test_several_results(device: Backend) -> None:
    into = (pg.target("rgb", "rgb32f"), pg.target("alpha", "r16"))
    picture = noise(6, 5)
    with pg.compile(list(split(pg.Input("frame"), into=into)), backend=device) as program:
        result = program(frame=picture)
    np.testing.assert_array_equal(result["rgb"], picture[..., :3])
    np.testing.assert_allclose(result["alpha"][..., 0], picture[..., 3], atol=1 / 65535)


def test_changed_values_reach_the_next_run(device: Backend) -> None:
    kernel = pg.kernel(source="def gain(c: Image, by: float) -> vec4: return c[0, 0] * by")
    with pg.compile(kernel(pg.Input("frame"), pg.Value("by", float)), backend=device) as program:
        picture = np.ones((2, 2, 4), np.float32)
        seen = [program(frame=picture, by=by)["gain"][0, 0, 0] for by in (2.0, 2.0, 3.0)]
    assert seen == [2, 2, 3]


#: Ends of int, multiples of what the sizes below divide, places whose nearest float is in another period.
FAR = (-(2**31), 2**31 - 1, -(2**31) + 7, 2**31 - 64, 2**24 + 1, -(2**24) - 1, 3 * 2**21 - 1, 25_200_000, -1_000_001, 0)


@pytest.mark.sampled
@pytest.mark.parametrize("border", ["repeat", "mirror", "reflect-101"])
@pytest.mark.parametrize("size", [1, 2, 3, 41, 256, 1001, 8191])
def test_any_int_finds_its_texel_by_a_periodic_rule(device: Backend, border: str, size: int) -> None:
    """Against exact integers; the places go through all periods of int.  41 · (1 / 41) is less than 1 in float32."""
    source = """def one(color: Image, base: Array[int, 10], step: int) -> float:
    p = pixel()
    return color.texel(ivec2(base[p.y % 10] + (p.x - 512) * step, 0)).r + color.texel(ivec2(0, base[p.y % 10])).g"""
    columns = np.zeros((1, size, 4), np.float32)
    columns[0, :, 0] = np.arange(size)
    for step in (1, 4_099_999):
        made = pg.kernel(source=source)(
            pg.Input("color").border(border), list(FAR), step, into=pg.target("out", "r32f", size=(1024, 10))
        )
        with pg.compile(made, device) as program:
            got = program(color=columns)["out"][..., 0]
        at = np.array(FAR, np.int64)[:, None] + (np.arange(1024) - 512) * step
        at = (at + 2**31) % 2**32 - 2**31
        np.testing.assert_array_equal(got, border_place(border, at, size))


@pytest.mark.parametrize("border", ["repeat", "mirror", "reflect-101"])
@pytest.mark.parametrize("offset", [3, 2**20, 2**20 + 1, 2**30 + 5, -(2**31) + 1])
def test_any_offset_finds_its_texel_by_a_periodic_rule(device: Backend, border: str, offset: int) -> None:
    columns = np.arange(23, dtype=np.float32).reshape(1, 23, 1)
    text = f"def one(color: Image) -> float: return color[{offset}, {offset}].r"
    got = run(device, text, columns, border, "r32f")[..., 0]
    np.testing.assert_array_equal(got[0], border_place(border, np.arange(23) + offset, 23))


def test_an_infinite_constant_is_infinite(device: Backend) -> None:
    text = "def one(c: Image) -> vec2: return vec2(float_from_bits(0x7F800000), float_from_bits(-8388608))"
    assert run(device, text, noise(1, 1), format_="rg32f")[0, 0].tolist() == [np.inf, -np.inf]


def test_uniform_arrays_are_indexed_at_run_time(device: Backend) -> None:
    for length, step in ((9, 1), (1000, 100)):
        text = f"def one(c: Image, w: Array[float, {length}]) -> float: return w[pixel().x * {step}]"
        got = run(device, text, noise(9, 2), format_="r32f", w=tuple(map(float, range(length))))
        assert got[0, :, 0].tolist() == [float(step * x) for x in range(9)]


def test_ints_and_bools_are_uniforms(device: Backend) -> None:
    text = """
def one(color: Image, n: int, on: bool, v: ivec2) -> vec3:
    return vec3(float(n), 1.0 if on else 0.0, float(v.y))
"""
    assert run(device, text, noise(2, 2), format_="rgb32f", n=-7, on=True, v=(1, 5))[0, 0].tolist() == [-7, 1, 5]
