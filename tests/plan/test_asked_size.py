"""``compile(size=…)`` is obeyed, or refused with the reason."""

from __future__ import annotations

import numpy as np
import pytest

import passgraph as pg
from passgraph.graph.run_values import OUTPUT_SIZE
from passgraph.graph.targets import Target

frame = pg.Input("frame", "rgba32f", (8, 4))
copy = pg.kernel(source="def copy(color: Image) -> vec4: return color[0, 0]")
zoom = pg.kernel(source="def zoom(color: Image) -> vec4: return color.sample(uv())")
fill = pg.kernel(source="def fill(level: float) -> vec4: return vec4(level)")


def sizes(*outputs: Target, size: tuple[int, int] | None) -> list[tuple[int, int]]:
    with pg.compile(outputs, "null", size=size) as program:
        return [program.plan.resources[number].size for number in program.plan.outputs.values()]


def refusal(*outputs: Target, size: tuple[int, int]) -> str:
    with pytest.raises(pg.GraphError) as caught:
        sizes(*outputs, size=size)
    return str(caught.value)


def test_outputs_that_take_the_size_have_it() -> None:
    relative = zoom(frame, into=pg.target("relative", scale=1.0))
    assert sizes(relative, size=(16, 9)) == [(16, 9)]
    assert sizes(copy(relative), fill(1.0), size=(16, 9)) == [(16, 9), (16, 9)]
    assert sizes(zoom(frame, into=pg.target("half", scale=0.5)), size=(16, 9)) == [(8, 5)]


def test_an_output_as_large_as_an_input_is_not_made_another_size_in_silence() -> None:
    assert refusal(zoom(copy(frame)), size=(16, 9)) == (
        "size=(16, 9) was requested, but output 'zoom' is 8x4, the size of input 'frame'; leave size out, or declare "
        "the target with scale=1.0, which takes the requested size"
    )
    assert sizes(zoom(copy(frame)), size=(8, 4)) == [(8, 4)]


def test_a_share_of_an_input_of_the_size_asked_for_is_no_other_size() -> None:
    half = zoom(frame, into=pg.target("half", like=frame, scale=0.5))
    assert sizes(half, size=(8, 4)) == [(4, 2)]
    assert "output 'half' is 4x2, the size of input 'frame'" in refusal(half, size=(16, 9))


def test_passes_between_do_not_hide_it() -> None:
    between = zoom(frame, into=pg.target("between", scale=0.5))
    add = pg.kernel(source="def add(a: Image, b: Image) -> vec4: return a[0, 0] + b.sample(uv())")
    assert "output 'add' is 8x4, the size of input 'frame'" in refusal(add(frame, between), size=(16, 9))


def test_an_open_input_is_judged_at_the_first_run() -> None:
    with pg.compile(copy(pg.Input("open")), "reference", size=(3, 2)) as program:
        with pytest.raises(pg.GraphError, match=r"size=\(3, 2\) was requested, but output 'copy' is 5x4"):
            program(open=np.zeros((4, 5, 4), np.float32))
        assert program(open=np.ones((2, 3, 4), np.float32))["copy"].shape == (2, 3, 4)


def test_declared_sizes_stay_and_a_size_for_nobody_is_refused() -> None:
    map_ = fill(1.0, into=pg.target("map", size=(32, 32)))
    assert "output 'map' is 32x32, as target 'map' is declared" in refusal(map_, size=(16, 9))
    # Beside an output that takes it, and behind passes that do, it stays what it is.
    assert sizes(map_, fill(0.5), size=(16, 9)) == [(32, 32), (16, 9)]
    picture = fill(0.5, into=pg.target("picture"))
    assert sizes(zoom(picture, into=pg.target("thumb", size=(2, 2))), size=(16, 9)) == [(2, 2)]
    aspect = OUTPUT_SIZE.map(lambda size: size[0] / size[1])
    assert sizes(fill(aspect, into=pg.target("strip", size=(4, 1))), size=(16, 9)) == [(4, 1)]


def test_a_size_that_nothing_takes_need_not_be_given() -> None:
    small = fill(1.0, into=pg.target("small", size=(3, 2)))
    with pg.compile(fill(1.0, into=pg.target("alike", like=small)), "null") as program:
        assert program.plan.size == (3, 2)
    with pytest.raises(pg.GraphError, match=r"the output's size is not known: give pg.compile\(..., size="):
        pg.compile(fill(1.0), "null")


def test_sizes_taken_from_each_other_in_a_circle() -> None:
    spec = pg.target("first")
    second = fill(1.0, into=pg.target("second", like=pg.previous(spec)), name="one")
    first = copy(second, into=spec, name="two")
    text = refusal(first, size=(4, 4))
    assert text == (
        "pass 'two' takes its size from 'second', which takes its own from 'first'; give one of the two a size"
    )


def test_what_is_reduced_hangs_on_the_size_of_its_picture() -> None:
    """Asked for are the picture's pixels, of which the result has fewer."""
    top = pg.reduce(frame, "max")
    assert sizes(top, pg.histogram(frame, 5), size=(8, 4)) == [(1, 1), (5, 1)]
    assert "output 'frame.max' is 1x1, reduced from input 'frame'" in refusal(top, size=(16, 9))
    relative = zoom(frame, into=pg.target("relative", scale=1.0))
    assert sizes(pg.reduce(relative, "sum", axis="y"), size=(16, 9)) == [(16, 1)]
