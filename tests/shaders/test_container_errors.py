"""Headers of strangers: every mistake is told with its place, and none is more than an error."""

from __future__ import annotations

import json
import random
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import passgraph as pg
from passgraph.shaders.containers.isf import read_header, read_isf
from passgraph.shaders.shader_file import load_shader

BODY = "void main() { gl_FragColor = vec4(0.5); }"
BROKEN = '{\n  "INPUTS": [\n    {"NAME" "a"}\n  ]\n}'
TOLD = 's.fs:3: the header is no JSON: Expecting \':\' delimiter\n        {"NAME" "a"}\n' + 16 * " " + "^"
WHOLE: dict[str, Any] = {
    "DESCRIPTION": "x", "ISFVSN": "2",
    "INPUTS": [
        {"NAME": "inputImage", "TYPE": "image"},
        {"NAME": "amount", "TYPE": "float", "MIN": 0.0, "MAX": 1.0, "DEFAULT": 0.5, "LABEL": "how much"},
        {"NAME": "mode", "TYPE": "long", "VALUES": [0, 1], "LABELS": ["a", "b"], "DEFAULT": 1},
        {"NAME": "tint", "TYPE": "color", "DEFAULT": [1, 0, 0, 1]},
        {"NAME": "at", "TYPE": "point2D", "DEFAULT": [0, 0], "MIN": [0, 0], "MAX": [1, 1]},
    ],
    "PASSES": [
        {"TARGET": "small", "WIDTH": "$WIDTH / 4", "HEIGHT": "max(floor($HEIGHT * $amount), 1.0)", "FLOAT": True},
        {"TARGET": "kept", "PERSISTENT": True},
        {},
    ],
    "IMPORTED": {},
}  # fmt: skip


def written(folder: Path, header: Any, body: str = BODY) -> Path:
    file = folder / "s.fs"
    file.write_text(f"/*{header if isinstance(header, str) else json.dumps(header)}*/\n{body}")
    return file


@pytest.mark.parametrize(
    ("header", "said"),
    [
        (BROKEN, TOLD),
        ('{"INPUTS": [', "the header is no JSON"),
        ('{"A": ' + "[" * 1_000_000, "the header is no JSON: nested too deeply"),
        ('{"A": ' + "1" * 5000 + "}", "the header is no JSON: Exceeds the limit"),
        ('{"INPUTS": 3}', "INPUTS must be a list, got 3"),
        ('{"INPUTS": [3]}', "INPUTS[0] must be an object, got 3"),
        ('{"INPUTS": [{"NAME": "a b", "TYPE": "float"}]}', "a name has letters, digits and underscores, got 'a b'"),
        ('{"INPUTS": [{"NAME": "a", "TYPE": "flaot"}]}', "INPUTS[0]: TYPE is one of float, bool"),
        ('{"INPUTS": [{"NAME": "a", "TYPE": "float", "MIN": "low"}]}', "INPUTS[0]: MIN must be a number, got 'low'"),
        ('{"INPUTS": [{"NAME": "a", "TYPE": "float", "DEFAULT": NaN}]}', "INPUTS[0]: DEFAULT must be a number"),
        ('{"INPUTS": [{"NAME": "a", "TYPE": "float"}, {"NAME": "a", "TYPE": "bool"}]}', "two inputs 'a'"),
        ('{"PASSES": {"TARGET": "a"}}', "PASSES must be a list"),
        ('{"PASSES": [{"TARGET": [1]}]}', "PASSES[0]: a name has letters"),
        ('{"PASSES": ' + json.dumps([{}] * 65) + "}", "PASSES has 65 entries; at most 64"),
        ('{"IMPORTED": {"a": {"PATH": "none.png"}}}', "imported picture 'a'"),
        ('{"IMPORTED": {"a": {"PATH": "../../etc/passwd"}}}', "'a' lies outside of the shader's folder"),
        ('{"IMPORTED": {"a": {"PATH": "/etc/passwd"}}}', "'a' lies outside of the shader's folder"),
        ('{"IMPORTED": {"a": {"PATH": 3}}}', "imported picture 'a' has no PATH"),
        ('{"IMPORTED": {"a": 3}}', "must be an object"),
    ],
)  # fmt: skip
def test_a_wrong_header_is_told_with_its_place(header: str, said: str, tmp_path: Path) -> None:
    with pytest.raises(pg.InputError) as told:
        load_shader(written(tmp_path, header))
    assert said in str(told.value)
    assert "s.fs" in str(told.value)


@pytest.mark.parametrize(
    ("width", "said"),
    [
        ("1e9", "1000000000"),
        ("$WIDTH / 0", "divides by zero"),
        ("1e300 * 1e300", "comes to inf pixels"),
        ("$WIDTH / ($HEIGHT - 8)", "divides by zero"),
        ("$depth", "which is no parameter"),
        ("$WIDTH ** 9", "a size has numbers"),
        ("__import__('os')", "a size has numbers"),
        ("max(1)", "a size has numbers"),
        ("$WIDTH +", "is no formula"),
        ("-" * 100 + "1", "nests deeper"),
        ("1+" * 300 + "1", "at most 500 characters"),
    ],
)
def test_a_wrong_size_is_told_with_its_pass(width: str, said: str, tmp_path: Path) -> None:
    header = {"PASSES": [{"TARGET": "a", "WIDTH": width}, {}]}
    body = "void main() { gl_FragColor = IMG_THIS_PIXEL(a); }"
    with pytest.raises(pg.PassgraphError) as told:
        pg.compile(load_shader(written(tmp_path, header, body))(), size=(8, 8))
    assert said in str(told.value)


@pytest.mark.parametrize("width", ["0", "-5", "0.2", "floor($WIDTH / 100)"])
def test_a_size_is_at_least_one_pixel(width: str, tmp_path: Path) -> None:
    path = written(
        tmp_path, {"PASSES": [{"TARGET": "a", "WIDTH": width}, {}]},
        "void main() { gl_FragColor = PASSINDEX == 0 ? vec4(RENDERSIZE.x) : IMG_THIS_PIXEL(a) * 0.25; }",
    )  # fmt: skip
    with pg.compile(load_shader(path)(), size=(8, 8)) as program:
        assert np.all(program()["s"] == 0.25)


@pytest.mark.parametrize(
    ("width", "expected"),
    [
        ("max(8.0, floor($WIDTH * 0.02))", 8), ("min($WIDTH, $count)", 5), ("$WIDTH / 3", 33), ("ceil($WIDTH / 3)", 34),
        ("abs(-$HEIGHT) + 1", 9), ("$count * 2 - 1", 9), ("", 100),
    ],
)  # fmt: skip
def test_a_size_is_what_its_formula_gives(width: str, expected: int, tmp_path: Path) -> None:
    header = {
        "INPUTS": [{"NAME": "count", "TYPE": "float", "DEFAULT": 5}],
        "PASSES": [{"TARGET": "a", "WIDTH": width, "FLOAT": True}, {}],
    }
    body = "void main() { gl_FragColor = PASSINDEX == 0 ? vec4(RENDERSIZE, 0.0, 1.0) : IMG_THIS_PIXEL(a); }"
    effect = load_shader(written(tmp_path, header, body))
    with pg.compile(effect(into=pg.target("out", "rgba32f", scale=1.0)), size=(100, 8)) as program:
        assert np.allclose(program()["out"][..., :2], (expected, 8), rtol=1e-6)


def test_a_pass_may_read_itself_and_later_ones(tmp_path: Path) -> None:
    """A buffer that is not drawn yet is black and transparent; a persistent one is the last frame's."""
    header = {"PASSES": [{"TARGET": "a"}, {"TARGET": "b", "PERSISTENT": True}, {}]}
    body = """void main() {
        if (PASSINDEX == 0) gl_FragColor = IMG_THIS_PIXEL(a) + IMG_THIS_PIXEL(b);
        else if (PASSINDEX == 1) gl_FragColor = IMG_THIS_PIXEL(b) + vec4(0.2);
        else gl_FragColor = vec4(IMG_THIS_PIXEL(a).r, IMG_THIS_PIXEL(b).r, 0.0, 1.0);
    }"""
    with pg.compile(load_shader(written(tmp_path, header, body))(), size=(3, 2)) as program:
        seen = [program()["s"][0, 0, :2].tolist() for _ in range(3)]
    assert np.allclose(seen, [[0.0, 0.2], [0.2, 0.4], [0.4, 0.6]], atol=1e-3)


@pytest.mark.parametrize("width", ["$WIDTH", "2"])
def test_a_buffer_that_later_frames_alone_read_is_drawn(width: str, tmp_path: Path) -> None:
    kept = [{"TARGET": name, "PERSISTENT": True} for name in ("b", "c")]
    header = {"PASSES": [{"TARGET": "a", "WIDTH": width}, *kept, {}]}
    body = """void main() {
        if (PASSINDEX == 0) gl_FragColor = IMG_THIS_PIXEL(c);
        else if (PASSINDEX == 1) gl_FragColor = IMG_THIS_PIXEL(b) + vec4(0.2);
        else if (PASSINDEX == 2) gl_FragColor = IMG_THIS_PIXEL(b) + IMG_THIS_PIXEL(a);
        else gl_FragColor = IMG_THIS_PIXEL(a);
    }"""
    with pg.compile(load_shader(written(tmp_path, header, body))(), size=(3, 2)) as program:
        seen = [float(program()["s"][0, 0, 0]) for _ in range(4)]
    assert np.allclose(seen, [0.0, 0.2, 0.6, 1.0], atol=3e-3)


@pytest.mark.parametrize(("is_float", "expected"), [(False, 0.0), (True, 0.003)])
def test_a_last_pass_keeps_what_its_own_format_holds(is_float: bool, expected: float, tmp_path: Path) -> None:
    """Hosts of ISF keep buffers of 8 bits, where a thousandth is nothing, unless the file says FLOAT."""
    header = {"PASSES": [{"TARGET": "a", "PERSISTENT": True, "FLOAT": is_float}]}
    effect = load_shader(written(tmp_path, header, "void main() { gl_FragColor = IMG_THIS_PIXEL(a) + 0.001; }"))
    with pg.compile(effect(into=pg.target("out", "rgba32f", scale=1.0)), size=(3, 2)) as program:
        shown = [program()["out"] for _ in range(3)]
    assert np.allclose(shown[-1], expected, atol=1e-6)


def test_a_last_pass_of_another_size_is_shown_whole(tmp_path: Path) -> None:
    header = {"PASSES": [{"TARGET": "a", "WIDTH": "2", "HEIGHT": "1"}]}
    path = written(tmp_path, header, "void main() { gl_FragColor = vec4(gl_FragCoord.x - 0.5); }")
    with pg.compile(load_shader(path)(), size=(4, 3)) as program:
        assert program()["s"][1, :, 0].tolist() == [0.0, 0.25, 0.75, 1.0]


def test_ten_megabytes_are_too_many(tmp_path: Path) -> None:
    file = tmp_path / "s.fs"
    file.write_text("/*{}*/" + " " * 10_000_000 + BODY)
    with pytest.raises(pg.InputError, match=r"s\.fs"):
        load_shader(file)


def test_a_parameter_that_is_called_like_the_clock_has_its_own_value(tmp_path: Path) -> None:
    header = {"INPUTS": [{"NAME": "time", "TYPE": "float", "DEFAULT": 0.25}]}
    effect = load_shader(written(tmp_path, header, "void main() { gl_FragColor = vec4(time, TIME, 0.0, 1.0); }"))
    assert set(effect.parameters) == {"time", "clock_time", "time_step"}
    with pg.compile(effect(time=0.5, clock_time=0.75), size=(1, 1)) as program:
        assert program()["s"][0, 0, :2].tolist() == [0.5, 0.75]


def _mutated(rng: random.Random, value: Any, depth: int = 0) -> Any:
    """The same with something else somewhere."""
    if rng.random() < 0.03 or not isinstance(value, (dict, list)):
        strange = [
            None, True, -1, 0, 1e308, 10**400, float("nan"), "", "$WIDTH", "a b", "image", "float", [], {}, [[]], "\0",
            "é" * 70, {"NAME": "x"}, -0.0, "1e9", "../x", "main", "void", "gl_FragColor", "pg_main", "PASSINDEX", "if",
        ]  # fmt: skip
        return rng.choice(strange) if rng.random() < 0.1 else value
    if isinstance(value, list):
        made = [_mutated(rng, one, depth + 1) for one in value]
        return made * rng.choice((1,) * 15 + (2,)) if rng.random() < 0.95 else made[1:]
    return {key: _mutated(rng, one, depth + 1) for key, one in value.items() if rng.random() > 0.01}


def test_thousands_of_mutated_headers_end_in_a_header_or_an_error() -> None:
    rng, read, told = random.Random(5), 0, list[str]()
    for _ in range(3000):
        text = json.dumps(_mutated(rng, WHOLE))
        if rng.random() < 0.4:
            at = rng.randrange(len(text))
            text = text[:at] + rng.choice(["", ",", "}", '"', "\\", "9", "*/", "\0"]) + text[at + rng.randrange(3) :]
        try:
            read_header(f"/*{text}*/\n{BODY}", "s.fs")
            read += 1
        except pg.InputError as error:
            told.append(str(error))
    assert 100 < read < 2900
    assert all(text.startswith("s.fs") for text in told)


def test_mutated_files_become_graphs_or_errors(tmp_path: Path) -> None:
    rng, made = random.Random(6), 0
    body = "void main() { gl_FragColor = IMG_THIS_PIXEL(inputImage) * amount + IMG_NORM_PIXEL(small, at); }"
    for _ in range(150):
        text = f"/*{json.dumps(_mutated(rng, WHOLE))}*/\n{body}"
        try:
            effect = read_isf(text, tmp_path / "s.fs")
            pg.graph(effect(*map(pg.Input, effect.images)))
            made += 1
        except pg.PassgraphError:
            pass
    assert 10 < made < 150


_STAGE = "which are not read here: a fragment shader gives its own pixel a color"


@pytest.mark.parametrize(
    ("name", "text", "line", "told"),
    [
        ("a.hook", "//!HOOK LUMA\n//!BIND HOOKED\n//!COMPUTE 32 8\nvoid hook() {}", 3, "a compute shader (//!COMPUTE)"),
        ("a.hook", "//!HOOK MAIN\n//!BIND HOOKED\n\nvec4 hook() { barrier(); return vec4(0); }", 4,
         f"barrier belongs to compute shaders, {_STAGE}"),
        ("a.glsl", "#version 430\nlayout(local_size_x = 8, local_size_y = 8) in;\nvoid main() {}", 2,
         f"local_size_x belongs to compute shaders, {_STAGE}"),
        ("a.glsl", "\n\nlayout(rgba8) uniform writeonly image2D shown;\n" + BODY, 3, "image2D belongs to compute"),
        ("a.glsl", "shared float kept[8];\n" + BODY, 1, "shared belongs to compute"),
        ("a.glsl", "void main() {\n  int i = gl_WorkGroupID.x;\n}", 2, "gl_WorkGroupID belongs to compute"),
        ("a.glsl", "void main() {\n  imageStore(shown, 1, 2);\n}", 2, "'shown' is not defined here"),
        ("a.glsl", "uniform atomic_uint count;\n" + BODY, 1, "atomic_uint belongs to compute"),
        ("a.glsl", "void main() {\n  EmitVertex();\n}", 2, "EmitVertex belongs to geometry shaders"),
        ("a.glsl", "void main() {\n  gl_Position = vec4(0);\n}", 2, "gl_Position belongs to vertex shaders"),
        ("s.fs", "/*{}*/\nlayout(local_size_x = 8) in;\n" + BODY, 2, "local_size_x belongs to compute"),
        ("a.glsl", "\nvec2 mainSound(int i, float t) { return vec2(0); }", 2, "mainSound makes no picture"),
        ("a.glsl", "void mainCubemap(out vec4 c, vec2 f, vec3 o, vec3 d) {}", 1, "mainCubemap makes no picture"),
    ],
)  # fmt: skip
def test_what_belongs_to_other_stages_is_refused_with_its_line(
    tmp_path: Path, name: str, text: str, line: int, told: str
) -> None:
    (tmp_path / name).write_text(text)
    with pytest.raises(pg.PassgraphError) as raised:
        load_shader(tmp_path / name)
    assert str(raised.value).startswith(f"{tmp_path / name}:{line}: {told}")
    assert text.split("\n")[line - 1].strip() in str(raised.value)


def test_a_variable_may_be_called_as_another_stage_calls_something() -> None:
    pg.kernel(glsl="float shared = 1.0, barrier = 2.0; void main() { gl_FragColor = vec4(shared + barrier); }")
    pg.kernel(glsl="float imageLoad(float x) { return x; } void main() { gl_FragColor = vec4(imageLoad(1.0)); }")


_HALVES = "#if defined(VERTEX)\nvoid main() {}\n#elif defined(FRAGMENT)\n" + BODY + "\n#endif\n"
_SIZED = (
    '/*{"INPUTS": [{"NAME": "share", "TYPE": "%s"}], "PASSES": [{"TARGET": "a", "WIDTH": "$WIDTH * $share"}, {}]}*/\n'
)


@pytest.mark.parametrize(
    ("name", "text", "parameter", "given"),
    [
        ("a.fs", _SIZED % "float" + BODY, "share", pg.Value("share", float)),
        ("a.fs", _SIZED % "point2D" + BODY, "share", (0.5, 0.5)),
        ("a.hook", "//!HOOK MAIN\nvec4 hook() { return vec4(0.5); }", "output_scale", pg.Value("scale", float)),
        ("a.glsl", _HALVES, "output_scale", pg.Value("scale", float)),
    ],
)
def test_sizes_come_from_numbers_and_not_from_runs(
    tmp_path: Path, name: str, text: str, parameter: str, given: Any
) -> None:
    (tmp_path / name).write_text(text)
    shader = load_shader(tmp_path / name)
    pictures = [pg.Input(name) for name in shader.images]
    assert shader.constants >= {parameter}
    with pytest.raises(pg.InputError, match=f"a.*: parameter '{parameter}', which sizes of passes come from, must be"):
        shader(*pictures, **{parameter: given})


#: A parameter ``{0}``, which the picture is multiplied by; it is 0.5 if nobody says else.
NAMING = {
    "s.fs": '/*{{"INPUTS": [{{"NAME": "p", "TYPE": "image"}}, {{"NAME": "{0}", "TYPE": "float", "DEFAULT": 0.5}}]}}*/\n'
    "void main() {{ gl_FragColor = IMG_THIS_PIXEL(p) * {0}; }}",
    "t.glsl": "uniform float {0}; // = 0.5\nvec4 transition(vec2 uv) {{ return getFromColor(uv) * {0}; }}",
    "m.glsl": "//!PARAM {0}\n//!TYPE float\n0.5\n//!HOOK MAIN\n//!BIND HOOKED\n"
    "vec4 hook() {{ return HOOKED_tex(HOOKED_pos) * {0}; }}",
    "l.glsl": '#pragma parameter {0} "a" 0.5 0.0 1.0 0.1\n#if defined(VERTEX)\nattribute vec4 VertexCoord, TexCoord; '
    "uniform mat4 MVPMatrix; varying vec2 v; void main() {{ gl_Position = MVPMatrix * VertexCoord; v = TexCoord.xy; }}"
    "\n#elif defined(FRAGMENT)\nvarying vec2 v; uniform sampler2D Texture; uniform float {0}; "
    "void main() {{ gl_FragColor = texture2D(Texture, v) * {0}; }}\n#endif",
}  # fmt: skip


@pytest.mark.parametrize("file", NAMING)
@pytest.mark.parametrize("called", ["name", "self", "arguments", "lambda", "MAIN"])
def test_a_parameter_may_be_called_as_python_and_passgraph_call_something(
    tmp_path: Path, file: str, called: str
) -> None:
    (tmp_path / file).write_text(NAMING[file].format(called))
    effect = load_shader(tmp_path / file)
    pictures = [pg.Input("frame", "rgba32f", (1, 1)) for _ in effect.images[:1]]
    for given, expected in (({}, 0.25), ({called: 1.0}, 0.5)):
        with pg.compile(effect(*pictures, into=pg.target("o", "rgba32f", size=(1, 1)), **given)) as program:
            assert program(frame=np.full((1, 1, 4), 0.5, np.float32))["o"][0, 0, 0] == expected


@pytest.mark.parametrize("file", NAMING)
def test_no_parameter_is_called_as_the_target(tmp_path: Path, file: str) -> None:
    (tmp_path / file).write_text(NAMING[file].format("into"))
    with pytest.raises(pg.InputError, match=f"{file}: calls a parameter or picture 'into'.* give it another name"):
        load_shader(tmp_path / file)


def test_a_texture_within_a_file_may_be_called_as_a_target_is(tmp_path: Path) -> None:
    texture = "//!TEXTURE into\n//!SIZE 1 1\n//!FORMAT r8\nFF\n"
    hook = "//!HOOK MAIN\n//!BIND into\nvec4 hook() { return vec4(texture(into, vec2(0.5)).r); }"
    (tmp_path / "m.glsl").write_text(texture + hook)
    with pg.compile(load_shader(tmp_path / "m.glsl")(pg.Input("frame")), size=(1, 1)) as program:
        assert program(frame=np.zeros((1, 1, 4), np.float32))["m"].min() == 1.0


def test_a_name_of_other_letters_is_told_with_its_line(tmp_path: Path) -> None:
    (tmp_path / "m.glsl").write_text(NAMING["m.glsl"].format("été"))
    with pytest.raises(pg.InputError, match=r"m\.glsl:1: //!PARAM is a name that shaders can write, got 'été'"):
        load_shader(tmp_path / "m.glsl")


def test_a_transition_says_defaults_behind_declarations_and_within_them(tmp_path: Path) -> None:
    """Both ways stand in what gl-transitions publishes."""
    file = tmp_path / "a.glsl"
    file.write_text(
        "uniform float soft; // = 0.25\n"
        "uniform ivec2 least/* = ivec2(20) */; // so many squares\n"
        "uniform int steps /* = 5 * 10 */; // 0 for none\n"
        "uniform vec3 rim /* of each square */;\n"
        "uniform bool thick; // = 1\n"
        "uniform bool thin /* = 0 */;\n"
        "uniform bool plain; // = true;\n"
        "vec4 transition(vec2 uv) { return vec4(rim * soft, float(steps + least.x)) + progress * getToColor(uv); }\n"
    )
    said = {name: np.ravel(one.default).tolist() for name, one in load_shader(file).parameters.items()}
    assert [said.pop(name) for name in ("thick", "thin", "plain")] == [[True], [False], [True]]
    assert said == {"progress": [0.5], "soft": [0.25], "least": [20, 20], "steps": [50], "rim": [0, 0, 0]}
    file.write_text("uniform float k /* = nowhere */;\nvec4 transition(vec2 uv) { return vec4(k); }")
    with pytest.raises(pg.KernelError) as caught:
        load_shader(file)
    assert str(caught.value).splitlines()[0].startswith(f"{file}:1: 'nowhere' is not defined")
    assert str(caught.value).splitlines()[2].index("^") == 4 + len("uniform float k /* = ")
