"""Arrays of the caller: read and written where they lie, in the types in which programs hold pictures."""

from __future__ import annotations

import tracemalloc
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

import passgraph as pg
from passgraph.effects import black_and_white, gaussian_blur
from passgraph.verify.compare import compare
from tests.hostile.guard import guarded_copy

SIZE = (24, 160)  # height and width: rows longer than what machine code reads at once
BACKENDS = ("reference", "numpy", "gl", "opencl", "webgpu")


def grey(name: str = "grey", format: str = "rgba8") -> pg.Target:
    return black_and_white(pg.Input("frame"), into=pg.target(name, format))


def photo(channels: int = 4, dtype: Any = np.uint8, size: tuple[int, int] = SIZE) -> np.ndarray[Any, Any]:
    top = 1 if np.dtype(dtype).kind == "f" else np.iinfo(dtype).max
    return (np.random.default_rng(5).random((*size, channels)) * top).astype(dtype)


@pytest.fixture(params=BACKENDS)
def backend(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@pytest.mark.sampled
@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.float16, np.float32])
@pytest.mark.parametrize("channels", [1, 2, 3, 4])
def test_an_array_means_the_same_in_its_own_type_and_as_values(backend: str, channels: int, dtype: Any) -> None:
    given = photo(channels, dtype)
    values = given / np.float32(np.iinfo(dtype).max) if given.dtype.kind == "u" else given.astype(np.float32)
    output = gaussian_blur(pg.Input("frame"), 1.0, 2)
    with pg.compile(output, backend=backend) as program:
        as_given, as_values = program(frame=given), program(frame=values.astype(np.float32))
    if backend == "gl" and given.dtype.kind == "u":  # drivers may read fractions a little off
        assert compare(output, [backend], frame=given[:8, :8]).within_bounds
        assert np.abs(as_given["gaussian_blur"] - as_values["gaussian_blur"]).max() < 1 / np.iinfo(dtype).max / 16
    else:
        assert np.array_equal(as_given["gaussian_blur"], as_values["gaussian_blur"])


@pytest.mark.sampled
@pytest.mark.parametrize("format", ["rgba8", "rgba16", "rgba16f", "rgba32f", "rgb8", "rgb16", "rgba8_srgb"])
def test_results_come_in_the_targets_own_type(backend: str, format: str) -> None:
    held = pg.formats.FORMATS[format]
    with pg.compile(grey(format=format), backend=backend) as program:
        values = program(frame=photo())["grey"]
    with pg.compile(grey(format=format), backend=backend, results="stored") as program:
        stored = program(frame=photo())["grey"]
    assert values.dtype == np.float32 and stored.dtype == np.dtype(held.number)
    expected = stored / np.float32(held.steps) if held.steps else stored.astype(np.float32)
    assert np.array_equal(values, expected)


@pytest.mark.parametrize("dtype", [np.uint8, np.float32])
def test_results_are_written_into_the_callers_array(backend: str, dtype: Any) -> None:
    with pg.compile(grey(), backend=backend) as program:
        expected = program(frame=photo())["grey"]
        room = np.full((*SIZE, 4), 7, dtype)
        result = program(frame=photo(), into={"grey": room})["grey"]
        again = program.read("grey")["grey"]
    assert np.shares_memory(result, room) and np.shares_memory(again, room)
    assert np.array_equal(room / np.float32(255) if dtype == np.uint8 else room, expected)


def views(base: np.ndarray[Any, Any]) -> dict[str, np.ndarray[Any, Any]]:
    """Layouts of pictures of one size within a larger array (3 × height, 2 × width + 3, channels)."""
    height, width = SIZE
    channels = base.shape[2]
    flat = base.reshape(-1)
    odd = np.lib.stride_tricks.as_strided(  # rows that are no whole number of pixels apart
        flat[1:], (height, width, channels), (width * channels + 1, channels, 1)
    )
    return {
        "plain": base[:height, :width],
        "at the end": base[-height:, -width:],
        "from the bottom up": base[height - 1 :: -1, :width],
        "every second row": base[: 2 * height : 2, 3 : 3 + width],
        "every second column": base[:height, : 2 * width : 2],
        "from right to left": base[:height, width - 1 :: -1],
        "channels in reverse": base[:height, :width, ::-1],
        "odd rows": odd,
    }


@pytest.mark.sampled
@pytest.mark.parametrize("layout", list(views(np.zeros((72, 323, 3), np.uint8))))
@pytest.mark.parametrize("channels", [3, 4])
def test_any_layout_reads_and_writes_as_a_plain_copy(backend: str, layout: str, channels: int) -> None:
    base = photo(channels, size=(3 * SIZE[0], 2 * SIZE[1] + 3))
    around = np.full_like(base, 99)
    given, room = views(base)[layout], views(around)[layout]
    output = gaussian_blur(pg.Input("frame"), 1.5, 3, into=pg.target("soft", f"{'rgba'[:channels]}8"))
    with pg.compile(output, backend=backend, results="stored") as program:
        expected = program(frame=np.ascontiguousarray(given))["soft"]
        program(frame=given, into={"soft": room})
    assert np.array_equal(room, expected)
    room[...] = 99
    assert (around == 99).all()  # nothing else was written


def test_plain_arrays_stay_where_they_are_on_numpy() -> None:
    given, room = photo(), np.empty((*SIZE, 4), np.uint8)
    with pg.compile(grey()) as program:
        program(frame=given, into={"grey": room})
        told = program.explain()
        program(frame=given[..., ::-1], into={"grey": room[..., ::-1]})
        moved = program.explain()
    assert "input 'frame': read in place from uint8" in told and "output 'grey': written in place in" in told
    assert "input 'frame': moved to rgba8" in moved and "output 'grey': moved into uint8" in moved


SHIFTED = pg.kernel(source="def shifted(color: Image) -> vec4: return color.sample(uv() + 0.001)")
AROUND: dict[str, Any] = {
    "a pixel": lambda frame, into: black_and_white(frame, into=into),
    "a window": lambda frame, into: gaussian_blur(frame, 2.0, 5, into=into),
    "anywhere": lambda frame, into: SHIFTED(frame, into=into),
}


@pytest.mark.parametrize("channels", [1, 2, 3, 4])
@pytest.mark.parametrize("width", [5, 33, 1021])
@pytest.mark.parametrize("reads", list(AROUND))
def test_nothing_beyond_the_callers_memory_is_touched(reads: str, width: int, channels: int) -> None:
    """Both arrays end where a page ends, behind which all is forbidden: a wider load or store ends the process."""
    given = guarded_copy(photo(channels, size=(16, width)))
    output = AROUND[reads](pg.Input("frame"), pg.target("made", "rgba8"))
    with pg.compile(output, results="stored") as program:
        room = guarded_copy(np.zeros((16, width, 4), np.uint8))
        program(frame=given, into={"made": room})
        assert np.array_equal(room, program(frame=given.copy())["made"])


def test_a_call_with_room_allocates_no_picture() -> None:
    given, room = photo(size=(256, 256)), np.empty((256, 256, 4), np.uint8)
    with pg.compile(gaussian_blur(pg.Input("frame"), 1.0, 2, into=pg.target("soft", "rgba8"))) as program:
        program(frame=given, into={"soft": room})
        tracemalloc.start()
        program(frame=given, into={"soft": room})
        _, most = tracemalloc.get_traced_memory()
        tracemalloc.stop()
    assert most < given.nbytes / 4


def test_a_result_is_the_callers() -> None:
    for name in BACKENDS:
        for results in ("float32", "stored"):
            with pg.compile(grey(), backend=name, results=results) as program:
                first = program(frame=photo())["grey"]
                kept = first.copy()
                program(frame=255 - photo())
            assert np.array_equal(first, kept)


def test_what_is_given_is_not_changed_and_not_kept() -> None:
    given = photo()
    before = given.copy()
    with pg.compile(grey()) as program:
        one = program(frame=given)["grey"]
        assert np.array_equal(given, before)
        given[...] = 0
        two = program(frame=given)["grey"]
    assert one.any() and not two[..., :3].any()


def test_pictures_of_other_libraries_come_as_they_are() -> None:
    given = photo(3)

    class OnlyDLPack:
        def __dlpack__(self, **options: Any) -> Any:
            return given.__dlpack__(**options)

        def __dlpack_device__(self) -> tuple[int, int]:
            return given.__dlpack_device__()

    with pg.compile(grey()) as program:
        expected = program(frame=given)["grey"]
        for other in (Image.fromarray(given), memoryview(given), OnlyDLPack()):
            assert np.array_equal(program(frame=other)["grey"], expected)
        room = np.empty((*SIZE, 4), np.uint8)
        program(frame=given, into={"grey": memoryview(room)})
        assert np.array_equal(room / np.float32(255), expected)


def test_a_target_with_history_is_moved_out() -> None:
    spec = pg.target("sum", "rgba8")
    add = pg.kernel(source="def add(color: Image, before: Image) -> vec4: return color[0, 0] * 0.25 + before[0, 0]")
    output = add(pg.Input("frame"), pg.previous(spec), into=spec)
    rooms = [np.empty((*SIZE, 4), np.uint8) for _ in range(3)]
    with pg.compile(output, results="stored") as program:
        expected = [program(frame=photo())["sum"] for _ in rooms]
    with pg.compile(output) as program:
        for room in rooms:
            program(frame=photo(), into={"sum": room})
    assert all(np.array_equal(*pair) for pair in zip(rooms, expected, strict=True))
    assert not np.array_equal(rooms[0], rooms[2])


def test_static_passes_fill_new_room_too() -> None:
    output = black_and_white(pg.Input("frame", static=True), into=pg.target("grey", "rgba8"))
    given, rooms = photo(), [np.zeros((*SIZE, 4), np.uint8) for _ in range(3)]
    with pg.compile(output) as program:
        for room in rooms:
            program(frame=given, into={"grey": room})
    assert rooms[0].any() and all(np.array_equal(rooms[0], room) for room in rooms)


WRONG: dict[str, tuple[Any, str]] = {
    "another name": ({"gray": np.empty((*SIZE, 4), np.uint8)}, "into= names 'gray'; the outputs are grey"),
    "another shape": (
        {"grey": np.empty((*SIZE, 3), np.uint8)},
        r"\(24, 160, 4\) of uint8 or float32, as target",
    ),
    "another type": ({"grey": np.empty((*SIZE, 4), np.uint16)}, "got .* of uint16"),
    "no array": ({"grey": [[0]]}, "cannot be written into"),
    "no mapping": ([np.empty(3)], "takes arrays by output name"),
    "one pixel everywhere": ({"grey": np.broadcast_to(np.zeros(4, np.uint8), (*SIZE, 4))}, "read-only"),
}


@pytest.mark.parametrize("case", list(WRONG))
def test_room_that_does_not_fit_is_refused(case: str) -> None:
    into, message = WRONG[case]
    with pg.compile(grey()) as program, pytest.raises(pg.InputError, match=message):
        program(frame=photo(), into=into)


def test_room_that_overlaps_is_refused(tmp_path: Path) -> None:
    both = np.zeros((*SIZE, 4), np.uint8)
    frame = pg.Input("frame")
    targets = [black_and_white(frame, into=pg.target(name, "rgba8")) for name in ("one", "two")]
    with pg.compile(targets) as program:
        with pytest.raises(pg.InputError, match="output 'one' shares memory with input 'frame'; give each its own"):
            program(frame=both, into={"one": both})
        with pytest.raises(pg.InputError, match="shares memory with that of output 'two'"):
            program(frame=photo(), into={"one": both, "two": both[::-1]})
    wide = np.zeros((SIZE[0], 2 * SIZE[1], 4), np.uint8)
    wide[:, : SIZE[1]] = photo()
    with pg.compile(grey()) as program:  # side by side in one array they do not
        program(frame=wide[:, : SIZE[1]], into={"grey": wide[:, SIZE[1] :]})
    assert wide[:, SIZE[1] :].any()


def test_an_array_that_overlaps_itself_is_refused() -> None:
    row = np.zeros((1, SIZE[1], 4), np.uint8)
    room = np.lib.stride_tricks.as_strided(row, (*SIZE, 4), (0, 4, 1), writeable=True)
    with pg.compile(grey()) as program, pytest.raises(pg.InputError, match="pixels that share memory"):
        program(frame=photo(), into={"grey": room})


def test_an_input_cannot_be_called_into() -> None:
    with pytest.raises(pg.GraphError, match="cannot be called 'into'"):
        pg.compile(black_and_white(pg.Input("into")))
