"""The text of shaders; no device is needed."""

from __future__ import annotations

import math

import pytest

from passgraph.backends.gl.capabilities import Capabilities
from passgraph.backends.gl.counts_source import counting_dialect
from passgraph.backends.gl.dialect import GLSL_330, dialect_of
from passgraph.backends.gl.glsl import GLSL
from passgraph.graph.calls import kernel
from passgraph.language import scalar as s
from passgraph.language.lower import Facts, ImageFacts, lower


def printer(source: str = "def one(color: Image) -> float: return color[0, 0].r", **facts: object) -> GLSL:
    return GLSL(lower(kernel(source=source).program, Facts(**facts)))  # type: ignore[arg-type]


def shader(source: str, border: str = "clamp") -> str:
    return printer(source, images={"color": ImageFacts(border=border)}).shader().text


def test_float_literals_have_all_digits() -> None:
    assert printer().literal(s.Lit("float", 0.1)) == "0.10000000149011612"


def test_negative_literals_stand_in_brackets() -> None:
    assert printer().literal(s.Lit("float", -1.5)) == "(-1.5)"
    assert printer().literal(s.Lit("int", -3)) == "(-3)"


def test_the_smallest_int_is_written_as_a_difference() -> None:
    assert printer().literal(s.Lit("int", -(2**31))) == "(-2147483647 - 1)"


@pytest.mark.parametrize(
    ("value", "bits"),
    [
        (math.inf, "2139095040"),
        (-math.inf, "(-8388608)"),
        (math.nan, "2143289344"),
        (-0.0, "(-2147483647 - 1)"),
        (1e-40, "71362"),
        (1e39, "2139095040"),
    ],
)
def test_what_has_no_literal_is_made_from_bits(value: float, bits: str) -> None:
    assert printer().literal(s.Lit("float", value)) == f"intBitsToFloat({bits})"


@pytest.mark.parametrize("product", ["color[0, 0].r * 0.0", "-0.0 * color[0, 0].r"])
def test_a_product_with_zero_is_not_left_to_compilers(product: str) -> None:
    text = shader(f"def one(color: Image) -> float: return {product}")
    assert "* pg_hidden(" in text and "* 0.0" not in text


def test_this_pixel_is_read_without_a_border_rule() -> None:
    text = shader("def one(color: Image) -> vec4: return color[0, 0]")
    assert "textureLod(pg_image0, vec2(pg_here.x, pg_here.y), 0.0)" in text and "?" not in text


def test_a_clamped_offset_is_left_to_the_sampler() -> None:
    text = shader("def one(color: Image) -> vec4: return color[-1, 0]")
    assert "textureLod(pg_image0, vec2((pg_here.x + ((-1.0) * pg_texel0.x)), pg_here.y), 0.0)" in text


def test_float_values_are_precise_where_the_driver_can() -> None:
    text = shader("def one(color: Image) -> float: return color[0, 0].r * 2.0")
    assert "PRECISE float" in text and "#define PRECISE precise" in text


def test_a_value_compared_with_itself_asks_for_nan_by_its_bits() -> None:
    text = shader("def one(color: Image) -> float:\n    c = color[0, 0].r\n    return 0.0 if c != c else c")
    assert "pg_isnan(t1.x)" in text


def test_only_called_functions_are_printed() -> None:
    text = shader("def one(color: Image) -> float: return float(int(color[0, 0].r))")
    assert "int pg_to_int" in text and "bool pg_isnan" in text and "pg_border_mirror" not in text


def test_uniform_blocks_are_declared_only_when_used() -> None:
    assert "pg_floats" not in shader("def one(color: Image) -> vec4: return color[0, 0]")
    text = shader("def one(color: Image, w: Array[float, 5]) -> float: return color[0, 0].r * w[4]")
    assert "uniform float pg_floats[5];" in text and "pg_floats[4]" in text


def test_long_uniform_blocks_are_packed_into_vectors() -> None:
    text = shader("def one(color: Image, w: Array[float, 1001]) -> float: return color[0, 0].r * w[1000]")
    assert "uniform vec4 pg_floats[251];" in text and "pg_floats[250].x" in text


def test_a_generated_line_knows_its_kernel_line() -> None:
    source = "def one(color: Image) -> float:\n    c = color[0, 0].r\n    d = c * 3.0\n    return sqrt(d)"
    listing = printer(source).shader()
    lines = listing.text.splitlines()
    number = 1 + next(i for i, line in enumerate(lines) if "* 3.0" in line)
    assert listing.span_at(number).line == 3


def test_lines_of_the_prelude_belong_to_the_kernel_line_that_calls_it() -> None:
    source = "def one(color: Image) -> float:\n    c = color[0, 0].r * 2.0\n    return sin(c)"
    listing = printer(source).shader()
    assert {span.file for span in listing.spans} == {"<kernel text>"}


def es_shader(source: str, version: tuple[int, int], *extensions: str) -> str:
    program = lower(kernel(source=source).program, Facts(images={"color": ImageFacts()}))
    dialect = dialect_of(Capabilities(True, version, frozenset(extensions)))
    return GLSL(program, dialect=dialect).shader().text


@pytest.mark.parametrize(
    ("version", "extensions", "first", "precise"),
    [
        ((3, 0), (), "#version 300 es", ""),
        ((3, 1), (), "#version 300 es", ""),
        ((3, 1), ("GL_EXT_gpu_shader5",), "#version 310 es", " precise"),
        ((3, 2), (), "#version 320 es", " precise"),
    ],
)
def test_opengl_es_is_told_its_precisions(
    version: tuple[int, int], extensions: tuple[str, ...], first: str, precise: str
) -> None:
    lines = es_shader("def one(color: Image) -> float: return color[0, 0].r * 2.0", version, *extensions).splitlines()
    assert lines[0] == first and f"#define PRECISE{precise}" in lines
    assert [line for line in lines if line.startswith("precision")] == [
        "precision highp float;", "precision highp int;", "precision highp sampler2D;",
    ]  # fmt: skip


def test_without_precise_the_least_of_two_asks_for_nan() -> None:
    source = "def one(color: Image) -> float: return min(color[0, 0].r, color[0, 0].g)"
    assert "pg_isnan(t1.x) ? t1.x" in es_shader(source, (3, 0))
    assert "pg_isnan" not in es_shader(source, (3, 2))


def test_the_size_of_an_int_is_not_the_builtin() -> None:
    """Compilers take abs as never negative, also of the lowest int; NVIDIA's then drops a clamp's lower end."""
    text = shader("def one(color: Image) -> float: return float(abs(int(color[0, 0].r)))")
    assert "= pg_abs(" in text and "= abs(" not in text


def test_what_does_not_hold_is_not_left_to_compilers() -> None:
    """NVIDIA's turns !(a < b) into a >= b, which is false for NaN."""
    text = shader("def one(color: Image) -> float: return 0.0 if not (color[0, 0].r < 1.0) else 1.0")
    assert " ^^ true)" in text and "!" not in text


def test_the_fragment_shader_of_counts_asks_for_no_compute_shaders() -> None:
    """NVIDIA's compiler refuses the outputs of a shader that does."""
    for stage in ("compute", "fragment"):
        text = counting_dialect(GLSL_330, is_core=False, stage=stage).header
        assert ("compute" in text) == (stage == "compute") and "GL_ARB_shader_storage_buffer_object" in text
