"""What shaders cannot say, and how they are told: file, line, the line itself, a caret."""

from __future__ import annotations

from pathlib import Path

import pytest

from passgraph.errors import InputError, KernelError
from passgraph.glsl import parse

MAIN = "void main() { gl_FragColor = vec4(1); }"


def test_an_error_shows_the_line_of_the_shader_and_a_caret() -> None:
    text = "#version 330\n\nvoid main() {\n\tvec4 c = vec3(1.0); // too short\n}"
    with pytest.raises(KernelError) as caught:
        parse(text, file="look.frag")
    assert str(caught.value) == (
        "look.frag:4: c must be vec4, got vec3\n    \tvec4 c = vec3(1.0); // too short\n    \t     ^"
    )


def test_an_error_in_a_macro_shows_where_it_is_used() -> None:
    with pytest.raises(KernelError) as caught:
        parse("#define F(x) x + nowhere\nvoid main() {\n  gl_FragColor = vec4(F(1.0));\n}")
    assert str(caught.value).splitlines()[0] == "<shader>:3: 'nowhere' is not defined here; declare it before"
    assert str(caught.value).splitlines()[2].index("^") == 4 + len("  gl_FragColor = vec4(")


def test_an_argument_of_a_macro_keeps_its_place() -> None:
    with pytest.raises(KernelError) as caught:
        parse("#define F(x) (x + 1.0)\nvoid main() {\n  gl_FragColor = vec4(F(nowhere));\n}")
    assert str(caught.value).splitlines()[2].index("^") == 4 + len("  gl_FragColor = vec4(F(")


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("void main() { gl_FragColor = vec4(1) }", "';' is expected here, got '}'"),
        ("void main() {", "this brace is not closed"),
        ("void main() { int i = ; }", "an expression is expected here, got ';'"),
        ("/* void main() {}", "*/ is missing"),
        ("float f() { return 1.0; }", "there is no function main()"),
        ("void main() { float a = 1.0; }", "the shader writes nothing"),
        ("uniform float k; void main() { k = 1.0; }", "k is a uniform and cannot be assigned to"),
        ("const float k = 1.0; void main() { k++; }", "k is const and cannot be assigned to"),
        ("void main() { 1.0 = 2.0; }", "this cannot be assigned to"),
        ("void main() { vec2 v; v.xx = vec2(1); }", "names a component twice"),
        ("void main() { int i = 1.5; }", "narrowing is never silent"),
        ("float f(int a) { return 1.0; } void main() { f(vec2(1)); }", "f takes no (vec2)"),
        ("float f(int a) { return 1.0; } void main() { f(); }", "f takes 1 arguments, got 0"),
        ("float f() { return f(); } void main() { f(); }", "GLSL has no recursion"),
        ("float f(); void main() { f(); }", "declared but has no body"),
        ("void f() {} void main() { float a = f(); }", "a void function gives no value"),
        ("void f(out float a) {} void main() { f(1.0); }", "writes to its parameter 'a'"),
        ("void main() { nothing(1.0); }", "there is no function 'nothing'"),
        ("void main() { vec3 colour; gl_FragColor = vec4(color, 1); }", "not defined here; did you mean 'colour'?"),
        ("void main() { float x = smothstep(0., 1., .5); }", "function 'smothstep'; did you mean 'smoothstep'?"),
        ("void main() { float x = lerp(0., 1., .5); }", "there is no function 'lerp'; write mix(a, b, t)"),
        ("void main() { float4 c = float4(1); }", "there is no type 'float4'; write vec4"),
        ("float3x2 m; void main() { }", "there is no type 'float3x2'; write mat2x3"),
        ("void main() { Lamp a; }", "there is no type 'Lamp'; declare it before"),
        ("void main() { float a = 1.0 gl_FragColor = vec4(a); }", "';' is expected here, got 'gl_FragColor'"),
        ("void main() { vec2 a = vec2(1.0 2.0); }", "')' is expected here, got '2.0'"),
        ("float f(vec3 c, int k) { return c[k]; } void main() { f(vec3(1), 3); }", "index 3 is outside vec3 (0 to 2)"),
        ("void f(int k) { vec3 c; c[k] = 1.0; } void main() { f(-1); }", "index -1 is outside vec3 (0 to 2)"),
        ("uniform bool b; void main() { vec3 c = vec3(1); if (b) c[3] = 1.0; }", "index 3 is outside vec3 (0 to 2)"),
        ("void main() { break; }", "break belongs inside a loop"),
        ("void main() { switch (1) { case 0: continue; } }", "continue belongs inside a loop"),
        ("void main() { if (1) { } }", "a condition must be bool, got int"),
        ("void main() { float a = 1.5 % 2.0; }", "use mod()"),
        ("void main() { bool b = vec2(1) < vec2(2); }", "use lessThan()"),
        ("uniform samplerCube t; " + MAIN, "samplerCube is not read here: pictures are flat"),
        ("void main() { float a[2]; a[5] = 1.0; }", "outside"),
        ("void main() { float a[0]; }", "from 1 to 16777216"),
        ("void main() { float a[1025]; }", "a would hold Array[float, 1025]; arrays of more than 1024"),
        ("uniform float t[1025]; void main() { gl_FragColor = vec4(t == t); }", "a side of == would hold Array"),
        ("uniform float t[1025] = {1.0}; void main() { }", "what t is set to would hold Array"),
        ("float[1025] f() { return f(); } void main() { gl_FragColor = vec4(f()[0]); }", "the result of f would hold"),
        ("uniform float t[1025]; float f(float a[1025]) { a[0] = 1.0; return a[1]; } void main() { f(t); }", "f(a) w"),
        ("buffer B { float data[]; }; void main() { }", "the length of an array is a known whole number"),
        ("in vec4 tint; void main() { gl_FragColor = tint; }", "input tint has no value"),
        ("struct S { S s; }; " + MAIN, "a type is expected here"),
        ("struct S { float a; }; void main() { S s; s.b = 1.0; }", "S has no field 'b'"),
        ("uniform float a; uniform vec2 a; " + MAIN, "a is a uniform already"),
        ("out int n; void main() { n = 1; }", "an output is a float"),
        ("void main() { int a = 4294967296; }", "does not fit 32 bits"),
        ("void main() { float a = 1e39; }", "does not fit float32"),
        ("void main() { int a = 08; }", "is octal"),
        ("void main() { float a = 1.0 $ 2.0; }", "';' is expected"),
        # The preprocessor
        ("#if 1\n" + MAIN, "this condition has no #endif"),
        ("#endif\n", "#endif without #if"),
        ("#else\n", "#else without #if"),
        ("#if 1\n#else\n#else\n#endif", "#else after #else"),
        ("#if 1 +\n#endif", "the condition ends too early"),
        ("#if (1\n#endif", "not closed"),
        ("#if 1.5\n#endif", "not a whole number"),
        ("#error it's \"broken\"\n", "the shader says: it's \"broken\""),
        ("#include \"a.glsl\"\n", "no folder to read from"),
        ("#nonsense\n", "there is no directive #nonsense"),
        ("#define F(a, a) a\n", "names with commas between"),
        ("#define F(a\n", "no closing parenthesis"),
        ("#define F(a) a\nfloat a = F(1;", "no closing parenthesis"),
        ("#define F(a) a\nfloat a = F(1, 2);", "takes 1 arguments, got 2"),
        ("#define J(a, b) a ## b\nfloat a = J(+, 1);", "is not one word"),
        ("#version fifteen\n", "#version takes a number"),
    ],
)  # fmt: skip
def test_what_is_refused_says_why(text: str, told: str) -> None:
    with pytest.raises(KernelError) as caught:
        parse(text)
    assert told in str(caught.value)


def test_text_must_be_text() -> None:
    with pytest.raises(InputError, match="must be str, got bytes"):
        parse(b"void main() {}")  # type: ignore[arg-type]


def test_includes_stay_in_their_folder(tmp_path: Path) -> None:
    inner = tmp_path / "shaders"
    (inner / "lib").mkdir(parents=True)
    once = "#pragma once\n#ifdef SEEN\n#error twice\n#endif\n#define SEEN\n"
    (inner / "lib" / "a.glsl").write_text(once + '#include "b.glsl"\nfloat a() { return b(); }')
    (inner / "lib" / "b.glsl").write_text("float b() { return 2.0; }")
    (tmp_path / "secret.glsl").write_text("float a() { return 1.0; }")
    main = "void main() { gl_FragColor = vec4(a()); }"
    twice = '#include "lib/a.glsl"\n#include <lib/a.glsl>\n'
    assert parse(twice + main, folder=inner).program.results
    for name, told in (
        ("../secret.glsl", "may not leave"),
        ("/etc/passwd", "may not leave"),
        ("no.glsl", "there is no file 'no.glsl' in .*shaders"),
        ("common", "pieces of three.js are not read"),
    ):
        with pytest.raises(KernelError, match=told):
            parse(f'#include "{name}"\n{main}', folder=inner)


def test_files_that_include_others_twice_end(tmp_path: Path) -> None:
    for i in range(30):
        (tmp_path / f"{i}.glsl").write_text(f'#include "{i + 1}.glsl"\n' * 2)
    (tmp_path / "30.glsl").write_text("\n")
    with pytest.raises(KernelError, match="more than 1000 files"):
        parse('#include "0.glsl"\n' + MAIN, folder=tmp_path)
    (tmp_path / "0.glsl").write_text("//" + "x" * 300_000 + "\n")
    with pytest.raises(KernelError, match="characters together"):
        parse('#include "0.glsl"\n' * 2 + MAIN, folder=tmp_path)


def test_a_file_that_includes_itself_ends(tmp_path: Path) -> None:
    (tmp_path / "a.glsl").write_text('#include "a.glsl"\n')
    with pytest.raises(KernelError, match="deeper than 32"):
        parse('#include "a.glsl"\n' + MAIN, folder=tmp_path)
