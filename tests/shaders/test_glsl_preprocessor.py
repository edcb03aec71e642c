"""The preprocessor: what it defines itself, and what it refuses."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import passgraph as pg
from passgraph.errors import KernelError
from passgraph.glsl import parse
from passgraph.glsl.preprocess import EXTENSIONS

MAIN = "void main() { gl_FragColor = vec4(1.0); }"


def number_of(text: str) -> float:
    kernel = pg.kernel(glsl=text)
    with pg.compile(kernel(into=pg.target("r", "rgba32f", size=(1, 1)))) as program:
        return float(program()["r"][0, 0, 0])


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("void main() {\n gl_FragColor = vec4(float(__LINE__)); }", 2.0),
        ("#define HERE __LINE__\n\nvoid main() {\n gl_FragColor = vec4(float(HERE)); }", 4.0),
        ("#line 20\nvoid main() { gl_FragColor = vec4(float(__LINE__)); }", 21.0),  # GLSL 1.10: the line after it
        ("#version 300 es\nout highp vec4 o;\n#line 20\nvoid main() { o = vec4(float(__LINE__)); }", 20.0),
        ("#line 20 7\nvoid main() { gl_FragColor = vec4(float(__FILE__)); }", 7.0),
        ("void main() { gl_FragColor = vec4(float(__FILE__)); }", 0.0),
        ("#if __LINE__ == 1 && __FILE__ == 0 && defined(__LINE__)\n#define N 3.0\n#endif\n"
         "void main() { gl_FragColor = vec4(N); }", 3.0),
    ],
)  # fmt: skip
def test_the_line_and_the_number_of_the_text_are_macros(text: str, expected: float) -> None:
    """GLSL 3.30, section 3.3."""
    assert number_of(text) == expected


#: What a shader uses of each extension, or declares by it.
USES = {
    "GL_OES_standard_derivatives": "dFdx(1.0)", "GL_EXT_shader_texture_lod": "texture2DLodEXT(t, vec2(0.5), 0.0).x",
    "GL_ARB_shader_texture_lod": "texture2DGradARB(t, vec2(0.5), vec2(0.0), vec2(0.0)).x",
    "GL_ARB_texture_rectangle": "texture2DRect(r, vec2(0.5)).x",
    "GL_ARB_texture_gather": "textureGather(t, vec2(0.5)).x",
    "GL_ARB_texture_query_lod": "textureQueryLOD(t, vec2(0.5)).x",
    "GL_ARB_texture_query_levels": "float(textureQueryLevels(t))", "GL_ARB_derivative_control": "dFdxFine(1.0)",
    "GL_ARB_shader_bit_encoding": "intBitsToFloat(0)", "GL_ARB_uniform_buffer_object": "b.u",
    "GL_ARB_shading_language_packing": "float(packHalf2x16(vec2(0.0)))", "GL_ARB_arrays_of_arrays": "a[0][1]",
    "GL_OES_EGL_image_external": "texture2D(e, vec2(0.5)).x", "GL_ARB_fragment_coord_conventions": "gl_FragCoord.x",
    "GL_EXT_draw_buffers": "(gl_FragData[0] = vec4(0.0)).x", "GL_ARB_draw_buffers": "(gl_FragData[0] = vec4(0.0)).x",
}  # fmt: skip


@pytest.mark.parametrize("name", EXTENSIONS)
def test_an_extension_that_is_defined_is_read(name: str) -> None:
    declared = (
        "uniform sampler2D t; uniform sampler2DRect r; uniform samplerExternalOES e; uniform B { float u; } b;\n"
        "float a[1][2]; layout(origin_upper_left) in vec4 gl_FragCoord;"
    )
    if name == "GL_ARB_explicit_attrib_location":
        declared, value, out = "layout(location = 0) out vec4 o;", "1.0", "o"
    else:
        value, out = USES[name], "gl_FragColor" if "FragData" not in USES[name] else "vec4 x"
    head = f"#extension {name} : enable\n#ifndef {name}\n#error\n#endif\n"
    assert parse(f"{head}{declared}\nvoid main() {{ {out} = vec4({value}); }}").extensions == (name,)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("#define A 1\n#define A 2\n", "2: macro A has another meaning already (line 1); #undef it before"),
        ("#define A (1 + 2)\n#define A (1+ 2)\n", "2: macro A has another meaning already (line 1)"),
        ("#define A(x) x\n#define A(y) y\n", "2: macro A has another meaning already"),
        ("#define A\n#define A 1\n", "2: macro A has another meaning already"),
        ("#define GL_own 1\n", "GL_own is not for shaders to define; names that begin with GL_ are GLSL's own"),
        ("#define __VERSION__ 1\n", "__VERSION__ is not for shaders to define"),
        ("#define __LINE__ 1\n", "__LINE__ is defined by GLSL itself"),
        ("#undef __FILE__\n", "__FILE__ is defined by GLSL itself"),
        ("#undef GL_OES_standard_derivatives\n", "is not for shaders to define"),
        ("#undef A B\n", "#undef A ends before 'B'; write a comment: // B"),
        ("#ifdef A B\n#endif\n", "#ifdef ends before 'B'; write a comment: // B"),
        ("#ifndef A\n#else B\n#endif\n", "#else ends before 'B'"),
        ("#ifndef A\n#endif A\n", "#endif ends before 'A'"),
        ("#line\n", "#line takes the number of the next line, and of the text; got nothing"),
        ("#line 1 2 3\n", "#line takes the number of the next line, and of the text; got 1 2 3"),
        ("#extension GL_X\n", "#extension takes NAME : require or enable or warn or disable (all"),
        ("#extension GL_X : on\n", "got GL_X : on"),
        ("#extension all : require\n", "got all : require"),
        ("#version 100\nfloat a;\n#extension all : warn\n", "3: #extension stands before all declarations"),
        ("#version 290\n", "there is no GLSL 290; versions are 110, 120"),
        ("#version 300\n", "there is no GLSL 300; versions are"),
        ("#version 330 es\n", "there is no GLSL 330 es; versions are"),
        ("float a;\n#version 330\n", "2: #version stands before everything else in a shader; move it to the top"),
        ("#version 100\n#if A\n#endif\n", "2: A is not defined, which is an error in GLSL ES; ask defined(A)"),
        ("#version 100\n#if 1 && A\n#endif\n", "A is not defined"),
    ],
)  # fmt: skip
def test_what_no_driver_takes_is_refused(text: str, said: str) -> None:
    """GLSL 4.60, section 3.3; GLSL ES 3.00, section 3.4."""
    with pytest.raises(KernelError, match=re.escape(said)):
        parse(text + MAIN)


@pytest.mark.parametrize(
    "text",
    [
        "#define A 1 + 2\n#define A 1   +   2 // as before\n",
        "#define A(x, y) x\n#define A(x,y) x\n",
        "#define A 1\n#undef A\n#define A 2\n",
        "#ifdef A // B\n#else /* C */\n#endif // A\n",
        "#if A\n#error\n#endif\n",  # undefined names are 0 in desktop GLSL
        "#version 100\n#if 0 && A || 1 || B\n#endif\n",
        "#version 100\n#if defined(A) && A > 1\n#endif\n",
        "// a comment\n#version 330 core\n#define gl_FragColor o\nout vec4 o;\n",
        '#line 7 "a.glsl"\n',
        "#extension all : warn\n#extension GL_X_unknown : enable\n",
    ],
)
def test_what_drivers_take_is_read(text: str) -> None:
    assert parse(text + MAIN).program.results


def test_a_shader_may_define_its_containers_macros_anew() -> None:
    shader = parse(
        "#define N 2.0\nvoid main() { gl_FragColor = vec4(N); }", prelude="#define N 1.0\n", defines={"N": "0.0"}
    )
    assert shader.program.results


def test_what_guards_leave_out_does_not_count(tmp_path: Path) -> None:
    """Each file includes the one before twice: 2**24 includes without guards."""
    (tmp_path / "0.glsl").write_text("float zero;\n")
    for i in range(1, 25):
        guard = f"// file {i}\n#ifndef FILE_{i}\n#define FILE_{i}\n"
        twice = f'#include "{i - 1 or "one"}.glsl"\n' * 2
        (tmp_path / f"{i}.glsl").write_text(
            f"{guard}{twice}#ifdef NEVER\n#else\nfloat f{i};\n#endif\n#endif // FILE_{i}\n"
        )
    (tmp_path / "one.glsl").write_text("#pragma once\nfloat one;\n" + "/* long */" * 20_000)
    tree = parse(f'#include "24.glsl"\n#include "24.glsl"\n{MAIN}', folder=tmp_path)
    assert len(tree.source.included) == 25


@pytest.mark.parametrize(
    "text",
    [
        "#ifndef A\n#define A\n#endif\nfloat behind;\n",
        "float before;\n#ifndef A\n#define A\n#endif\n",
        "#ifndef A\n#define A\n#else\nfloat other;\n#endif\n",
    ],
)
def test_a_file_with_text_beside_its_guard_is_read_each_time(text: str, tmp_path: Path) -> None:
    (tmp_path / "a.glsl").write_text(text)
    with pytest.raises(KernelError, match="more than 1000 files are included"):
        parse('#include "a.glsl"\n#undef NEVER\n' * 1001 + MAIN, folder=tmp_path)
