"""What each version of GLSL forbids: reserved words, operators, qualifiers; and that the others allow it."""

from __future__ import annotations

import pytest

import passgraph as pg

MAIN = "void main() { gl_FragColor = vec4(1.0); }"
NEW = "out vec4 color; void main() { color = vec4(1.0); }"


def kernel(text: str) -> pg.Kernel:
    return pg.kernel(glsl=text, name="k")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("float input;" + MAIN, "'input' is a reserved word of GLSL; choose another name"),
        ("float half() { return 1.0; }" + MAIN, "'half' is a reserved word of GLSL"),
        ("struct using { float a; };" + MAIN, "'using' is a reserved word of GLSL"),
        ("struct S { float this; };" + MAIN, "'this' is a reserved word of GLSL"),
        ("void f(float double) { }" + MAIN, "'double' is a reserved word of GLSL"),
        ("void main() { float if = 1.0; }", "'if' is a reserved word of GLSL"),
        ("#version 330\nfloat filter;" + NEW, "'filter' is a reserved word of GLSL 3.30"),
        ("#version 300 es\nprecision highp float; float sample;" + NEW, "'sample' is a reserved word of GLSL ES 3.00"),
        ("#version 300 es\nprecision highp float; uniform common { float a; } b;" + NEW, "'common' is a reserved"),
        ("float gl_mine;" + MAIN, "'gl_mine': names that begin with gl_ belong to GLSL"),
        ("#version 100\nvoid main() { int a = 5 % 3; }", "GLSL ES 1.00 has no operator %; begin with a newer #version"),
        ("#version 120\nvoid main() { int a = 5; a <<= 1; }", "GLSL 1.20 has no operator <<="),
        ("#version 110\nvoid main() { int a = ~5; }", "GLSL 1.10 has no operator ~"),
        ("void main() { uniform float a; }", "a variable inside of a function cannot be uniform; leave that out"),
        ("void main() { in float a; }", "a variable inside of a function cannot be in"),
        ("void f(uniform float a) { }" + MAIN, "a parameter cannot be uniform"),
        ("in float f() { return 1.0; }" + MAIN, "the result of a function cannot be in"),
        ("struct S { uniform float a; };" + MAIN, "a field of a struct cannot be uniform"),
        ("uniform sampler2D s; sampler2D f() { return s; }" + MAIN, "a function cannot return a sampler"),
        ("void f(out sampler2D s) { }" + MAIN, "a sampler cannot be out"),
        ("int main() { return 1; }", "main returns nothing; write void main()"),
        ("float f() { return; }" + MAIN, "a function that is not void returns a value; write it after return"),
        ("void f() { break; }" + MAIN, "break belongs inside a loop"),
        ("void f() { while (true) { } continue; }" + MAIN, "continue belongs inside a loop"),
        ("float f(const float a) { a = 2.0; return a; } void main() { f(1.0); }", "a is a parameter and cannot be"),
        (
            "#version 300 es\nprecision highp float; void f(mediump in float a) { }" + NEW,
            "in comes earlier: const, then in or out, then precision",
        ),
    ],
)  # fmt: skip
def test_what_a_version_forbids_is_refused(text: str, message: str) -> None:
    with pytest.raises(pg.KernelError) as caught:
        kernel(text)
    assert message in str(caught.value)


@pytest.mark.parametrize(
    "text",
    [
        "float filter, sample, buffer, smooth, patch, lowp;" + MAIN,  # names in text without a version
        "#version 110\nfloat lowp;" + MAIN,
        "#version 120\nfloat filter;" + MAIN,
        "#version 330\nfloat sample;" + NEW,
        "#version 130\nvoid main() { int a = (5 % 3) << 1; gl_FragColor = vec4(a); }",
        "#version 420\nvoid f(mediump in float a) { }" + NEW,
        "void main() { for (int i = 0; i < 2; i++) { switch (i) { case 0: continue; default: break; } } "
        "gl_FragColor = vec4(1.0); }",
        "layout(origin_upper_left) in vec4 gl_FragCoord;" + MAIN,
        "float f(const in float a) { return a; } void main() { gl_FragColor = vec4(f(1.0)); }",
    ],
)
def test_what_a_version_allows_is_read(text: str) -> None:
    assert kernel(text).name == "k"
