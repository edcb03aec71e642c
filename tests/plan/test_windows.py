"""Footprints of plans, and the programs of windows."""

from __future__ import annotations

from typing import Any

import pytest

import passgraph as pg
from passgraph.graph.targets import named_outputs
from passgraph.language import scalar as s
from passgraph.language.lower import lower
from passgraph.plan.build import build
from passgraph.plan.data import Options, PixelStep, Plan
from passgraph.plan.window import WINDOW, WINDOW_PARAMETER, Halo, footprint, placed, window_plan, windows

KERNELS = """
def left(color: Image) -> vec4: return color[-3, 0]
def down(color: Image) -> vec4: return color[0, 2] + color[0, 5]
def both(a: Image, b: Image) -> vec4: return a[1, 0] + b[0, -1]
def here(color: Image) -> vec4: return color[0, 0]
def nested(color: Image) -> vec4:
    total = color[0, 0]
    for i in range(100):
        if total.r < 0.5:
            total += vec4(vec2(pixel()) / vec2(output_size()), vec2(color.size))
            break
    return total
"""


def made(name: str, *images: pg.Target, border: str = "clamp") -> pg.Target:
    result: pg.Target = pg.kernel(source=KERNELS, name=name)(
        *(image.border(border) for image in images), into=pg.target(f"{name}{len(images)}", "rgba32f"), name=name
    )
    return result


def plan_of(target: pg.Target, size: tuple[int, int] = (100, 80)) -> Plan:
    return build(
        named_outputs(target), inputs={"frame": (pg.target("f", "rgba32f").format, size)},
        options=Options(static=False), in_windows=True,
    )  # fmt: skip


FRAME = pg.Input("frame")


@pytest.mark.parametrize(
    ("graph", "halo"),
    [
        (made("here", FRAME), Halo()),
        (made("left", FRAME), Halo(left=3)),
        (made("down", made("left", FRAME)), Halo(left=3, down=5)),
        (made("both", made("left", FRAME), FRAME), Halo(left=3, right=1, up=1)),
        (made("both", made("left", made("down", FRAME)), made("here", FRAME)), Halo(3, 1, 1, 5)),
        (made("left", FRAME, border="zero"), Halo(left=3)),
        (made("left", FRAME, border="mirror"), Halo(left=3, right=3)),
    ],
    ids=["here", "left", "chain", "two ways", "diamond", "zero", "mirror"],
)  # fmt: skip
def test_reaches_add_up_along_chains(graph: pg.Target, halo: Halo) -> None:
    found = footprint(plan_of(graph))
    assert found.halo == halo
    assert (found.wide, found.high) == ("", "")


def test_rules_that_lead_to_the_other_side_ask_for_all_of_an_axis() -> None:
    found = footprint(plan_of(made("down", made("left", FRAME, border="repeat"))))
    assert found.wide.startswith("pass 'left' reads 'frame' beyond its border by the rule 'repeat'")
    assert found.high == ""


@pytest.mark.parametrize("length", [1, 2, 9, 10])
@pytest.mark.parametrize("core", [1, 3, 10])
@pytest.mark.parametrize(("before", "behind"), [(0, 0), (2, 1), (0, 7), (12, 12)])
def test_windows_are_alike_and_hold_what_they_need(length: int, core: int, before: int, behind: int) -> None:
    found = list(windows(length, core, before, behind))
    window = min(length, core + before + behind)
    assert [begin for _, begin, _ in found] == list(range(0, length, core))
    assert found[-1][2] == length
    for place, begin, end in found:
        assert 0 <= place <= max(0, begin - before)
        assert min(length, end + behind) <= place + window <= length


def program(name: str) -> s.ScalarProgram:
    return lower(pg.kernel(source=KERNELS, name=name).program)


def test_a_program_that_does_not_ask_where_it_is_stays() -> None:
    assert placed(program("left"), ["color"]) is not None
    left = program("left")
    assert placed(left, ["color"]) is left


def test_builtins_inside_loops_and_branches_come_from_the_parameter() -> None:
    before = program("nested")
    after = placed(before, ["color"])
    loaded = [i for i in s.walk(after.body) if isinstance(i, s.LoadBuiltin)]
    assert sorted(str(i.name) for i in loaded) == ["pixel.0", "pixel.1"]
    assert {str(name) for name, _ in after.builtins} == {"pixel.0", "pixel.1"}
    read = {i.index.value for i in s.walk(after.body) if isinstance(i, s.LoadUniform) and isinstance(i.index, s.Lit)}
    first = before.int_count
    assert read == set(range(first, first + 4))
    assert after.int_count == first + 4
    ids = [value.id for i in s.walk(after.body) for value in s.results_of(i)]
    assert len(ids) == len(set(ids))


def test_images_held_whole_keep_their_size() -> None:
    after = placed(program("nested"), [])
    assert {"size.color.0", "size.color.1"} <= {str(name) for name, _ in after.builtins}


def test_one_program_serves_every_picture() -> None:
    def key(size: tuple[int, int]) -> Any:
        plan = plan_of(made("nested", FRAME), size)
        step = window_plan(plan, footprint(plan), (16, 16)).steps[0]
        assert isinstance(step, PixelStep)
        assert step.values[WINDOW_PARAMETER] is WINDOW
        return step.program.key

    assert key((100, 80)) == key((100_000, 20_000))


def test_no_value_may_have_the_name_of_the_windows_own() -> None:
    gain = pg.kernel(source="def gain(color: Image, by: float) -> vec4: return color[0, 0] * by")
    plan = plan_of(gain(FRAME, pg.Value(WINDOW.name), into=pg.target("made", "rgba32f")))
    with pytest.raises(
        pg.GraphError, match="'tile window' is reserved for the value with a tile's position; rename your value"
    ):
        window_plan(plan, footprint(plan), (16, 16))


def test_a_windows_plan_is_as_large_as_the_window() -> None:
    plan = plan_of(made("down", made("left", FRAME)), (100_000, 60_000))
    found = window_plan(plan, footprint(plan), (64, 32))
    assert found.size == (64, 32)
    assert {step.size for step in found.steps} == {memory.size for memory in found.memories} == {(64, 32)}
