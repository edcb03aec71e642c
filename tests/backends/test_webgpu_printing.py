"""The text of shaders in WGSL; no device is needed."""

from __future__ import annotations

import math
import re

import pytest

from passgraph.backends.webgpu.textures import stored_as
from passgraph.backends.webgpu.wgsl import WGSL
from passgraph.formats import FORMATS
from passgraph.graph.calls import kernel
from passgraph.language import scalar as s
from passgraph.language.facts import Facts, ImageFacts
from passgraph.language.lower import lower


def printer(source: str = "def one(color: Image) -> float: return color[0, 0].r", border: str = "clamp") -> WGSL:
    return WGSL(lower(kernel(source=source).program, Facts(images={"color": ImageFacts(border=border)})))


def module(source: str, border: str = "clamp") -> str:
    return printer(source, border).shader().text


@pytest.mark.parametrize(
    ("value", "bits"), [(math.inf, 0x7F800000), (-math.inf, 0xFF800000), (-0.0, 0x80000000), (1e-40, 0x116C2)]
)
def test_floats_that_wgsl_refuses_as_constants_are_made_from_bits(value: float, bits: int) -> None:
    assert printer().literal(s.Lit("float", value)) == f"bitcast<f32>({bits:#x}u | pg_nil)"


@pytest.mark.parametrize("product", ["color[0, 0].r * 0.0", "-0.0 * color[0, 0].r"])
def test_a_product_with_zero_is_not_left_to_compilers(product: str) -> None:
    text = module(f"def one(color: Image) -> float: return {product}")
    assert "| pg_nil)" in text and "* 0.0" not in text


def test_sums_that_other_sums_read_cannot_be_reordered() -> None:
    text = module("def one(color: Image) -> float:\n    c = color[0, 0]\n    return (c.r + c.g) - c.r")
    assert "bitcast<f32>(bitcast<u32>((t1.x + t1.y)) | pg_nil)" in text


@pytest.mark.parametrize(
    ("expression", "kept"),
    [
        ("c.r * c.g + c.r * c.b", ["t1.x * t1.y", "t1.x * t1.z"]),
        ("c.r * (1.0 - c.g) + c.b * c.g", ["1.0 - t1.y"]),
        ("sqrt(c.r) * sqrt(c.r)", ["sqrt(t1.x)"]),
        ("(c.r * 2.0) * 3.0", ["t1.x * 2.0"]),
        ("c.r + -c.g", ["-t1.y"]),
        ("c.r + c.g + c.b", []),
        ("c.r * c.g + c.b", []),
    ],
)
def test_what_compilers_would_combine_is_kept_apart(expression: str, kept: list[str]) -> None:
    text = module(f"def one(color: Image) -> float:\n    c = color[0, 0]\n    return {expression}")
    for part in kept:
        assert f"bitcast<u32>(({part})) | pg_nil)" in text or f"bitcast<u32>({part}) | pg_nil)" in text
    assert bool(kept) == ("| pg_nil)" in text)


@pytest.mark.parametrize("same", [
    "c.r - c.r", "c.r / c.r", "(c.r + 1.0) - (1.0 + c.r) + (c.g - c.g)", "c.r - max(c.r, c.r)",
    "clamp(c.r, c.r, c.r) / min(c.r, c.r)",
])  # fmt: skip
def test_a_difference_of_one_value_may_be_nan(same: str) -> None:
    text = module(f"def one(color: Image) -> float:\n    c = color[0, 0]\n    return {same}")
    assert re.search(r"[-/] bitcast<f32>\(bitcast<u32>\([\w.]+\) \| pg_nil2\)", text)


def test_a_choice_between_other_values_is_made_plainly() -> None:
    text = module("def one(color: Image) -> float: return 2.0 if color[0, 0].r < 0.5 else 3.0")
    assert "select(0u" not in text
    text = module("def one(color: Image) -> float:\n    r = color[0, 0].r\n    return -r if r < 0.0 else r")
    assert "((select(0u, 1u, (bitcast<f32>(bitcast<u32>(t1.x) | pg_nil2) < " in text


def test_a_result_that_is_stored_only_is_printed_plainly() -> None:
    text = module("def one(color: Image) -> float: return color[0, 0].r + 1.5")
    assert "= (t1.x + 1.5);" in text


def test_unequal_is_not_equal_turned_around() -> None:
    """wgpu makes ``!=`` false for NaN."""
    text = module("def one(color: Image) -> float: return 1.0 if color[0, 0].r != 0.5 else 0.0")
    assert "((select(0u, 1u, bitcast<f32>(bitcast<u32>(t1.x) | pg_nil2) == 0.5) | pg_nil) == 0u)" in text


def test_operations_on_constants_alone_are_left_to_the_device() -> None:
    program = lower(kernel(source="def one(color: Image) -> float: return color[0, 0].r").program, Facts())
    made = s.Op(s.Val("int", 90), "add", "int", (s.Lit("int", 2**31 - 1), s.Lit("int", 1)))
    assert WGSL(program).operation(made, ["2147483647", "1"]) == "(bitcast<i32>(bitcast<u32>(2147483647) | pg_nil) + 1)"


def test_this_pixel_is_read_without_a_border_rule() -> None:
    text = module("def one(color: Image) -> float: return color[0, 0].r", "repeat")
    assert "textureSampleLevel(pg_image0, pg_nearest, vec2<f32>(pg_here0.x, pg_here0.y), 0.0)" in text
    assert "pg_near_mod" not in text


def test_a_zero_border_tests_the_sides_that_are_left() -> None:
    text = module("def one(color: Image) -> float: return color[-1, 0].r", "zero")
    assert "(pg_pixel.x + (-1)) >= 0" in text and "< pg_size0.x" not in text


@pytest.mark.parametrize(
    ("name", "has_norm16", "stored"),
    [
        ("rgb8", False, "rgba8unorm"), ("rgb32f", False, "rgba32float"), ("r16", True, "r16unorm"),
        ("r16", False, "r32float"), ("rgb16", True, "rgba16unorm"), ("rgba8_srgb", False, "rgba8unorm"),
        ("depth32f", True, "depth32float"), ("depth32f_stencil8", True, "depth32float-stencil8"),
    ],
)  # fmt: skip
def test_a_format_that_webgpu_lacks_is_stored_wider(name: str, has_norm16: bool, stored: str) -> None:
    assert stored_as(FORMATS[name], has_norm16).name == stored


def test_the_entries_of_a_table_are_parameters() -> None:
    """Compilers take a minute for a variable of a thousand entries."""

    def text(count: int) -> str:
        entries = ", ".join(f"{number}.5" for number in range(count))
        return module(f"T = ({entries})\ndef one(color: Image) -> float: return T[int(color[0, 0].r)]")

    assert "var<private>" not in text(4)
    assert len(text(1000)) < len(text(4)) + 16  # only digits of its length
