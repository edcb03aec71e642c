"""Pictures that shader files bring: under two names, in files that are loaded twice, and on the command line."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import passgraph as pg
from passgraph.commands.entry import run

FILES = {
    "pass.glsl": """#if defined(VERTEX)
        attribute vec4 VertexCoord; attribute vec2 TexCoord; varying vec2 at; uniform mat4 MVPMatrix;
        void main() { gl_Position = MVPMatrix * VertexCoord; at = TexCoord; }
        #elif defined(FRAGMENT)
        varying vec2 at; uniform sampler2D Texture, A, B;
        void main() { gl_FragColor = texture2D(Texture, at) + texture2D(A, at) + 2.0 * texture2D(B, at); }
        #endif""",
    "two.glslp": 'shaders = 1\nshader0 = pass.glsl\nscale_type0 = source\ntextures = "A;B"\nA = tex.png\nB = tex.png\n',
    "two.fs": """/*{"INPUTS": [{"NAME": "inputImage", "TYPE": "image"}],
        "IMPORTED": {"A": {"PATH": "tex.png"}, "B": {"PATH": "tex.png"}}}*/
        void main() {
            gl_FragColor = IMG_THIS_PIXEL(inputImage) + IMG_THIS_PIXEL(A) + 2.0 * IMG_THIS_PIXEL(B);
        }""",
    "two.hook": """//!HOOK MAIN
//!BIND HOOKED
//!BIND A
//!BIND B
vec4 hook() { return HOOKED_tex(HOOKED_pos) + texture(A, HOOKED_pos) + 2.0 * texture(B, HOOKED_pos); }
//!TEXTURE A
//!SIZE 1 1
//!FORMAT rgba8
33333333
//!TEXTURE B
//!SIZE 1 1
//!FORMAT rgba8
33333333
""",
}
SHADERS = ("two.glslp", "two.fs", "two.hook")
#: The frame is 26 of 255, the texture 51, and three times that is added.
FRAME, TEXTURE, SUM = 26, 51, 26 + 3 * 51


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for name, text in FILES.items():
        Path(name).write_text(text)
    pg.save("tex.png", np.full((2, 3, 4), TEXTURE / 255))
    pg.save("frame.png", np.full((4, 5, 4), FRAME / 255))


@pytest.mark.parametrize("name", SHADERS)
def test_one_picture_under_two_names_is_two_textures(name: str) -> None:
    shader = pg.load_shader(name)
    frame = np.full((4, 5, 4), FRAME, np.uint8)
    with pg.compile(shader(pg.Input("frame"), into=pg.target("shown", "rgba8")), results="stored") as program:
        assert (program(frame=frame)["shown"] == SUM).all()


@pytest.mark.parametrize("name", SHADERS)
def test_shaders_with_textures_apply_to_one_picture(name: str) -> None:
    """Their inputs have pictures already, so that the graph is planned before the first run."""
    assert run(["apply", name, "frame.png", "-o", "out.png"]) == 0
    assert (np.rint(pg.load("out.png") * 255) == SUM).all()
    assert run(["plan", name, "frame.png"]) == 0


@pytest.mark.parametrize("name", SHADERS)
def test_a_file_that_is_loaded_twice_brings_one_input_for_each_name(name: str) -> None:
    once, again = pg.load_shader(name), pg.load_shader(name)
    first = once(pg.Input("frame"), into=pg.target("first", "rgba32f"))
    both = again(first, into=pg.target("both", "rgba32f"))
    with pg.compile(both) as program:
        made = program(frame=np.full((4, 5, 4), 0.25, np.float32))["both"]
    assert np.abs(made - (0.25 + 6 * 0.2)).max() < 2**-10  # passes of mpv write half floats


def test_pictures_that_differ_stay_two_inputs() -> None:
    """A file that was written anew between its two loads: which of the two a run would bring, its name cannot say."""
    once = pg.load_shader("two.fs")
    pg.save("tex.png", np.zeros((2, 3, 4)))
    first = once(pg.Input("frame"), into=pg.target("first"))
    with pytest.raises(pg.GraphError, match=r"two different inputs are called 'two\.fs:"):
        pg.compile(pg.load_shader("two.fs")(first, into=pg.target("both")))


def test_an_input_with_a_default_and_no_format_is_planned_before_the_first_run() -> None:
    add = pg.kernel(source="def add(a: Image, b: Image) -> vec4: return a[0, 0] + b.sample(uv())")
    texture = pg.Input("texture", default=np.full((2, 3, 4), TEXTURE, np.uint8))
    with pg.compile(add(pg.Input("frame", "rgba8", (5, 4)), texture)) as program:
        assert program.plan.resources[program.plan.inputs["texture"]].format.name == "rgba8"
        made = program(frame=np.full((4, 5, 4), FRAME, np.uint8))["add"]
        assert program.replanned == 0
    assert np.abs(made - (FRAME + TEXTURE) / 255).max() < 1e-3
