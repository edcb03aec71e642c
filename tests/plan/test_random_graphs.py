"""Random graphs: with any optimisation off, in any order, every result is the same, bit for bit, over several runs."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

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
from passgraph.verify.fuzz.graphs import OPTIMISATIONS, different, graphs, grown, plannable, run_thrice
from tests.conftest import SLOW_ON_OPENCL, require
from tests.plan.orders import apart, shuffled

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
        expected = run_thrice(outputs, backend, pg.Options())
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
        expected = run_thrice(outputs, backend, options)
        for way in range(3):
            patch.setattr(passgraph.plan.build, "order", lambda work, way=way: shuffled(work, seed + way))
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
