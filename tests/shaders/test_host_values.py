"""Values that hosts give to shaders: they are uniforms, so that a text may use their names for something else."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import passgraph as pg
from passgraph.errors import InputError, KernelError
from passgraph.shaders.containers.libretro import read_preset

SIZE = (4, 2)
ISF = '/*{"ISFVSN": "2", "INPUTS": []}*/\n'
SHADERTOY = "void mainImage(out vec4 o, in vec2 p) {{ o = vec4({}); }}\n"


def effect_of(folder: Path, name: str, text: str) -> pg.ShaderEffect:
    (folder / name).write_text(text)
    return pg.load_shader(folder / name)


def frames(effect: pg.ShaderEffect, count: int = 1, **values: Any) -> list[list[float]]:
    """The first pixel of the first frames."""
    pictures = [pg.Input("frame", size=SIZE)] if effect.images else []
    given = {"frame": np.zeros((*SIZE[::-1], 4), np.float32)} if effect.images else {}
    with pg.compile(effect(*pictures, into=pg.target("o", "rgba32f"), **values), size=SIZE) as program:
        return [next(iter(program(**given).values()))[0, 0].tolist() for _ in range(count)]


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("float f(float TIME) { return TIME + 1.0; }\nvoid main() { gl_FragColor = vec4(f(2.0)); }", 3.0),
        ("void main() { vec2 RENDERSIZE = vec2(7.0); gl_FragColor = vec4(RENDERSIZE.x); }", 7.0),
        ("struct S { float TIME; };\nvoid main() { S s = S(5.0); gl_FragColor = vec4(s.TIME); }", 5.0),
        ("#define TIME (TIME + 2.0)\nvoid main() { gl_FragColor = vec4(TIME); }", 3.0),
        ("float DATE() { return 4.0; }\nvoid main() { gl_FragColor = vec4(DATE()); }", 4.0),
        ("uniform float TIME;\nvoid main() { gl_FragColor = vec4(TIME); }", 1.0),
        ("uniform vec2 RENDERSIZE;\nvoid main() { gl_FragColor = vec4(RENDERSIZE.x * 10.0 + RENDERSIZE.y); }", 42.0),
        ("void main() { gl_FragColor = vec4(PASSINDEX == 0 ? 8.0 : 9.0); }", 8.0),
    ],
)
def test_an_isf_may_use_the_names_of_its_host(text: str, expected: float, tmp_path: Path) -> None:
    effect = effect_of(tmp_path, "a.fs", ISF + text)
    assert frames(effect, **{name: 1.0 for name in effect.parameters if name == "time"}) == [[expected] * 4]


@pytest.mark.parametrize(
    ("before", "value", "expected"),
    [
        ("#define iTime (iTime * 2.0)\n", "iTime", 6.0),
        ("#define c 0.5\n#define drawn 1\n", "c", 0.5),
        ("uniform vec2 iResolution;\n", "iResolution.x * 10.0 + iResolution.y", 42.0),
        ("uniform vec3 iResolution; uniform float iTime;\n", "iResolution.z + iTime", 4.0),
        ("float iTime(float iDate) { return iDate; }\n", "iTime(9.0)", 9.0),
    ],
)
def test_a_shadertoy_may_use_the_names_of_its_host(before: str, value: str, expected: float, tmp_path: Path) -> None:
    effect = effect_of(tmp_path, "a.glsl", before + SHADERTOY.format(value))
    assert frames(effect, **{name: 3.0 for name in effect.parameters if name == "time"}) == [[expected] * 4]


def test_a_uniform_of_the_host_has_its_type(tmp_path: Path) -> None:
    said = r"a.glsl:1: uniform iTime is float in this format, got vec2; give it that type, or another name"
    with pytest.raises(KernelError, match=said):
        effect_of(tmp_path, "a.glsl", "uniform vec2 iTime;\n" + SHADERTOY.format("iTime.x"))


def test_a_function_of_an_mpv_shader_may_have_a_name_of_the_players(tmp_path: Path) -> None:
    code = "float random(vec2 v) { return v.x; }\nvec4 hook() { return vec4(random(vec2(6.0)), vec2(0.5), 1.0); }"
    text = f"//!HOOK MAIN\n//!BIND HOOKED\n{code}\n"
    assert frames(effect_of(tmp_path, "a.hook", text)) == [[6.0, 0.5, 0.5, 1.0]]


def test_no_time_has_passed_before_the_first_frame(tmp_path: Path) -> None:
    """ISF specification, version 2: TIMEDELTA is 0 in the first frame."""
    effect = effect_of(
        tmp_path, "a.fs", ISF + "void main() { gl_FragColor = vec4(TIMEDELTA, float(FRAMEINDEX), 0, 1); }"
    )
    assert frames(effect, 3, time_step=0.25) == [[0, 0, 0, 1], [0.25, 1, 0, 1], [0.25, 2, 0, 1]]


def test_shadertoy_counts_months_from_0(tmp_path: Path) -> None:
    """As JavaScript's Date.getMonth(), whose value the site hands on."""
    effect = effect_of(tmp_path, "a.glsl", SHADERTOY.format("iDate"))
    assert frames(effect, date=(2024.0, 3.0, 9.0, 60.0)) == [[2024.0, 2.0, 9.0, 60.0]]


def test_line_comments_may_stand_before_the_header_of_an_isf(tmp_path: Path) -> None:
    header = '/*{"ISFVSN": "2", "INPUTS": [{"NAME": "level", "TYPE": "float", "DEFAULT": 0.5}]}*/\n'
    text = f"// by me\n\n  // {{}} /* and another\n{header}void main() {{ gl_FragColor = vec4(level); }}"
    effect = effect_of(tmp_path, "a.fs", text)
    assert effect.kind == "ISF"
    assert frames(effect) == [[0.5] * 4]


# libretro


@pytest.mark.parametrize(
    ("entries", "sides"),
    [
        ("scale_type0 = source\nscale_type_x0 = viewport\nscale_type_y0 = absolute\nscale0 = 2.0",
         [("source", 2.0), ("source", 2.0)]),
        ("scale_type0 = source\nscale0 = 2.0\nscale_x0 = 3.0", [("source", 2.0), ("source", 2.0)]),
        ("scale_type_x0 = source\nscale_type_y0 = viewport\nscale0 = 2.0\nscale_y0 = 0.5",
         [("source", 2.0), ("viewport", 2.0)]),
        ("scale_type_x0 = absolute\nscale_x0 = 64\nscale_y0 = 3.0", [("absolute", 64.0), ("source", 3.0)]),
    ],
)  # fmt: skip
def test_a_scale_of_both_sides_wins_over_one_of_its_own(
    entries: str, sides: list[tuple[str, float]], tmp_path: Path
) -> None:
    """As RetroArch reads presets (video_shader_parse.c)."""
    preset = read_preset(f"shaders = 1\nshader0 = a.glsl\n{entries}\n", tmp_path / "a.glslp")
    assert preset.passes[0].sides is not None
    assert [(side.type, side.by) for side in preset.passes[0].sides] == sides


# mpv


HOOK = "\n//!HOOK MAIN\n//!BIND HOOKED\n{}vec4 hook() {{ return vec4({}); }}\n"


@pytest.mark.parametrize(
    ("parameters", "value", "given", "expected"),
    [
        ("//!PARAM k\n//!TYPE uint\n//!MINIMUM 0\n//!MAXIMUM 5\n2\n", "float(k >> 1u)", {}, 1.0),
        ("//!PARAM k\n//!TYPE uint\n2\n", "float(k)", {"k": 7}, 7.0),
        ("//!PARAM k\n//!TYPE DEFINE\n3\n", "float(k) / 2.0", {}, 1.5),
        ("//!PARAM k\n//!TYPE CONSTANT int\n3\n", "float(k)", {}, 3.0),
        ("//!PARAM mode\n//!TYPE ENUM int\nred\ngreen\nblue\n", "mode == blue ? 1.0 : 0.0", {"mode": "blue"}, 1.0),
        ("//!PARAM mode\n//!TYPE ENUM int\nred\ngreen\nblue\n", "mode == blue ? 1.0 : float(mode)", {}, 0.0),
        ("//!PARAM mode\n//!TYPE ENUM int\nred\ngreen\n", "mode == 1 ? 1.0 : 0.0", {"mode": 1}, 1.0),
    ],
)
def test_parameters_of_mpv_have_each_type(
    parameters: str, value: str, given: dict[str, Any], expected: float, tmp_path: Path
) -> None:
    """libplacebo's custom-shaders.md, directive TYPE."""
    effect = effect_of(tmp_path, "a.hook", parameters + HOOK.format("", value))
    assert frames(effect, **given) == [[expected] * 4]


def test_choices_of_mpv_are_numbers_in_conditions_and_macros(tmp_path: Path) -> None:
    chosen = "//!PARAM mode\n//!TYPE ENUM int\nred\ngreen\n"
    effect = effect_of(tmp_path, "a.hook", chosen + HOOK.format("//!WHEN mode green =\n", "1.0"))
    assert effect.parameters["mode"].choices == {"red": 0, "green": 1}
    assert [frames(effect, mode=mode)[0][0] for mode in ("red", "green")] == [0.0, 1.0]
    macro = "//!PARAM kind\n//!TYPE ENUM DEFINE\nPAL\nNTSC\n"
    code = "#if kind == NTSC\n#error no\n#elif kind == PAL\n#define own 2.0\n#endif\n"
    effect = effect_of(tmp_path, "b.hook", macro + HOOK.format(code, "own"))
    assert frames(effect) == [[2.0] * 4]


@pytest.mark.parametrize(
    ("parameters", "said"),
    [
        ("//!PARAM k\n//!TYPE float\n1.0\n//!PARAM k\n//!TYPE int\n1\n", "a.hook:4: .* there are two parameters 'k'"),
        ("//!PARAM k\n//!TYPE ENUM float\n1.0\n", "TYPE ENUM float is not read here; there are float, int, uint"),
        ("//!PARAM k\n//!TYPE ENUM int\na-b\n", "the choices of an ENUM are names, one a line, got 'a-b'"),
        ("//!PARAM k\n//!TYPE ENUM int\na\nb\n//!PARAM l\n//!TYPE ENUM int\nb\n",
         "choice 'b' has another number in a parameter above"),
    ],
)  # fmt: skip
def test_wrong_parameters_of_mpv_are_told(parameters: str, said: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=said):
        effect_of(tmp_path, "a.hook", parameters + HOOK.format("", "1.0"))


# Plain shaders of viewers


def test_the_uniforms_of_viewers_are_set(tmp_path: Path) -> None:
    """As glslViewer and the Book of Shaders name them."""
    text = (
        "uniform vec2 u_resolution;\nuniform highp float u_time; // seconds\nuniform int u_frame;\n"
        "uniform sampler2D u_tex0;\nuniform vec2 u_tex0Resolution;\nuniform vec2 u_mouse;\n"
        "void main() { gl_FragColor = vec4(gl_FragCoord.xy / u_resolution, u_time + float(u_frame), "
        "u_tex0Resolution.x + u_mouse.y + texture2D(u_tex0, vec2(0.5)).x); }"
    )
    effect = effect_of(tmp_path, "a.frag", text)
    assert effect.images == ("u_tex0",)
    assert list(effect.parameters) == ["time", "time_step", "u_mouse"]
    assert [str(note).split("\n")[0].split(":", 1)[1] for note in effect.notes] == [
        "1: u_resolution is the size of the result in pixels, as in glslViewer",
        "2: u_time is the time of the frame: time and time_step are its parameters, as in glslViewer",
        "3: u_frame is the number of the frame, as in glslViewer",
        "5: u_tex0Resolution is the size of u_tex0, as in glslViewer",
    ]
    made = frames(effect, 2, time=1.0, time_step=0.5, u_mouse=(0.0, 0.25))
    assert made == [[0.125, 0.75, 1.0, 4.25], [0.125, 0.75, 2.5, 4.25]]


def test_other_uniforms_are_parameters_whatever_they_are_called(tmp_path: Path) -> None:
    text = "uniform vec4 u_time; uniform float u_resolution;\nvoid main() { gl_FragColor = u_time * u_resolution; }"
    effect = effect_of(tmp_path, "a.frag", text)
    assert list(effect.parameters) == ["u_time", "u_resolution"]
    assert not effect.notes
    assert frames(effect, u_time=(1, 2, 3, 4), u_resolution=2.0) == [[2, 4, 6, 8]]
