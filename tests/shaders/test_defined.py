"""GLSL's functions settled in an original are those of kernels, bit for bit."""

from __future__ import annotations

import numpy as np
from defined import NAMES, definitions, used
from original import HEAD, original

import passgraph as pg
from passgraph.verify.report import other_bits

#: Of a picture with positive numbers: what kernels and originals compute of each texel.
TEXT = """
uniform sampler2D given;
void main() {
    vec4 a = texelFetch(given, ivec2(gl_FragCoord.xy), 0);
    vec4 b = a.wxyz;
    gl_FragColor = vec4(%s);
}
"""
VALUES = (
    "sin(100.0 * a)", "cos(100.0 * a)", "tan(a)", "vec4(asin(a.xy), acos(a.zw))", "atan(a - 0.5, b - 0.5)",
    "atan(9.0 * a)", "sinh(a)", "cosh(a)", "tanh(a)", "exp(9.0 * a)", "exp2(9.0 * a)", "log(a)", "log2(a)",
    "pow(a - 0.5, floor(2.0 + 3.0 * a))", "pow(a, 9.0 * b)", "mod(99.0 * a, b)",
    "mod(99.0 * a, 1.7)", "fract(99.0 * a)",
    "mix(a, b, a.x)", "mix(a, b, b)", "smoothstep(a, b, a.zwxy)", "smoothstep(0.2, 0.7, a)", "inversesqrt(a)",
    "dot(a, b), dot(a.xyz, b.xyz), dot(a.x, b.x), 1.0", "length(a), length(a.xyz), distance(a.xy, b.xy), 1.0",
    "normalize(a.xyz - 0.5), 1.0", "texture(given, a.xy)", "texture(given, 3.0 * b.xy - 1.0)",
    "texture(given, vec2(0.0) / 0.0)",
)  # fmt: skip


def test_settled_functions_have_the_bits_that_kernels_have() -> None:
    picture = np.random.default_rng(5).uniform(0.01, 0.99, (16, 16, 4)).astype(np.float32)
    wrong = []
    with original() as driver:
        for value in VALUES:
            text = TEXT % value
            kernel = pg.kernel(glsl=text, name="values")
            program = pg.compile(kernel(pg.Input("given"), into=pg.target("out", "rgba32f")), backend="gl")
            head = HEAD.replace("330", "420").replace("out vec4", "precise out vec4") + definitions(used(text))
            settled = driver.run(text, (16, 16), {"given": picture}, {}, head)
            if other_bits(program(given=picture)["out"], settled).any():
                wrong.append(value)
    assert not wrong


def test_every_function_that_is_settled_is_tried() -> None:
    assert set(used(" ".join(VALUES))) == NAMES


def test_only_functions_that_a_text_calls_and_does_not_define_are_settled() -> None:
    assert used("float mod(vec2 a) { return sin (a.x); } uniform float cos; mymix(1.0)") == ["sin"]
    assert used("IMG_NORM_PIXEL(a, b)") == used("getFromColor(p)") == ["texture"]


def test_one_function_alone_is_put_in_the_place_of_the_drivers() -> None:
    for name in NAMES:
        said = definitions([name])
        assert f"#define {name} pg_{name}\n" in said
        assert said.count("#define") == 1
