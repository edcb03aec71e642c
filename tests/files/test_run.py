"""Frames through a program: order, threads, history, what fails and what stops."""

from __future__ import annotations

import errno
import os
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import passgraph as pg
from passgraph.errors import GraphError, InputError
from passgraph.files import Arrays, Frame, Outcome, Pattern, Pictures, Sink, Still, ToArrays, ToPictures
from passgraph.files.stored import stored
from tests.files.made import ADD, INVERT, SCALED, inverted, picture, sequence, summed, value
from tests.picture_files import names_in


@pytest.mark.parametrize("jobs", [1, 2, 5])
def test_frames_keep_their_order(jobs: int) -> None:
    made, told = ToArrays(), list[Outcome]()
    with inverted() as program:
        summary = pg.frames(program, Arrays([picture(i) for i in range(20)]), made, jobs=jobs, watch=told.append)
    assert [round(float(one[0, 0, 0]) * 255) for one in made.pictures] == [255 - i for i in range(20)]
    assert [outcome.number for outcome in told] == list(range(1, 21))
    assert (summary.written, summary.whole, summary.size) == (20, True, (6, 4))


def test_a_sequence_of_files_becomes_another(tmp_path: Path) -> None:
    sequence(tmp_path / "a", range(3, 7))
    with inverted() as program:
        summary = pg.frames(program, tmp_path / "a" / "in.####.png", tmp_path / "out.%02d.png")
    assert summary.written == 4
    assert [value(tmp_path / f"out.{n:02d}.png") for n in range(3, 7)] == [225, 215, 205, 195]


@pytest.mark.parametrize("jobs", [1, 3])
def test_history_sees_every_frame_in_order(jobs: int) -> None:
    made = ToArrays()
    with summed() as program:
        pg.frames(program, Arrays([picture(i) for i in range(9)]), made, jobs=jobs)
    assert [round(float(one[0, 0, 0]) * 255) for one in made.pictures] == [0, 1, 3, 6, 10, 15, 21, 28, 36]


def test_values_are_constants_or_functions_of_the_number() -> None:
    program = pg.compile(SCALED(pg.Input("frame"), gain=pg.Value("gain", float)), backend="reference")
    source, by_number, constant = Arrays([picture(255)] * 3), ToArrays(), ToArrays()
    with program:
        pg.frames(program, source, by_number, values=lambda number: {"gain": number / 4})
        pg.frames(program, source, constant, values={"gain": 0.5})
    assert [one[0, 0, 0] for one in by_number.pictures] == [0.25, 0.5, 0.75]
    assert [one[0, 0, 0] for one in constant.pictures] == [0.5] * 3


@pytest.mark.parametrize(
    ("values", "message"),
    [
        (lambda number: number, "values must give a mapping by name, got 1"),
        ({3: 4}, "values must give a mapping by name, got {3: 4}"),
        ({"frame": 4}, "'frame' is among the values and has a source too"),
        ({"other": 4}, "'other'"),
    ],
)
def test_values_that_do_not_fit(values: Any, message: str) -> None:
    with inverted() as program:
        summary = pg.frames(program, {"frame": Arrays([picture(1)])}, ToArrays(), values=values)
    assert message in summary.failed[0].reason


def test_several_inputs_go_in_step() -> None:
    made = ToArrays()
    with pg.compile(ADD(pg.Input("one"), pg.Input("two")), backend="reference") as program:
        sources = {"one": Arrays([picture(i) for i in range(4)]), "two": Still(picture(100))}
        pg.frames(program, sources, made)
        assert [round(float(one[0, 0, 0]) * 255) for one in made.pictures] == [100, 101, 102, 103]
        uneven = {"one": Arrays([picture(i) for i in range(4)]), "two": Arrays([picture(1)] * 2)}
        summary = pg.frames(program, uneven, ToArrays())
        assert (summary.written, summary.stopped) == (
            2, "arrays: ends after 2 frames, and arrays has more; give 'two' one for each",
        )  # fmt: skip
        with pytest.raises(GraphError, match=r"has 2 inputs that a source could be for \(one, two\); give a mapping"):
            pg.frames(program, Arrays([]), made)
        with pytest.raises(GraphError, match=r"there is no input 'three'; the program has one, two"):
            pg.frames(program, {"three": Arrays([])}, made)
        with pytest.raises(InputError, match=r"none of the sources ends"):
            pg.frames(program, {"one": Still(picture(1)), "two": Still(picture(1))}, made)


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.float32])
def test_stored_types_reach_the_program_as_they_are(dtype: type) -> None:
    given = list[Any]()

    class Program(pg.Program):
        def __call__(self, /, **pictures: Any) -> pg.Result:
            given.append(pictures["frame"])
            return super().__call__(**pictures)

    one = np.ones((2, 3, 4), dtype)
    with inverted() as program:
        program.__class__ = Program
        pg.frames(program, Arrays([one]), ToArrays())
    assert given[0] is one


@pytest.mark.parametrize(
    ("result", "dtype", "expected"),
    [
        (np.float32([0.0, 0.5, 2.0]), np.uint8, [0, 128, 255]),
        (np.float32([0.0, 0.5, 2.0]), np.uint16, [0, 32768, 65535]),
        (np.float32([-1.0, 0.5, 2.0]), np.float32, [-1.0, 0.5, 2.0]),
        (np.float16([0.5]), np.float32, [0.5]),
        (np.uint8([0, 51, 255]), np.uint8, [0, 51, 255]),
        (np.uint8([0, 51, 255]), np.uint16, [0, 13107, 65535]),
        (np.uint16([0, 13107, 65535]), np.uint8, [0, 51, 255]),
        (np.uint8([0, 255]), np.float32, [0.0, 1.0]),
    ],
)
def test_results_of_every_type_are_stored_in_every_type(result: Any, dtype: type, expected: list[float]) -> None:
    made = stored(result, np.dtype(dtype), "frame")
    assert (made.dtype, made.tolist()) == (dtype, expected)


def test_every_backend_takes_frames(backend_name: str, tmp_path: Path) -> None:
    """Results of earlier frames are still being stored while the program runs again."""
    sequence(tmp_path, range(1, 13), (40, 30))
    with inverted(backend_name) as program:
        assert pg.frames(program, tmp_path / "in.####.png", tmp_path / "out.#.png", jobs=4).written == 12
    assert [value(tmp_path / f"out.{n}.png") for n in range(1, 13)] == [255 - 10 * n for n in range(1, 13)]


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
def test_linear_decodes_as_loading_does(dtype: type, tmp_path: Path) -> None:
    levels = np.linspace(0, np.iinfo(dtype).max, 64).astype(dtype).reshape(4, 4, 4)
    np.save(tmp_path / "a.npy", levels)
    made = ToArrays()
    with pg.compile(SCALED(pg.Input("frame"), gain=1.0), backend="numpy") as program:
        pg.frames(program, tmp_path / "a.npy", made, linear=True)
    assert np.array_equal(made.pictures[0], pg.load(tmp_path / "a.npy", linear=True))


# What fails


@pytest.mark.parametrize("jobs", [1, 2])
def test_a_broken_frame_fails_alone(tmp_path: Path, jobs: int) -> None:
    sequence(tmp_path, range(1, 7))
    (tmp_path / "in.0003.png").write_bytes((tmp_path / "in.0003.png").read_bytes()[:50])
    told = list[Outcome]()
    with inverted() as program:
        summary = pg.frames(program, tmp_path / "in.%04d.png", tmp_path / "out.#.png", jobs=jobs, watch=told.append)
    assert (summary.written, summary.whole) == (5, False)
    assert [outcome.state for outcome in told] == ["written"] * 2 + ["failed"] + ["written"] * 3
    assert summary.failed[0].number == 3
    assert "in.0003.png: truncated or corrupt" in summary.failed[0].reason
    assert sorted(path.name for path in tmp_path.glob("out*")) == [f"out.{n}.png" for n in (1, 2, 4, 5, 6)]


def test_a_picture_with_nan_fails_alone() -> None:
    bad = np.full((2, 3, 4), np.nan, np.float32)
    with inverted() as program:
        summary = pg.frames(program, Arrays([picture(1), bad, picture(2)]), ToArrays())
    assert (summary.written, [one.number for one in summary.failed]) == (2, [2])
    assert "NaN" in summary.failed[0].reason


def test_nan_in_a_result_names_the_frame(tmp_path: Path) -> None:
    source = "def root(color: Image) -> vec4: return vec4(sqrt(color[0, 0].r - 0.5), 0.0, 0.0, 1.0)"
    with pg.compile(pg.kernel(source=source)(pg.Input("frame")), backend="numpy") as program:
        summary = pg.frames(program, Arrays([picture(200), picture(1)]), tmp_path / "out.#.png")
    assert (summary.written, [one.number for one in summary.failed]) == (1, [2])
    assert summary.failed[0].reason.startswith("array 2: 24 of 96 values are NaN, the first in row 0")


def test_another_size_plans_again() -> None:
    made = ToArrays()
    with inverted() as program:
        summary = pg.frames(program, Arrays([picture(1), picture(2, (5, 7)), picture(3)]), made)
        assert program.replanned == 2
    assert summary.whole
    assert [one.shape for one in made.pictures] == [(4, 6, 4), (7, 5, 4), (4, 6, 4)]


def test_another_size_fails_where_there_is_history() -> None:
    made = ToArrays()
    with summed() as program:
        summary = pg.frames(program, Arrays([picture(1), picture(50, (5, 7)), picture(2)]), made)
    assert "array 2: is 5x7 pixels, and frames before it are 6x4; an effect that reads last frame" in (
        summary.failed[0].reason
    )
    assert [round(float(one[0, 0, 0]) * 255) for one in made.pictures] == [1, 3]


def test_a_program_that_does_not_fit_is_an_error_at_once(tmp_path: Path) -> None:
    with inverted() as program, pytest.raises(GraphError, match=r"there is no result 'other'; there are invert"):
        pg.frames(program, Arrays([picture(1)] * 3), tmp_path / "out.#.png", output="other")
    assert not list(tmp_path.iterdir())


class Breaking(Arrays):
    """Breaks off behind its pictures."""

    def __iter__(self) -> Iterator[Frame]:
        yield from super().__iter__()
        raise InputError("the reel: torn")


def test_a_source_that_breaks_off_keeps_what_came_before() -> None:
    made = ToArrays()
    with inverted() as program:
        summary = pg.frames(program, Breaking([picture(1)] * 3), made)
        assert (summary.written, summary.stopped, summary.whole) == (3, "the reel: torn", False)
        with pytest.raises(InputError, match="the reel: torn"):
            pg.frames(program, Breaking([]), made)


# A disk that fills, Ctrl-C


@pytest.mark.parametrize("jobs", [1, 2])
def test_a_full_disk_keeps_what_is_whole(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, jobs: int) -> None:
    from passgraph import pictures

    write, count = pictures.write_image, iter(range(100))

    def full(file: Path, temporary: Path, *others: Any) -> None:
        if next(count) >= 3:
            temporary.write_bytes(b"begun")
            raise OSError(errno.ENOSPC, "No space left on device", os.fspath(temporary))
        write(file, temporary, *others)

    monkeypatch.setattr(pictures, "write_image", full)
    with inverted() as program:
        summary = pg.frames(program, Arrays([picture(i) for i in range(50)]), tmp_path / "out.##.png", jobs=jobs)
    assert summary.written == 3
    assert summary.stopped.startswith("the disk is full: ")
    assert "cannot be written (No space left on device)" in summary.stopped
    names = names_in(tmp_path)
    assert len(names) == 3
    assert all(pg.load(tmp_path / name).shape == (4, 6, 4) for name in names)


@pytest.mark.parametrize("jobs", [1, 2])
def test_ctrl_c_keeps_what_is_whole(tmp_path: Path, jobs: int) -> None:
    told = list[int]()

    def stop(outcome: Outcome) -> None:
        told.append(outcome.number)
        if outcome.number == 4:
            time.sleep(0.05)  # what has begun ahead comes to its end
            raise KeyboardInterrupt

    sink = ToPictures(Pattern(str(tmp_path / "out.##.png")))
    with inverted() as program:
        with pytest.raises(KeyboardInterrupt):
            pg.frames(program, Arrays([picture(i) for i in range(50)]), sink, jobs=jobs, watch=stop)
        names = names_in(tmp_path)
        assert 4 <= len(names) <= 4 + 2 * jobs + 2
        assert names == [f"out.{number:02d}.png" for number in told]
        assert all(pg.load(tmp_path / name).shape == (4, 6, 4) for name in names)
        # The program and the sink go on.
        assert pg.frames(program, Arrays([picture(1)]), sink).written == 1
    assert not [thread for thread in threading.enumerate() if thread.name.startswith("passgraph_frames")]


def test_a_sink_is_told_how_a_run_ended() -> None:
    told = list[str]()

    class Told(Sink):
        def take(self, frame: Frame, prepared: Any) -> None:
            if frame.number == 3:
                raise ValueError("a defect")

        def finish(self) -> None:
            told.append("finish")

        def abandon(self) -> None:
            told.append("abandon")

    with inverted() as program:
        pg.frames(program, Arrays([picture(1)] * 2), Told())
        with pytest.raises(ValueError, match="a defect"):
            pg.frames(program, Arrays([picture(1)] * 9), Told(), jobs=2)
        pg.frames(program, Arrays([]), Told())
    assert told == ["finish", "abandon", "abandon"]


# Memory, and going on


@pytest.mark.parametrize("jobs", [1, 3])
def test_few_frames_are_held_however_many_there_are(jobs: int) -> None:
    read, taken, most = 0, 0, 0
    lock = threading.Lock()

    def numbered(number: int) -> Frame:
        def load() -> Any:
            nonlocal read, most
            with lock:
                read += 1
                most = max(most, read - taken)
            return picture(1)

        return Frame(number, f"{number}", load)

    class Many:
        name, count = "many", 200

        def __iter__(self) -> Iterator[Frame]:
            return (numbered(i) for i in range(1, 201))

    class Slow(Sink):
        def take(self, frame: Frame, prepared: Any) -> None:
            nonlocal taken
            time.sleep(0.0005)
            with lock:
                taken += 1

    with inverted("numpy") as program:
        assert pg.frames(program, Many(), Slow(), jobs=jobs).written == 200
    assert most <= 2 * jobs + 2


def test_resume_leaves_out_what_is_there(tmp_path: Path) -> None:
    sequence(tmp_path, range(1, 6))
    source, sink = tmp_path / "in.####.png", tmp_path / "out.#.png"
    with inverted() as program:
        pg.frames(program, source, sink)
        (tmp_path / "out.2.png").unlink()
        (tmp_path / "out.4.png").write_bytes(b"")
        later = (tmp_path / "out.5.png").stat().st_mtime_ns + 10**9
        os.utime(tmp_path / "in.0005.png", ns=(later, later))
        told = list[Outcome]()
        summary = pg.frames(program, source, sink, resume=True, watch=told.append)
    assert [outcome.state for outcome in told] == ["kept", "written", "kept", "written", "written"]
    assert (summary.written, summary.kept, summary.whole) == (3, 2, True)
    assert [value(tmp_path / f"out.{n}.png") for n in range(1, 6)] == [245, 235, 225, 215, 205]


def test_resume_with_history_runs_what_it_does_not_write(tmp_path: Path) -> None:
    sequence(tmp_path, range(1, 5))
    source, sink = tmp_path / "in.####.png", tmp_path / "out.#.png"
    with summed() as program:
        pg.frames(program, source, sink)
    (tmp_path / "out.3.png").unlink()
    (tmp_path / "out.2.png").write_bytes((tmp_path / "out.1.png").read_bytes())
    with summed() as program:
        summary = pg.frames(program, source, sink, resume=True)
    assert (summary.written, summary.kept, summary.remade) == (2, 2, 1)
    assert [value(tmp_path / f"out.{n}.png") for n in range(1, 5)] == [10, 30, 60, 100]


def test_wrong_arguments() -> None:
    with inverted() as program:
        for jobs in (0, -1, 1.5, True, "2"):
            with pytest.raises(InputError, match=r"jobs must be a whole number from 1 to 256"):
                pg.frames(program, Arrays([]), ToArrays(), jobs=jobs)  # type: ignore[arg-type]
        with pytest.raises(InputError, match=r"expected a numbered sequence such as shot\.%04d\.png, or a video"):
            pg.frames(program, Arrays([]), "out.png")
        with pytest.raises(InputError, match=r"unknown suffix '\.abc'"):
            pg.frames(program, Arrays([]), "out.#.abc")
    with pytest.raises(GraphError, match=r"the program of frames must be what pg\.compile returned"):
        pg.frames(INVERT, Arrays([]), ToArrays())  # type: ignore[arg-type]


def test_pictures_count_from_one_or_keep_their_numbers(tmp_path: Path) -> None:
    assert [frame.number for frame in Pictures([tmp_path / "b.png", tmp_path / "a.png"])] == [1, 2]
    assert [frame.number for frame in Pictures({7: tmp_path / "x7.png", 9: tmp_path / "x9.png"})] == [7, 9]
