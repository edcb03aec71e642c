"""Which names a scope of GLSL may declare, held against the OpenGL driver's compiler."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

import passgraph as pg
from passgraph.errors import KernelError
from passgraph.glsl import parse

if TYPE_CHECKING:
    import moderngl

VERTEX = "#version 330\nin vec2 at; void main() { gl_Position = vec4(at, 0.0, 1.0); }"
HEAD = "#version 330\nout vec4 shown;\n#define gl_FragColor shown\n"


def refusal(context: moderngl.Context, text: str) -> str:
    """What the driver says; empty where it takes the shader."""
    import moderngl

    try:
        context.program(vertex_shader=VERTEX, fragment_shader=HEAD + text).release()
    except moderngl.Error as error:
        return str(error)
    return ""


@pytest.mark.parametrize(
    ("statements", "name"),
    [
        ("for (int i = 0; i < 3; i++) { int i = 2; x += float(i); }", "i"),
        ("for (int i = 0; i < 3; i++) int i = 2;", "i"),
        ("for (int i = 0, k = 3; i < k; i++) { x += 1.0; int k = i; }", "k"),
        ("for (int i = 0; i < 3; i++) { x += 1.0; } int i = 1; int i = 2;", "i"),
        ("{ float x = 1.0; float x = 2.0; }", "x"),
        ("switch (int(x)) { case 0: int i = 1; break; case 1: int i = 2; break; }", "i"),
        ("x = own(x);", "a"),
    ],
)
def test_what_a_scope_has_is_not_declared_again(context: moderngl.Context, statements: str, name: str) -> None:
    """The block of a loop or a function is one scope with what stands in its head."""
    function = "float own(float a) { float a = 2.0; return a; }\n" if "own" in statements else ""
    text = f"{function}void main() {{ float x = 0.5; {statements} gl_FragColor = vec4(x); }}"
    assert re.search("redeclared|redeclaration", refusal(context, text))
    with pytest.raises(KernelError, match=f"{name} is declared already in this scope; give it another name") as error:
        parse(text)
    assert "^" in str(error.value)


@pytest.mark.parametrize(
    "statements",
    [
        "for (int i = 0; i < 3; i++) { { int i = 2; x += float(i); } }",
        "for (int i = 0; i < 3; i++) for (int i = 0; i < 2; i++) x += float(i);",
        "for (int i = 0; i < 3; i++) { for (int i = 0; i < 2; i++) { x += float(i); } }",
        "for (int i = 0; i < 3; i++) if (i > 1) { int i = 2; x += float(i); }",
        "int i = 1; for (i = 0; i < 3; i++) { int i = 2; x += float(i); }",
        "int i = 7; for (int i = 0; i < 3; i++) { x += float(i); } x += float(i);",
        "for (int i = 0; i < 3; i++) { x += 1.0; } for (int i = 0; i < 3; i++) { float k = x; x += k; }",
        "if (x > 0.0) { int i = 1; x += float(i); } else { int i = 2; x += float(i); }",
        "x = own(x);",
    ],
)
def test_an_inner_scope_may_declare_a_name_of_an_outer_one(context: moderngl.Context, statements: str) -> None:
    own = "float own(float a) { if (a > 0.0) { float a = 2.0; return a; } return a; }\n"
    function = own if "own" in statements else ""
    text = f"{function}void main() {{ float x = 0.5; {statements} gl_FragColor = vec4(x); }}"
    assert not refusal(context, text)
    parse(text)


@pytest.mark.parametrize(
    ("outside", "said", "at"),
    [
        ("float a;\nfloat a;", "a is a variable already (line 1)", (2, "a")),
        ("const float a = 1.0;\nint a = 1;", "a is a variable already", (2, "a")),
        ("float b, a, c, a;", "a is a variable already", (1, "a")),
        ("uniform float a;\nuniform float a;", "a is a uniform already", (2, "a")),
        ("uniform float a; float a = 2.0;", "a is a uniform already", (1, "a")),
        ("uniform Block { float a; };\nin vec2 a;", "a is a uniform already", (2, "a")),
        ("uniform Block { float a; vec2 a; };", "a stands here already", (1, "a")),
        ("uniform Block { float b; } a; float a;", "a is a block already", (1, "a")),
        ("in vec2 a; out vec4 a;", "a is a variable already", (1, "a")),
        ("float a() { return 1.0; }\nfloat a;", "a is a function already (line 1)", (2, "a")),
        ("float main;", "main is a variable already", (3, "main")),
        ("float a; struct a { float b; };", "a is a variable already", (1, "a")),
        ("struct a { float b; }; float a;", "a is a struct already", (1, "a")),
        ("float f(float a, int b, float a) { return a; }", "a stands here already", (1, "a")),
        ("float f() { return 1.0; }\nfloat f() { return 2.0; }", "f is defined for these parameters already (line 1)",
         (2, "f")),
        ("float f(vec2 a[2]) { return 1.0; } float f(in vec2[2] b) { return 2.0; }", "f is defined for", (1, "f")),
        ("float f(mat2 a) { return 1.0; }\nfloat f(mat2x2 b) { return 2.0; }", "f is defined for", (2, "f")),
        ("float f(float a);\nfloat f(float b) { return b; }\nfloat f(float c) { return c; }",
         "f is defined for these parameters already (line 2)", (3, "f")),
        ("float f();\nint f() { return 2; }", "f gives float for these parameters already (line 1)", (2, "f")),
        ("#define TWO float a; float a;\nTWO", "a is a variable already", (2, "TWO")),
    ],
)  # fmt: skip
def test_one_name_is_one_thing_outside_of_functions(
    context: moderngl.Context, outside: str, said: str, at: tuple[int, str]
) -> None:
    """Whether or not it is used."""
    text = f"{outside}\nvoid main() {{ gl_FragColor = vec4(1.0); }}"
    line = text.count("\n") + 1 if at[1] == "main" else at[0]
    assert refusal(context, text)
    with pytest.raises(KernelError) as error:
        parse(text)
    first, shown, caret = str(error.value).split("\n")
    assert first.startswith(f"<shader>:{line}: {said}")
    assert shown[caret.index("^") : caret.rindex("^") + 1] == at[1]


@pytest.mark.parametrize(
    ("outside", "said"),
    [
        ("struct S { float a; float b; float a; };", "a stands here already; give one of the two another name"),
        ("struct S { float a, a; };", "a stands here already; give one of the two another name"),
        ("struct S { float a; };\nstruct S { float a; };", "S is a struct already (line 1)"),
    ],
)
def test_fields_and_structs_have_one_name_each(outside: str, said: str) -> None:
    """GLSL 4.60, sections 4.1.8 and 4.2.2, which this driver does not enforce."""
    with pytest.raises(KernelError, match=re.escape(said)):
        parse(f"{outside}\nvoid main() {{ gl_FragColor = vec4(1.0); }}")


@pytest.mark.parametrize(
    "outside",
    [
        "float f(float a); float f(float a); float f(float b) { return b; } float f(float c);",
        "float f(float a) { return a; } float f(int a) { return 2.0; } float f(float a, float b) { return a; }",
        "float f(float a[2]) { return 1.0; } float f(float a[3]) { return 2.0; }",
        "float f(float a, float a);",
        "float a; float f(float a) { return a; } float g() { float a = 1.0; return a; }",
        "float f() { return 1.0; } float g() { float f = 1.0; return f; }",
        "float a; struct S { float a; };",
        "float a; uniform Block { float a; } block;",
        "float sin(float a) { return 1.0; }",
        "#ifdef NEVER\nfloat a;\n#endif\nfloat a;",
    ],
)
def test_other_parameters_and_other_scopes_make_names_anew(context: moderngl.Context, outside: str) -> None:
    text = f"{outside}\nvoid main() {{ gl_FragColor = vec4(1.0); }}"
    assert not refusal(context, text)
    parse(text)


def test_a_shader_may_declare_what_its_container_has() -> None:
    """A uniform again, and functions and variables of its own in the place of the container's."""
    shader = parse(
        "uniform float level; float own() { return 2.0; } void main() { gl_FragColor = vec4(own() * level); }",
        prelude="uniform float level; float own() { return 1.0; } float other;", postlude="float other;",
    )  # fmt: skip
    assert [one.name for one in shader.uniforms] == ["level"]
    with pytest.raises(KernelError, match="uniform level is float already"):
        parse("uniform vec2 level; void main() { gl_FragColor = vec4(1.0); }", prelude="uniform float level;")


def test_what_an_included_file_has_is_named_with_its_file(tmp_path: Path) -> None:
    (tmp_path / "a.h").write_text("\nfloat a;\n")
    with pytest.raises(KernelError, match=re.escape("a is a variable already (a.h:2)")):
        parse('#include "a.h"\nfloat a; void main() { gl_FragColor = vec4(1.0); }', folder=tmp_path)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("float f() { return a; } float a = 1.0; void main() { gl_FragColor = vec4(f()); }",
         "'a' is used before its declaration; declare it before"),
        ("void main() { gl_FragColor = vec4(f()); }\nfloat f() { return 1.0; }",
         "f is called before its declaration (line 2); declare a prototype before the call"),
        ("float a = b; float b = 1.0; void main() { gl_FragColor = vec4(a); }",
         "'b' is not defined here; declare it before"),
    ],
)  # fmt: skip
def test_names_are_declared_before_they_are_used(context: moderngl.Context, text: str, said: str) -> None:
    assert refusal(context, text)
    with pytest.raises(KernelError, match=re.escape(said)):
        parse(text)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("float f(); float g() { return f(); } float f() { return 3.0; } void main() { gl_FragColor = vec4(g()); }",
         3.0),
        ("float g() { return abs(-2.0); } float abs(float x) { return 7.0; } void main() { gl_FragColor = vec4(g()); }",
         2.0),
        ("float abs(float x) { return 7.0; } float g() { return abs(-2.0); } void main() { gl_FragColor = vec4(g()); }",
         7.0),
        ("const int N = 2; float f(float x[N]) { return x[1]; } "
         "void main() { const int N = 3; float x[2]; x[0] = 1.0; x[1] = 5.0; gl_FragColor = vec4(f(x)); }", 5.0),
    ],
)  # fmt: skip
def test_a_function_has_the_names_of_its_place(context: moderngl.Context, text: str, expected: float) -> None:
    """A built-in function is hidden only from the declaration of its namesake on."""
    assert not refusal(context, text)
    with pg.compile(pg.kernel(glsl=text)(into=pg.target("r", "rgba32f", size=(1, 1)))) as program:
        assert (program()["r"] == expected).all()
