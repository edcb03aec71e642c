"""Pixel passes of the gl backend against the reference."""

from __future__ import annotations

import numpy as np
import pytest

import passgraph as pg
from passgraph import Image, vec4
from passgraph.language.borders import border_place
from passgraph.verify.compare import compare

pytestmark = pytest.mark.gl
PICTURE = np.random.default_rng(7).random((6, 9, 4), np.float32)


def run(
    source: str, backend: str = "gl", picture: np.ndarray = PICTURE, border: str = "clamp", **kernel: object
) -> np.ndarray:
    with pg.compile(output(source, border, **kernel), backend=backend, non_finite="keep") as program:
        return np.asarray(program(color=picture)["out"])


def check(source: str, picture: np.ndarray = PICTURE, border: str = "clamp") -> None:
    """What the oracle allows; of values that are only moved, that is the reference's alone."""
    (report,) = compare(output(source, border), ["gl"], color=picture).backends
    assert report.within_bounds, report.failed or str(report.first_divergence)


def output(source: str, border: str, **kernel: object) -> pg.Target:
    made = pg.kernel(source=source)
    channels = sum({"float": 1, "vec2": 2, "vec3": 3, "vec4": 4}[str(r.type)] for r in made.program.results)
    into = pg.target("out", format=("r32f", "rg32f", "rgb32f", "rgba32f")[channels - 1])
    return made(pg.Input("color").border(border), into=into, **kernel)


@pytest.mark.parametrize("border", ["clamp", "zero", "repeat", "mirror", "reflect-101"])
@pytest.mark.parametrize("offset", ["-1, 0", "1, 0", "0, -2", "0, 3", "-20, 15", "40, -31"])
def test_offsets_follow_the_border_rule(border: str, offset: str) -> None:
    check(f"def one(color: Image) -> vec4: return color[{offset}]", border=border)


#: Ends of int, multiples of what the sizes below divide, places whose nearest float is in another period.
FAR = (-(2**31), 2**31 - 1, -(2**31) + 7, 2**31 - 64, 2**24 + 1, -(2**24) - 1, 3 * 2**21 - 1, 25_200_000, -1_000_001, 0)


@pytest.mark.sampled
@pytest.mark.parametrize("border", ["repeat", "mirror", "reflect-101"])
@pytest.mark.parametrize("size", [1, 2, 3, 41, 256, 1001, 8191])
def test_any_int_finds_its_texel_by_a_periodic_rule(border: str, size: int) -> None:
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
        with pg.compile(made, backend="gl") as program:
            got = program(color=columns)["out"][..., 0]
        at = np.array(FAR, np.int64)[:, None] + (np.arange(1024) - 512) * step
        at = (at + 2**31) % 2**32 - 2**31
        np.testing.assert_array_equal(got, border_place(border, at, size))


@pytest.mark.parametrize("border", ["repeat", "mirror", "reflect-101"])
@pytest.mark.parametrize("offset", [3, 2**20, 2**20 + 1, 2**30 + 5, -(2**31) + 1])
def test_any_offset_finds_its_texel_by_a_periodic_rule(border: str, offset: int) -> None:
    columns = np.arange(23, dtype=np.float32).reshape(1, 23)
    got = run(f"def one(color: Image) -> float: return color[{offset}, {offset}].r", "gl", columns, border)[..., 0]
    np.testing.assert_array_equal(got[0], border_place(border, np.arange(23) + offset, 23))


@pytest.mark.parametrize("border", ["clamp", "zero", "repeat", "mirror", "reflect-101"])
def test_positions_follow_the_border_rule(border: str) -> None:
    check("def one(color: Image) -> vec4: return color.texel(pixel() * 5 - 20)", border=border)


@pytest.mark.parametrize("border", ["clamp", "zero", "repeat", "mirror", "reflect-101"])
def test_offsets_bounded_by_a_loop_follow_the_border_rule(border: str) -> None:
    source = """
def one(color: Image) -> vec4:
    total = vec4(0.0)
    for i in range(100):
        if i > 92:
            break
        total = total + color[i - 46, 46 - i]
    return total
"""
    check(source, border=border)


def test_row_0_is_on_top() -> None:
    got = run("def one(color: Image) -> vec2: return vec2(pixel())")
    assert got[0, 0].tolist() == [0, 0] and got[5, 8].tolist() == [8, 5]


def test_sizes_are_width_and_height() -> None:
    got = run("def one(color: Image) -> vec4: return vec4(vec2(color.size), vec2(output_size()))")
    assert got[0, 0].tolist() == [9, 6, 9, 6]


def test_three_channels_are_written_and_read() -> None:
    check("def one(color: Image) -> vec3: return color[0, 0].bgr")


@pg.kernel
def both(color: Image) -> tuple[vec4, float]:
    return color[0, 0], color[0, 0].g


def test_several_targets_are_written_at_once() -> None:
    first, second = both(pg.Input("color"), into=(pg.target("a", format="rgba32f"), pg.target("b", format="r32f")))
    with pg.compile([first, second], backend="gl") as program:
        result = program(color=PICTURE)
    assert np.array_equal(result["a"], PICTURE) and np.array_equal(result["b"], PICTURE[..., 1:2])


@pytest.mark.parametrize("format_", ["rgba8", "rgba16", "rgba16f", "rgb8", "rg16f", "r16"])
def test_stored_values_are_the_reference_s(format_: str) -> None:
    channels = {"rgba": 4, "rgb": 3, "rg": 2, "r": 1}[format_.rstrip("0123456789f")]
    kind = {1: "float", 2: "vec2", 3: "vec3", 4: "vec4"}[channels]
    kernel = pg.kernel(source=f"def one(color: Image) -> {kind}: return color[0, 0].{'rgba'[:channels]}")
    target = kernel(pg.Input("color", format="rgba32f"), into=pg.target("out", format=format_))
    results = []
    for backend in ("gl", "reference"):
        with pg.compile(target, backend=backend) as program:
            results.append(program(color=PICTURE)["out"])
    assert np.array_equal(*results)


def test_nan_checks_survive_the_compiler() -> None:
    picture = np.array([[[np.nan, np.inf, -np.inf, 1.0]]], np.float32)
    source = """
def one(color: Image) -> vec4:
    c = color[0, 0]
    negated = 1.0 if not (c.r < 1.0) else 0.0
    return vec4(1.0 if isnan(c.r) else 0.0, 1.0 if c.r != c.r else 0.0, 1.0 if isinf(c.b) else 0.0, negated)
"""
    assert run(source, picture=picture).ravel().tolist() == [1.0, 1.0, 1.0, 1.0]


def test_an_infinite_constant_is_infinite() -> None:
    source = "def one(color: Image) -> vec2: return vec2(float_from_bits(0x7F800000), float_from_bits(-8388608))"
    assert run(source)[0, 0].tolist() == [np.inf, -np.inf]


def test_float_to_int_saturates_and_nan_is_0() -> None:
    picture = np.array([[[3e9, -3e9, np.nan, -1.5]]], np.float32)
    source = """
def one(color: Image) -> vec4:
    c = color[0, 0]
    return vec4(1.0 if int(c.r) == 2147483647 else 0.0, 1.0 if int(c.g) == -2147483648 else 0.0,
                float(int(c.b)), float(int(c.a)))
"""
    assert run(source, picture=picture).ravel().tolist() == [1.0, 1.0, 0.0, -1.0]


@pytest.mark.parametrize("operator", ["//", "%"])
def test_int_division_floors_as_in_python(operator: str) -> None:
    a, b = np.meshgrid(np.arange(-9, 10), np.arange(-4, 5))
    picture = np.stack([a, b, a * 0, a * 0], -1).astype(np.float32)
    source = f"def one(color: Image) -> float: return float(int(color[0, 0].r) {operator} int(color[0, 0].g))"
    check(source, picture=picture)


def test_the_smallest_int_divides_without_a_trap() -> None:
    picture = np.array([[[-(2.0**31), -1.0, 0.0, 0.0]]], np.float32)
    source = "def one(color: Image) -> float: return float(int(color[0, 0].r) // int(color[0, 0].g))"
    assert run(source, picture=picture).ravel().tolist() == [-(2.0**31)]


def test_angle_reduction_keeps_its_precision() -> None:
    picture = np.linspace(-8000, 8000, 64, dtype=np.float32).reshape(4, 4, 4)
    check("def one(color: Image) -> vec4: return sin(color[0, 0])", picture=picture)


def test_halves_are_rounded_to_even() -> None:
    picture = np.array([[[0.5, 1.5, 2.5, -0.5]]], np.float32)
    got = run("def one(color: Image) -> vec4: return round(color[0, 0])", picture=picture)
    assert got.ravel().tolist() == [0.0, 2.0, 2.0, 0.0]


def test_loops_that_stay_loops_break_and_continue() -> None:
    source = """
def one(color: Image, stop: int = 70) -> float:
    total = 0.0
    for i in range(0, 100):
        if i % 3 == 1:
            continue
        if i > stop:
            break
        total = total + float(i)
    return total
"""
    expected = sum(i for i in range(72) if i % 3 != 1 and i <= 70)
    assert run(source)[0, 0, 0] == expected


def test_loops_count_down() -> None:
    source = """
def one(color: Image) -> float:
    total = 0.0
    for i in range(200, -3, -7):
        total = total * 0.5 + float(i)
    return total
"""
    check(source)


def test_uniform_arrays_are_indexed_at_run_time() -> None:
    weights = tuple(float(w) for w in range(9))
    source = "def one(color: Image, w: Array[float, 9]) -> float: return w[pixel().x]"
    assert run(source, w=weights)[0, :, 0].tolist() == list(weights)


def test_long_uniform_arrays_are_indexed_at_run_time() -> None:
    weights = tuple(float(w) for w in range(1000))
    source = "def one(color: Image, w: Array[float, 1000]) -> float: return w[pixel().x * 100 + 3]"
    assert run(source, w=weights)[0, :, 0].tolist() == [100.0 * x + 3 for x in range(9)]


def test_ints_and_bools_are_uniforms() -> None:
    source = """
def one(color: Image, n: int, on: bool, v: ivec2) -> vec3:
    return vec3(float(n), 1.0 if on else 0.0, float(v.y))
"""
    assert run(source, n=-7, on=True, v=(1, 5))[0, 0].tolist() == [-7, 1, 5]


def test_constant_tables_are_indexed_at_run_time() -> None:
    source = """
TABLE = (1.0, 0.1, -2.5, 1e-40, 4.0)

def one(color: Image) -> float:
    return TABLE[pixel().x % 5]
"""
    got = run(source)[0, :, 0]
    np.testing.assert_allclose(got[:5], np.array([1.0, 0.1, -2.5, 0.0, 4.0], np.float32), atol=1e-38)
