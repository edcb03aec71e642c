"""Room for results: memory is handed out again when nobody has it any more, and never before."""

from __future__ import annotations

import gc
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
import pytest

import passgraph as pg
from passgraph.files import Arrays, Frame, ToArrays
from passgraph.files.frame import Sink
from passgraph.run.caller_arrays import MIN_POOLED_BYTES, BufferPool, room_of

DIM = "def dim(color: Image) -> vec4: return color[0, 0] * 0.5"


@pytest.fixture
def program() -> Iterator[pg.Program]:
    dimmed = pg.kernel(source=DIM)(pg.Input("frame"), into=pg.target("dimmed", "rgba8"))
    with pg.compile(dimmed, results="stored") as made:
        made(frame=np.zeros((4, 6, 4), np.uint8))
        yield made


def place(array: np.ndarray) -> int:
    return array.ctypes.data


def picture(value: int) -> np.ndarray:
    return np.full((256, 256, 4), value, np.uint8)


@pytest.mark.parametrize("results", ["stored", "float32"])
def test_memory_is_handed_out_again_when_the_last_view_is_gone(results: Any) -> None:
    """Of results that passes write in place, and of those that are moved to be values."""
    dimmed = pg.kernel(source=DIM)(pg.Input("frame"), into=pg.target("dimmed", "rgba8"))
    with pg.compile(dimmed, results=results) as program:
        first = program(frame=picture(100))["dimmed"]
        at, view, one = place(first), first[1:, ::2], 1 if results == "stored" else 1 / 255
        first[0] = 7  # a result is the caller's
        del first
        gc.collect()
        second = program(frame=picture(200))["dimmed"]
        assert place(second) != at  # a view is still somebody's
        assert np.all(view == np.float32(50 * one)) and np.all(second == np.float32(100 * one))
        del view
        program(frame=picture(0))  # of which nobody wants the result
        third = program(frame=picture(20))["dimmed"]
        assert place(third) == at and np.all(third == np.float32(10 * one))
        assert np.all(second == np.float32(100 * one))


def test_few_memories_wait_and_small_ones_not_at_all() -> None:
    spare = BufferPool(most=2)
    kind = (MIN_POOLED_BYTES, 1), np.dtype(np.uint8)
    held = [spare.array(*kind) for _ in range(5)]
    places = {place(array) for array in held}
    assert not any(at % 64 for at in places) and len(places) == 5
    held.clear()
    assert [len(waiting) for waiting in spare._free.values()] == [2]
    small = spare.array((MIN_POOLED_BYTES - 1,), np.dtype(np.uint8))
    assert small.flags.owndata
    del small
    assert [len(waiting) for waiting in spare._free.values()] == [2]


def test_memory_that_threads_drop_and_take_is_one_of_theirs_at_a_time() -> None:
    spare, kind = BufferPool(), ((MIN_POOLED_BYTES,), np.dtype(np.uint8))

    def hold(thread: int) -> bool:
        for _ in range(200):
            array = spare.array(*kind)
            array[::4096] = thread
            if not np.all(array[::4096] == thread):
                return False
        return True

    with ThreadPoolExecutor(4) as pool:
        assert all(pool.map(hold, range(4)))


def test_room_has_the_type_of_results() -> None:
    dimmed = pg.kernel(source=DIM)(pg.Input("frame", "rgba8", (3, 2)), into=pg.target("dimmed", "rgba8"))
    for results, dtype in (("stored", np.uint8), ("float32", np.float32)):
        with pg.compile(dimmed, results=results) as program:  # type: ignore[arg-type]
            room = room_of(program.plan, results)
            assert (room["dimmed"].shape, room["dimmed"].dtype) == ((2, 3, 4), dtype)
            assert program(frame=np.full((2, 3, 4), 200, np.uint8), into=room)["dimmed"] is room["dimmed"]


def pictures() -> list[np.ndarray]:
    """One size, another, and the first again; the last ones of another type."""
    rng = np.random.default_rng(3)
    sizes = [(4, 6)] * 4 + [(5, 3)] * 3 + [(4, 6)] * 3
    made = [rng.integers(0, 256, (*size, 4), np.uint8) for size in sizes]
    return [*made, *(rng.random((4, 6, 4), np.float32) for _ in range(3))]


@pytest.mark.parametrize("jobs", [1, 3])
def test_frames_that_a_sink_keeps_stay_as_they_are(program: pg.Program, jobs: int) -> None:
    sink, given = ToArrays(), pictures()
    assert pg.frames(program, Arrays(given), sink, jobs=jobs).whole
    for made, picture in zip(sink.pictures, given, strict=True):
        np.testing.assert_array_equal(made, program(frame=picture)["dimmed"] / np.float32(255))


class Places(Sink):
    """Where results lay, of which it keeps nothing."""

    name = "places"

    def __init__(self) -> None:
        self.places: list[int] = []

    def stores(self, frame: Frame, size: tuple[int, int]) -> np.dtype:
        return np.dtype(np.uint8)

    def prepare(self, frame: Frame, picture: np.ndarray) -> None:
        self.places.append(place(picture))


def test_a_sink_that_keeps_nothing_sees_the_same_memory(program: pg.Program) -> None:
    """Of a whole sequence a few pictures; without room each is a new one, which may lie anywhere."""
    sink = Places()
    frames = [np.full((512, 512, 4), n, np.uint8) for n in range(12)]
    assert pg.frames(program, Arrays(frames), sink, jobs=1).whole
    assert len(set(sink.places[1:])) <= 3
