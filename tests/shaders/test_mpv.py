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
from passgraph.graph.formulas import evaluated
from passgraph.shaders.containers.mpv_header import holds, rpn_formula, side_formula

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
        ("//!HOOK CHROMA\n//!BIND HOOKED\nvec4 hook() { return vec4(0.0); }", ":1: //!HOOK CHROMA is not read here"),
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


@pytest.mark.parametrize(("hook", "offset"), [("MAIN", "0.25 0"), ("MAIN", "ALIGN"), ("LUMA", "0 -1")])
@pytest.mark.parametrize("backend", ["numpy", "gl"])
def test_passes_draw_what_the_original_draws(
    tmp_path: Path, context: moderngl.Context, hook: str, offset: str, backend: str
) -> None:
    seen = made(tmp_path, FIELD.replace("{0}", hook).replace("{1}", offset), backend)
    expected = Original(context, MpvFile(tmp_path / "chain.glsl"), (17, 13), (34, 26)).draw(FRAME)
    assert seen.shape == expected.shape == (13, 17, 4)
    assert np.ptp(expected[:, :, 0]) > 0.1, "a plain picture shows nothing"
    np.testing.assert_allclose(seen, expected, atol=1e-3)
