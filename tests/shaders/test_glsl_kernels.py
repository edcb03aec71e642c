"""Shaders as kernels: parameters, outputs, notes, travel, every backend."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from agreement_glsl import picture, run

import passgraph as pg
from passgraph.glsl import parse

TEXT = """#version 330
uniform float amount = 0.25;
uniform vec3 tint = vec3(1.0, 0.5, 0.25);
uniform sampler2D image;
uniform mat2 turn = mat2(1, 2, 3, 4);
uniform int steps;
uniform float weights[3] = float[3](1.0, 2.0, 3.0);
struct Lens { vec2 centre; float k; };
uniform Lens lens;
in vec2 uv;
layout(location = 1) out vec4 second;
layout(location = 0) out vec3 first;
void main() {
    first = mix(texture(image, uv).rgb, tint, amount) + vec3(turn * uv, steps) * weights[steps];
    second = vec4(lens.centre - uv, lens.k, 1.0);
}"""
LENS = SimpleNamespace(centre=(0.5, 0.25), k=3.0)


def drawn(backend: str, travelled: bool = False) -> tuple[Any, Any]:
    kernel = pg.kernel(glsl=TEXT)
    made = dict(zip("ab", kernel(pg.Input("frame"), steps=1, lens=LENS), strict=True))
    if travelled:
        made = pg.from_data(pg.to_data(made))
    with pg.compile(made, backend=backend) as program:
        result = program(frame=picture(9, 7))
        return np.asarray(result["a"]), np.asarray(result["b"])


def test_uniforms_are_parameters_with_samplers_first() -> None:
    kernel = pg.kernel(glsl=TEXT, name="looks")
    assert repr(kernel) == (
        "<passgraph pixel kernel looks(image: Image, amount: float, tint: vec3, turn: mat2, steps: int, "
        "weights: Array[float, 3], lens: Lens)>"
    )
    defaults = {p.name: p.default for p in kernel.parameters if p.has_default}
    assert defaults == {"amount": 0.25, "tint": (1, 0.5, 0.25), "turn": (1, 2, 3, 4), "weights": (1, 2, 3)}


def test_a_shader_computes_what_its_formula_says() -> None:
    first, second = drawn("reference")
    frame = picture(9, 7).astype(np.float64)
    y, x = np.mgrid[0:7, 0:9]
    u, v = (x + 0.5) / 9, 1 - (y + 0.5) / 7
    turned = np.stack([u + 3 * v, 2 * u + 4 * v, np.ones_like(u)], -1)
    np.testing.assert_allclose(first, frame[..., :3] * 0.75 + np.array([1, 0.5, 0.25]) / 4 + turned * 2, atol=1e-5)
    np.testing.assert_allclose(second, np.stack([0.5 - u, 0.25 - v, 3 + 0 * u, 1 + 0 * u], -1), atol=1e-6)


@pytest.mark.parametrize("backend", ["numpy", "gl", "opencl", "webgpu"])
def test_backends_agree_on_a_shader(backend: str) -> None:
    for one, other in zip(drawn(backend), drawn("reference"), strict=True):
        np.testing.assert_allclose(one, other, atol=4e-6)


def test_a_shader_travels() -> None:
    for one, other in zip(drawn("reference", travelled=True), drawn("reference"), strict=True):
        np.testing.assert_array_equal(one, other)


def test_gathers_at_the_middle_of_a_texel_take_it() -> None:
    """As devices do, which round places to 1/256 texel."""
    shader = parse(
        "uniform sampler2D t; void main() { gl_FragColor = textureGather(t, gl_FragCoord.xy / vec2(53, 31)).wwww; }"
    )
    frame = picture(53, 31)
    np.testing.assert_array_equal(run(shader, (53, 31), {"t": frame})[:, :, 0], frame[:, :, 0])


@pytest.mark.parametrize("backend", ["reference", "numpy", "gl", "opencl", "webgpu"])
def test_not_a_number_is_its_limit_where_that_is_known(backend: str) -> None:
    text = """uniform float zero;
    void main() {
        vec2 v = vec2(zero / zero, 0.5);
        gl_FragColor = vec4(max(v.x, 0.25), min(v, 0.125).x, clamp(v, 0.375, 1.0).x, clamp(v, vec2(0), v.yy).y);
    }"""
    graph = pg.kernel(glsl=text, name="limits")(zero=0.0, into=pg.target("out", "rgba32f"))
    with pg.compile(graph, backend=backend, size=(1, 1)) as program:
        assert program()["out"][0, 0].tolist() == [0.25, 0.125, 0.375, 0.5]


def test_numbers_have_swizzles() -> None:
    text = "uniform int n; void main() { float x = 0.25; gl_FragColor = vec4(x.xx, x.r, 0) + vec4(n.sss, x.x); }"
    graph = pg.kernel(glsl=text, name="same")(n=2, into=pg.target("out", "rgba32f"))
    with pg.compile(graph, size=(1, 1)) as program:
        assert program()["out"][0, 0].tolist() == [2.25, 2.25, 2.25, 0.25]


def test_one_kernel_comes_from_one_text() -> None:
    with pytest.raises(pg.GraphError, match="one of the three"):
        pg.kernel(glsl="void main() {}", source="x")  # type: ignore[call-overload]


def test_preludes_declare_what_a_container_has() -> None:
    """Their uniforms are parameters where they are used, and the shader may declare their variables anew."""
    shader = parse(
        "uniform float k; float own = 3.0; vec4 look(vec2 at) { return get(at) * k + BIAS + speed * own; }",
        prelude="uniform sampler2D from; uniform float time, unused; float speed = 2.5, own = 4.0;\n"
        "vec4 get(vec2 p) { return texture2D(from, p); }",
        postlude="void main() { gl_FragColor = look(pg_position) + time; }",
        defines={"BIAS": "2.0"},
    )
    assert [p.name for p in shader.program.parameters] == ["from", "time", "k"]
    frame = picture(3, 2)
    np.testing.assert_allclose(run(shader, (3, 2), {"from": frame}, {"time": 0.5, "k": 3.0}), frame * 3 + 10, atol=1e-5)


def test_a_prelude_may_compute_inputs() -> None:
    shader = parse(
        "in vec2 left[2]; void main() { gl_FragColor = vec4(left[0], left[1]); }",
        prelude="vec2 left[2]; void before() { left[0] = pg_position - 1.0; left[1] = pg_position; }",
        postlude="void both() { before(); main(); }",
        entry="both",
    )
    assert run(shader, (1, 1), {})[0, 0].tolist() == [-0.5, -0.5, 0.5, 0.5]


def test_volumes_are_read_as_python_kernels_read_them() -> None:
    """A table of colours whose entries rise along each axis gives back the colours that go in."""
    table = np.stack(np.meshgrid(*[np.linspace(0, 1, 5)] * 3, indexing="ij")[::-1], -1).astype(np.float32)
    text = """
    uniform sampler2D t;
    uniform sampler3D lut;
    void main() {
        gl_FragColor = vec4(texture(lut, texelFetch(t, ivec2(gl_FragCoord.xy), 0).rgb * 0.8 + 0.1).rgb, 1.0);
    }"""
    frame = picture(5, 4)
    graded = pg.kernel(glsl=text)(pg.Input("frame"), pg.Input("table").slices(5))
    with pg.compile(graded, backend="reference") as program:
        shown = np.asarray(program(frame=frame, table=pg.stacked(table))["shader"])
    np.testing.assert_allclose(shown[..., :3], frame[..., :3], atol=1e-6)


def test_a_sampler_is_chosen_from_an_array() -> None:
    read = "texelFetch(maps[int(gl_FragCoord.x) % 3], ivec2(0), 0)"
    text = f"uniform sampler2D maps[3]; void main() {{ gl_FragColor = {read}; }}"
    kernel = pg.kernel(glsl=text)
    assert repr(kernel) == "<passgraph pixel kernel shader(maps: Array[Image, 3])>"
    inputs = [pg.Input(name) for name in "abc"]
    shown = kernel(inputs, into=pg.target("shown", format="rgba32f", scale=1.0))
    with pg.compile(shown, backend="reference", size=(4, 1)) as program:
        found = program(**{name: np.full((1, 1, 4), k, np.float32) for k, name in enumerate("abc")})["shown"]
    assert np.asarray(found)[0, :, 0].tolist() == [0, 1, 2, 0]


def test_the_value_of_an_entry_is_the_output() -> None:
    shader = parse("float grey() { return 0.5; }", entry="grey")
    assert [str(result.type) for result in shader.program.results] == ["float"]


def test_outputs_of_old_shaders_are_numbered() -> None:
    shader = parse("void main() { gl_FragData[1] = vec4(1); gl_FragData[0] = vec4(2); }")
    assert [result.name for result in shader.program.results] == ["gl_FragData0", "gl_FragData1"]


@pytest.mark.parametrize(
    ("text", "line", "told"),
    [
        ("void main() {\nfloat a;\ngl_FragColor = vec4(a); }", 3, "a has no value here; it is 0"),
        ("in vec2 here;\nvoid main() { gl_FragColor = here.xyxy; }", 1, "input here is the position"),
        ("uniform int n; void main() {\nfor (int i = 0; i < n; i++) gl_FragColor += 1.0; }", 2, "1024 trips at most"),
        ("uniform bool b; float f()\n{ if (b) return 1.; } void main() { gl_FragColor = vec4(f()); }", 2, "may end"),
        ("uniform sampler2D t; void main() {\ngl_FragColor = texture2D(t, vec2(0), 1.0); }", 2, "smaller level"),
        ("\nprecision mediump float; void main() { gl_FragColor = vec4(1); }", 2, "32 bits here"),
        ("void main() {\ngl_FragColor = vec4(fract(sin(gl_FragCoord.x) * 43758.5)); }", 2, "noise amplifies"),
    ],
)  # fmt: skip
def test_reliances_are_noted(text: str, line: int, told: str) -> None:
    notes = parse(text).notes
    assert [note.span.line for note in notes] == [line]
    assert told in notes[0].text
    assert str(notes[0]).startswith(f"<shader>:{line}: ")


@pytest.mark.parametrize(
    ("outside", "inside", "value"),
    [
        # Constants, and variables that nobody writes, switch between variants.
        ("float mode = 2.0;", "if (mode < 1.0) r = gone(); else r = 1.0;", 1),
        ("const int n = 3;", "r = n > 4 ? gone() : n > 2 ? 5.0 : gone();", 5),
        ("bool on = true; float f() { if (on) return 2.0; else { return gone(); } }", "r = f();", 2),
        ("bool on = true; float f() { if (on) return 2.0; return gone(); }", "r = f();", 2),
        ("bool on = true;", "for (int i = 0; i < 4; i++) { if (!on) break; r += 1.0; }", 4),
        # The side that is left out still says of which type both are.
        ("", "r = (true ? 1 : 2.0) / 2;", 0.5),
        ("", "r = (true ? 1 : 2) / 2;", 0),
        # Somebody writes these.
        ("float mode = 2.0; void f() { mode = 0.5; }", "f(); r = mode < 1.0 ? 1.0 : 2.0;", 1),
        ("int n = 2; void f(out int m) { m = 7; }", "f(n); if (n > 2) r = n;", 7),
        ("vec2 v = vec2(1, 2);", "v.y++; r = v.y > 2.5 ? v.y : 0.0;", 3),
    ],
)
def test_what_constants_rule_out_is_not_read(outside: str, inside: str, value: float) -> None:
    text = f"{outside} void main() {{ float r = 0.0; {inside} gl_FragColor = vec4(r); }}"
    assert run(parse(text), (1, 1), {})[0, 0, 0] == value


def test_what_gives_no_reason_is_not_noted() -> None:
    text = "void f(out float b) { b = 1.0; } void main() { float a; f(a); float c; c = a; gl_FragColor = vec4(a + c); }"
    assert parse(text).notes == ()


@pytest.mark.parametrize("length", ["max(int(1.5), 1) * 2 + 1", "int(max(2, 3))", "min(3, 7)", "int(bool(2)) + 2"])
def test_lengths_of_arrays_are_made_of_functions_of_known_numbers(length: str) -> None:
    text = f"void main() {{ float a[{length}]; a[2] = 1.0; gl_FragColor = vec4(a[2], float(a.length()), 0.0, 1.0); }}"
    with pg.compile(pg.kernel(glsl=text)(into=pg.target("o", "rgba32f", (1, 1)))) as program:
        assert program()["o"][0, 0].tolist() == [1.0, 3.0, 0.0, 1.0]
