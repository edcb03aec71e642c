"""Chains of pixel passes on the numpy backend: the same bits as pass by pass, and no memory that grows."""

from __future__ import annotations

import cProfile
import gc
import tracemalloc
from typing import Any

import numpy as np
import pytest

import passgraph as pg
from passgraph.backends.numpy.pixels import chains
from passgraph.effects import gaussian_blur
from passgraph.effects.filters.blur import depth_aware_blur
from passgraph.plan.chains import Chains
from passgraph.plan.data import Step

WIDE = """
def wide(color: Image, left: Const[int], right: Const[int], up: Const[int], down: Const[int], by: float = 0.3) -> vec4:
    return color[left, up] * by + color[right, down].bgra * 0.5 + color[0, 0] * vec4(pixel(), 1.0, 0.25) * 0.01
"""
wide = pg.kernel(source=WIDE)
both = pg.kernel(
    source="def both(a: Image, b: Image) -> vec4: return a[1, -2] * 0.5 + b[0, 3] * float(a.size.x) * 0.01 + b[-1, 0]"
)
pair = pg.kernel(source="def pair(color: Image) -> tuple[vec4, vec2]: return color[0, 1] * 0.5, color[-1, 0].gr")
join = pg.kernel(source="def join(a: Image, b: Image) -> vec4: return a[2, 0] - vec4(b[0, -2].rg, b[0, 1].rg)")
anywhere = pg.kernel(source="def anywhere(color: Image) -> vec4: return color.texel(ivec2(3, 2)) + color[0, 0]")
zoomed = pg.kernel(source="def zoomed(color: Image) -> vec4: return color.sample(uv() * 0.9)")
jumping = pg.kernel(source="def jumping(a: Image, b: Image) -> vec4: return a.texel(ivec2(9, 7)) + a[0, 0] + b[0, 1]")
UNCHAINED = pg.Options(fuse=False)


def picture(size: tuple[int, int], seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).random((size[1], size[0], 4), np.float32)


def chain_lengths(program: pg.Program) -> list[int]:
    """How many passes each call into the backend does."""
    execution = program._execution
    assert execution is not None
    return [len(unit.steps) for unit in execution.units]


def both_ways(outputs: Any, lengths: list[int], threads: int = 3, **given: Any) -> None:
    """Two frames chained and unchained: the same bits; ``lengths`` of the chains."""
    found = []
    for options in (pg.Options(), UNCHAINED):
        with pg.compile(outputs, f"numpy:{threads}", options=options) as program:
            frames = [dict(program(**given)) for _ in range(2)]
            assert chain_lengths(program) == (lengths if options.fuse else [1] * sum(lengths))
        found.append(frames)
    for one, other in zip(*found, strict=True):
        for name in one:
            np.testing.assert_array_equal(one[name], other[name])


def wide_chain(size: tuple[int, int], border: str, formats: tuple[str, ...]) -> pg.Target:
    """Passes that reach left, right, up and down by different amounts."""
    reaches = ((-3, 2, -1, 4), (-1, 5, -6, 0), (0, 0, 2, 3), (1, 2, -2, -1))
    target: Any = pg.Input("frame", "rgba32f", size)
    for number, (reach, format_) in enumerate(zip(reaches, formats, strict=False)):
        made = target.border(border) if number else target
        target = wide(made, *reach, into=pg.target(f"t{number}", format_))
    return target


@pytest.mark.sampled
@pytest.mark.parametrize("border", ["clamp", "zero"])
@pytest.mark.parametrize("size", [(1, 1), (2, 70), (70, 2), (33, 20), (320, 200)])
def test_a_chain_gives_the_same_bits_as_its_passes(size: tuple[int, int], border: str) -> None:
    for formats in (("rgba32f", "rgba32f"), ("rgba16f", "rgba8", "rgba32f", "rgba16f")):
        both_ways(wide_chain(size, border, formats), [len(formats)], frame=picture(size))


@pytest.mark.parametrize("kibibytes", [8, 20, 30])
def test_tiles_that_are_narrower_than_the_picture_give_the_same_bits(
    kibibytes: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Columns of pieces: rings hold a part of each row, and texels at its sides are computed twice."""
    monkeypatch.setattr(chains, "RING_BYTES", kibibytes * 1024)
    monkeypatch.setattr(chains, "MIN_SHARE", 1)
    monkeypatch.setattr(chains, "MIN_COLUMNS", 1)
    size = (150, 120)
    target = wide_chain(size, "clamp", ("rgba32f", "rgba16f", "rgba32f"))
    with pg.compile(target, "numpy:2") as program:
        steps = program.plan.steps
    tiles = chains.tiling(chains.stages(steps), 2, 1000)  # type: ignore[arg-type]
    assert tiles is not None and tiles.columns > 1
    both_ways(target, [3], frame=picture(size))


def test_several_results_and_several_readers_go_through_rings() -> None:
    size = (75, 66)
    frame = pg.Input("frame", "rgba32f", size)
    first, second = pair(frame, into=(pg.target("first", "rgba16f"), pg.target("second", "rg32f")))
    joined = join(first, second, into=pg.target("joined", "rgba32f"))
    both_ways(both(joined, joined, into=pg.target("out", "rgba32f")), [3], frame=picture(size))


@pytest.mark.parametrize("radius", [1, 7, 20])
def test_blurs_give_the_same_bits(radius: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(chains, "MAX_AGAIN", 1000)
    size = (60, 600)
    frame, depth = pg.Input("frame", "rgba32f", size), pg.Input("depth", "r32f", size)
    deep = picture(size, 1)[:, :, :1] + 1
    both_ways(gaussian_blur(frame, 0.4 * radius, radius), [2], frame=picture(size))
    # The depth of an input is made that of surfaces first.
    both_ways(depth_aware_blur(frame, depth, radius), [3], frame=picture(size), depth=deep)


def test_a_result_never_takes_the_memory_of_what_is_still_read() -> None:
    """Step by step the last pass of a chain may write where the first one read; chained it must not."""
    size = (200, 150)
    start = zoomed(pg.Input("frame", "rgba32f", size), into=pg.target("start", "rgba32f"))
    first = anywhere(start, into=pg.target("first", "rgba32f"))
    second = wide(first, 0, 0, 1, 2, into=pg.target("second", "rgba32f"))
    out = zoomed(second, into=pg.target("out", "rgba32f"))
    with pg.compile(out, "numpy") as program:
        places = {resource.name: resource.memory for resource in program.plan.resources}
        assert places["start"] == places["second"]
        assert program._execution is not None and program._execution.storages.apart
    both_ways(out, [1, 2, 1], frame=picture(size))


def chain_of(outputs: Any) -> list[int]:
    with pg.compile(outputs, "numpy") as program:
        return chain_lengths(program)


def test_what_else_is_read_stays_a_pass() -> None:
    """Results, history, reads anywhere, other sizes and borders that lead far away end a chain."""
    size = (64, 48)
    frame = pg.Input("frame", "rgba32f", size)
    reach = (-1, 1, -1, 1)
    inner = wide(frame, *reach, into=pg.target("inner", "rgba32f"))
    outer = wide(inner, *reach, into=pg.target("outer", "rgba32f"))
    assert chain_of(outer) == [2]
    assert chain_of([inner, outer]) == [1, 1]
    assert chain_of(both(outer, pg.previous(inner), into=pg.target("late", "rgba32f"))) == [1, 2]
    assert chain_of(wide(inner.border("repeat"), *reach, into=pg.target("far", "rgba32f"))) == [1, 1]
    assert chain_of(wide(inner.border("mirror"), *reach, into=pg.target("far", "rgba32f"))) == [1, 1]
    assert chain_of(anywhere(inner, into=pg.target("far", "rgba32f"))) == [1, 1]
    assert chain_of(zoomed(inner, into=pg.target("small", "rgba32f", (32, 24)))) == [1, 1]


def test_footprints_too_large_for_the_cache_stay_passes() -> None:
    size = (200, 1300)
    frame = pg.Input("frame", "rgba32f", size)
    assert chain_of(gaussian_blur(frame, 100.0, 300)) == [1, 1]


def test_a_dear_pass_is_not_computed_again() -> None:
    """Where rows around pieces cost more than what a chain saves, there is none."""
    size = (640, 360)
    text = """
def dear(color: Image) -> vec4:
    total = color[0, 0]
    for i in range(400):
        total = total * 0.5 + color[0, 0].bgra
    return total
"""
    dear = pg.kernel(source=text)(pg.Input("frame", "rgba32f", size), into=pg.target("dear", "rgba32f"))
    out = pg.target("out", "rgba32f")
    assert chain_of(wide(dear, 0, 0, -3, 3, into=out)) == [1, 1]
    assert chain_of(wide(dear, -3, 3, 0, 0, into=out)) == [2]


def test_an_observer_sees_every_target() -> None:
    """What lies between chained passes is not kept, so whoever looks gets them one by one, before and behind."""
    size = (50, 40)
    target = wide_chain(size, "clamp", ("rgba32f", "rgba16f", "rgba32f"))
    seen: dict[str, np.ndarray] = {}

    def observe(step: Step, written: dict[str, np.ndarray]) -> None:
        seen.update(written)

    with pg.compile(target, "numpy") as program, pg.compile(target, "numpy", options=UNCHAINED) as plain:
        chained = program(frame=picture(size))["t2"]
        program.run(observe, frame=picture(size))
        looked = program.read()["t2"]
        expected: dict[str, np.ndarray] = {}
        plain.run(lambda step, written: expected.update(written), frame=picture(size))
        assert set(seen) == {"t0", "t1", "t2"} == set(expected)
        for name, found in seen.items():
            np.testing.assert_array_equal(found, expected[name])
        np.testing.assert_array_equal(chained, looked)
        np.testing.assert_array_equal(program(frame=picture(size))["t2"], chained)


def test_a_parameter_of_a_chained_pass_can_be_set() -> None:
    size = (50, 40)
    target = wide_chain(size, "clamp", ("rgba32f", "rgba16f"))
    found = []
    for options in (pg.Options(), UNCHAINED):
        with pg.compile(target, "numpy", options=options) as program:
            before = program(frame=picture(size))["t1"]
            for step in program.plan.steps:
                program.set(step.name, "by", 0.75)
            found.append(program(frame=picture(size))["t1"])
            assert not np.array_equal(found[-1], before)
    np.testing.assert_array_equal(*found)


def test_static_chains_run_once() -> None:
    size = (60, 40)
    still = pg.Input("still", "rgba32f", size, static=True)
    soft = gaussian_blur(still, 1.0, 3)
    out = both(soft, pg.Input("frame", "rgba32f", size), into=pg.target("out", "rgba32f"))
    with pg.compile(out, "numpy") as program:
        assert program.plan.steps[0].static and chain_lengths(program) == [2, 1]
    both_ways(out, [2, 1], still=picture(size, 1), frame=picture(size))


def test_only_closed_groups_are_offered() -> None:
    size = (32, 32)
    frame = pg.Input("frame", "rgba32f", size)
    inner = wide(frame, -1, 1, 0, 0, into=pg.target("inner", "rgba32f"))
    middle = wide(inner, -1, 1, 0, 0, into=pg.target("middle", "rgba32f"))
    out = both(middle, inner, into=pg.target("out", "rgba32f"))
    with pg.compile(out, "null") as program:
        assert [list(Chains(program.plan).ends(start)) for start in range(3)] == [[3], [3], []]
    with pg.compile([out, middle], "null") as program:
        assert [list(Chains(program.plan).ends(start)) for start in range(3)] == [[], [], []]


def test_what_a_pass_behind_a_shorter_chain_reads_is_kept() -> None:
    """The last of three cannot be chained, for it jumps; the first two alone are no group then."""
    size = (40, 24)
    frame = pg.Input("frame", "rgba32f", size)
    first = wide(frame, -1, 1, 0, 0, into=pg.target("first", "rgba32f"))
    second = wide(frame, 0, 0, -1, 1, into=pg.target("second", "rgba32f"))
    out = jumping(first, second, into=pg.target("out", "rgba32f"))
    with pg.compile(out, "numpy") as program:
        assert [list(Chains(program.plan).ends(start)) for start in range(3)] == [[3], [3], []]
    both_ways(out, [1, 2], frame=picture(size))


def test_a_frame_allocates_nothing_that_lasts() -> None:
    """Behind the first frames neither Python's memory nor the process's grows; no frame takes a picture's worth."""
    size = (320, 200)
    target = gaussian_blur(wide_chain(size, "clamp", ("rgba32f", "rgba16f")), 2.0, 5)
    given = picture(size)
    with pg.compile(target, "numpy:2") as program:
        for _ in range(3):
            program.run(frame=given)
        gc.collect()
        resident = resident_bytes()
        tracemalloc.start()
        try:
            program.run(frame=given)
            first, _ = tracemalloc.get_traced_memory()
            tracemalloc.reset_peak()
            for _ in range(50):
                program.run(frame=given)
            last, peak = tracemalloc.get_traced_memory()
        finally:
            tracemalloc.stop()
        # Not even a row of a picture a frame: what is left are the arguments that a waking thread still holds.
        assert last - first < 50 * size[0] * 16
        # Looking an input through for NaN takes less than the picture itself.
        assert peak - first < given.nbytes
        assert resident_bytes() - resident < given.nbytes


def resident_bytes() -> int:
    """Memory of this process that is really there."""
    try:
        with open("/proc/self/status", encoding="ascii") as status:
            return next(int(line.split()[1]) * 1024 for line in status if line.startswith("VmRSS"))
    except OSError:
        pytest.skip("the system does not tell a process's memory this way")


def test_a_pass_costs_few_calls_of_its_own() -> None:
    """Forty passes over 16x16 pixels, one by one, against twenty: what Python does for each."""
    assert (calls_of_a_run(40) - calls_of_a_run(20)) / 20 < 30


def calls_of_a_run(count: int) -> int:
    """Calls of functions, C's too, that a run takes once everything is bound."""
    size = (16, 16)
    target: Any = pg.Input("frame", "rgba32f", size)
    for number in range(count):
        target = wide(target, -1, 1, 0, 1, into=pg.target(f"t{number}", "rgba32f"))
    with pg.compile(target, "numpy:1", options=UNCHAINED) as program:
        given = picture(size)
        for _ in range(3):
            program.run(frame=given)
        counted = cProfile.Profile()
        counted.enable()
        program.run(frame=given)
        counted.disable()
    return sum(entry.callcount for entry in counted.getstats())


def test_a_piece_is_large_beside_what_is_computed_again() -> None:
    """The share of rows that pieces of a 15-tap blur compute twice, at a full picture's size."""
    size = (1920, 1080)
    target = gaussian_blur(pg.Input("frame", "rgba32f", size), 3.0, 7)
    with pg.compile(target, "null") as program:
        chain = chains.stages(program.plan.steps)  # type: ignore[arg-type]
    assert chain is not None
    tiles = chains.tiling(chain, 2, 16_384)
    assert tiles is not None and tiles.columns == 1
    assert (tiles.rows + 14) / tiles.rows < 1.11
    rings = chain[0].rows * chains.pitch(chain[0], tiles.width) * 16
    assert rings <= chains.RING_BYTES
