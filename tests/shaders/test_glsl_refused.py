"""Invalid GLSL, one shader for each rule: what the error says.

Sections are those of GLSL 3.30, or of the version that is named.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

import passgraph as pg

if TYPE_CHECKING:
    import moderngl

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
    ("6.1: a call of a function without a body", "330", "float f(float a); float g() { return f(1.0); }" + NEW,
     "f is declared but has no body"),
    ("4.1.7: a sampler in a struct that is given back", "",
     "struct S { float x; sampler2D t; }; uniform S s; S f() { return s; }" + MAIN,
     "a function cannot return a sampler"),
    ("4.1.7: a sampler in a struct that is written to", "", "struct S { sampler2D t; }; void f(inout S s) { }" + MAIN,
     "f(s) holds a sampler, which cannot be inout"),
    # Declarations
    ("4.2.2: a name twice in one scope", "330", "void main() { float a; int a; }",
     "a is declared already in this scope"),
    ("4.2.2: a name of two kinds", "330", "struct f { float a; }; float f() { return 1.0; }" + NEW,
     "f is a struct already"),
    ("4.2.2: a name of one block in another", "330", "void main() { { float b; } color.x = b; }", "'b' is not defined"),
    ("4.2.2: a name before its declaration", "330", "void f() { color.x = later; } float later; void main() { f(); }",
     "'later' is used before its declaration; declare it before"),
    ("4.1.8: a struct before its declaration", "330", "S s; struct S { float a; };" + NEW,
     "a type is expected here, got 'S'"),
    ("4.1.8: a struct in a struct", "330", "struct S { struct T { float a; } t; };" + NEW,
     "a struct within a struct is declared before it"),
    ("4.1.8: a struct without fields", "330", "struct S { };" + NEW, "has no fields"),
    ("3.6: a reserved word as a name", "300 es", "float texture2DRect, input;" + NEW, "'input' is a reserved word"),
    ("3.7: names that begin with gl_", "330", "float gl_more;" + NEW, "names that begin with gl_ belong to GLSL"),
    ("4.1.9: arrays of arrays before GLSL 4.30", "330", "void main() { float[2] a[3]; }",
     "GLSL 3.30 has no arrays of arrays; begin with a newer #version"),
    ("ES 3.00, 4.1.9: arrays of arrays as parameters", "300 es", "void f(float a[2][2]) { }" + NEW,
     "GLSL ES 3.00 has no arrays of arrays"),
    ("4.1.9: an array with no length and no value", "300 es", "void main() { float a[]; }",
     "the length of an array is a"),
    ("4.1.9: a length of 0", "330", "void main() { float a[0]; }",
     "the length of an array is a known whole number from 1"),
    ("4.1.9: another number of elements", "330", "void main() { float a[3] = float[3](1.0, 2.0); }",
     "takes 3 values, got 2"),
    ("GLSL 4.20, 4.1.11: lists in braces before 4.20", "330", "void main() { float a[2] = { 1.0, 2.0 }; }",
     "GLSL 3.30 has no lists in braces; write the array's constructor"),
    ("ES 3.10: lists in braces", "310 es", "void main() { vec2 a = { 1.0, 2.0 }; }",
     "GLSL ES 3.10 has no lists in braces"),
    ("4.3: two storage qualifiers of another kind inside of a function", "330", "void main() { uniform float a; }",
     "a variable inside of a function cannot be uniform"),
    ("4.3.3: a constant without a value", "330", "const float k;" + NEW, "const k needs a value"),
    ("4.3.3: a constant that is written to", "330", "const float k = 1.0; void main() { k = 2.0; }",
     "k is const and cannot be assigned to"),
    ("4.3.5: a uniform that is written to", "330", "uniform float k; void main() { k = 2.0; }",
     "k is a uniform and cannot be assigned to"),
    ("4.3.7: a block with a qualifier of inputs", "300 es", "uniform B { in float a; };" + NEW,
     "a member of a block of uniforms cannot be in; leave that out"),
    ("4.3.7: an invariant block", "300 es", "invariant uniform B { float a; };" + NEW,
     "a block of uniforms cannot be invariant"),
    ("4.3.7: a constant in a block", "300 es", "uniform B { const float a; };" + NEW,
     "a member of a block of uniforms cannot be const"),
    ("4.3.7: a sampler in a block", "300 es", "uniform B { sampler2D s; };" + NEW,
     "a block of uniforms cannot hold a sampler, got s; declare it outside"),
    ("4.3.7: a struct that a block declares", "300 es", "uniform B { struct S { float a; } s; };" + NEW,
     "a struct within"),
    ("4.3.7: two blocks of one name", "300 es", "uniform B { float a; } b; uniform B { float a; } c;" + NEW,
     "B is a block already"),
    ("4.3.7: a member twice", "300 es", "uniform B { float a; float a; } b;" + NEW, "a stands here already"),
    ("ES 3.10, 4.3.9: arrays of arrays of blocks", "310 es", "uniform B { float a; } b[2][2];" + NEW,
     "GLSL ES 3.10 has no arrays of arrays of blocks, got B[][]"),
    ("4.3.8: a layout that is none", "300 es", "layout(std14) uniform B { float a; };" + NEW,
     "there is no layout 'std14'; did you mean 'std140'?"),
    ("4.3.8.1: two conventions of gl_FragCoord", "330",
     "layout(origin_upper_left) in vec4 gl_FragCoord;\nin vec4 gl_FragCoord;" + NEW,
     "gl_FragCoord has origin_upper_left already (line 3), got no layout; write both alike"),
    ("7.1: a built-in variable of another type", "", "varying vec3 gl_TexCoord[2];" + MAIN,
     "gl_TexCoord is built in as in or varying vec4, got varying vec3; declare it so, or not at all"),
    ("7.1: a built-in input as a uniform", "330", "uniform float gl_ClipDistance[2];" + NEW,
     "gl_ClipDistance is built in as in or varying float, got uniform float"),
    ("7.2: gl_FragColor and gl_FragData", "", "void main() { gl_FragColor = vec4(1.0); gl_FragData[0] = vec4(1.0); }",
     "a shader writes one kind of outputs, got gl_FragColor and gl_FragData; leave out one"),
    ("7.2: gl_FragColor, and an output in a function that nothing calls", "330",
     "void f() { color.x = 1.0; } void main() { gl_FragColor = vec4(1.0); }",
     "one kind of outputs, got gl_FragColor and"),
    ("4.7: qualifiers in another order", "300 es", "void f(highp in float a) { }" + NEW, "in comes earlier"),
    # Functions
    ("6.1: a prototype with another qualifier", "330", "void f(float a);\nvoid f(const float a) { }" + NEW,
     "f takes this as in already (line 3), got const in; write both alike"),
    ("6.1: a prototype that passes otherwise", "330", "void f(out float a);\nvoid f(inout float a) { }" + NEW,
     "f takes this as out already (line 3), got inout"),
    ("6.1: a prototype with another result", "330", "float f(float a); int f(float a) { return 1; }" + NEW,
     "f gives float for these parameters already"),
    ("6.1: two bodies", "330", "void f(float a) { } void f(float b) { }" + NEW,
     "f is defined for these parameters already"),
    ("ES 1.00, 4.2.6: two prototypes", "100",
     "float f(float a); float f(float a); float f(float a) { return a; }" + MAIN,
     "f is declared already; GLSL ES 1.00 has one declaration of each"),
    ("6.1: an array of unknown length as a parameter", "330", "void f(float a[]);" + NEW,
     "an array as a parameter has a known length, got a[]; write it"),
    ("ES 1.00, 6.1: an array as a result", "100", "struct S { float a[2]; }; S f() { S s; return s; }" + MAIN,
     "GLSL ES 1.00 has no functions that return arrays, also in structs"),
    ("ES 3.00, 6.1: a built-in function's name", "300 es", "float sin(int a) { return 1.0; }" + NEW,
     "sin is a function of GLSL ES 3.00 already; choose another name"),
    ("ES 1.00, 8: a built-in function's name and parameters", "100", "float sin(float a) { return 1.0; }" + MAIN,
     "sin is a function of GLSL ES 1.00 already"),
    ("6.1: a call before the declaration", "330", "void main() { color.x = f(); } float f() { return 1.0; }",
     "f is called before its declaration"),
    ("6.1: too few arguments", "330", "float f(float a) { return a; } void main() { color.x = f(); }",
     "f takes 1 arguments"),
    ("6.1: an argument of another type", "330", "float f(vec2 a) { return a.x; } void main() { color.x = f(1.0); }",
     "f takes no (float)"),
    ("6.1: a value for an out parameter", "330", "void f(out float a) { a = 1.0; } void main() { f(1.0); }",
     "f writes to its parameter 'a', which takes a variable"),
    ("6.1: a parameter's name twice", "330", "void f(float a, int a) { }" + NEW, "a stands here already"),
    ("6.1: main with a result", "330", "int main() { return 1; }", "main returns nothing; write void main()"),
    ("6.4: break outside of a loop", "330", "void f() { break; }" + NEW, "break belongs inside a loop"),
    ("6.4: return without a value", "330", "float f() { return; }" + NEW,
     "a function that is not void returns a value"),
    # Statements and expressions
    ("6.2: a condition that is no bool", "330", "void main() { if (1) color.x = 1.0; }",
     "a condition must be bool, got int"),
    ("6.2: a switch over a float", "330", "void main() { switch (1.0) { default: break; } }", "takes an int or a uint"),
    ("6.2: a label twice", "330", "void main() { switch (1) { case 1: break; case 1: break; } }", "has case 1 already"),
    ("6.2: default twice", "330", "void main() { switch (1) { default: break; default: break; } }",
     "has default already"),
    ("6.2: a statement before the first label", "330", "void main() { switch (1) { color.x = 1.0; } }",
     "case or default is"),
    ("6.2: a label at the end of a switch", "330", "void main() { switch (1) { case 0: break; default: } }",
     "a switch ends with a statement, got a label; write break; behind it"),
    ("6.2: a label outside of a switch", "330", "void main() { for (;;) { case 1: break; } }",
     "a label stands in the block of a switch, got case; move it there"),
    ("5.1: operators that ES 1.00 reserves", "100", "void main() { int a = 5 % 3; }", "GLSL ES 1.00 has no operator %"),
    ("5.4.2: too few components", "330", "void main() { color = vec4(vec2(1.0)); }",
     "vec4() takes 4 components, got 2"),
    ("5.4.2: an argument behind the last component", "330", "void main() { color = vec4(color, 1.0); }",
     "got another argument"),
    ("5.5: a component twice on the left side", "330", "void main() { color.xx = vec2(1.0); }",
     "names a component twice"),
    ("5.5: a component that a vector lacks", "330", "void main() { vec2 a = vec2(1.0); color.x = a.z; }", "z"),
    ("5.8: an assignment to no variable", "330", "void main() { 1.0 = 2.0; }", "this cannot be assigned to"),
    ("5.8: narrowing", "330", "void main() { int a = 1.5; }", "a must be int, got float"),
    ("4.1.3: an octal number with an 8", "300 es", "void main() { int a = 018; }", "018 begins with 0 and so is octal"),
    ("ES 3.00, 4.1.4: a suffix of a whole number", "300 es", "void main() { float a = 1f; }",
     "1f is no number of GLSL ES 3.00; write 1.0"),
    # The preprocessor
    ("ES 3.00, 3.1: a number that goes on as a name", "300 es", "#define e +1\nvoid main() { int a = 1e; }",
     "1e is no number and no name; put a space or a sign between"),
    ("3.3: a macro with another meaning", "330", "#define A 1\n#define A 2\n" + NEW,
     "macro A has another meaning already"),
    ("3.3: a macro named defined", "330", "#define defined 1\n" + NEW, "defined"),
    ("3.3: an unknown directive", "330", "#def A\n" + NEW, "there is no directive #def"),
    ("3.3: #error", "330", "#error too old\n" + NEW, "the shader says: too old"),
    ("3.3: a condition without an end", "330", "#if 1\n" + NEW, "this condition has no #endif"),
    ("3.3: #else twice", "330", "#if 1\n#else\n#else\n#endif\n" + NEW, "#else after #else"),
    ("3.3: a word behind #endif", "330", "#if 1\n#endif x\n" + NEW, "#endif ends before 'x'"),
    ("3.3: a float in a condition", "330", "#if 1.0\n#endif\n" + NEW, "is not a whole number"),
    ("ES 3.00, 3.4: an unknown name in a condition", "300 es", "#if UNKNOWN\n#endif\n" + NEW, "UNKNOWN is not defined"),
    ("3.3: too few arguments of a macro", "330", "#define F(a, b) a\nfloat x = F(1.0);" + NEW,
     "macro F takes 2 arguments"),
    ("3.3: a behavior that is none", "330", "#extension GL_ARB_texture_gather : perhaps\n" + NEW,
     "#extension takes NAME :"),
    ("3.3: #version behind a declaration", "", "float a;\n#version 330\n" + NEW,
     "#version stands before everything else"),
    ("3.3: #version behind a macro", "", "#define A\n#version 330\n" + NEW, "#version stands before everything else"),
    ("3.3: a word behind #version", "", "#version 100 more\n" + MAIN, "there is no GLSL 100 more"),
    ("3.4: a comment without an end", "330", NEW + " /* and", "*/ is missing"),
]  # fmt: skip


#: Versions and shaders that come close, and are valid.
READ = [
    # A local constant may depend on anything from GLSL 4.20 on, and so in text without a version.
    ("", "uniform float u; void main() { const float k = u; gl_FragColor.x = k; }"),
    ("460", "void main() { float a = 1.0; const float k = a; color.x = k; }"),
    ("330", "uniform float u; float g = u; void main() { color.x = g; }"),
    ("100", "const float k = (1.0, 2.0);" + MAIN),
    ("300 es", "const int n = 3; const float k[n] = float[](1.0, sin(2.0), float(n)); float a[k.length()];" + NEW),
    ("330", "const vec3 v = vec3(1.0, 2.0, 3.0); struct S { int i; }; const S s = S(2); float a[s.i];"
     "void main() { const float k = v.y; color.x = k; }"),
    ("330", "float a[gl_MaxDrawBuffers];" + NEW),
    ("330", "void main() { vec4 color = vec4(1.0); color.x = 2.0; gl_FragColor = color; }"),
    ("", "#version 330\n#extension GL_ARB_arrays_of_arrays : enable\nout vec4 color; float a[2][3];"
     "void main() { a[1][2] = 1.0; color.x = a[1][2]; }"),
    ("", "void main() { float a[2][2] = { { 1.0, 2.0 }, { 3.0, 4.0 } }; gl_FragColor.x = a[1][0] + 1f; }"),
    ("330", "uniform B { layout(row_major) uniform mat4 m; float a; } b[2]; void main() { color.x = b[1].a; }"),
    ("330", "in vec4 gl_FragCoord; void main() { gl_FragDepth = 1.0; color = gl_FragCoord; }"),
    ("100", "float round(float x) { return floor(x + 0.5); } float sin(int x) { return sin(float(x)); }" + MAIN),
    ("300 es",
     "vec4 texture2D(sampler2D s, vec2 v) { return texture(s, v); } float f(float a); float f(float a);" + NEW),
    ("330", "float sin(float x) { return x; } void main() { color.x = sin(3.0); }"),
    ("330", "void main() { switch (1) { case 0: default: ; } color.x = 1.0; }"),
    ("330", "#define A(x) x\n#if 0\n1e 0x \n#endif\nvoid main() { color.x = A(1e2) + .5e-1; }"),
    ("", "#version 120\n#extension GL_EXT_gpu_shader4 : enable\nvoid main() { gl_FragColor = vec4(5 % 3 << 2); }"),
    # What is not read here is no error in a function that nothing calls.
    ("", "vec4 f(samplerCube s, vec3 v) { return textureCube(s, v); }" + MAIN),
    ("", "float f(float x) { return noise1(x); } bool h() { return gl_HelperInvocation; }" + MAIN),
    ("", "float f(int n, float a[4]) { float s = 0.0; for (int i = 0; i < n; i++) s += a[i]; return s; }" + MAIN),
    ("", "void f(out vec2 a, inout vec2 b, sampler2D s) { a = b + texture2D(s, b).xy; b = a; }" + MAIN),
]  # fmt: skip


@pytest.mark.parametrize(("version", "text", "message"), [row[1:] for row in REFUSED], ids=[row[0] for row in REFUSED])
def test_an_invalid_shader_is_refused(version: str, text: str, message: str) -> None:
    with pytest.raises(pg.KernelError) as caught:
        pg.kernel(glsl=HEADS[version] + text, name="k")
    assert message in str(caught.value)
    assert "^" in str(caught.value)  # the caret below the line


@pytest.mark.parametrize(("version", "text"), READ)
def test_what_differs_little_from_it_is_read(version: str, text: str) -> None:
    assert pg.kernel(glsl=HEADS[version] + text, name="k").name == "k"


def refused_by(context: moderngl.Context, version: str, text: str) -> bool:
    """Return True if the driver refuses a fragment shader, or to link it."""
    import moderngl

    head, given = HEADS[version].split("\n")[0], "attribute" if version in ("", "100") else "in"
    corner = f"{given} vec2 corner; void main() {{ gl_Position = vec4(corner, 0.0, 1.0); }}"
    try:
        context.program(vertex_shader=f"{head}\n{corner}", fragment_shader=HEADS[version] + text).release()
    except moderngl.Error:
        return True
    return False


@pytest.mark.gl
def test_the_driver_refuses_the_same(context: moderngl.Context) -> None:
    """Mesa lets a block have a member twice, and has no GLSL 4.60."""
    taken = [rule for rule, version, text, _ in REFUSED if not refused_by(context, version, text)]
    assert taken == ["4.3.7: a member twice"]


@pytest.mark.gl
def test_the_driver_reads_the_same(context: moderngl.Context) -> None:
    """Text without a version is read here as the version that allows it; Mesa reserves texture2D in ES 3.00, too."""
    rows = [(version, text) for version, text in READ if version not in ("", "460") and "vec4 texture2D" not in text]
    assert [text for version, text in rows if refused_by(context, version, text)] == []
