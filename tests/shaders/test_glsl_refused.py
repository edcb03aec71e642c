"""Invalid GLSL, one shader for each rule: what the error says.

Sections are those of GLSL 3.30, or of the version that is named.
"""

from __future__ import annotations

import pytest

import passgraph as pg

HEADS = {
    "": "",
    "100": "#version 100\nprecision highp float;\n",
    "300 es": "#version 300 es\nprecision highp float; out vec4 color;\n",
    "310 es": "#version 310 es\nprecision highp float; out vec4 color;\n",
    "330": "#version 330\nout vec4 color;\n",
    "460": "#version 460\nout vec4 color;\n",
}
MAIN, NEW = "void main() { gl_FragColor = vec4(1.0); }", "void main() { color = vec4(1.0); }"
CONSTANT = "must be a constant expression: of literals, constants and built-in functions"

#: The rule with its section, the version, the shader, and a part of the error.
REFUSED = [
    # Names, and constant expressions
    ("4.2.2: a name of one branch in the other", "330",
     "void main() { if (true) { float b = 1.0; } else { color.x = b; } }", "'b' is not defined here"),
    ("4.2.2: a name in a function that nothing calls", "", "float f() { return nowhere; }" + MAIN,
     "'nowhere' is not defined here"),
    ("4.3.3: the value of a constant outside of functions", "", "uniform float u; const float k = u;" + MAIN,
     "const k " + CONSTANT),
    ("4.3.3: the value of a local constant", "330", "uniform float u; void main() { const float k = u; color.x = k; }",
     "const k " + CONSTANT),
    ("4.3.3: a variable in a constant", "100", "void main() { float a = 1.0; const float k = a; gl_FragColor.x = k; }",
     "const k " + CONSTANT),
    ("4.3.3: the shader's own function in a constant", "300 es",
     "float f() { return 1.0; } void main() { const float k = f(); color.x = k; }", "const k " + CONSTANT),
    ("4.3.3: a parameter in a constant, whatever is passed", "300 es",
     "float f(const float a) { const float k = a; return k; } void main() { color.x = f(1.0); }",
     "const k " + CONSTANT),
    ("4.1.9: a parameter as the length of an array", "",
     "float f(const int n) { float a[n]; a[0] = 1.0; return a[0]; } void main() { gl_FragColor.x = f(3); }",
     "the length of an array " + CONSTANT),
    ("4.1.9: a variable as the length of an array", "330", "void main() { int n = 3; float a[n]; color.x = a[0]; }",
     "the length of an array must be a whole number that is known here"),
    ("6.2: a label that varies", "330", "uniform int u; void main() { switch (1) { case u: color.x = 1.0; } }",
     "a label must be a"),
    ("ES 1.00, 4.3: a global from a uniform", "100", "uniform float u; float g = u;" + MAIN,
     "the value of g outside of functions " + CONSTANT),
    ("ES 3.00, 4.3: a global from a global", "300 es", "float g = 1.0; float h = g;" + NEW,
     "the value of h outside of functions " + CONSTANT),
    ("ES 3.00, 4.3.3: a comma in a constant", "300 es", "const float k = (1.0, 2.0);" + NEW, "const k " + CONSTANT),
    # Functions that nothing calls
    ("6.1: a void function returns a value", "100", "void f() { return 1.0; }" + MAIN,
     "f is void and returns no value"),
    ("6.1.1: a constant parameter is written to", "300 es", "void f(const float a) { a = 1.0; }" + NEW,
     "a is a parameter and cannot be assigned to"),
    ("6.1.1: an element of a constant parameter is written to", "300 es",
     "void f(const float a[3]) { a[0] = 1.0; }" + NEW, "a is a parameter and cannot be assigned to"),
    ("5.8: types in a function that nothing calls", "330", "float f() { int i = 1.5; return 1.0; }" + NEW,
     "i must be int, got float"),
    ("6.1: recursion in functions that nothing calls", "330",
     "float f(float a); float g(float a) { return f(a); } float f(float a) { return g(a); }" + NEW, "calls itself"),
    ("4.1.7: a sampler in a struct that is given back", "",
     "struct S { float x; sampler2D t; }; uniform S s; S f() { return s; }" + MAIN,
     "a function cannot return a sampler"),
    ("4.1.7: a sampler in a struct that is written to", "", "struct S { sampler2D t; }; void f(inout S s) { }" + MAIN,
     "f(s) holds a sampler, which cannot be inout"),
]  # fmt: skip


@pytest.mark.parametrize(("version", "text", "message"), [row[1:] for row in REFUSED], ids=[row[0] for row in REFUSED])
def test_an_invalid_shader_is_refused(version: str, text: str, message: str) -> None:
    with pytest.raises(pg.KernelError) as caught:
        pg.kernel(glsl=HEADS[version] + text, name="k")
    assert message in str(caught.value)
    assert "^" in str(caught.value)  # the caret


@pytest.mark.parametrize(
    ("version", "text"),
    [
        # A local constant may depend on anything from GLSL 4.20 on, and so in text without a version.
        ("", "uniform float u; void main() { const float k = u; gl_FragColor.x = k; }"),
        ("460", "void main() { float a = 1.0; const float k = a; color.x = k; }"),
        ("330", "uniform float u; float g = u; void main() { color.x = g; }"),
        ("100", "const float k = (1.0, 2.0);" + MAIN),
        ("300 es", "const int n = 3; const float k[n] = float[](1.0, sin(2.0), float(n)); float a[k.length()];" + NEW),
        ("330", "const vec3 v = vec3(1.0, 2.0, 3.0); struct S { int i; }; const S s = S(2); float a[s.i];"
         "void main() { const float k = v.y; color.x = k; }"),
        ("330", "float a[gl_MaxDrawBuffers];" + NEW),
        # What is not read here is no error in a function that nothing calls.
        ("", "vec4 f(samplerCube s, vec3 v) { return textureCube(s, v); }" + MAIN),
        ("", "float f(float x) { return noise1(x); } bool h() { return gl_HelperInvocation; }" + MAIN),
        ("", "float f(int n, float a[4]) { float s = 0.0; for (int i = 0; i < n; i++) s += a[i]; return s; }" + MAIN),
        ("", "void f(out vec2 a, inout vec2 b, sampler2D s) { a = b + texture2D(s, b).xy; b = a; }" + MAIN),
    ],
)  # fmt: skip
def test_what_differs_little_from_it_is_read(version: str, text: str) -> None:
    assert pg.kernel(glsl=HEADS[version] + text, name="k").name == "k"
