"""Random graphs of passes, pictures and tiles: what tiles give is the whole, or the graph is refused for a reason."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import passgraph as pg
from passgraph.language.borders import BORDERS
from passgraph.verify.fuzz.random_graphs import FORMATS
from tests.files.tile_graphs import inputs, kernel, same

BOUNDED = settings(deadline=None, derandomize=True, database=None, suppress_health_check=[HealthCheck.too_slow])
#: Kernels by name, with the images that they take.
PASSES = {"sobel": 1, "vignette": 1, "placed": 1, "far": 1, "unsharp": 2, "gradient": 0}
ARGUMENTS: dict[str, tuple[object, ...]] = {"vignette": (0.5,), "unsharp": (0.5,)}


@st.composite
def cases(draw: st.DrawFn) -> dict[str, Any]:
    """Up to six passes, each with what it reads (counted back from the newest), a format and a border rule."""
    step = st.tuples(
        st.sampled_from(tuple(PASSES)), st.integers(0, 3), st.integers(0, 5),
        st.sampled_from(FORMATS), st.sampled_from(tuple(BORDERS)),
    )  # fmt: skip
    sides = st.integers(1, 40)
    return {
        "steps": draw(st.lists(step, min_size=1, max_size=6)),
        "outputs": draw(st.lists(st.integers(0, 5), max_size=1)),
        "size": (draw(sides), draw(sides)),
        "tile": (draw(sides), draw(sides)),
    }


def grown(case: dict[str, Any]) -> list[pg.Target]:
    """The outputs of a case; the last pass is always one of them."""
    contents = [pg.Input("frame", "rgba32f", case["size"])]
    for number, (name, first, second, format_, border) in enumerate(case["steps"]):
        images = [contents[-1 - back % len(contents)].border(border) for back in (first, second)][: PASSES[name]]
        into = pg.target(f"t{number}", format_, like=contents[0])
        contents.append(kernel(name)(*images, *ARGUMENTS.get(name, ()), into=into, name=f"p{number}"))
    made = contents[1:]
    return list(
        {target.name: target for target in (made[-1], *(made[n % len(made)] for n in case["outputs"]))}.values()
    )


def assert_tiles_are_the_whole(case: dict[str, Any]) -> None:
    outputs, (width, height) = grown(case), case["size"]
    with pg.compile(outputs) as program:
        given = {"frame": inputs(width, height)["frame"]} if program.inputs else {}
        expected = program(**given)
    results = {name: np.full_like(expected[name], np.nan) for name in expected}
    pg.tiled(outputs, given, results, tile=case["tile"], progress=False)
    for name in expected:
        assert same(results[name], expected[name]), name


@settings(BOUNDED, max_examples=20)
@given(cases())
def test_tiles_of_random_graphs_are_the_whole(case: dict[str, Any]) -> None:
    assert_tiles_are_the_whole(case)


@pytest.mark.slow
@settings(BOUNDED, max_examples=150)
@given(cases())
def test_tiles_of_many_random_graphs_are_the_whole(case: dict[str, Any]) -> None:
    assert_tiles_are_the_whole(case)


def test_a_halo_that_is_too_small_is_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    """A planted mistake: the reach of the last pass alone."""
    from passgraph.plan.window import Halo

    case = {
        "steps": [("far", 0, 0, "rgba32f", "clamp"), ("sobel", 0, 0, "rgba32f", "clamp")],
        "outputs": [], "size": (40, 30), "tile": (8, 8),
    }  # fmt: skip
    assert_tiles_are_the_whole(case)
    monkeypatch.setattr(Halo, "beyond", lambda self, _: self)
    with pytest.raises(AssertionError):
        assert_tiles_are_the_whole(case)
