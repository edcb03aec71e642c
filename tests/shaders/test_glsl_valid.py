"""Valid GLSL that few shaders have, computed as the driver computes it."""

from __future__ import annotations

import re
from collections.abc import Iterator

import numpy as np
import pytest
from original import Original, original

import passgraph as pg
from passgraph.errors import KernelError
from passgraph.glsl import parse

HEAD = "#version 430\n"
VALID = {
    "open lengths at every level": """
out vec4 o; void main() { float a[][] = float[][](float[](1.0, 2.0, 3.0), float[](4.0, 5.0, 6.0));
int i = int(gl_FragCoord.x); o = vec4(a[i % 2][i], float(a.length()), float(a[0].length()), a[1][2]); }""",
    "an open length from another array": """
out vec4 o; void main() { float a[3] = float[3](1.0, 2.0, gl_FragCoord.x); float[] b = a; float c[] = b;
o = vec4(b[2], c[2], float(b.length()), c[0]); }""",
    "an open length from a function": """
out vec4 o; float[2][3] f(float x) { return float[][](float[](x, 1.0, 2.0), float[](3.0, 4.0, 5.0)); }
void main() { float a[][3] = f(gl_FragCoord.x); o = vec4(a[0][0], a[1][2], float(a.length()), 1.0); }""",
    "lists in braces": """
out vec4 o; void main() { float a[][3] = { { 1.0, 2.0, 3.0 }, { 4.0, 5.0, gl_FragCoord.x } };
float b[] = { 7.0, 8.0 }; mat2 m = { { 1.0, gl_FragCoord.x }, { 3.0, 4.0 } };
b[0] = m[0][1] + m[1][0]; o = vec4(a[1][2], a[0][1], float(a.length()) + b[0], b[1]); }""",
    "a loop that declares in its condition": """
out vec4 o; void main() { float x = 0.0; int n = 0; while (bool more = n < int(gl_FragCoord.x) + 1) {
bool inner = more; if (n == 1) { n += 2; continue; } x += inner ? 1.0 : 9.0; n++; }
o = vec4(x, float(n), 0.0, 1.0); }""",
    "a macro that asks what is defined": """
#define HAS(name) defined(name)
#define BOTH defined(FIRST) && defined FIRST
#define FIRST 1
out vec4 o;
#if BOTH && !defined(SECOND)
void main() { o = vec4(1.0, gl_FragCoord.x, 0.0, 1.0); }
#endif""",
    "a variable named like a struct": """
struct S { float v; }; out vec4 o; float f(S S, float y) { return S.v + y; }
float g(S S) { float b; { struct S { vec2 w; }; b = S(vec2(1.0, 7.0)).w.y; } return b + S.v; }
void main() { S S = S(gl_FragCoord.x); float b; for (int S = 0; S < 3; S++) b = float(S);
o = vec4(f(S, 1.0), S.v, b, g(S)); }""",
    "a struct of one block": """
out vec4 o; struct S { float v; }; void main() { float a = gl_FragCoord.x; { struct S { float w, x; };
S s = S(a, 2.0); a = s.w * s.x; } S t = S(a); if (true) { struct T { S s; }; T u = T(t); a = u.s.v + 1.0; }
o = vec4(a, t.v, 0.0, 1.0); }""",
    "lines that go on inside of a word": """
#def\\
ine TWICE(x) (x \\
  * 2.0)
out vec4 o; void main() { fl\\
oat foo = gl_Frag\\
Coord.x; // a comment \\ foo = 7.0;
o = vec4(TWICE(fo\\
o), foo, 0.0, 1.0); }""",
    "void functions in ? :": """
out vec4 o; int k = 0; void f(int x) { k += x; } void g() { k += 100; } void main() {
gl_FragCoord.x > 1.0 ? f(3) : g(); true ? f(1) : g(); (k > 50 ? f(20) : g()); o = vec4(float(k), 0.0, 0.0, 1.0); }""",
    "constructors take what they need of a matrix": """
out vec4 o; void main() { mat3 m = mat3(1, 2, 3, 4, 5, 6, 7, 8, gl_FragCoord.x);
o = vec4(vec4(m).w, vec3(5.0, m).z, float(m), float(ivec4(m).y)) + vec4(mat2(m[0], m[2])); }""",
    "an out parameter of another type": """
out vec4 o; float f(out int x, vec2 y) { x = 4; return y.x; } void main() { float a; float b = f(a, vec2(gl_FragCoord));
o = vec4(1.0 / a, b, 0.0, 1.0); }""",
    "lengths that functions of constants decide": """
out vec4 o; void main() { float a[bitfieldExtract(7, 0, 2) == -1 ? 2 : -1]; a[1] = gl_FragCoord.x;
float b[dot(vec2(1.0), vec2(2.0)) == 4.0 ? 3 : -1]; b[2] = ldexp(a[1], 2); o = vec4(a[1], b[2], 0.0, 1.0); }""",
    "the range of depths": """
out vec4 o; void main() { gl_DepthRangeParameters r = gl_DepthRange;
o = vec4(r.near, gl_DepthRange.far, r.diff, gl_FragCoord.x); }""",
    "products of 64 bits": """
out vec4 o; void main() { uint x = 4000000000u - uint(gl_FragCoord.x) * 77777u, high, low; ivec2 up, down;
umulExtended(x, 3735928559u, high, low); ivec2 y = ivec2(-int(x >> 2u), -5);
imulExtended(y, ivec2(2147483647, 1 + int(gl_FragCoord.x)), up, down);
o = vec4(float(high >> 8u), float(low >> 8u), float(up.x >> 8) + float(up.y), float(down.x >> 8) + float(down.y)); }""",
    "a uniform with a struct as its value": """
struct T { vec2 w; int n[2]; mat2 m; }; struct S { float v; T t[2]; }; uniform S s = S(3.0, T[2](
T(vec2(1.0, 2.0), int[2](3, 4), mat2(1.0)), T(vec2(5.0, 6.0), int[2](7, 8), mat2(1.0, 2.0, 3.0, 4.0))));
out vec4 o; void main() { o = vec4(s.v, s.t[0].w.y, s.t[1].n[0], s.t[1].m[1][0]) + gl_FragCoord.x; }""",
    "labels from constants in structs": """
struct T { vec4 v; }; struct S { T t; int a[2]; }; out vec4 o; void main() { const S s = S(T(vec4(1.0)), int[2](3, 0));
float c[s.a[0]]; c[2] = 0.0; switch (int(gl_FragCoord.x)) { case ivec2(s.t.v.xy).x: c[2] = 5.0; break;
case clamp(min(s.a[0], 2), 2, 6): c[2] = 6.0; break; case s.a[1]: c[2] = 7.0; } o = vec4(c[2]); }""",
    "limits are constants": """
out vec4 o; void main() { float a[gl_MaxDrawBuffers > 3 ? 2 : 1]; a[1] = gl_FragCoord.x;
o = vec4(a[1], float(a.length()), 0.0, 1.0); }""",
}


@pytest.fixture(scope="module")
def there() -> Iterator[Original]:
    with original() as made:
        yield made


@pytest.mark.gl
@pytest.mark.parametrize("name", VALID)
def test_valid_shaders_give_what_the_driver_gives(name: str, there: Original) -> None:
    expected = there.run(VALID[name], (3, 1), {}, {}, head=HEAD)
    for backend in ("reference", "numpy"):
        target = pg.kernel(glsl=HEAD + VALID[name])(into=pg.target("r", "rgba32f", size=(3, 1)))
        with pg.compile(target, backend=backend) as program:
            assert np.array_equal(program()["r"], expected)


def test_a_line_in_a_macro_is_where_its_call_ends() -> None:
    """GLSL ES 3.00, section 3.4: arguments are replaced first, and the macro where its closing parenthesis is."""
    macros = "#define HERE __LINE__\n#define F(a, b) HERE, a, b\n"
    text = macros + "void main() {\n gl_FragColor = vec4(F(__LINE__,\n __LINE__\n ), 1); }"
    with pg.compile(pg.kernel(glsl=text)(into=pg.target("r", "rgba32f", size=(1, 1)))) as program:
        assert program()["r"][0, 0].tolist() == [6.0, 4.0, 5.0, 1.0]


@pytest.mark.parametrize(
    ("cases", "said"),
    [
        ("case 1: x = 1.0;\n case 2: case 1: x = 2.0;", "this switch has case 1 already (line 2); leave out one"),
        ("default: x = 1.0; case 1: break; default: x = 2.0;", "this switch has default already; leave out one"),
    ],
)
def test_a_switch_has_each_label_once(cases: str, said: str) -> None:
    text = f"void main() {{ float x = 0.0; switch (int(gl_FragCoord.x)) {{\n {cases} }} gl_FragColor = vec4(x); }}"
    with pytest.raises(KernelError, match=re.escape(said)):
        parse(text)


OLDER = {
    "an array whose indices say its length": """#version 120
vec2 a[]; vec2 b[]; void main() { float c[]; c[2] = 3.0; float c[3] = float[](0.0, 1.0, 7.0);
a[3].y = gl_FragCoord.x; b[3] = abs(a[3]); gl_FragColor = vec4(c[2], b[3].y, 0.0, 1.0); }""",
    "a variable with the name of a later type": """#version 110
void main() { float mat4x2 = gl_FragCoord.x; gl_FragColor = vec4(mat4x2, 0.0, 0.0, 1.0); }""",
}


@pytest.mark.gl
@pytest.mark.parametrize("name", OLDER)
def test_valid_shaders_of_older_versions_give_what_the_driver_gives(name: str, there: Original) -> None:
    expected = there.run(OLDER[name], (3, 1), {}, {}, head="")
    with pg.compile(pg.kernel(glsl=OLDER[name])(into=pg.target("r", "rgba32f", size=(3, 1)))) as program:
        assert np.array_equal(program()["r"], expected)


def test_a_variable_hides_a_parameter_in_the_first_version_for_devices() -> None:
    """GLSL ES 1.00 nests the scope of a body in that of its function, as glslang does; Mesa and WebGL refuse it."""
    text = "#version 100\nprecision highp float; float f(float x) { float x = 7.0; return x; } "
    kernel = pg.kernel(glsl=text + "void main() { gl_FragColor = vec4(f(1.0)); }")
    with pg.compile(kernel(into=pg.target("r", "rgba32f", size=(1, 1)))) as program:
        assert program()["r"][0, 0].tolist() == [7.0] * 4


def test_what_fixed_functions_hand_on_is_what_opengl_begins_with() -> None:
    text = """#version 120
varying vec4 gl_TexCoord[2]; void main() {
gl_FragColor = vec4(gl_TexCoord[0].xy, gl_TexCoord[1].w, gl_TexCoord[0].w) + gl_Color - gl_SecondaryColor.a; }"""
    shader = parse(text)
    assert [note.text for note in shader.notes] == [
        "gl_TexCoord[0] is the position in the picture here, from (0, 0) at the bottom left to (1, 1)"
    ]
    for declared in ("varying vec4 gl_TexCoord[2];", "varying vec4 gl_TexCoord[];", ""):
        kernel = pg.kernel(glsl=text.replace("varying vec4 gl_TexCoord[2];", declared))
        with pg.compile(kernel(into=pg.target("r", "rgba32f", size=(2, 2)))) as program:
            assert program()["r"][..., :].tolist() == [
                [[0.25, 0.75, 1.0, 1.0], [0.75, 0.75, 1.0, 1.0]],
                [[0.25, 0.25, 1.0, 1.0], [0.75, 0.25, 1.0, 1.0]],
            ]


@pytest.mark.parametrize(
    ("value", "said"),
    [
        ("vec2(1.0, 2.0, 3.0)", "vec2() takes 2 components, got another argument behind them"),
        ("vec4(mat2(1.0), 1.0)", "vec4() takes 4 components, got another argument behind them"),
        ("mat2(mat2(1.0), 1.0)", "mat2() takes one matrix, or numbers and vectors, got both"),
        ("(x > 1.0 ? 1.0 : f())", "both sides of ? : must have one type, got a void function on one of them"),
        ("(x > 1.0 ? f() : f())", "a void function gives no value"),
    ],
)
def test_values_that_do_not_fit(value: str, said: str) -> None:
    with pytest.raises(KernelError, match=re.escape(said)):
        parse(f"void f() {{}} void main() {{ float x = gl_FragCoord.x; gl_FragColor = vec4({value}[0]); }}")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("#version 300 es\nout mediump vec4 o; void main() { float a[]; a[1] = 1.0; o = vec4(a[1]); }",
         "the length of an array is a known whole number from 1 to"),
        ("#version 120\nvoid main() { float a[2]; a[1] = 1.0; float a[3]; }", "a is declared already in this scope"),
        ("#version 300 es\nout mediump vec4 o; float f(float x) { float x = 1.0; return x; } void main() { f(1.0); }",
         "x is declared already in this scope"),
    ],
)  # fmt: skip
def test_what_other_versions_have(text: str, said: str) -> None:
    with pytest.raises(KernelError, match=re.escape(said)):
        parse(text)


def test_an_error_behind_a_continued_word_shows_its_own_line() -> None:
    text = "void main() {\n    float a\\\nb = 1.0; float\\\n c = ab + unknown;\n    gl_FragColor = vec4(c);\n}"
    with pytest.raises(KernelError) as raised:
        parse(text)
    assert str(raised.value) == (
        "<shader>:4: 'unknown' is not defined here; declare it before\n     c = ab + unknown;\n              ^^^^^^^"
    )


@pytest.mark.parametrize("condition", ["defined", "defined(", "defined(A", "defined 1"])
def test_defined_takes_a_name(condition: str) -> None:
    with pytest.raises(KernelError, match=r"defined takes the name of a macro|this parenthesis is not closed"):
        parse(f"#if {condition}\n#endif\nvoid main() {{ gl_FragColor = vec4(1.0); }}")
