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
float b[] = { 7.0, 8.0 }; o = vec4(a[1][2], a[0][1], float(a.length()), b[1]); }""",
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
