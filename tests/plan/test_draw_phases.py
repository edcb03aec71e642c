"""Draws in plans: what they write, what they draw over, and what is copied first."""

from __future__ import annotations

import numpy as np
import pytest

import passgraph as pg
from passgraph import vec4
from passgraph.graph.targets import Target
from passgraph.plan.build import build
from passgraph.plan.data import CopyStep, DrawStep, Options, PixelStep, Plan
from tests.plan.phases import add, copy, frame, left, named, pair, plan, steps, still

TRIANGLE = pg.Mesh.make(np.array([[-1, -1, 0], [1, -1, 0], [0, 1, 0]], np.float32), np.array([[0, 1, 2]]))


@pg.struct
class Corner:
    position: vec4


@pg.vertex
def place(vertex: pg.Vertex) -> Corner:
    return Corner(vec4(vertex.position, 1.0))


@pg.fragment
def paint(corner: Corner, color: pg.vec3) -> vec4:
    return vec4(color, 0.5)


def drawn(into: object, name: str, **settings: object) -> Target:
    made: Target = pg.draw(
        TRIANGLE,
        vertex=place,
        fragment=paint,
        into=into,
        color=(1.0, 0.0, 0.0),
        name=name,
        **settings,  # type: ignore[arg-type]
    )
    return made


def draw_plan(*outputs: Target, **options: bool) -> Plan:
    named = {f"out{i}": target for i, target in enumerate(outputs)}
    return build(named, (8, 4), options=Options(**options))


def copies(made: Plan) -> list[str]:
    return [step.name for step in made.steps if isinstance(step, CopyStep)]


def test_a_pass_is_called_as_its_target_is() -> None:
    def name(made: Target) -> str:
        assert made.made_by is not None
        return made.made_by.name

    assert name(copy(frame, into=pg.target("gray"))) == "gray"
    assert name(copy(frame, into=pg.target("gray"), name="graded")) == "graded"
    assert name(pair(frame, into=(pg.target("light"), pg.target("dark")))[0]) == "light+dark"
    assert (name(copy(frame)), name(pair(frame)[0])) == ("copy", "pair")
    stages = {"vertex": place, "fragment": paint, "color": (1.0, 0.0, 0.0)}
    color = pg.draw(TRIANGLE, into=pg.target("color"), depth=pg.target("depth", "depth32f"), **stages)
    shadow = pg.draw(TRIANGLE, vertex=place, depth=pg.target("shadow", "depth32f"))
    assert (name(color), name(shadow)) == ("color", "shadow")
    # The name of what is drawn over is taken.
    assert name(pg.draw(TRIANGLE, into=color, depth=color.depth, **stages)) == "paint"


def test_a_draw_writes_its_depth_too_and_says_what_it_starts_from() -> None:
    color = drawn(pg.target("drawn"), "first", depth=pg.target("drawn depth", "depth32f"))
    over = drawn(color, "over", depth=color.depth)
    for target, contents in ((color, ()), (over, (color, color.depth))):
        assert target.made_by is not None
        assert [spec.name for spec in target.made_by.writes] == ["drawn", "drawn depth"]
        assert target.made_by.drawn_over == contents


@pytest.mark.parametrize("fuse", [True, False])
def test_images_of_a_step_are_those_of_its_program_in_its_order(fuse: bool) -> None:
    """What backends hand over goes by place, where kernels take more images than they read, and in another order."""
    crossed = pg.kernel(source="def crossed(a: Image, b: Image, c: Image) -> vec4: return c[1, 0] + a[0, 0]")
    inner = named(add, still, frame, name="inner")
    made = plan(named(crossed, inner, frame, still, name="out"), fuse=fuse)
    for step in made.steps:
        assert isinstance(step, PixelStep)
        assert [name for name, _ in step.images] == [use.name for use in step.program.images]
    names = {resource.id: resource.name for resource in made.resources}
    assert [names[r] for r in made.steps[-1].reads] == (["still", "frame", "still"] if fuse else ["still", "inner"])


def test_a_vertex_program_names_the_attributes_that_it_reads() -> None:
    text = """
class Corner:
    position: vec4
    color: vec4

def place(vertex: Vertex) -> Corner:
    return Corner(vec4(vertex.position + vertex.normal, 1.0), vertex.color)

def paint(corner: Corner) -> vec4:
    return corner.position
"""
    stages = {"vertex": pg.vertex(source=text, name="place"), "fragment": pg.fragment(source=text, name="paint")}
    made = plan(pg.draw(TRIANGLE, into=pg.target("drawn", size=(8, 4)), **stages))
    assert isinstance(made.steps[0], DrawStep)
    # The colour goes with the varying that nobody reads.
    assert made.steps[0].vertex.attributes == ("normal", "position")


def test_a_draw_over_content_works_in_place() -> None:
    base = drawn(pg.target("canvas", "rgba32f"), "base")
    made = draw_plan(drawn(base, "over", blend="alpha"))
    assert steps(made) == ["base", "over"]
    assert len(made.resources) == 1
    assert made.steps[1].reads == (0,)


def test_readers_of_the_old_content_come_before_the_draw() -> None:
    base = drawn(pg.target("canvas", "rgba32f"), "base")
    over = drawn(base, "over")
    seen = named(left, base, name="seen")
    made = draw_plan(named(add, over, seen, name="out"), fuse=False)
    assert copies(made) == []
    assert steps(made).index("seen") < steps(made).index("over")


def test_content_that_is_an_output_is_copied_first() -> None:
    base = drawn(pg.target("canvas", "rgba32f"), "base")
    made = draw_plan(base, drawn(base, "over"))
    assert steps(made) == ["base", "copy canvas", "over"]
    assert "copied canvas before over draws over it: its content is still needed" in made.notes


def test_content_that_is_read_behind_the_draw_is_copied_first() -> None:
    base = drawn(pg.target("canvas", "rgba32f"), "base")
    over = drawn(base, "over")
    made = draw_plan(named(add, over, base, name="out"))
    assert copies(made) == ["copy canvas"]


def test_two_draws_over_one_content_do_not_see_each_other() -> None:
    base = drawn(pg.target("canvas", "rgba32f"), "base")
    made = draw_plan(named(add, drawn(base, "one"), drawn(base, "two"), name="out"))
    assert copies(made) == ["copy canvas", "copy canvas"]
    of = {step.name: step.writes for step in made.steps}
    assert len({of["base"], of["one"], of["two"]}) == 3


def test_depth_is_drawn_over_as_color_is() -> None:
    base = drawn(pg.target("canvas", "rgba32f"), "base", depth=pg.target("depth", "depth32f"))
    over = drawn(base, "over", depth=base.depth)
    made = draw_plan(over)
    assert len(made.resources) == 2
    assert set(made.steps[1].reads) == {0, 1}


def test_explain_tells_draws_and_copies() -> None:
    base = drawn(pg.target("canvas", "rgba32f"), "base")
    text = draw_plan(base, drawn(base, "over")).explain()
    assert "1. base: nothing → canvas (draws 1 triangles, 8x4; runs once)" in text
    assert "copy canvas: canvas → canvas (copies, 8x4" in text
