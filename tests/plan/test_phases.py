"""Culling, fusion, order, lifetimes, shared memory and sizes: what a plan decides, without running it."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import passgraph as pg
from passgraph import Image, vec4
from passgraph.formats import format_named
from passgraph.plan.build import build
from passgraph.plan.data import PixelStep, Plan
from tests.plan.orders import apart
from tests.plan.phases import add, copy, either, frame, join, left, named, pair, plan, sized, steps, still, zoom

# Culling


def test_a_pass_is_left_out_when_a_constant_drops_its_reader() -> None:
    unused = named(copy, frame, name="unused")
    made = plan(either(frame, unused, False, name="out"), fuse=False)
    assert steps(made) == ["out"]
    assert "left out pass unused: nothing that reaches an output reads it" in made.notes
    assert steps(plan(either(frame, unused, True, name="out"), fuse=False)) == ["unused", "out"]


def test_what_only_fed_a_dropped_pass_goes_with_it() -> None:
    first = named(copy, frame, name="first")
    second = named(copy, first, name="second")
    assert steps(plan(either(frame, second, False, name="out"), fuse=False)) == ["out"]
    assert set(steps(plan(either(frame, second, False, name="out"), fuse=False, cull=False))) == {
        "first",
        "second",
        "out",
    }


def test_history_that_only_a_dropped_pass_reads_is_dropped() -> None:
    spec = pg.target("kept", "rgba32f")
    kept = copy(frame, into=spec, name="kept")
    blend = named(add, kept, pg.previous(spec), name="blend")
    made = plan(either(frame, blend, False, name="out"), fuse=False)
    assert steps(made) == ["out"]
    assert not any(resource.kind == "history" for resource in made.resources)
    assert steps(plan(either(frame, blend, True, name="out"), fuse=False)) == ["kept", "blend", "out"]


def test_outputs_and_what_feeds_them_stay() -> None:
    first = named(copy, frame, name="first")
    assert steps(plan(first, named(copy, first, name="second"))) == ["first", "second"]


# Fusion


def test_a_chain_becomes_one_pass() -> None:
    chain = named(copy, named(copy, named(copy, frame, name="a"), name="b"), name="c")
    made = plan(chain)
    assert steps(made) == ["c"]
    (step,) = made.steps
    assert isinstance(step, PixelStep)
    assert step.fused == ("a", "b")
    assert len(made.memories) == 2
    assert "fused pass a into b: read at the same pixel, by it alone" in made.notes


def test_both_results_of_a_pass_fuse_into_their_one_reader() -> None:
    one, two = pair(frame, into=(pg.target("one", "rgba32f"), pg.target("two", "rgba32f")))
    assert steps(plan(named(add, one, two, name="sum"))) == ["sum"]


@pytest.mark.parametrize(
    ("kernel", "why"),
    [(left, "neighbours"), (zoom, "jumps"), (sized, "the picture's size is read")],
    ids=lambda v: str(v),
)
def test_nothing_fuses_into_a_pass_that_reads_elsewhere(kernel: object, why: str) -> None:
    first = named(copy, frame, name="first")
    assert steps(plan(named(kernel, first, name="out"))) == ["first", "out"], why


def test_nothing_fuses_across_sizes() -> None:
    small = named(zoom, frame, name="small", size=(2, 2))
    assert steps(plan(named(zoom, small, name="out", size=(8, 4)))) == ["small", "out"]


def test_an_output_is_not_fused_away() -> None:
    first = named(copy, frame, name="first")
    assert steps(plan(first, named(copy, first, name="out"))) == ["first", "out"]


def test_a_pass_with_two_readers_is_not_computed_twice() -> None:
    first = named(copy, frame, name="first")
    made = plan(named(add, named(left, first, name="a"), named(copy, first, name="b"), name="out"))
    assert "first" in steps(made)


def test_history_is_not_fused_away() -> None:
    spec = pg.target("first", "rgba32f")
    first = copy(frame, into=spec, name="first")
    assert steps(plan(named(add, first, pg.previous(spec), name="out"))) == ["first", "out"]


def test_work_that_runs_once_is_not_fused_into_work_of_every_frame() -> None:
    once = named(copy, still, name="once")
    assert steps(plan(named(add, once, frame, name="out"))) == ["once", "out"]
    assert steps(plan(named(copy, once, name="out"))) == ["out"]


def test_a_picture_read_by_a_fused_pass_and_by_its_reader_is_still_written() -> None:
    """Once ``middle`` is inside ``out``, ``first`` has one reader, which reads it twice."""
    first = named(copy, frame, name="first")
    middle = named(copy, first, name="middle")
    assert steps(plan(named(add, middle, first, name="out"))) == ["first", "out"]
    other = named(copy, first, name="other")
    assert steps(plan(named(add, middle, frame, name="out"), other)) == ["first", "out", "other"]


def test_fusion_can_be_switched_off() -> None:
    assert steps(plan(named(copy, named(copy, frame, name="a"), name="b"), fuse=False)) == ["a", "b"]


# Order


def test_passes_are_ordered_for_least_memory() -> None:
    """Two large pictures, each made small: one after another only one large one is alive."""
    large = [named(zoom, frame, name=f"large{i}", size=(256, 256)) for i in range(2)]
    small = [named(zoom, target, name=f"small{i}", size=(8, 4)) for i, target in enumerate(large)]
    out = named(add, *small, name="out")
    assert steps(plan(out, fuse=False)) == ["large0", "small0", "large1", "small1", "out"]
    assert plan(out, fuse=False).bytes < plan(out, fuse=False, alias=False).bytes
    assert set(steps(plan(out, fuse=False, order=False))) == set(steps(plan(out, fuse=False)))


def test_what_needs_most_far_up_comes_first() -> None:
    """The branch with the largest picture ends in a small one; the other one keeps more."""
    medium = named(zoom, named(zoom, frame, name="medium", size=(64, 64)), name="half", size=(48, 48))
    large = named(zoom, frame, name="large", size=(256, 256))
    small = named(zoom, named(zoom, large, name="small", size=(8, 4)), name="smaller", size=(4, 4))
    out = named(join, medium, small, name="out")
    assert steps(plan(out, fuse=False)) == ["large", "small", "smaller", "medium", "half", "out"]


@pytest.mark.parametrize("order", [True, False])
def test_producers_come_first(order: bool) -> None:
    a, b = named(copy, frame, name="a"), named(left, frame, name="b")
    made = plan(named(add, named(add, a, b, name="c"), b, name="d"), fuse=False, order=order)
    place = {name: i for i, name in enumerate(steps(made))}
    assert max(place["a"], place["b"]) < place["c"] < place["d"]


# Lifetimes and memory


def sharing(made: Plan) -> dict[int, list[int]]:
    shared: dict[int, list[int]] = {}
    for resource in made.resources:
        shared.setdefault(resource.memory, []).append(resource.id)
    return shared


def assert_nothing_alive_is_overwritten(made: Plan) -> None:
    spans = made.lifetimes
    for members in sharing(made).values():
        for i, one in enumerate(members):
            assert all(apart(spans[one], spans[other]) for other in members[i + 1 :])
            assert len(members) == 1 or not made.resources[one].persistent


def test_lifetimes_reach_from_first_to_last_touch() -> None:
    a = named(left, frame, name="a")
    b = named(left, a, name="b")
    c = named(add, named(left, b, name="between"), a, name="c")
    made = plan(c, fuse=False)
    spans = {r.name: s for r, s in zip(made.resources, made.lifetimes.values(), strict=True)}
    assert spans == {"frame": (0, 4), "a": (0, 3), "b": (1, 2), "between": (2, 3), "c": (0, 4)}


def test_pictures_that_are_never_alive_together_share_memory() -> None:
    target = frame
    for i in range(6):
        target = named(left, target, name=f"t{i}")
    made = plan(target)
    assert len(made.memories) == 4  # the input, the output and two in turn
    assert_nothing_alive_is_overwritten(made)
    assert len(plan(target, alias=False).memories) == 7


def test_a_picture_must_be_apart_from_everything_in_a_memory() -> None:
    """Granite's mistake is to ask one occupant of a memory only.

    ``second`` takes the memory of ``first``, which is over, and lives to the end; ``third`` is apart from
    ``first`` but not from ``second``.
    """
    first = named(left, frame, name="first")
    second = named(left, named(left, first, name="between"), name="second")
    third = named(left, second, name="third")
    made = plan(named(add, named(left, third, name="fourth"), second, name="out"))
    of = {resource.name: resource.memory for resource in made.resources}
    assert of["first"] == of["second"]
    assert of["third"] != of["second"]
    assert_nothing_alive_is_overwritten(made)


def test_three_in_one_memory_are_apart_pair_by_pair() -> None:
    target, kept = frame, []
    for i in range(9):
        target = named(left, target, name=f"t{i}")
        if i % 3 == 0:
            kept.append(target)
    out = target
    for i, other in enumerate(kept):
        out = named(add, out, other, name=f"s{i}")
    made = plan(out, fuse=False)
    assert max(len(members) for members in sharing(made).values()) >= 3
    assert_nothing_alive_is_overwritten(made)


def test_only_one_format_and_size_shares() -> None:
    a = named(left, frame, name="a", format="rgba32f")
    b = named(left, a, name="b", format="rgba16f")
    c = named(left, b, name="c", format="rgba8")
    d = named(zoom, c, name="d", format="rgba32f", size=(4, 4))
    made = plan(named(zoom, d, name="out", size=(8, 4)))
    assert all(len(members) == 1 for members in sharing(made).values())


def test_outputs_inputs_and_history_keep_their_memory() -> None:
    spec = pg.target("first", "rgba32f")
    first = copy(frame, into=spec, name="first")
    out = named(left, named(left, named(add, first, pg.previous(spec), name="mixed"), name="more"), name="out")
    made = plan(out, first)
    for resource in made.resources:
        if resource.name in ("frame", "first", "previous first", "out"):
            assert resource.persistent
            assert sharing(made)[resource.memory] == [resource.id]


# Static work


def test_what_depends_on_static_inputs_only_runs_once() -> None:
    once = named(left, still, name="once")
    made = plan(named(add, once, frame, name="out"))
    assert [step.static for step in made.steps] == [True, False]
    assert "pass once depends on static inputs only: runs once" in made.notes
    assert not any(step.static for step in plan(named(add, once, frame, name="out"), static=False).steps)
    assert next(r for r in made.resources if r.name == "once").persistent


def test_values_decide_too() -> None:
    gain = pg.kernel(source="def gain(color: Image, by: float) -> vec4: return color[0, 0] * by")
    assert plan(gain(still, 2.0)).steps[0].static
    assert plan(gain(still, pg.Value("by", float, static=True))).steps[0].static
    assert not plan(gain(still, pg.Value("by", float))).steps[0].static


def test_a_target_with_history_is_written_in_every_run() -> None:
    spec = pg.target("once", "rgba32f")
    once = left(still, into=spec, name="once")
    made = plan(named(add, once, pg.previous(spec), name="out"))
    assert not any(step.static for step in made.steps)


# Sizes


def test_size_classes() -> None:
    classes = {
        "absolute": {"size": (3, 2)}, "relative": {"scale": 0.3}, "like": {"like": frame, "scale": 0.5},
        "open": {}, "narrow": {"scale": (0.3, 2.0)}, "low": {"like": frame, "scale": (1.0, 0.3)},
    }  # fmt: skip
    made = build({name: named(zoom, frame, name=name, **settings) for name, settings in classes.items()}, (10, 7))
    sizes = {step.name: step.size for step in made.steps}
    assert sizes == {
        "absolute": (3, 2),
        "relative": (3, 3),
        "like": (4, 2),
        "open": (8, 4),
        "narrow": (3, 14),
        "low": (8, 2),
    }


@pytest.mark.parametrize("scale", [0.0, -1.0, 17.0, (0.5,), (0.5, 0.5, 0.5), (0.5, 0.0), "half", (0.5, "half"), True])
def test_scales_that_cannot_be(scale: Any) -> None:
    with pytest.raises(pg.GraphError, match="target 'a': scale"):
        pg.target("a", scale=scale)


def test_the_output_is_as_large_as_the_first_input_unless_told() -> None:
    relative = named(zoom, frame, name="out", scale=1.0)
    assert plan(relative).size == (8, 4)
    assert build({"out": relative}, (5, 6)).size == (5, 6)
    assert build({"out": named(zoom, frame, name="fixed", size=(2, 9))}).size == (2, 9)


def test_an_input_that_only_lends_its_size_takes_no_memory() -> None:
    lender = pg.Input("lender", "rgba32f", (3, 5))
    fill = pg.kernel(source="def fill(level: float) -> vec4: return vec4(level)")
    made = plan(fill(1.0, into=pg.target("out", like=lender)))
    assert made.steps[0].size == (3, 5)
    assert made.inputs == {}


def test_inputs_bind_their_format_and_size_from_outside() -> None:
    made = build({"out": copy(pg.Input("any"))}, None, {"any": (format_named("rgba8"), (5, 3))})
    assert made.steps[0].size == (5, 3)
    assert made.resources[made.inputs["any"]].format.name == "rgba8"


# Looking at it


def test_explain_tells_steps_memory_and_reasons() -> None:
    chain = named(left, named(copy, named(left, frame, name="a"), name="b"), name="c")
    text = plan(chain).explain()
    assert text.splitlines()[0] == "2 steps, output 8x4"
    assert "  1. b: frame → b (pixels with a, 8x4)" in text or "  1. a: frame → a (pixels, 8x4)" in text
    assert "memory: 0.0 MiB in" in text


def test_svg_is_well_formed_and_names_everything() -> None:
    from xml.etree import ElementTree

    made = plan(named(left, named(left, frame, name="<a&b>"), name="out"))
    drawing = made.svg()
    assert ElementTree.fromstring(drawing).tag.endswith("svg")
    for name in ("frame", "&lt;a&amp;b&gt;", "1. ", "2. out"):
        assert name in drawing
    assert drawing.count("<circle") == sum(len(step.reads) + len(step.writes) for step in made.steps)


def test_the_graph_is_there_to_look_at() -> None:
    out = named(add, named(copy, frame, name="a"), frame, name="out")
    kinds = sorted(kind for _, kind in pg.graph(out).nodes(data="kind"))
    assert kinds == ["input", "pass", "pass", "target", "target"]


HALVES = """
def halves(color: Image) -> vec4:
    if color.size.x == 2 * output_size().x:
        return color.texel(2 * pixel())
    return vec4(0.5)
"""


@pytest.mark.parametrize("known", [True, False])
def test_a_branch_on_known_sizes_is_decided_when_planned(known: bool) -> None:
    halves = pg.kernel(source=HALVES, known_sizes=known)
    for width, reads in ((8, True), (7, False)):
        picture = pg.Input("picture", "rgba32f", (width, 4))
        (step,) = plan(halves(picture, into=pg.target("half", "rgba32f", like=picture, scale=0.5))).steps
        assert isinstance(step, PixelStep)
        assert bool(step.images) == (reads or not known)
        assert any(name.kind in ("size", "output_size") for name, _ in step.program.builtins) != known


def test_known_sizes_are_those_of_each_run(backend_name: str) -> None:
    """An input of another size plans again, and the kernel is made for that size."""
    open_picture = pg.Input("picture", "rgba32f")
    halves = pg.kernel(source=HALVES, known_sizes=True)
    made = halves(open_picture, into=pg.target("half", "rgba32f", like=open_picture, scale=0.5))
    with pg.compile(made, backend=backend_name) as program:
        for width in (8, 7, 6):
            picture = np.random.default_rng(width).random((4, width, 4), np.float32)
            expected = picture[::2, ::2] if width % 2 == 0 else np.full((2, 4, 4), 0.5, np.float32)
            np.testing.assert_array_equal(program(picture=picture)["half"], expected)


def test_a_decorator_takes_known_sizes() -> None:
    @pg.kernel(known_sizes=True)
    def area(color: Image) -> vec4:
        return vec4(float(color.size.x * color.size.y))

    (step,) = plan(area(frame)).steps
    assert isinstance(step, PixelStep)
    assert not step.images
