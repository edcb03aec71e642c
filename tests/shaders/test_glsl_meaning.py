"""What GLSL means: small shaders read here beside the same text on OpenGL."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from agreement_glsl import both, picture, run
from original import Original, original
from random_glsl import random_shader

import passgraph as pg
from passgraph.glsl import parse


@pytest.fixture(scope="module")
def gl() -> Iterator[Original]:
    with original() as made:
        yield made


_MAIN = "void main() { vec2 p = gl_FragCoord.xy; int n = int(p.x); vec4 o = vec4(0);"


def cases() -> dict[str, str]:
    """Shaders by what they show."""
    sections = Path(__file__).with_name("meaning.glsl").read_text().split("\n//// ")[1:]
    found = {}
    for section in sections:
        title, _, text = section.partition("\n")
        before, _, body = text.rpartition("// main\n")
        found[title] = f"{before}\n{_MAIN}\n{body}\ngl_FragColor = o; }}"
    return found


CASES = cases()


@pytest.mark.sampled
@pytest.mark.parametrize("name", CASES)
def test_a_shader_means_what_it_means_to_opengl(gl: Original, name: str) -> None:
    ours, theirs = both(gl, CASES[name], newer=name.endswith("4.30"))
    np.testing.assert_allclose(ours, theirs, rtol=2e-5, atol=2e-5)


SAMPLERS = "uniform sampler2D t; "


@pytest.mark.parametrize(
    "read",
    [
        "texture2D(t, p / vec2(7, 6))",
        "texture2D(t, p * 0.4 - 0.7)",
        "texelFetch(t, ivec2(p), 0)",
        "vec4(textureSize(t, 0), 0, 1)",
        "textureProj(t, vec3(p, 9.0)) + textureProj(t, vec4(p, 1.0, 8.0))",
        "textureLod(t, p.yx / 8.0, 0.0)",
        "textureOffset(t, p / vec2(5, 4), ivec2(1, -1)) + texelFetchOffset(t, ivec2(1), 0, ivec2(1, 0))",
        "texture(t, p / vec2(5, 4), 0.0) + textureGrad(t, p / vec2(8, 5), vec2(0), vec2(0))",
        "textureGather(t, p / vec2(6, 5)) - textureGather(t, p.yx / 5.0)",
    ],
)
def test_pictures_look_upright_to_a_shader(gl: Original, read: str) -> None:
    """(0, 0) is the bottom left corner; weights of llvmpipe's filter have 8 bits."""
    text = f"{SAMPLERS} void main() {{ vec2 p = gl_FragCoord.xy; gl_FragColor = {read}; }}"
    ours, theirs = both(gl, text, (5, 4), {"t": picture(7, 6)})
    np.testing.assert_allclose(ours, theirs, atol=6e-3)


DERIVATIVES = """void main() {
    vec2 p = gl_FragCoord.xy;
    vec3 v = texelFetch(t, ivec2(p), 0).xyz * vec3(p * p.yx + p.x, p.y * p.y);
    if (p.x > 1.5) v.xz *= 2.0;
    for (int i = 0; i < 5; i++) {
        if (v.x > 20.0) break;
        v += p.yxx;
    }
    gl_FragColor = vec4(dFdxFine(v.x), dFdyFine(v.y), fwidthFine(v.z), dFdxFine(v.z) - dFdyFine(v.z));
}"""


def test_derivatives_are_the_fine_ones_and_grow_upward(gl: Original) -> None:
    size, pictures = (6, 4), {"t": picture(6, 4)}
    head = "#version 450\n#define gl_FragColor shown_color\nout vec4 shown_color;\n"
    theirs = gl.run(SAMPLERS + DERIVATIVES, size, pictures, {}, head)
    np.testing.assert_allclose(run(parse(SAMPLERS + DERIVATIVES), size, pictures), theirs, rtol=1e-5, atol=1e-5)
    plain = (SAMPLERS + DERIVATIVES).replace("Fine", "")
    np.testing.assert_allclose(run(parse(plain), size, pictures), theirs, rtol=1e-5, atol=1e-5)


def test_the_filter_of_a_handle_holds_in_shaders() -> None:
    """The nearest texel of a bigger picture, by the numbers of its rows and columns."""
    kernel = pg.kernel(
        glsl="uniform sampler2D t; void main() { gl_FragColor = texture2D(t, pg_position * 1.25 - 0.1); }"
    )
    frame = picture(7, 6)
    target = kernel(pg.Input("t").filter("nearest"), into=pg.target("shown", format="rgba32f", scale=1.0))
    with pg.compile(target, backend="numpy", size=(23, 19)) as program:
        shown = np.asarray(program(t=frame)["shown"])
    x, y = (
        np.clip(np.floor(((np.arange(n) + 0.5) / n * 1.25 - 0.1) * m), 0, m - 1).astype(int)
        for n, m in ((23, 7), (19, 6))
    )
    np.testing.assert_array_equal(shown, frame[::-1][y][:, x][::-1])


def test_samplers_are_handed_to_functions(gl: Original) -> None:
    text = "uniform sampler2D a, b; vec4 f(sampler2D s, vec2 p) { return texture2D(s, p); }"
    text += "void main() { gl_FragColor = f(a, pg_position) - f(b, pg_position); }"
    ours, theirs = both(gl, text, (5, 4), {"a": picture(5, 4, 1), "b": picture(5, 4, 2)})
    np.testing.assert_allclose(ours, theirs, atol=1e-6)


@pytest.mark.parametrize(
    ("before", "value", "expected"),
    [
        ("float f(float a, float b) { return a * 100.0 + b; }", "f(a, a += 2.0)", 103.0),
        ("float f(float a, float b) { return a * 100.0 + b; }", "f(a++, a++) + a", 105.0),
        ("", "a + (a = 3.0) * 10.0", 31.0),
        ("", "vec3(a, a++, a).x + a", 3.0),
        ("float g(inout float x) { return x += 4.0; }", "a + g(a) + a", 11.0),
    ],
)  # fmt: skip
def test_what_an_expression_changes_does_not_reach_back(before: str, value: str, expected: float) -> None:
    """Arguments are computed from left to right (GLSL 4.60, 6.1.1), operands too; Mesa reads variables later."""
    text = f"{before} void main() {{ float a = 1.0; float v = {value}; gl_FragColor = vec4(v); }}"
    assert run(parse(text), (1, 1), {})[0, 0, 0] == expected


def test_pixels_that_are_discarded_are_zero(gl: Original) -> None:
    text = "bool far(float x) { if (x > 3.0) discard; return x > 2.0; }"
    text += "void main() { if (far(gl_FragCoord.x) || gl_FragCoord.y < 1.0) discard; gl_FragColor = vec4(1); }"
    ours, theirs = both(gl, text)
    np.testing.assert_array_equal(ours, theirs)


@pytest.mark.parametrize("seed", range(6))
def test_shaders_made_by_chance_mean_what_they_mean_to_opengl(gl: Original, seed: int) -> None:
    ours, theirs = both(gl, random_shader(seed), (2, 2))
    np.testing.assert_array_equal(ours, theirs)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(100, 200))
def test_more_shaders_made_by_chance_mean_what_they_mean_to_opengl(gl: Original, seed: int) -> None:
    ours, theirs = both(gl, random_shader(seed), (3, 2))
    np.testing.assert_array_equal(ours, theirs)
