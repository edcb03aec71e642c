"""Which names a scope of GLSL may declare, held against the OpenGL driver's compiler."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

import pytest

from passgraph.errors import KernelError
from passgraph.shaders.glsl import parse

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
