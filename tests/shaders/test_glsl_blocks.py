"""Uniform blocks: members have the scope of their block, and each parameter is read as it is declared."""

from __future__ import annotations

import re
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import passgraph as pg
from passgraph.errors import KernelError
from passgraph.glsl import parse
from passgraph.graph.calls import PixelKernel
from passgraph.language import ir
from passgraph.language import scalar as s
from passgraph.language.builtin_name import PIXEL
from passgraph.language.emitter import Emitter
from passgraph.language.lower import lower
from passgraph.language.types import FLOAT, INT, Array

BACKENDS = ["reference", "numpy", "gl", "opencl", "webgpu"]
AT = "int(gl_FragCoord.x)"


def text_of(declared: str, value: str) -> str:
    return f"#version 330\n{declared}\nout vec4 o;\nvoid main() {{ o = {value}; }}"


def computed(text: str, backend: str, width: int, **values: Any) -> Any:
    kernel = pg.kernel(glsl=text)
    with pg.compile(kernel(into=pg.target("r", "rgba32f", size=(width, 1)), **values), backend=backend) as program:
        return program()["r"][0]


@pytest.mark.parametrize("backend", BACKENDS)
def test_two_blocks_with_a_member_of_one_name_have_their_own_values(backend: str) -> None:
    declared = "uniform A { float c; } a;\nuniform B { float c[64]; } b;"
    numbers = np.arange(64, dtype=np.float32) + 5.0
    result = computed(text_of(declared, f"vec4(a.c, b.c[{AT}], b.c[63], 1.0)"), backend, 70, a_c=3.0, b_c=numbers)
    assert (result[:, 0] == 3.0).all()
    assert result[:64, 1].tolist() == numbers.tolist()
    assert (result[64:, 1] == 68.0).all()  # an index outside reads the nearest element
    assert (result[:, 2] == 68.0).all()


@pytest.mark.parametrize("backend", BACKENDS)
def test_a_plain_uniform_may_have_the_name_of_a_blocks_member(backend: str) -> None:
    declared = "uniform A { vec2 c; } a;\nuniform float c;"
    assert computed(text_of(declared, "vec4(a.c, c, 1.0)"), backend, 1, a_c=(1, 2), c=3)[0].tolist() == [1, 2, 3, 1]


@pytest.mark.parametrize("backend", BACKENDS)
def test_arrays_of_blocks_are_read_by_index(backend: str) -> None:
    declared = "struct S { float x[2]; };\nlayout(shared) uniform A { float c; vec2 k[3]; mat2 m; S s; } a[2];"
    value = f"vec4(a[1].c, a[{AT}].k[2 - {AT}].y, a[0].m[1].x, a[1].s.x[{AT}])"
    given = {
        "c": [1.0, 2.0], "k": np.arange(12).reshape(2, 3, 2), "m": np.arange(8).reshape(2, 2, 2),
        "s": [SimpleNamespace(x=[10.0, 11.0]), SimpleNamespace(x=[12.0, 13.0])],
    }  # fmt: skip
    assert computed(text_of(declared, value), backend, 2, **given).tolist() == [[2, 5, 1, 12], [2, 9, 1, 13]]


@pytest.mark.parametrize(
    ("declared", "names"),
    [
        ("uniform A { float c; vec2 d; } a;", ["c", "d"]),
        ("uniform A { float c; };", ["c"]),
        ("uniform A { float c; } a; uniform B { float c; float d; } b;", ["a_c", "b_c", "d"]),
        ("uniform A { float c; } a; uniform B { float c; };", ["a_c", "c"]),
        ("uniform A { float c; } a; uniform float c, a_c;", ["a_a_c", "c", "a_c"]),
        ("uniform A { float c; } a; uniform B { float c; float a_c; } b;", ["a_a_c", "b_c", "a_c"]),
    ],
)
def test_parameters_of_members_have_names_of_their_own(declared: str, names: list[str]) -> None:
    assert [uniform.name for uniform in parse(text_of(declared, "vec4(1.0)")).uniforms] == names


def test_a_member_is_not_the_containers_uniform_of_its_name() -> None:
    shader = parse(
        text_of("uniform A { vec4 level; } a;", "a.level"), entry="begin", prelude="uniform float level;\n",
        postlude="void begin() { main(); o *= level; }",
    )  # fmt: skip
    assert [(one.name, str(one.type)) for one in shader.uniforms] == [("level", "float"), ("a_level", "vec4")]


@pytest.mark.parametrize(
    ("declared", "said"),
    [
        ("uniform A { float c; } a;\nuniform A { vec4 c; } b;", "A is a block already (line 2)"),
        ("uniform A { float c; };\nfloat A;", "A is a block already (line 2)"),
        ("uniform A { float c; };\nuniform B { vec4 c; };", "c is a uniform already (line 2)"),
    ],
)
def test_a_block_has_one_declaration(declared: str, said: str) -> None:
    with pytest.raises(KernelError, match=re.escape(said)):
        parse(text_of(declared, "vec4(1.0)"))


def test_a_parameter_of_kernel_text_has_one_declaration() -> None:
    """Python's parser takes both; only its compiler, which never runs for text, refuses them."""
    with pytest.raises(KernelError, match="k has two parameters 's'; rename one of them"):
        pg.kernel(source="def k(s: float, s: Array[float, 64]) -> float:\n    return s[int(pixel().x)]")


# What the compiler holds, whatever a front end makes


@pytest.mark.parametrize("length", [64, 2000])
def test_a_program_that_reads_a_parameter_as_another_type_is_refused(length: int) -> None:
    """As a front end would make it that lets two declarations share a parameter."""
    program = parse(f"uniform float c[{length}]; void main() {{ gl_FragColor = vec4(c[{AT}]); }}").program
    (parameter,) = program.parameters
    for declared in (FLOAT, Array(FLOAT, length - 1), Array(INT, length)):
        wrong = replace(program, parameters=(replace(parameter, type=declared),))
        with pytest.raises(KernelError, match=re.escape(f"parameter c is declared as {declared} and read as Array")):
            lower(wrong)
    lower(program)
    with pytest.raises(KernelError, match="parameter c is declared as None"):
        lower(replace(program, parameters=()))
    assert isinstance(PixelKernel.of_program(program).program, ir.TypedKernel)


def test_each_index_into_memory_is_known_to_lie_inside() -> None:
    e = Emitter()
    slot = s.UniformSlot("c", Array(FLOAT, 4), "float", 3, 4)
    unknown = e.builtin(PIXEL[0], "int")
    low, high = s.Lit("int", 3), s.Lit("int", 6)
    e.uniform(slot, e.op("min", e.op("max", unknown, low), high))
    for index in (unknown, e.op("max", unknown, low), e.op("min", unknown, high), s.Lit("int", 2), s.Lit("int", 7)):
        with pytest.raises(KernelError, match="parameter c has the numbers 3 to 6, and is read or written at"):
            e.uniform(slot, index)
    array = e.array("float", 4)
    for index in (unknown, s.Lit("int", 4), s.Lit("int", -1)):
        with pytest.raises(KernelError, match="array a0 has the numbers 0 to 3"):
            e.read_at(array, index)
        with pytest.raises(KernelError, match="array a0 has the numbers 0 to 3"):
            e.write_at(array, index, s.Lit("float", 0.0))
        with pytest.raises(KernelError, match="the constant t has the numbers 0 to 2"):
            e.table("t", "float", (1.0, 2.0, 3.0), index)
