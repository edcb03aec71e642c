"""Random graphs: with any optimisation off, in any order, every result is the same, bit for bit, over several runs."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import passgraph as pg
import passgraph.plan.build
from passgraph.backends.base import Backend
from passgraph.backends.null import NullBackend
from passgraph.backends.registry import open_backend
from passgraph.plan.data import Resource, Step, lifetimes
from passgraph.verify.fuzz.cases import EXACT
from passgraph.verify.fuzz.naive import naive_difference
from passgraph.verify.fuzz.random_graphs import OPTIMISATIONS, different, frames, graphs, grown, plannable, run_frames
from tests.conftest import SLOW_ON_OPENCL, require
from tests.plan.orders import apart, shuffled

SIZE = (8, 6)
TRIANGLE = pg.Mesh.make(np.array([[-1, -1, 0.5], [3, -1, 0.5], [-1, 3, 0.5]], np.float32), np.array([[0, 1, 2]]))
KERNELS = """
class Corner:
    position: vec4

def place(vertex: Vertex) -> Corner:
    return Corner(vec4(vertex.position, 1.0))

def paint(corner: Corner, texture: Image, by: float) -> vec4:
    return texture.texel(pixel()) * by
"""
PLACE, PAINT = pg.vertex(source=KERNELS, name="place"), pg.fragment(source=KERNELS, name="paint")
BOUNDED = settings(
    deadline=None,
    derandomize=True,
    database=None,
    # The fixture is a name, the same for every example.
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.function_scoped_fixture],
)


@settings(BOUNDED, max_examples=14)
@given(graphs())
def test_plans_never_let_pictures_overlap(case: dict[str, Any]) -> None:
    assert_no_pictures_overlap(case)


@pytest.mark.slow
@settings(BOUNDED, max_examples=100)
@given(graphs())
def test_many_plans_never_let_pictures_overlap(case: dict[str, Any]) -> None:
    assert_no_pictures_overlap(case)


def assert_no_pictures_overlap(case: dict[str, Any]) -> None:
    outputs = grown(case)
    if not plannable(outputs):
        return
    for off in (None, *OPTIMISATIONS):
        options = pg.Options() if off is None else replace(pg.Options(), **{off: False})
        with pg.compile(outputs, NullBackend(), options=options) as program:
            made = program.plan
            spans = made.lifetimes
            for one in made.resources:
                for other in made.resources[one.id + 1 :]:
                    assert one.memory != other.memory or apart(spans[one.id], spans[other.id])
            written = {resource.id for resource in made.resources if resource.kind != "target"}
            for step in made.steps:
                assert set(step.reads) <= written, "read before it is written"
                written.update(step.writes)
            assert set(made.outputs.values()) <= written


@pytest.mark.parametrize("backend_name", SLOW_ON_OPENCL)
@settings(BOUNDED, max_examples=5)
@given(case=graphs())
def test_each_optimisation_off_equals_on(backend_name: str, case: dict[str, Any]) -> None:
    """Where compilers contract nothing; on OpenGL all that leaves the kernels as they are."""
    require(backend_name)
    outputs = grown(case)
    if not plannable(outputs):
        return
    with open_backend(backend_name) as backend:
        expected = run_frames(outputs, backend, pg.Options())
        for off in OPTIMISATIONS:
            if backend_name in EXACT or off not in ("fuse", "simplify"):
                other = replace(pg.Options(), **{off: False})
                assert different(outputs, backend, pg.Options(), other, expected) == "", f"{off} off"


@settings(BOUNDED, max_examples=4)
@given(case=graphs(), seed=st.integers(0, 99))
def test_every_order_of_passes_gives_the_same(backend_name: str, case: dict[str, Any], seed: int) -> None:
    """Aliasing follows the order, so memories are shared by other pictures each time."""
    outputs = grown(case)
    if not plannable(outputs):
        return
    # Unfused, so that there is more to put in order.
    options = pg.Options(fuse=False)
    with open_backend(backend_name) as backend, pytest.MonkeyPatch.context() as patch:
        expected = run_frames(outputs, backend, options)
        for way in range(3):
            patch.setattr(passgraph.plan.build, "order", lambda draft, way=way: shuffled(draft, seed + way))
            assert different(outputs, backend, options, options, expected) == ""


@settings(BOUNDED, max_examples=9)
@given(case=graphs())
def test_the_plan_means_what_was_written(case: dict[str, Any]) -> None:
    assert_means_what_was_written(case)


@pytest.mark.slow
@settings(BOUNDED, max_examples=40)
@given(case=graphs())
def test_many_plans_mean_what_was_written(case: dict[str, Any]) -> None:
    assert_means_what_was_written(case)


def assert_means_what_was_written(case: dict[str, Any]) -> None:
    """The reference, which never fuses, with everything else on, against everything off."""
    outputs = grown(case)
    if not plannable(outputs):
        return
    everything_off = pg.Options(**dict.fromkeys(OPTIMISATIONS, False))
    with open_backend("reference") as backend:
        assert different(outputs, backend, everything_off, pg.Options()) == ""


@settings(BOUNDED, max_examples=12)
@given(case=graphs())
def test_a_plan_gives_what_its_passes_give_one_by_one(case: dict[str, Any]) -> None:
    assert_is_naive(case)


@pytest.mark.slow
@settings(BOUNDED, max_examples=500)
@given(case=graphs())
def test_many_plans_give_what_their_passes_give_one_by_one(case: dict[str, Any]) -> None:
    assert_is_naive(case)


def assert_is_naive(case: dict[str, Any]) -> None:
    outputs = grown(case)
    if not plannable(outputs):
        return
    with open_backend("numpy") as backend:
        for options in (pg.Options(), replace(pg.Options(), **{case["off"]: False})):
            assert naive_difference(outputs, backend, frames(), options) == ""


@pytest.mark.parametrize("backend_name", ["reference", "numpy", "gl", "opencl", "webgpu"])
def test_content_drawn_over_by_a_static_pass_is_there_in_every_run(backend_name: str) -> None:
    """A static draw, a reader of every run, and a static draw over the same target."""
    require(backend_name)
    level = pg.kernel(source="def level(still: Image, frame: Image) -> vec4: return still[0, 0] + frame[0, 0]")
    still = pg.Input("still", "rgba32f", SIZE, static=True)
    frame = pg.Input("frame", "rgba32f", SIZE)
    first = pg.draw(TRIANGLE, vertex=PLACE, fragment=PAINT, into=pg.target("t", "rgba32f", SIZE), texture=still, by=1.0)
    read = level(first, frame, into=pg.target("read", "rgba32f", SIZE))
    over = pg.draw(TRIANGLE, vertex=PLACE, fragment=PAINT, into=first, texture=still, by=5.0)
    picture = np.ones((SIZE[1], SIZE[0], 4), np.float32)
    found = []
    with open_backend(backend_name) as backend, pg.compile({"read": read, "over": over}, backend) as program:
        for number in (10, 20, 30):
            results = program(still=picture, frame=np.full_like(picture, number))
            found.append((results["read"][2, 2, 0], results["over"][2, 2, 0]))
    assert found == [(11, 5), (21, 5), (31, 5)]


def test_a_plan_that_shares_memory_too_early_is_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    """A planted mistake: every lifetime seems to end at once."""
    case = {
        "steps": [["left", 0, 0, 0, "rgba32f", False, "clamp"], ["left", 1, 0, 0, "rgba32f", False, "clamp"],
                  ["left", 0, 0, 0, "rgba32f", False, "clamp"], ["add", 0, 2, 0, "rgba32f", False, "clamp"]],
        "outputs": [],
    }  # fmt: skip
    outputs = grown(case)

    def too_short(resources: list[Resource], steps: list[Step]) -> dict[int, tuple[int, int]]:
        return {number: (first, first) for number, (first, _) in lifetimes(resources, steps).items()}

    def compare(backend: Backend) -> str:
        return different(outputs, backend, pg.Options(alias=False, fuse=False), pg.Options(fuse=False))

    with open_backend("numpy") as backend:
        assert compare(backend) == ""
        monkeypatch.setattr("passgraph.plan.emit.lifetimes", too_short)
        assert compare(backend) != ""
