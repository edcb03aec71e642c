"""Samplers of lines, rectangles and volumes: held against closed forms, and reads of the same picture by sampler2D."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import passgraph as pg
from passgraph.errors import KernelError
from passgraph.glsl import parse

Picture = NDArray[np.float32]
SIZE = (5, 4)
NOISE = np.random.default_rng(3).random((3, 4, 4)).astype(np.float32)
LINE = NOISE[:1]


def drawn(text: str, *pictures: Picture, handle: Any = lambda one: one, backend: str = "numpy") -> Picture:
    """Return what a shader draws; its samplers are called a, b."""
    kernel = pg.kernel(glsl=f"#version 330 compatibility\n{text}")
    handles = [handle(pg.Input(name, "rgba32f")) for name in "ab"[: len(pictures)]]
    made = kernel(*handles, into=pg.target("r", "rgba32f", size=SIZE))
    with pg.compile(made, backend=backend) as program:
        return program(**dict(zip("ab", pictures, strict=False)))["r"]


BOTH = [
    # A read of the sampler a, and the same one of the sampler2D b.
    ("sampler1D", "texture(a, x)", "texture(b, vec2(x, 0.5))"),
    ("sampler1D", "texture1D(a, x, 0.0)", "texture(b, vec2(x, 0.5))"),
    ("sampler1D", "textureLod(a, x, 0.0)", "texture(b, vec2(x, 0.5))"),
    ("sampler1D", "textureOffset(a, x, 1)", "textureOffset(b, vec2(x, 0.5), ivec2(1, 0))"),
    ("sampler1D", "textureProj(a, vec2(x, 0.7))", "texture(b, vec2(x / 0.7, 0.5))"),
    ("sampler1D", "texture1DProj(a, vec4(x, 9.0, 9.0, 0.7))", "texture(b, vec2(x / 0.7, 0.5))"),
    ("sampler1D", "textureGrad(a, x, 0.1, 0.2)", "textureGrad(b, vec2(x, 0.5), vec2(0.1, 0.0), vec2(0.2, 0.0))"),
    ("sampler1D", "texelFetch(a, int(x * 4.0), 0)", "texelFetch(b, ivec2(x * 4.0, 0), 0)"),
    ("sampler1D", "texelFetchOffset(a, 1, 0, 2)", "texelFetch(b, ivec2(3, 0), 0)"),
    ("sampler1D", "vec4(textureSize(a, 0))", "vec4(textureSize(b, 0).x)"),
    ("sampler2DRect", "texture(a, y * 4.0)", "texture(b, y * 4.0 / vec2(textureSize(b, 0)))"),
    ("sampler2DRect", "texture2DRect(a, y * 4.0)", "texture(b, y * 4.0 / vec2(textureSize(b, 0)))"),
    ("sampler2DRect", "texture2DRectProj(a, vec3(y, 0.5))", "texture(b, y / 0.5 / vec2(textureSize(b, 0)))"),
    ("sampler2DRect", "textureProj(a, vec4(y, 9.0, 0.5))", "texture(b, y / 0.5 / vec2(textureSize(b, 0)))"),
    ("sampler2DRect", "texelFetch(a, ivec2(y * 3.0))", "texelFetch(b, ivec2(y * 3.0), 0)"),
    ("sampler2DRect", "texelFetchOffset(a, ivec2(1), ivec2(1, -1))", "texelFetch(b, ivec2(2, 0), 0)"),
    ("sampler2DRect", "textureGather(a, y * 3.0)", "textureGather(b, y * 3.0 / vec2(textureSize(b, 0)))"),
    ("sampler2DRect", "vec4(textureSize(a), 0, 1)", "vec4(textureSize(b, 0), 0, 1)"),
]  # fmt: skip


@pytest.mark.parametrize(("sampler", "read", "flat"), BOTH)
@pytest.mark.parametrize("backend", ["numpy", "reference"])
def test_a_sampler_reads_what_a_flat_one_reads(sampler: str, read: str, flat: str, backend: str) -> None:
    picture = LINE if sampler == "sampler1D" else NOISE
    text = f"""uniform {sampler} a; uniform sampler2D b; out vec4 o;
void main() {{ vec2 y = gl_FragCoord.xy / vec2(5.0, 4.0); float x = y.x; o = {{}}; }}"""
    found, expected = (drawn(text.replace("{}", one), picture, picture, backend=backend) for one in (read, flat))
    assert np.abs(found - expected).max() < 1e-6
    assert expected.any()


def test_a_line_is_the_lowest_row_of_a_picture() -> None:
    text = "uniform sampler1D a; out vec4 o; void main() { o = texture(a, 0.375) - texelFetch(a, 1, 0); }"
    assert not drawn(text, NOISE).any()
    text = "uniform sampler1D a[2]; out vec4 o; void main() { o = texelFetch(a[int(gl_FragCoord.x) % 2], 2, 0); }"
    kernel = pg.kernel(glsl=f"#version 330\n{text}")
    made = kernel([pg.Input("a", "rgba32f"), pg.Input("b", "rgba32f")], into=pg.target("r", "rgba32f", size=SIZE))
    with pg.compile(made) as program:
        found = program(a=NOISE, b=NOISE * 0.5)["r"]
    assert found[0, 0].tolist() == NOISE[2, 2].tolist()
    assert found[0, 1].tolist() == (NOISE[2, 2] * np.float32(0.5)).tolist()


def test_a_volume_has_a_size_and_texels() -> None:
    volume = np.random.default_rng(5).random((6, 4, 4)).astype(np.float32)  # three slices of 4 x 2
    text = """uniform sampler3D a; out vec4 o; void main() { ivec3 n = textureSize(a, 0);
if (gl_FragCoord.x < 1.0) o = vec4(n, 1.0); else o = texelFetchOffset(a, ivec3(3, 0, 1), 0, ivec3(0, 1, 1)); }"""
    found = drawn(text, volume, handle=lambda one: one.slices(3))
    assert found[0, 0].tolist() == [4.0, 2.0, 3.0, 1.0]
    assert found[0, 1].tolist() == volume[5, 3].tolist()


def test_functions_are_chosen_by_the_sampler() -> None:
    text = """uniform sampler1D a; uniform sampler2D b; out vec4 o; float f(sampler2D s) { return 2.0; }
float f(sampler1D s) { return 1.0; } void main() { o = vec4(f(a), f(b), 0.0, 1.0); }"""
    assert drawn(text, LINE, NOISE)[0, 0].tolist() == [1.0, 2.0, 0.0, 1.0]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("uniform sampler1D a; BODY texture(a, vec2(1.0)); }", "where to read must be float, got vec2"),
        ("uniform sampler1D a; BODY textureProj(a, vec3(1.0)); }", "a projected read takes a vec2 or a vec4, got vec3"),
        ("uniform sampler2D a; BODY textureProj(a, vec2(1.0)); }", "a projected read takes a vec3 or a vec4, got vec2"),
        ("uniform sampler2D a; BODY texture(a); }", "where to read is missing"),
        ("uniform sampler2D a; BODY vec4(textureQueryLod(a), 0.0, 0.0); }", "where to read is missing"),
        ("uniform sampler2DRect a; BODY texelFetchOffset(a, ivec2(1), 0, ivec2(1)); }",
         "texelFetchOffset() takes a sampler, a texel and an offset"),
        ("struct S { sampler2DRect r; }; uniform S a; BODY vec4(1.0); }",
         "a sampler2DRect is a uniform or a parameter here, no field"),
        ("uniform sampler1D a; vec4 f(sampler2D s) { return vec4(1.0); } BODY f(a); }", "f takes no (Image)"),
    ],
)  # fmt: skip
def test_reads_that_do_not_fit_their_sampler(text: str, said: str) -> None:
    with pytest.raises(KernelError, match=re.escape(said)):
        parse("#version 430\nout vec4 o;\n" + text.replace("BODY", "void main() { o ="))
