"""What effects lean on: inputs that bring their own picture, the output's size as a value, notes."""

from __future__ import annotations

import numpy as np

import passgraph as pg

double = pg.kernel(source="def double(color: Image) -> vec4: return color[0, 0] * 2.0")
ratio = pg.kernel(source="def ratio(color: Image, aspect: float) -> vec4: return color[0, 0] * aspect")


def test_an_input_may_bring_its_own_picture() -> None:
    own = np.full((2, 3, 4), 0.25, np.float32)
    made = double(pg.Input("texture", "rgba32f", (3, 2), static=True, default=own))
    with pg.compile(made, backend="reference", size=(3, 2)) as program:
        assert program()["double"].max() == 0.5
        assert program(texture=own * 4)["double"].max() == 2.0
        assert program()["double"].max() == 0.5


def test_textures_do_not_set_the_output_size() -> None:
    own = np.ones((2, 3, 4), np.float32)
    texture = pg.Input("texture", "rgba32f", (3, 2), default=own)
    blend = pg.kernel(source="def blend(t: Image, c: Image) -> vec4: return t.sample(uv()) * c.sample(uv())")
    with pg.compile(
        blend(texture, pg.Input("frame"), into=pg.target("out", "rgba32f", scale=1.0)), backend="reference"
    ) as program:
        assert program(frame=np.ones((5, 7, 4), np.float32))["out"].shape == (5, 7, 4)


def test_the_output_size_is_a_value() -> None:
    aspect = pg.OUTPUT_SIZE.map(lambda size: size[0] / size[1])
    with pg.compile(ratio(pg.Input("frame"), aspect), backend="reference") as program:
        assert program(frame=np.ones((2, 8, 4), np.float32))["ratio"].max() == 4.0
        assert program(frame=np.ones((4, 8, 4), np.float32))["ratio"].max() == 2.0


def test_notes_of_targets_are_explained() -> None:
    made = double(pg.Input("frame"), into=pg.target("out", "rgba32f", notes=("no blur: its width is 0",)))
    with pg.compile(made, backend="reference") as program:
        program(frame=np.ones((1, 1, 4), np.float32))
        assert "- no blur: its width is 0" in program.explain()
