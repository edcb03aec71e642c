"""Planning takes steps and memory in proportion to the passes, whatever their graph looks like."""

from __future__ import annotations

import cProfile
import gc
import sys
import tracemalloc
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

import passgraph as pg
from passgraph.backends.null import NullBackend
from passgraph.graph.targets import Target
from passgraph.language import lower_cache
from passgraph.language.lower import Facts, Fused, ImageFacts, lower
from passgraph.language.parameter_name import ParameterName
from passgraph.plan.chains import MAX_STEPS, Chains
from passgraph.plan.data import PixelStep
from passgraph.plan.fuse import MAX_FUSED_INSTRUCTIONS
from tests.corners import placed

pytestmark = pytest.mark.slow

SIZE = (16, 12)
BY = ParameterName("by")
half = pg.kernel(source="def half(color: Image) -> vec4: return color[0, 0] * 0.5")
gain = pg.kernel(source="def gain(color: Image, by: float) -> vec4: return sqrt(abs(color[0, 0])) * by")
add = pg.kernel(source="def add(a: Image, b: Image) -> vec4: return a[0, 0] + b[0, 0]")
left = pg.kernel(source="def left(color: Image) -> vec4: return color[-1, 0]")
zoom = pg.kernel(source="def zoom(color: Image) -> vec4: return color.sample(uv())")
CORNER = placed("""
def paint(corner: Corner) -> vec4:
    return vec4(0.5)
""")
STAGES: dict[str, Any] = {
    "vertex": pg.vertex(source=CORNER, name="place"),
    "fragment": pg.fragment(source=CORNER, name="paint"),
}
MESH = pg.Mesh.make([[-1, -1, 0], [1, -1, 0], [0, 1, 0]], [[0, 1, 2]])


def made(kernel: Any, *given: Any, number: object, **settings: Any) -> Target:
    target: Target = kernel(*given, into=pg.target(f"t{number}", "rgba32f", **settings), name=f"p{number}")
    return target


def frame() -> Target:
    return pg.Input("frame", "rgba32f", SIZE)


def row(count: int) -> list[Target]:
    """Pointwise passes one behind the other."""
    last = frame()
    for number in range(count):
        last = made(half, last, number=number)
    return [last]


def twice(count: int) -> list[Target]:
    """Each pass reads the one before through two parameters."""
    last = frame()
    for number in range(count):
        last = made(add, last, last, number=number)
    return [last]


def valued(count: int) -> list[Target]:
    """Each pass has a value of its own."""
    last = frame()
    for number in range(count):
        last = made(gain, last, pg.Value(f"v{number}", float), number=number)
    return [last]


def unfused(count: int) -> list[Target]:
    last = frame()
    for number in range(count):
        last = made(left, last, number=number)
    return [last]


def diamonds(count: int) -> list[Target]:
    last = frame()
    for number in range(count // 3):
        one, other = made(left, last, number=f"{number}a"), made(half, last, number=f"{number}b")
        last = made(add, one, other, number=number)
    return [last]


def steps_back(count: int) -> list[Target]:
    """Each pass reads the two before it: as many ways through the graph as rabbits."""
    before, last = frame(), frame()
    before = last
    for number in range(count):
        before, last = last, made(add, before, last, number=number)
    return [last]


def tree(count: int) -> list[Target]:
    """Many that may run at once, added up in pairs."""
    level = [made(left, frame_, number=k) for frame_ in [frame()] for k in range(count // 2)]
    number = count
    while len(level) > 1:
        pairs = list(zip(level[::2], level[1::2], strict=False))
        number += len(pairs)
        rest = level[-1:] if len(level) % 2 else []
        level = [made(add, *pair, number=number + k * count) for k, pair in enumerate(pairs)] + rest
    return level


def fan(count: int) -> list[Target]:
    """One picture read by all, and every one an output."""
    first = made(left, frame(), number="first")
    return [made(half, first, number=number) for number in range(count)]


def sized(count: int) -> list[Target]:
    """Each target takes its size from the one before."""
    last = frame()
    for number in range(count):
        last = made(zoom, last, number=number, like=last)
    return [last]


def remembering(count: int) -> list[Target]:
    last = frame()
    for number in range(count):
        spec = pg.target(f"t{number}", "rgba32f")
        last = add(last, pg.previous(spec), into=spec, name=f"p{number}")
    return [last]


def draws(count: int) -> list[Target]:
    """Each draw over the one before, whose content a pass reads too."""
    last, other = pg.draw(MESH, into=pg.target("drawn", "rgba32f", SIZE), name="d", **STAGES), frame()
    for number in range(count // 2):
        other = made(add, last, other, number=number)
        last = pg.draw(MESH, into=last, name=f"d{number}", **STAGES)
    return [last, other]


SHAPES = (row, twice, valued, unfused, diamonds, steps_back, tree, fan, sized, remembering, draws)


@pytest.fixture(autouse=True)
def own_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PASSGRAPH_CACHE", str(tmp_path))


@contextmanager
def counted(calls: list[int]) -> Iterator[None]:
    """How many functions, Python's and built-in ones, are called."""
    profile = cProfile.Profile()
    with profile:
        yield
    calls.append(sum(entry.callcount for entry in profile.getstats()))


def plan(outputs: list[Target]) -> pg.Program:
    return pg.compile(outputs, NullBackend())


@pytest.mark.parametrize("shape", SHAPES, ids=lambda shape: shape.__name__)
def test_steps_grow_with_the_passes(shape: Callable[[int], list[Target]]) -> None:
    """Twice the passes, twice the calls: sorting and heaps add a little, squares and cubes would make it 4 and 8."""
    plan(shape(20)).close()  # what is loaded once
    calls: list[int] = []
    for count in (250, 500):
        outputs = shape(count)
        with counted(calls):
            with plan(outputs) as program:
                program.explain()
            pg.graph(*outputs)
    assert calls[1] < 2.3 * calls[0]
    assert calls[1] < 500 * 6000


@pytest.mark.parametrize("shape", [row, twice, unfused, tree], ids=lambda shape: shape.__name__)
def test_memory_grows_with_the_passes(shape: Callable[[int], list[Target]]) -> None:
    peaks = []
    for count in (20, 250, 500):
        outputs = shape(count)
        gc.collect()
        tracemalloc.start()
        try:
            program = plan(outputs)
            peaks.append(tracemalloc.get_traced_memory()[1])
        finally:
            tracemalloc.stop()
        assert len(program.explain()) < 400 * count
        program.close()
    assert peaks[2] < 2.3 * peaks[1]


@pytest.mark.parametrize("shape", [row, twice, sized, draws], ids=lambda shape: shape.__name__)
def test_a_thousand_passes_nest_no_calls(shape: Callable[[int], list[Target]]) -> None:
    """Python's own stack is as deep for a thousand passes as for one."""
    outputs = shape(1000)
    before = sys.getrecursionlimit()
    sys.setrecursionlimit(250)
    try:
        plan(outputs).close()
    finally:
        sys.setrecursionlimit(before)


def test_a_thousand_producers_inside_each_other_are_lowered() -> None:
    """Fusion stops long before, but what it hands to the lowering is walked, not recursed into."""
    facts = Facts(images={"color": ImageFacts()})
    for number in range(1000):
        facts = Facts(images={"color": ImageFacts(fused=Fused(half.program, facts, number, 0))})
    program = lower(half.program, facts)
    assert len(program.images) == 1
    assert sum(type(i).__name__ == "Op" for i in program.body) == 4004  # 4 channels of 1001 multiplications


def test_fused_kernels_stay_below_a_length() -> None:
    with plan(row(1000)) as program:
        steps = program.plan.steps
        assert len(steps) > 1
        assert sum(len(step.fused) + 1 for step in steps) == 1000  # type: ignore[union-attr]
        for step in steps:
            assert len(step.program.body) <= MAX_FUSED_INSTRUCTIONS  # type: ignore[union-attr]


def gains(count: int) -> Target:
    """Threes of passes that fuse, each pass with a value of its own; between them one that reads a neighbour."""
    last = frame()
    for number in range(count):
        pair = [made(gain, last, float(number + k), number=f"{number}{'ab'[k]}") for k in range(2)]
        last = made(left, made(add, *pair, number=f"{number}c"), number=number)
    return last


def test_rows_that_are_alike_are_lowered_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Wherever in the graph they stand: what is fused is numbered from 0 on in each."""
    lowered: list[str] = []
    original = lower_cache._lowered
    monkeypatch.setattr(lower_cache, "_lowered", lambda *given: lowered.append(given[0].name) or original(*given))
    with plan([gains(30)]) as program:
        steps = [step for step in program.plan.steps if isinstance(step, PixelStep) and step.fused]
    assert len(steps) == 30
    assert len({step.program.key for step in steps}) == 1
    assert lowered.count("add") == 2  # by itself, and with what is fused into it
    assert {tuple(step.values) for step in steps} == {(BY.of(0), BY.of(1))}
    assert [step.values[BY.of(0)] for step in steps] == list(map(float, range(30)))


def test_chains_that_a_backend_is_asked_for_are_few_and_short() -> None:
    """Each step is the start of a few, so that a backend that takes none is asked in proportion to the steps."""
    with plan(unfused(100)) as program:
        chains = Chains(program.plan)
        for start in range(100):
            ends = list(chains.ends(start))
            assert ends == sorted(ends, reverse=True)
            assert all(start + 2 <= end <= min(start + MAX_STEPS, 100) for end in ends)
            assert len(ends) == max(0, min(start + MAX_STEPS, 100) - start - 1)


def test_chains_of_long_steps_are_short(monkeypatch: pytest.MonkeyPatch) -> None:
    """What is compiled at once has a length, however many steps it is of."""
    with plan(unfused(40)) as program:
        length = len(program.plan.steps[0].program.body)  # type: ignore[union-attr]
        monkeypatch.setattr("passgraph.plan.chains.MAX_INSTRUCTIONS", 5 * length)
        assert [max(Chains(program.plan).ends(start)) for start in (0, 7)] == [5, 12]
        monkeypatch.setattr("passgraph.plan.chains.MAX_INSTRUCTIONS", length)
        assert list(Chains(program.plan).ends(0)) == []
