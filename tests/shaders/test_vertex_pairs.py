"""Plain fragment shaders with a vertex shader beside them, held against OpenGL, which draws the same two triangles."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import moderngl
import numpy as np
import pytest
from numpy.typing import NDArray

import passgraph as pg
from passgraph.errors import InputError, KernelError
from passgraph.glsl import syntax
from passgraph.language.source import Span
from passgraph.shaders.containers.viewer_inputs import vertex_file, viewer_inputs
from tests.offscreen import offscreen

Picture = NDArray[np.float32]
SIZE = (13, 9)
CORNERS = np.array([(0, 0), (1, 0), (0, 1), (1, 1)], np.float32)
#: What each input of the shaders below is at the corners.
GIVEN = {
    "position": np.hstack([CORNERS * 2 - 1, np.zeros((4, 1), np.float32)]),
    "aPos": CORNERS * 2 - 1,
    "uv": CORNERS,
    "a_texcoord": CORNERS,
    "aNormal": np.tile(np.array([0, 0, 1], np.float32), (4, 1)),
    "color": np.ones((4, 4), np.float32),
}
HEAD = "#version 330\n"
PAIRS: dict[str, tuple[str, str, dict[str, Any]]] = {
    "a position handed on": (
        "in vec3 position; in vec2 uv; out vec2 at;\nvoid main() { at = uv; gl_Position = vec4(position, 1.0); }",
        "in vec2 at; out vec4 o; void main() { o = vec4(at, at.x * at.y, 1.0); }",
        {},
    ),
    "names that both have, for something else": (
        """in vec2 aPos; in vec2 a_texcoord; in vec3 aNormal; in vec4 color; uniform float amount;
const float scale = 2.0; struct S { vec2 uv; }; out vec3 shade; out float side[2];
float f(float x) { return x * scale; }
void main() { S s = S(a_texcoord); vec2 uv = s.uv + f(amount); shade = vec3(uv, 0.5) * aNormal.z * color.a;
side[0] = uv.x; side[1] = -uv.y; gl_Position = vec4(aPos.xy, 0., 1.); }""",
        """in vec3 shade; in float side[2]; uniform float amount; out vec4 o;
float scale = 0.25; struct S { float uv; }; float f(float x) { return x + scale; } float aPos = 4.0;
void main() { S s = S(f(amount)); o = vec4(shade.xy + side[0], s.uv * aPos, side[1]); }""",
        {"amount": 0.375},
    ),
    "a picture that turns and shrinks": (
        """in vec3 position; in vec2 uv; out vec2 at; uniform float turn; out mat2 m;
void main() { float c = cos(turn), s = sin(turn); m = mat2(uv.x, 1.0, uv.y, uv.x); at = uv;
gl_Position = vec4(mat2(c, s, -s, c) * position.xy * 0.61, 0.1, 1.0); }""",
        "in vec2 at; in mat2 m; out vec4 o; void main() { o = vec4(at, m[1]); }",
        {"turn": 0.7},
    ),
    "a picture in perspective": (
        """in vec3 position; out vec3 v; uniform mat4 view;
void main() { v = position * 0.5 + 0.5; gl_Position = view * vec4(position, 1.0 + 0.4 * position.y); }""",
        "in vec3 v; out vec4 o; void main() { o = vec4(v, 1.0); }",
        {"view": np.eye(4)},
    ),
    "globals that begin anew at each vertex": (
        """in vec3 position; struct S { float x; }; S s = S(1.0); float sum[2] = float[](0.25, 0.5); int calls = 0;
out vec3 v; void add() { s.x += 1.0; sum[1] += position.x; calls++; }
void main() { add(); v = vec3(s.x, sum[1], float(calls)); gl_Position = vec4(position, 1.0); }""",
        "in vec3 v; out vec4 o; void main() { o = vec4(v, 1.0); }",
        {},
    ),
    "depth and w of pixels": (
        """in vec3 position; void main() {
gl_Position = vec4(position.xy, 0.5 * position.x, 1.5 + 0.4 * position.y); }""",
        "out vec4 o; void main() { o = gl_FragCoord; }",
        {},
    ),
    "depth and w of pixels that are counted from the top": (
        """in vec3 position; void main() {
gl_Position = vec4(position.xy, 0.5 * position.x, 1.5 + 0.4 * position.y); }""",
        """#extension GL_ARB_fragment_coord_conventions : enable
layout(origin_upper_left, pixel_center_integer) in vec4 gl_FragCoord;
out vec4 o; void main() { o = gl_FragCoord + vec4(0.0, 1.0, 0.0, 0.0); }""",
        {},
    ),
    "a local variable with the name of an input": (
        """in vec3 position; out vec2 v;
void main() { v = position.xy; { vec4 position = vec4(position * 0.5, 1.0); gl_Position = position; } }""",
        "in vec2 v; out vec4 o; void main() { o = vec4(v, 0.0, 1.0); }",
        {},
    ),
    "one triangle that covers the picture, by numbers of vertices": (
        """out vec2 v;
void main() { v = vec2((gl_VertexID << 1) & 2, gl_VertexID & 2); gl_Position = vec4(v * 2.0 - 1.0, 0.0, 1.0); }""",
        "in vec2 v; out vec4 o; void main() { o = vec4(v, 0.0, 1.0); }",
        {},
    ),
}


@pytest.fixture(scope="module")
def context() -> Iterator[moderngl.Context]:
    with offscreen() as made:
        yield made


def drawn(context: moderngl.Context, vertex: str, fragment: str, values: Mapping[str, Any]) -> Picture:
    """Return what OpenGL draws: the strip of four corners, over black."""
    program = context.program(vertex_shader=HEAD + vertex, fragment_shader=HEAD + fragment)
    for name, value in values.items():
        program[name] = tuple(value.T.ravel()) if isinstance(value, np.ndarray) else value
    buffers = [(context.buffer(GIVEN[name].tobytes()), f"{GIVEN[name].shape[1]}f", name) for name in program
               if isinstance(program[name], moderngl.Attribute) and name in GIVEN]  # fmt: skip
    target = context.texture(SIZE, 4, dtype="f4")
    frame = context.framebuffer([target])
    frame.use()
    frame.clear()
    context.vertex_array(program, buffers).render(moderngl.TRIANGLE_STRIP, vertices=4)
    read = np.frombuffer(frame.read(components=4, dtype="f4"), np.float32).reshape(SIZE[1], SIZE[0], 4)
    return read[::-1]


def pair(folder: Path, vertex: str, fragment: str) -> Path:
    (folder / "shown.vert").write_text(vertex)
    (folder / "shown.frag").write_text(fragment)
    return folder / "shown.frag"


def ours(path: Path, values: Mapping[str, Any] | None = None, size: tuple[int, int] = SIZE) -> Picture:
    effect = pg.load_shader(path)
    with pg.compile(effect(into=pg.target("r", "rgba32f", size=size), **(values or {}))) as program:
        return program()["r"]


@pytest.mark.gl
@pytest.mark.parametrize("name", PAIRS)
def test_a_pair_gives_what_opengl_draws(name: str, tmp_path: Path, context: moderngl.Context) -> None:
    vertex, fragment, values = PAIRS[name]
    expected = drawn(context, vertex, fragment, values)
    found = ours(pair(tmp_path, HEAD + vertex, HEAD + fragment), values)
    assert np.array_equal(found.any(axis=-1), expected.any(axis=-1))  # the same pixels
    assert np.abs(found - expected).max() < 2e-5


def test_matrices_of_viewers_leave_the_picture_where_it_is(tmp_path: Path) -> None:
    """What three.js puts before a ShaderMaterial need not be declared; other matrices are identities, and noted."""
    vertex = """varying vec2 v; uniform mat4 turned;
void main() { v = uv + normal.xy + cameraPosition.xy; gl_Position = projectionMatrix * modelViewMatrix * turned
 * vec4(position, 1.0); }"""
    path = pair(tmp_path, vertex, "varying vec2 v; void main() { gl_FragColor = vec4(v, 0.0, 1.0); }")
    effect = pg.load_shader(path)
    assert [str(note).splitlines()[0] for note in effect.notes] == [
        f"{tmp_path}/shown.vert:1: turned is the identity unless it is set, so nothing moves"
    ]
    assert ours(path, size=(2, 1))[0].tolist() == [[0.25, 0.5, 0.0, 1.0], [0.75, 0.5, 0.0, 1.0]]
    away = np.eye(4)
    away[0, 3] = 5.0
    assert not ours(path, {"turned": away}, (2, 1)).any()


def test_a_pair_for_fixed_functions(tmp_path: Path) -> None:
    vertex = """#version 120
void main() { gl_Position = gl_ModelViewProjectionMatrix * gl_Vertex; gl_TexCoord[0] = gl_MultiTexCoord0;
gl_TexCoord[1] = gl_Vertex; gl_FrontColor = gl_Color * vec4(0.5, 1.0, 1.0, 1.0); }"""
    fragment = """#version 120
void main() { gl_FragColor = vec4(gl_TexCoord[0].x, gl_TexCoord[1].x, gl_Color.rg); }"""
    assert ours(pair(tmp_path, vertex, fragment), size=(2, 1))[0].tolist() == [
        [0.25, -0.5, 0.5, 1.0],
        [0.75, 0.5, 0.5, 1.0],
    ]
    declared = vertex.replace("void main", "varying vec4 gl_TexCoord[2]; void main")
    assert ours(pair(tmp_path, declared, fragment), size=(2, 1))[0, 1].tolist() == [0.75, 0.5, 0.5, 1.0]
    bright = vertex.replace("vec4(0.5, 1.0, 1.0, 1.0)", "vec4(0.5, 3.0, 1.0, 1.0)")  # colors are clamped
    assert ours(pair(tmp_path, bright, fragment), size=(2, 1))[0, 0].tolist() == [0.25, -0.5, 0.5, 1.0]
    moved = vertex.replace("gl_ModelViewProjectionMatrix * gl_Vertex", "ftransform()")
    assert ours(pair(tmp_path, moved, fragment), size=(2, 1))[0, 1].tolist() == [0.75, 0.5, 0.5, 1.0]


def test_viewers_set_uniforms_of_both_shaders_and_say_so(tmp_path: Path) -> None:
    vertex = """attribute vec2 a_position; uniform float u_time; uniform vec2 u_resolution; varying vec2 v;
void main() { v = vec2(u_time, u_resolution.x); gl_Position = vec4(a_position, 0.0, 1.0); }"""
    path = pair(
        tmp_path, vertex, "varying vec2 v; uniform float u_time; void main() { gl_FragColor = vec4(v, u_time, 1); }"
    )
    assert ours(path, {"time": 2.0}, (2, 1))[0, 0].tolist() == [2.0, 2.0, 2.0, 1.0]
    assert [str(note).splitlines()[0].removeprefix(f"{tmp_path}/") for note in pg.load_shader(path).notes] == [
        "shown.frag:1: u_time is the time of the frame: time and time_step are its parameters, as in glslViewer",
        "shown.vert:1: u_time is the time of the frame: time and time_step are its parameters, as in glslViewer",
        "shown.vert:1: u_resolution is the size of the result in pixels, as in glslViewer",
        "shown.vert:1: input a_position is a corner of the picture, from (-1, -1) to (1, 1) here",
    ]


_FRAGMENT = "varying vec2 v; void main() { gl_FragColor = vec4(v, 0.0, 1.0); }"
_END = "v = vec2(1.0); gl_Position = vec4(position, 1.0); }"


@pytest.mark.parametrize(
    ("vertex", "fragment", "said"),
    [
        ("attribute vec3 tangent; varying vec2 v; void main() { " + _END, _FRAGMENT,
         "shown.vert:1: input tangent has no value here; a vec2, vec3 or vec4 with position, uv, normal or color in "
         "its name has one"),
        ("varying vec2 v; flat out int n; void main() { n = 1; " + _END, _FRAGMENT,
         "shown.vert:1: a vertex shader hands on floats, vectors and matrices of them here, got int"),
        ("out Block { vec2 v; }; void main() { " + _END, _FRAGMENT,
         "shown.vert:1: a vertex shader hands on variables here, no blocks; declare each of them as out"),
        ("varying vec3 v; void main() { v = vec3(1.0); gl_Position = vec4(position, 1.0); }", _FRAGMENT,
         "shown.frag:1: input v is vec2 here, and vec3 in the vertex shader"),
        ("varying vec2 v; void main() { " + _END, _FRAGMENT.replace(" v;", " w;").replace("(v", "(w"),
         "shown.frag:1: input w is no output of the vertex shader"),
        ("uniform mat4 projectionMatrix, mine; varying vec2 v; void main() { " + _END, _FRAGMENT,
         "shown.vert:1: projectionMatrix is declared together with others; give it a declaration of its own"),
        ("varying vec2 v[65]; void main() { " + _END, _FRAGMENT, "hands on more than 64 values"),
        ("varying vec2 v;\n\nvoid main() {\n" + _END.replace("1.0)", "unknown)"), _FRAGMENT,
         "shown.vert:4: 'unknown' is not defined here"),
    ],
)  # fmt: skip
def test_what_a_pair_may_not_do(tmp_path: Path, vertex: str, fragment: str, said: str) -> None:
    with pytest.raises((KernelError, InputError), match=re.escape(said)):
        pg.load_shader(pair(tmp_path, vertex, fragment))


@pytest.mark.parametrize(
    ("fragment", "vertex"),
    [
        ("a.frag", "a.vert"), ("a.fs", "a.vs"), ("a.fsh", "a.vsh"), ("a.frag.glsl", "a.vert.glsl"),
        ("a_frag.glsl", "a_vert.glsl"), ("a.fragment.glsl", "a.vertex.glsl"), ("fragment.glsl", "vertex.glsl"),
        ("a.glsl", None), ("shards.frag", "shards.vert"), ("waffs.glsl", None),
    ],
)  # fmt: skip
def test_the_vertex_shader_is_found_by_its_name(tmp_path: Path, fragment: str, vertex: str | None) -> None:
    assert vertex_file(tmp_path / fragment) is None
    for name in (
        "a.vert",
        "a.vs",
        "a.vsh",
        "a.vert.glsl",
        "a_vert.glsl",
        "a.vertex.glsl",
        "vertex.glsl",
        "shards.vert",
    ):
        (tmp_path / name).touch()
    assert vertex_file(tmp_path / fragment) == (None if vertex is None else tmp_path / vertex)


def test_an_input_is_known_by_words_in_its_name() -> None:
    corner, place = "vec4(pg_corner * 2.0 - 1.0, 0.0, 1.0)", "vec4(pg_corner, 0.0, 1.0)"
    values = {
        "vertex": corner, "inPosition": corner, "vertexCoord": corner, "aVertexTexCoord": place, "vertexUV": place,
        "st": place, "vertexNormal": "vec4(0.0, 0.0, 1.0, 0.0)", "inColor": "vec4(1.0)",
    }  # fmt: skip
    for name, value in values.items():
        span = Span("shown.vert", 1, 0, 1, name)
        variable = syntax.Variable(span, name, syntax.TypeName(span, "vec2"), None)
        assert viewer_inputs({}, []).at_corner(variable) == f"{value}.xy", name


@pytest.mark.parametrize(
    ("value", "stays"),
    [
        ("vec4(aPos,0,1)", True), ("vec4(aPos.xyz,1)", True), ("a_position", True), ("ftransform()", True),
        ("projectionMatrix*modelViewMatrix*vec4(position,1)", True), ("gl_ModelViewProjectionMatrix*gl_Vertex", True),
        ("vec4(uv,0,1)", False), ("vec4(hidden_position,1)", False), ("vec4(aPos,1,1)", False),
        ("turn*vec4(position,1)", False), ("vec4(position*2,1)", False),
    ],
)  # fmt: skip
def test_a_picture_that_stays_is_known_by_its_text(value: str, stays: bool) -> None:
    """Its pixels then need no search for their triangle."""
    inputs = frozenset(["aPos", "a_position", "position", "gl_Vertex", "uv"])
    assert viewer_inputs({}, []).keeps_place(value, inputs) is stays


def test_a_pair_can_be_serialized(tmp_path: Path) -> None:
    vertex, fragment, values = PAIRS["a picture that turns and shrinks"]
    path = pair(tmp_path, HEAD + vertex, HEAD + fragment)
    made = pg.load_shader(path)(into=pg.target("r", "rgba32f", size=SIZE), **values)
    again = pg.from_data(pg.to_data(made))
    with pg.compile(again) as program:
        assert np.array_equal(next(iter(program().values())), ours(path, values))
