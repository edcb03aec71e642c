"""Valid GLSL, one shader for each rule, with the numbers that the rule gives.

Sections are those of GLSL 3.30, or of the version that is named. ``test_glsl_refused`` has the rules of invalid text.
"""

from __future__ import annotations

import numpy as np
import pytest
from original import original

import passgraph as pg

HEADS = {
    "": "",
    "100": "#version 100\nprecision highp float;\n",
    "300 es": "#version 300 es\nprecision highp float; out vec4 color;\n",
    "330": "#version 330\nout vec4 color;\n",
    "430": "#version 430\nout vec4 color;\n",
}
#: The rule with its section, the version, the shader, and the numbers of its output.
RULES = [
    # Types, constants and scopes
    ("4.1.3: octal and hexadecimal numbers", "330",
     "void main() { color = vec4(017, 0x1F, 0xFFu, 3u); }", (15, 31, 255, 3)),
    ("4.1.4: floats without digits on one side, and with exponents", "330",
     "void main() { color = vec4(.5, 2., 1e2, 25e-1f); }", (0.5, 2, 100, 2.5)),
    ("4.1.9: a length from the initial value", "330",
     "void main() { float a[] = float[](1.0, 2.0, 3.0); color = vec4(a.length(), a[2], 0, 0); }", (3, 3, 0, 0)),
    ("4.1.9: the length of an array as a constant", "330",
     "float a[3]; float b[a.length() + 1]; void main() { color = vec4(b.length(), a.length(), 0, 0); }", (4, 3, 0, 0)),
    ("GLSL 4.30, 4.1.9: arrays of arrays, their lengths", "430",
     "void main() { int a[2][3]; a[1][2] = 7; color = vec4(a.length(), a[0].length(), a[1][2], 0); }", (2, 3, 7, 0)),
    ("4.1.9: arrays are assigned and compared as a whole", "330",
     "void main() { float a[2] = float[](1.0, 2.0), b[2] = a; b[0] = 3.0; a = b;"
     "color = vec4(a[0], a == b, a != float[](3.0, 4.0), 0); }", (3, 1, 1, 0)),
    ("4.1.8: structs are assigned and compared as a whole", "330",
     "struct S { float a; vec2 b; }; void main() { S s = S(1.0, vec2(2.0)), t = s; t.b.y = 5.0;"
     "color = vec4(s == t, s != t, t.b.y, s.b.y); }", (0, 1, 5, 2)),
    ("4.2.2: an inner name hides an outer one up to the end of its block", "330",
     "float a = 1.0; void main() { color.x = a; float a = 2.0; { float a = 3.0; color.y = a; } color.z = a; }",
     (1, 3, 2)),
    ("4.2.2: a name begins behind its initial value", "330",
     "float a = 2.0; void main() { float a = a + 1.0; color = vec4(a, 0, 0, 0); }", (3, 0, 0, 0)),
    ("4.2.2: the counter of a loop hides another", "330",
     "void main() { int i = 5; float s = 0.0; for (int i = 0; i < 3; i++) s += float(i); color = vec4(s, i, 0, 0); }",
     (3, 5, 0, 0)),
    ("4.1.8: a variable named like its struct", "330",
     "struct S { float a; }; void main() { S S = S(4.0); color = vec4(S.a, 0, 0, 0); }", (4, 0, 0, 0)),
    ("4.1.8: a field named like a struct hides it nowhere", "330",
     "struct c { float v; }; struct S { float c; c d; };"
     "void main() { S s = S(1.0, c(2.0)); color = vec4(s.c, s.d.v, 0, 0); }",
     (1, 2, 0, 0)),
    ("4.3.3: constants of constants and built-in functions", "330",
     "const int n = 2 * 3 - 1; const float k = max(float(n), sqrt(4.0)); float a[n];"
     "void main() { color = vec4(k, a.length(), n % 3, n >> 1); }", (5, 5, 2, 2)),
    ("4.3.5: the initial value of a uniform", "330",
     "uniform vec2 u = vec2(3.0, 4.0); void main() { color = vec4(u, length(u), 0); }", (3, 4, 5, 0)),
    ("4.3.7: members of a block have its scope", "330",
     "uniform A { float c; } a; float c = 2.0; void main() { float x = a.c; color = vec4(c, 0, 0, 0); }", (2, 0, 0, 0)),
    # Expressions
    ("5.1: operators bind as in C", "330",
     "void main() { color = vec4(1 + 2 * 3, 6 & 3 | 8, 1 << 2 + 1, 7 ^ 2 & 3); }", (7, 10, 8, 5)),
    ("5.1: operators of one level go from left to right", "330",
     "void main() { color = vec4(8.0 / 4.0 / 2.0, 7 - 3 - 2, 100 >> 2 >> 1, 2.0 - 1.0 + 3.0); }", (1, 2, 12, 4)),
    ("5.4.1: conversions of numbers", "330",
     "void main() { color = vec4(int(-1.9), uint(3.7), bool(0.5), float(true)); }", (-1, 3, 1, 1)),
    ("5.4.2: a vector from vectors and numbers", "330",
     "void main() { color = vec4(vec2(1.0, 2.0), vec3(3.0, 4.0, 5.0)); }", (1, 2, 3, 4)),
    ("5.4.2: a matrix from one number, and from a matrix", "330",
     "void main() { mat2 m = mat2(2.0); mat3 n = mat3(m); color = vec4(m[0][0], m[1][0], n[2][2], n[1][1]); }",
     (2, 0, 1, 2)),
    ("5.4.2: a matrix has its columns first", "330",
     "void main() { mat2 m = mat2(1.0, 2.0, 3.0, 4.0); color = vec4(m[0], m[1]); }", (1, 2, 3, 4)),
    ("GLSL 4.60, 5.4.2: a vector from a matrix", "330",
     "void main() { color = vec4(mat3(1, 2, 3, 4, 5, 6, 7, 8, 9)); }", (1, 2, 3, 4)),
    ("5.5: components by three sets of names", "330",
     "void main() { vec4 v = vec4(1.0, 2.0, 3.0, 4.0); color = vec4(v.wx, v.gr.x, v.stpq.z); }", (4, 1, 2, 3)),
    ("5.5: components on the left side, in another order", "330",
     "void main() { vec4 v = vec4(0.0); v.wy = vec2(1.0, 2.0); v.xz.y = 3.0; color = v; }", (0, 2, 3, 1)),
    ("5.6: a product of a matrix and a vector, either way", "330",
     "void main() { mat2 m = mat2(1, 2, 3, 4); color = vec4(m * vec2(1, 1), vec2(1, 1) * m); }", (4, 6, 3, 7)),
    ("5.8: an assignment is a value, from right to left", "330",
     "void main() { float a, b; a = b = 3.0; a += b *= 2.0; color = vec4(a, b, 0, 0); }", (9, 6, 0, 0)),
    ("5.9: ++ and --, before and behind", "330",
     "void main() { int i = 5; int a = i++, b = ++i, c = i--; color = vec4(a, b, c, i); }", (5, 7, 7, 6)),
    ("5.9: ? : and && evaluate the side that is needed", "330",
     "int n = 0; bool f() { n++; return true; } void main() { bool a = false && f(), b = true || f();"
     "float c = true ? 1.0 : float(f()); color = vec4(n, a, b, c); }", (0, 0, 1, 1)),
    ("5.9: ^^ evaluates both sides", "330",
     "int n = 0; bool f() { n++; return true; } void main() { bool a = f() ^^ f(); color = vec4(n, a, 0, 0); }",
     (2, 0, 0, 0)),
    ("5.9: a comma gives the last value, after all others", "330",
     "void main() { float a = 1.0; float b = (a = 4.0, a + 1.0); color = vec4(a, b, 0, 0); }", (4, 5, 0, 0)),
    ("5.9: shifts of negative numbers, and of uints", "330",
     "void main() { color = vec4(-8 >> 1, uint(-8) >> 28u, 1 << 4, ~5); }", (-4, 15, 16, -6)),
    # Functions
    ("6.1: arguments are copied in, and out at the end", "330",
     "float g = 1.0; void f(inout float a) { a = 5.0; color.y = g; } void main() { f(g); color.x = g; }", (5, 1)),
    ("6.1: an overload by its types", "330",
     "float f(int a) { return 1.0; } float f(float a) { return 2.0; } float f(vec2 a) { return 3.0; }"
     "void main() { color = vec4(f(1), f(1.0), f(vec2(1.0)), 0); }", (1, 2, 3, 0)),
    ("6.1: an exact overload wins over a conversion", "330",
     "float f(uint a) { return 1.0; } float f(float a) { return 2.0; }"
     "void main() { color = vec4(f(1u), f(1.0), 0, 0); }",
     (1, 2, 0, 0)),
    ("6.1: a function before its body, by a prototype", "330",
     "float f(float); void main() { color = vec4(f(3.0), 0, 0, 0); } float f(float a) { return a * 2.0; }",
     (6, 0, 0, 0)),
    ("6.1.1: a constant parameter", "330",
     "float f(const in float a) { return a + 1.0; } void main() { color = vec4(f(1.0), 0, 0, 0); }", (2, 0, 0, 0)),
    ("6.1: an array as result and parameter", "330",
     "float[2] f(float a[2]) { a[0] += 1.0; return a; } void main() { float b[2] = float[](1.0, 2.0);"
     "float c[2] = f(b); color = vec4(c[0], c[1], b[0], f(c)[0]); }", (2, 2, 1, 3)),
    ("7.1: a function of a built-in one's name", "330",
     "float sin(float a) { return a + 1.0; } void main() { color = vec4(sin(1.0), cos(0.0), 0, 0); }", (2, 1, 0, 0)),
    ("8.8: products of 64 bits; Mesa folds those of constants to 32", "430",
     "void main() { uint z = uint(gl_FragCoord.x), h, l; umulExtended(0xFFFFFFFFu - z, 2u, h, l); int i, j;"
     "imulExtended(-2 - int(z), 3, i, j); color = vec4(h, l - 0xFFFFFFF0u, i, j); }", (1, 14, -1, -6)),
    # Statements
    ("6.2: a switch falls through to the next label", "330",
     "float f(int i) { float s = 0.0; switch (i) { case 0: s += 1.0; case 1: s += 2.0; break; default: s = 9.0; }"
     "return s; } void main() { color = vec4(f(0), f(1), f(2), 0); }", (3, 2, 9, 0)),
    ("6.2: default stands anywhere", "330",
     "float f(int i) { float s = 0.0; switch (i) { default: s += 1.0; case 1: s += 2.0; break; case 2: s = 7.0; }"
     "return s; } void main() { color = vec4(f(0), f(1), f(2), 0); }", (3, 2, 7, 0)),
    ("6.3: continue goes to the last expression of for", "330",
     "void main() { float s = 0.0; int i; for (i = 0; i < 5; i++) { if (i == 2) continue; s += float(i); }"
     "color = vec4(s, i, 0, 0); }", (8, 5, 0, 0)),
    ("6.3: do runs once at least", "330",
     "void main() { int n = 0; do n++; while (false); color = vec4(n, 0, 0, 0); }", (1, 0, 0, 0)),
    ("6.3: a variable in a loop's condition", "330",
     "void main() { int n = 3; float s = 0.0; while (bool b = n > 0) { s += float(n--); } color = vec4(s, n, 0, 0); }",
     (6, 0, 0, 0)),
    ("6.4: break leaves one loop, return all", "330",
     "float f() { float s = 0.0; for (int i = 0; i < 9; i++) { for (int k = 0; k < 9; k++) { if (k == 2) break;"
     "s += 1.0; if (i == 3) return s; } } return -1.0; } void main() { color = vec4(f(), 0, 0, 0); }", (7, 0, 0, 0)),
    ("6.4: discard leaves nothing of the pixel", "330",
     "void main() { color = vec4(1.0); if (gl_FragCoord.x < 9.0) discard; color = vec4(2.0); }", (0, 0, 0, 0)),
    ("7.1: gl_FragCoord at the middle of a pixel", "330",
     "void main() { color = gl_FragCoord; }", (0.5, 0.5, 0.5, 1)),
    ("4.3.8.1: pixel_center_integer", "330",
     "layout(pixel_center_integer) in vec4 gl_FragCoord; void main() { color = gl_FragCoord; }", (0, 0, 0.5, 1)),
    ("7.4: limits are constants", "330",
     "float a[gl_MaxDrawBuffers]; void main() { color = vec4(a.length() >= 4, 0, 0, 0); }", (1, 0, 0, 0)),
    ("7.5: gl_DepthRange", "330",
     "void main() { color = vec4(gl_DepthRange.near, gl_DepthRange.far, gl_DepthRange.diff, 0); }", (0, 1, 1, 0)),
    ("GLSL 1.20, 7.6: gl_TexCoord[0] is the position", "",
     "void main() { gl_FragColor = gl_TexCoord[0]; }", (0.5, 0.5, 0, 1)),
    ("ES 1.00, 7.2: gl_FragData", "100", "void main() { gl_FragData[0] = vec4(1.0, 2.0, 3.0, 4.0); }", (1, 2, 3, 4)),
    # The preprocessor
    ("3.3: macros with parameters, and of macros", "330",
     "#define TWICE(x) ((x) * 2)\n#define FOUR TWICE(2)\nvoid main() { color = vec4(FOUR, TWICE(1 + 2), 0, 0); }",
     (4, 6, 0, 0)),
    ("3.3: a macro's own name within it stays", "330",
     "int f(int x) { return x + 1; }\n#define f(x) f(x * 10)\nvoid main() { color = vec4(f(2), 0, 0, 0); }",
     (21, 0, 0, 0)),
    ("3.3: ## joins words", "330",
     "#define JOIN(a, b) a##b\nvoid main() { float xy = 3.0; color = vec4(JOIN(x, y), JOIN(1, 2), 0, 0); }",
     (3, 12, 0, 0)),
    ("3.3: conditions, elif, and defined", "330",
     "#define A 3\n#if A < 3\n#define B 1\n#elif A == 3 && defined(A) && !defined NONE\n#define B 2\n#else\n"
     "#define B 4\n#endif\nvoid main() { color = vec4(B, 0, 0, 0); }", (2, 0, 0, 0)),
    ("3.3: operators of conditions bind as in C", "330",
     "#if 1 + 2 * 3 == 7 && (4 >> 1 | 1) == 3 && -1 < 0\nvoid main() { color = vec4(1, 0, 0, 0); }\n#endif",
     (1, 0, 0, 0)),
    ("3.3: #undef, and another meaning behind it", "330",
     "#define A 1\n#undef A\n#define A 2\nvoid main() { color = vec4(A, 0, 0, 0); }", (2, 0, 0, 0)),
    ("3.3: __LINE__ and __VERSION__", "330",
     "#line 40\nvoid main() { color = vec4(__LINE__, __VERSION__, 0, 0); }", (40, 330, 0, 0)),
    ("ES 3.00, 3.4: GL_ES, and the version", "300 es",
     "void main() { color = vec4(GL_ES, __VERSION__, 0, 0); }", (1, 300, 0, 0)),
    ("3.3: names of extensions that are read", "100",
     "#ifdef GL_OES_standard_derivatives\nvoid main() { gl_FragColor = vec4(1.0, 0.0, 0.0, 0.0); }\n#endif",
     (1, 0, 0, 0)),
    ("GLSL 4.20, 3.1: a line that goes on inside of a word", "430",
     "void ma\\\nin() { color = vec4(1, 0, 0, 0); }", (1, 0, 0, 0)),
    ("3.4: comments are white space", "330",
     "void/**/main() { int a = 8 /* / */ / 2; // \\\n color = vec4(0);\ncolor = vec4(a, 0, 0, 0); }", (4, 0, 0, 0)),
]  # fmt: skip


@pytest.mark.parametrize(("version", "text", "due"), [row[1:] for row in RULES], ids=[row[0] for row in RULES])
def test_a_rule_gives_its_numbers(version: str, text: str, due: tuple[float, ...]) -> None:
    kernel = pg.kernel(glsl=HEADS[version] + text, name="k")
    arguments = {p.name: 0.0 for p in kernel.parameters if not p.has_default}
    into = pg.target("r", "rgba32f", size=(1, 1))
    with pg.compile(kernel(**arguments, into=into), backend="reference") as program:
        assert program()["r"][0, 0, : len(due)].tolist() == list(due)


@pytest.mark.gl
def test_the_driver_gives_the_same_numbers() -> None:
    with original() as there:
        for rule, version, text, due in RULES:
            if version in ("330", "430"):
                seen = there.run(text, (1, 1), {}, {}, head=HEADS[version])
                assert np.array_equal(seen[0, 0, : len(due)], due), rule
