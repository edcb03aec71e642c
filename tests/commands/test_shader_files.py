"""Shader files on the command line."""

from __future__ import annotations

import json
from pathlib import Path

import click
import numpy as np
import pytest

import passgraph as pg
from passgraph.commands.apply import apply, command_of
from passgraph.commands.compare import compare
from passgraph.commands.entry import run
from passgraph.commands.inspect import inspect
from passgraph.commands.named import named_effect
from passgraph.commands.plan import plan
from passgraph.commands.shader_files import RESERVED

ISF = """/*{
  "DESCRIPTION": "Brighter, in one of two ways",
  "INPUTS": [
    {"NAME": "inputImage", "TYPE": "image"},
    {"NAME": "mask", "TYPE": "image"},
    {"NAME": "amount", "TYPE": "float", "MIN": 0.0, "MAX": 2.0, "DEFAULT": 0.1, "LABEL": "how much brighter"},
    {"NAME": "size", "TYPE": "float", "MIN": 0.0, "MAX": 1.0, "DEFAULT": 0.0},
    {"NAME": "mode", "TYPE": "long", "VALUES": [3, 7], "LABELS": ["add", "multiply"], "DEFAULT": 3},
    {"NAME": "flip", "TYPE": "bool", "DEFAULT": 0},
    {"NAME": "tint", "TYPE": "color", "DEFAULT": [1, 1, 1, 1]}
  ]
}*/
void main() {
    vec4 c = IMG_THIS_PIXEL(inputImage) * tint + IMG_THIS_PIXEL(mask);
    c.rgb = mode == 3 ? c.rgb + amount + size : c.rgb * amount;
    if (flip) c.rgb = 1.0 - c.rgb;
    gl_FragColor = c + float(FRAMEINDEX) / 255.0 + 0.0 * TIME;
}"""
GENERATOR = (
    '/*{"INPUTS": [{"NAME": "level", "TYPE": "float", "DEFAULT": 0.25}]}*/ void main() { gl_FragColor = vec4(level); }'
)
SHADERS = Path(__file__).parents[2] / "docs" / "shaders"
IMAGE = "void mainImage(out vec4 color, in vec2 place) { color = vec4(0.0, 1.0, 0.0, 1.0); }"
FADE = """uniform float depth; // = 0.0
vec4 transition(vec2 p) { return mix(getFromColor(p), getToColor(p), progress) + depth; }"""


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    Path("bright.fs").write_text(ISF)
    Path("level.fs").write_text(GENERATOR)
    Path("fade.glsl").write_text(FADE)
    pg.save("gray.png", np.full((6, 9, 3), 51 / 255, np.float32))
    pg.save("white.png", np.ones((6, 9, 4), np.float32))
    return tmp_path


def applied(*arguments: str) -> list[float]:
    """The upper left pixel in steps of 8 bits, rounded."""
    assert run(["apply", *arguments, "-o", "out.png"]) == 0
    return [round(float(v) * 255) for v in pg.load("out.png")[0, 0]]


def test_a_file_s_parameters_are_options() -> None:
    assert applied("bright.fs", "gray.png", "--amount", "0.2")[:3] == [102, 102, 102]
    assert applied("bright.fs", "gray.png", "--mode", "multiply", "--amount", "2")[:3] == [102, 102, 102]
    assert applied("bright.fs", "gray.png", "--amount", "0", "--flip")[:3] == [204, 204, 204]
    assert applied("bright.fs", "gray.png", "--amount", "0", "--tint", "1,0.2,0,1")[:3] == [51, 10, 0]


def test_a_parameter_that_is_called_as_an_option_has_a_prefix() -> None:
    assert applied("bright.fs", "gray.png", "--amount", "0", "--shader-size", "0.2")[:3] == [102, 102, 102]
    assert applied("fade.glsl", "gray.png", "--progress", "0", "--shader-depth", "0.2")[:3] == [102, 102, 102]


def test_further_images_are_picture_parameters() -> None:
    assert applied("fade.glsl", "gray.png", "--to", "white.png", "--progress", "0.5")[:3] == [153, 153, 153]
    assert applied("bright.fs", "gray.png", "--mask", "gray.png", "--amount", "0")[:3] == [102, 102, 102]


def test_a_generator_makes_a_picture_of_a_size(capsys: pytest.CaptureFixture[str]) -> None:
    assert applied("level.fs", "--size", "7x3", "--level", "0.4")[:3] == [102, 102, 102]
    assert pg.load("out.png").shape[:2] == (3, 7)
    assert run(["apply", "level.fs", "gray.png", "-o", "out.png"]) == 2
    assert run(["compare", "level.fs", "gray.png"]) == 2
    assert "takes no picture, got gray.png" in capsys.readouterr().err


def test_a_picture_for_what_reads_none_is_told(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["apply", "level.fs", "gray.png", "-o", "out.png"]) == 2
    assert "gray.png: level reads no picture, it makes its own" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("name", "told"),
    [
        ("a.slangp", "is a preset of libretro's Slang shaders; expected a fragment shader in GLSL (.fs .glsl"),
        ("a.gdshader", "is a shader of Godot"), ("a.FX", "is HLSL or Cg"), ("a.comp", "is a compute shader"),
        ("a.vert", "is a vertex shader"), ("a.wgsl", "is WGSL"),
    ],
)  # fmt: skip
def test_other_shaders_are_told_by_what_they_are(name: str, told: str, capsys: pytest.CaptureFixture[str]) -> None:
    Path(name).write_text(IMAGE)
    assert run(["apply", name, "gray.png", "-o", "out.png"]) == 2
    assert told in capsys.readouterr().err
    with pytest.raises(pg.errors.InputError, match="expected a fragment shader in GLSL"):
        pg.load_shader(name)


def test_a_shader_of_several_outputs_says_what_takes_them(capsys: pytest.CaptureFixture[str]) -> None:
    Path("two.frag").write_text(
        "#version 330\nlayout(location = 0) out vec4 a;\nlayout(location = 1) out vec4 b;\n"
        "void main() { a = vec4(0.0); b = vec4(1.0); }"
    )
    assert run(["apply", "two.frag", "-o", "out.png"]) == 2
    assert "two.frag: has 2 outputs, and an effect makes one picture; leave one output, or" in capsys.readouterr().err


def test_endings_in_capitals_are_the_same() -> None:
    Path("LEVEL.FS").write_text(GENERATOR)
    assert applied("LEVEL.FS", "--size", "4x4")[:3] == [64, 64, 64]


def test_frames_of_a_sequence_count() -> None:
    Path("in").mkdir()
    for number in range(3):
        pg.save(f"in/{number}.png", np.full((2, 2, 4), 0.2, np.float32))
    assert run(["apply", "bright.fs", "in", "-o", "made", "--amount", "0"]) == 0
    shown = [round(float(pg.load(f"made/{number}.png")[0, 0, 0]) * 255) for number in range(3)]
    assert shown == [51, 52, 53]


def test_help_has_ranges_labels_choices_and_defaults(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["apply", "bright.fs", "--help"]) == 0
    said = " ".join(capsys.readouterr().out.split())
    for text in (
        "Brighter, in one of two ways", "--amount NUMBER How much brighter [default: 0.1; 0.0<=x<=2.0]",
        "--mode [add|multiply]", "--flip / --no-flip", "--tint VEC4", "--mask FILE", "--shader-size", "--time-step",
    ):  # fmt: skip
        assert text in said


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (["--amount", "3"], "'--amount': 3.0 is not in the range 0.0<=x<=2.0"),
        (["--mode", "divide"], "'divide' is not one of 'add', 'multiply'"),
        (["--tint", "1,2"], "tint is vec4, expected 4 numbers"),
        (["--tint", "1,2,x,1"], "expected a number"),
        (["--amont", "1"], "No such option '--amont'"),
        (["--mask", "none.png"], "none.png: no such file"),
    ],
)
def test_wrong_values_are_refused(arguments: list[str], text: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["apply", "bright.fs", "gray.png", "-o", "out.png", *arguments]) == 2
    assert text in capsys.readouterr().err
    assert not Path("out.png").exists()


def test_plan_compare_and_check_take_shaders(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["plan", "bright.fs", "gray.png", "--amount", "1"]) == 0
    assert run(["plan", "level.fs", "--size", "30x20"]) == 0
    assert "output 30x20" in capsys.readouterr().out
    assert run(["compare", "bright.fs", "gray.png", "-b", "numpy"]) == 0
    assert run(["check", "bright.fs", "-b", "numpy", "--set", "amount=0.3", "--set", "mode=7"]) == 0
    assert run(["check", "level.fs", "-b", "numpy"]) == 0
    assert run(["check", "bright.fs", "--set", "amont=0.3"]) == 2
    assert "did you mean 'amount'" in capsys.readouterr().err


def test_every_option_of_commands_is_reserved() -> None:
    """Else a shader's parameter of that name could not be given."""
    Path("plain.fs").write_text("uniform sampler2D s; void main() { gl_FragColor = texture2D(s, vec2(0.5)); }")
    own: set[str] = set()
    for command in (
        command_of(named_effect("plain.fs")),
        command_of(named_effect("level.fs")),
        plan,
        compare,
        inspect,
        apply,
    ):
        for param in command.params:
            if isinstance(param, (click.Option, click.Argument)) and param.name != "level":
                flags = (option.lstrip("-").replace("-", "_") for option in (*param.opts, *param.secondary_opts))
                own |= {name for name in flags if len(name) > 1} | {str(param.name)}
    assert own <= RESERVED, own - RESERVED


def test_names_that_clash_with_each_other_are_told_apart() -> None:
    inputs = ", ".join(f'{{"NAME": "{n}", "TYPE": "bool"}}' for n in ("loud", "no_loud", "size", "shader_size", "help"))
    Path("clash.fs").write_text(f'/*{{"INPUTS": [{inputs}]}}*/ void main() {{ gl_FragColor = vec4(1.0); }}')
    effect = named_effect("clash.fs")
    names = [parameter.name for parameter in effect.parameters]
    assert names == ["loud", "shader_no_loud", "shader_size", "shader_shader_size", "shader_help"]
    assert run(["apply", "clash.fs", "--size", "2x2", "--shader-shader-size", "--no-loud", "-o", "out.png"]) == 0


def test_a_preset_of_libretro_is_a_graph_too(capsys: pytest.CaptureFixture[str]) -> None:
    """Its passes' sizes come from a parameter, which no run may bring."""
    preset = SHADERS / "crt.glslp"
    assert run(["plan", "-e", str(preset), "gray.png"]) == 0
    assert run(["check", str(preset), "-b", "reference"]) == 0
    assert "crt" in capsys.readouterr().out


def test_an_export_of_shadertoy_is_a_shader_where_an_effect_is_asked_for(capsys: pytest.CaptureFixture[str]) -> None:
    """Flat worlds are JSON too, so that a file alone is not taken for an effect."""
    passes = [{"type": "image", "name": "Image", "inputs": [], "outputs": [], "code": IMAGE}]
    Path("toy.json").write_text(json.dumps({"info": {"name": "toy"}, "renderpass": passes}))
    assert run(["apply", "toy.json", "-o", "out.png", "--size", "4x3", "-b", "reference"]) == 0
    assert pg.load("out.png")[0, 0].tolist() == [0.0, 1.0, 0.0, 1.0]
    assert run(["plan", "-e", "toy.json"]) == 0
    capsys.readouterr()
    assert run(["plan", "toy.json"]) == 2 and "--effect" in capsys.readouterr().err
