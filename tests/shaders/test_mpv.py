"""mpv user shaders: hooks, sizes and conditions, held against NumPy and OpenCV."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import cv2
import moderngl
import numpy as np
import pytest
from original_mpv import MpvFile, Original

import passgraph as pg
from passgraph.graph.run_values import evaluated
from passgraph.shaders.containers.mpv import holds, rpn_formula, side_formula

BACKENDS = ["reference", "numpy", "gl", "opencl"]
SIZES: dict[str, Any] = {"MAIN": ("width", "height"), "OUTPUT": (("mul", "width", 2.0), ("mul", "height", 2.0))}
FRAME = np.random.default_rng(3).random((13, 17, 4)).astype(np.float32)

#: A pass that saves, one that reads it at half the size, and one that doubles the picture.
CHAIN = """//!HOOK MAIN
//!BIND HOOKED
//!SAVE GREY
//!DESC grey
vec4 hook() { return vec4(dot(HOOKED_tex(HOOKED_pos).rgb, vec3(0.25, 0.5, 0.25))); }

//!HOOK MAIN
//!BIND GREY
//!SAVE BELOW
vec4 hook() { return GREY_texOff(vec2(0.0, 1.0)); }

//!HOOK MAIN
//!BIND HOOKED
//!BIND BELOW
//!WIDTH HOOKED.w 2 *
//!HEIGHT HOOKED.h 2 *
//!WHEN OUTPUT.w HOOKED.w 1.2 * >
vec4 hook() { return vec4(HOOKED_tex(HOOKED_pos).r, BELOW_tex(BELOW_pos).g, 0.0, 1.0); }
"""


def made(folder: Path, text: str, backend: str = "numpy", **values: Any) -> np.ndarray[Any, Any]:
    file = folder / "chain.glsl"
    file.write_text(text)
    graph = pg.load_shader(file)(pg.Input("frame"), into=pg.target("out", "rgba32f"), **values)
    with pg.compile(graph, backend=backend) as program:
        return program(frame=FRAME)["out"]


@pytest.mark.parametrize("backend", BACKENDS)
def test_passes_save_read_and_scale_with_rows_from_the_top(tmp_path: Path, backend: str) -> None:
    seen = made(tmp_path, CHAIN, backend)
    grey = FRAME[:, :, :3] @ np.array([0.25, 0.5, 0.25], np.float32)
    below = grey[np.minimum(np.arange(13) + 1, 12)].astype(np.float16).astype(np.float32)
    for channel, plane in ((0, FRAME[:, :, 0]), (1, below)):
        doubled = cv2.resize(plane, (34, 26), interpolation=cv2.INTER_LINEAR)
        np.testing.assert_allclose(seen[:, :, channel], doubled, atol=2e-3)


def test_a_pass_whose_condition_fails_is_left_out(tmp_path: Path) -> None:
    assert made(tmp_path, CHAIN, output_scale=1.0).shape == (13, 17, 4)
    assert made(tmp_path, CHAIN, output_scale=1.5).shape == (26, 34, 4)


def test_luma_alone_is_changed_by_a_hook_of_luma(tmp_path: Path) -> None:
    text = "//!HOOK LUMA\n//!BIND HOOKED\nvec4 hook() { return HOOKED_tex(HOOKED_pos) + 0.25; }\n"
    np.testing.assert_allclose(made(tmp_path, text)[:, :, :3], FRAME[:, :, :3] + 0.25, atol=2e-3)


def test_parameters_have_their_ranges(tmp_path: Path) -> None:
    text = (
        "//!PARAM strength\n//!DESC how much\n//!TYPE float\n//!MINIMUM 0.0\n//!MAXIMUM 1.0\n0.5\n\n"
        "//!HOOK MAIN\n//!BIND HOOKED\nvec4 hook() { return HOOKED_tex(HOOKED_pos) * strength; }\n"
    )
    np.testing.assert_allclose(made(tmp_path, text), FRAME * 0.5, atol=1e-3)
    np.testing.assert_allclose(made(tmp_path, text, strength=0.25), FRAME * 0.25, atol=1e-3)
    with pytest.raises(pg.InputError, match=r"'strength' is from 0.0 to 1.0, got 3.0"):
        made(tmp_path, text, strength=3.0)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("//!HOOK MAIN\n//!COMPUTE 8 8\nvoid hook() {}", r":2: a compute shader \(//!COMPUTE\) is not read here"),
        ("//!HOOK ALPHA\n//!BIND HOOKED\nvec4 hook() { return vec4(0.0); }", ":1: //!HOOK ALPHA is not read here"),
        ("//!HOOK MAIN\n//!BIND HOOKED; void x\nvec4 hook() { return vec4(0.0); }", ":2: //!BIND is a name"),
        ("//!HOOK MAIN\n//!SAVE\nvec4 hook() { return vec4(0.0); }", ":2: //!SAVE is a name that shaders can write"),
        ("//!PARAM 1x\n0\n//!HOOK MAIN\nvec4 hook() { return vec4(0.0); }", ":1: //!PARAM is a name"),
        ("//!PARAM frame\n0\n//!HOOK MAIN\nvec4 hook() { return vec4(0.0); }", "frame is a value of the player's"),
        ("//!PARAM k\n//!TYPE int\nnan\n//!HOOK MAIN\nvec4 hook() { return vec4(k); }", "must be a number, got 'nan'"),
        ("//!PARAM k\n1e999\n//!HOOK MAIN\nvec4 hook() { return vec4(k); }", "must be a number, got '1e999'"),
        ("//!HOOK MAIN\n//!NONSENSE 1\nvec4 hook() { return vec4(0.0); }", ":2: //!NONSENSE is no directive"),
        ("//!HOOK MAIN\n//!BIND NEVER\nvec4 hook() { return NEVER_tex(NEVER_pos); }", "no pass before has saved it"),
        ("//!HOOK MAIN\n//!WIDTH 2 *\nvec4 hook() { return vec4(0.0); }", "too few operands"),
        ("//!HOOK MAIN\n//!WIDTH OTHER.w\nvec4 hook() { return vec4(0.0); }", "has 'OTHER.w'"),
        ("//!HOOK MAIN\n//!WIDTH 1e30\nvec4 hook() { return vec4(0.0); }", "has '1e30'"),
        ("//!HOOK MAIN\n\n\nvec4 hook() { return 1.0; }", r"chain.glsl:4: "),
    ],
)
def test_what_is_wrong_is_told_with_its_line(tmp_path: Path, text: str, said: str) -> None:
    with pytest.raises(pg.PassgraphError, match=said):
        made(tmp_path, text)


@pytest.mark.parametrize(
    ("text", "expected"),
    [("1 0 >", True), ("1 !", False), ("MAIN.w MAIN.h >", True), ("OUTPUT.w MAIN.w / 2 =", True), ("7 4 % 3 =", True),
     ("1 0 %", False)],
)  # fmt: skip
def test_conditions_in_postfix_form(text: str, expected: bool) -> None:
    assert holds(text, SIZES, "here") is expected


def test_sizes_in_postfix_form() -> None:
    assert rpn_formula("MAIN.w 2 / 1 +", SIZES, "here") == ("add", ("div", "width", 2.0), 1.0)


@pytest.mark.parametrize(
    ("text", "expected"),
    [("MAIN.w 2 /", 7), ("MAIN.w 2 / 0.25 -", 6), ("OUTPUT.w MAIN.w 2 * < 5 * OUTPUT.w MAIN.w 2 * = 9 * +", 9),
     ("MAIN.w 5 %", 3), ("twice MAIN.w *", 26)],
)  # fmt: skip
def test_sides_compare_and_are_rounded(text: str, expected: int) -> None:
    assert evaluated(side_formula(text, SIZES, "here", {"twice": 2.0}), (13, 17)) == expected


#: Every way in which a pass may differ from a plain one: half the size of odd sides, fewer components, a gather, places
#: that passes move and that a later one puts back, sizes, curves, a parameter in a condition.
FIELD = """//!PARAM strength
//!TYPE float
//!MINIMUM 0
//!MAXIMUM 1
0.75

//!HOOK {0}
//!BIND HOOKED
//!SAVE HALF
//!WIDTH HOOKED.w 2 /
//!HEIGHT HOOKED.h 2 /
//!COMPONENTS 2
vec4 hook() { return HOOKED_texOff(vec2(0.5, -1.0)).xxxx + 0.125 + float(HOOKED_size.y) * vec4(0.01); }

//!HOOK {0}
//!BIND HOOKED
//!BIND HALF
//!WIDTH OUTPUT.w HOOKED.w 2 * > OUTPUT.w * HOOKED.w 2 * +
//!HEIGHT HOOKED.h
//!WHEN strength 0.5 >
//!OFFSET -0.5 0.25
vec4 hook() {
    vec4 near = HOOKED_gather(HOOKED_pos, 0) + HALF_tex(HALF_pos) * strength;
#if defined(HOOKED_raw) && __VERSION__ >= 400
    const ivec2 around[4] = ivec2[4](ivec2(1, 0), ivec2(-1, 1), ivec2(0), ivec2(2, -1));
    near.y += textureGatherOffset(HOOKED_raw, HOOKED_pos, ivec2(-2, 1), 0).z;
    near.xz -= textureGatherOffsets(HOOKED_raw, HOOKED_pos + 0.25 * HOOKED_pt, around, 0).yw * vec2(0.5, 0.25);
#endif
    return vec4(near.xyz / 3.0, 1.0);
}

//!HOOK {0}
//!BIND HOOKED
//!WHEN strength 0.5 <
vec4 hook() { return vec4(0.0); }

//!HOOK {0}
//!BIND HOOKED
//!WIDTH HOOKED.w 2 /
//!OFFSET {1}
vec4 hook() {
    vec4 c = linearize(HOOKED_tex(HOOKED_pos - 0.25 * tex_offset * HOOKED_pt));
    return delinearize(c * 0.5) + vec4(input_size / target_size * 0.1, 0.0, 0.0);
}
"""


@pytest.mark.sampled
@pytest.mark.parametrize(
    ("hook", "offset"),
    [
        ("MAIN", "0.25 0"),
        ("MAIN", "ALIGN"),
        ("LUMA", "0 -1"),
        ("CHROMA", "0.5 0"),
        ("LUMA\n//!HOOK CHROMA\n//!HOOK RGB", "0 0.5"),
    ],
)
@pytest.mark.parametrize("backend", ["numpy", "gl"])
def test_passes_draw_what_the_original_draws(
    tmp_path: Path, context: moderngl.Context, hook: str, offset: str, backend: str
) -> None:
    seen = made(tmp_path, FIELD.replace("{0}", hook).replace("{1}", offset), backend)
    expected = Original(context, MpvFile(tmp_path / "chain.glsl"), (17, 13), (34, 26)).draw(FRAME)
    assert seen.shape == expected.shape == (13, 17, 4)
    assert np.ptp(expected[:, :, 0]) > 0.1, "a plain picture shows nothing"
    np.testing.assert_allclose(seen, expected, atol=1e-3)


#: Planes, each with what the other has become, and the picture that they make behind them.
PLANES = """//!HOOK LUMA
//!BIND HOOKED
//!SAVE SMALL
//!WIDTH HOOKED.w 2 /
//!HEIGHT HOOKED.h 2 /
vec4 hook() { return HOOKED_tex(HOOKED_pos) * 0.5; }

//!HOOK CHROMA
//!HOOK LUMA
//!HOOK RGB
//!BIND HOOKED
#ifdef LUMA_raw
vec4 hook() { return LUMA_texOff(vec2(1.0, 0.0)); }
#else
vec4 hook() { return HOOKED_tex(HOOKED_pos).yxzw; }
#endif

//!HOOK MAIN
//!BIND MAIN
//!BIND SMALL
vec4 hook() { return vec4(MAIN_tex(MAIN_pos).bgr + SMALL_tex(SMALL_pos).x, 0.25); }

//!HOOK CHROMA
//!BIND HOOKED
//!BIND LUMA
//!WIDTH LUMA.w 2 *
vec4 hook() { return vec4(HOOKED_tex(HOOKED_pos).xy * 0.5 + LUMA_tex(LUMA_pos).x * 0.25, 7.0, 7.0); }
"""


def test_planes_are_changed_one_after_another_and_joined_before_the_picture(
    tmp_path: Path, context: moderngl.Context
) -> None:
    seen = made(tmp_path, PLANES)
    expected = Original(context, MpvFile(tmp_path / "chain.glsl"), (17, 13), (34, 26)).draw(FRAME)
    np.testing.assert_allclose(seen, expected, atol=2e-3)


def test_half_the_chroma_is_the_mean_of_four_pixels(tmp_path: Path) -> None:
    text = "//!HOOK CHROMA\n//!BIND HOOKED\nvec4 hook() { return vec4(vec2(HOOKED_size) / 256.0, 0.0, 0.0); }"
    half = made(tmp_path, text, chroma_scale=0.5)
    luma = FRAME[:, :, :3] @ np.array([0.2126, 0.7152, 0.0722], np.float32)
    np.testing.assert_allclose(half[:, :, 2] - luma, (9 / 256 - 0.5) * 1.8556, atol=2e-3)
    np.testing.assert_allclose(half[:, :, 0] - luma, (7 / 256 - 0.5) * 1.5748, atol=2e-3)
    frame = np.float32(np.random.default_rng(5).random((12, 16, 4)))
    (tmp_path / "same.glsl").write_text(text.replace("vec2(HOOKED_size) / 256.0", "HOOKED_tex(HOOKED_pos).xy"))
    graph = pg.load_shader(tmp_path / "same.glsl")(
        pg.Input("frame"), into=pg.target("out", "rgba32f"), chroma_scale=0.5
    )
    with pg.compile(graph) as program:
        seen = program(frame=frame)["out"]
    y = frame[:, :, :3] @ np.array([0.2126, 0.7152, 0.0722], np.float32)
    small = (frame[:, :, 2] - y).reshape(6, 2, 8, 2).mean((1, 3))
    expected = y + cv2.resize(small, (16, 12), interpolation=cv2.INTER_LINEAR)
    np.testing.assert_allclose(seen[:, :, 2], expected, atol=2e-3)


def hexadecimal(values: np.ndarray[Any, Any]) -> str:
    return values.tobytes().hex()


TABLE = np.random.default_rng(9).random((5, 6, 4)).astype(np.float32)
TEXTURES = {
    "rgba16f": ("6 5", hexadecimal(TABLE), "texture(TABLE, {0})"),
    "rgba32f": ("6 5", hexadecimal(TABLE), "texture(TABLE, {0}) + texelFetch(TABLE, ivec2(5, 4), 0)"),
    "r8": ("7 3", hexadecimal(np.arange(21, dtype=np.uint8) * 12), "vec4(texture(TABLE, {0}).x)"),
    "rg32f": ("3 2 4", hexadecimal(np.arange(48, dtype=np.float32) / 48), "texture(TABLE, vec3({0}, 0.3)).xyxy"),
}


@pytest.mark.parametrize("format", TEXTURES)
@pytest.mark.parametrize("said", ["//!FILTER NEAREST\n", "//!BORDER REPEAT\n"])
def test_textures_within_a_file_are_read_as_the_original_reads_them(
    tmp_path: Path, context: moderngl.Context, format: str, said: str
) -> None:
    size, digits, read = TEXTURES[format]
    if len(size.split()) == 3 and "NEAREST" not in said:
        said = "//!FILTER LINEAR\n"
    text = f"//!TEXTURE TABLE\n//!SIZE {size}\n//!FORMAT {format}\n{said}{digits[:64]}\n{digits[64:].upper()}\n\n"
    place = "HOOKED_pos * 1.7 - 0.3"
    text += f"//!HOOK MAIN\n//!BIND HOOKED\n//!BIND TABLE\nvec4 hook() {{ return {read.format(place)}; }}\n"
    seen = made(tmp_path, text)
    expected = Original(context, MpvFile(tmp_path / "chain.glsl"), (17, 13), (34, 26)).draw(FRAME)
    np.testing.assert_allclose(seen, expected, atol=6e-3)


@pytest.mark.parametrize(
    ("head", "said"),
    [
        ("//!SIZE 99999 99999\n//!FORMAT rgba32f\n00", r":1: //!TEXTURE T: SIZE has sides from 1 to 16384"),
        ("//!SIZE 16384 16384\n//!FORMAT rgba32f\n00", r"at most 4194304 texels"),
        ("//!SIZE 2048 2048\n//!FORMAT rgba32f\n00", r"ask for 134217728 hexadecimal digits, got 2"),
        ("//!SIZE 0 4\n//!FORMAT r8\n", "SIZE has sides from 1"),
        ("//!SIZE 4\n//!FORMAT r8\n00000000", "SIZE is width and height, and the depth of a volume, got '4'"),
        ("//!SIZE -1 1\n//!FORMAT r8\n00", "SIZE is width and height"),
        ("//!FORMAT r8\n00", "SIZE is width and height"),
        ("//!SIZE 1 1\n//!FORMAT rgba8ui\n00000000", "FORMAT is such as rgba16f"),
        ("//!SIZE 1 1\n//!FORMAT r8\n0g", "must be hexadecimal digits"),
        ("//!SIZE 1 1\n//!FORMAT r8\n//!FILTER CUBIC\n00", "FILTER is one of LINEAR, NEAREST, got 'CUBIC'"),
        ("//!SIZE 1 1\n//!FORMAT r8\n//!STORAGE\n00", r"that passes write \(//!STORAGE\) is not read here"),
    ],
)
def test_textures_that_are_wrong_are_told_before_memory_is_asked_for(tmp_path: Path, head: str, said: str) -> None:
    text = f"//!TEXTURE T\n{head}\n//!HOOK MAIN\n//!BIND T\nvec4 hook() {{ return texture(T, vec2(0.5)); }}\n"
    with pytest.raises(pg.InputError, match=said):
        made(tmp_path, text)
