"""``resume`` goes on only from what the run would make itself: the record beside the outputs, and its keys."""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import passgraph as pg
from passgraph.commands.entry import run
from passgraph.files import Arrays, Pictures, ToPictures
from passgraph.files import made as record
from passgraph.files.digests import digest, file_state
from passgraph.files.made import NAME, Made
from tests.files.made import INVERT, SCALED, inverted, picture, sequence, summed, value

FRAMES = range(1, 6)


@pytest.fixture(autouse=True)
def _here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    sequence(Path("a"), FRAMES)
    Path("out").mkdir()


def outputs() -> dict[int, Path]:
    return {number: Path(f"out/{number}.png") for number in FRAMES}


def inputs() -> Pictures:
    return Pictures({number: Path(f"a/in.{number:04d}.png") for number in FRAMES})


def scaled(values: Any, *, resume: bool = True, **how: Any) -> tuple[int, int, int]:
    """Frames written, kept and made anew by a run that scales the pictures."""
    with pg.compile(SCALED(pg.Input("frame"), gain=pg.Value("gain")), backend="reference") as program:
        summary = pg.frames(program, inputs(), ToPictures(outputs()), values=values, resume=resume, **how)
    assert summary.whole
    return summary.written, summary.kept, summary.remade


def test_the_same_run_keeps_all() -> None:
    assert scaled({"gain": 1.0}, resume=False) == (5, 0, 0)
    assert scaled({"gain": 1.0}) == (0, 5, 0)
    assert scaled({"gain": 1.0}, resume=False) == (5, 0, 0)


def test_another_value_makes_all_anew() -> None:
    scaled({"gain": 1.0})
    assert scaled({"gain": 2.0}) == (5, 0, 5)
    assert [value(path) for path in outputs().values()] == [20 * number for number in FRAMES]


def test_a_value_that_changes_over_the_frames_counts_where_it_differs() -> None:
    scaled(lambda number: {"gain": 1.0 + number})
    assert scaled(lambda number: {"gain": 1.0 + number if number != 3 else 0.5}) == (1, 4, 1)
    assert value(outputs()[3]) == 15


def test_what_was_done_with_one_value_is_not_gone_on_with_another() -> None:
    """A run that was stopped halfway, and begun again with another look."""

    def stop(outcome: Any) -> None:
        if outcome.number == 3:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        scaled({"gain": 1.0}, jobs=1, watch=stop)
    written = sum(path.exists() for path in outputs().values())
    assert scaled({"gain": 2.0}) == (5, 0, written)
    assert [value(path) for path in outputs().values()] == [20 * number for number in FRAMES]


def cut(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:-20])


def empty(path: Path) -> None:
    path.write_bytes(b"")


def swap(path: Path) -> None:
    path.write_bytes(Path("out/1.png").read_bytes())


@pytest.mark.parametrize("harm", [cut, empty, swap, Path.unlink])
def test_an_output_that_is_not_as_it_was_written_is_made_anew(harm: Callable[[Path], None]) -> None:
    scaled({"gain": 1.0})
    harm(outputs()[4])
    assert scaled({"gain": 1.0}) == (1, 4, int(outputs()[4].exists() and harm is not Path.unlink))
    assert [value(path) for path in outputs().values()] == [10 * number for number in FRAMES]


def test_an_input_that_was_replaced_makes_its_output_anew() -> None:
    scaled({"gain": 1.0})
    pg.save("a/in.0002.png", picture(200))
    later = Path("out/2.png").stat().st_mtime_ns - 10**9  # an older file, as one that is copied with its time
    os.utime("a/in.0002.png", ns=(later, later))
    assert scaled({"gain": 1.0}) == (1, 4, 1)
    assert value(outputs()[2]) == 200


def test_another_graph_backend_output_or_version_makes_all_anew(monkeypatch: pytest.MonkeyPatch) -> None:
    def made(program: pg.Program, **how: Any) -> int:
        with program:
            return pg.frames(program, inputs(), ToPictures(outputs(), **how), resume=True).written

    assert made(inverted()) == 5
    assert made(inverted()) == 0
    assert made(inverted("numpy")) == 5
    assert made(inverted("numpy"), bits=16) == 5
    rounded = INVERT(pg.Input("frame"), into=pg.target("rounded", "rgba8"))
    assert made(pg.compile(rounded, backend="numpy"), bits=16) == 5
    assert made(pg.compile(rounded, backend="numpy"), bits=16) == 0
    monkeypatch.setattr(record, "__version__", "0.0.1")
    assert made(pg.compile(rounded, backend="numpy"), bits=16) == 5


def test_with_history_a_frame_depends_on_those_before_it() -> None:
    with summed() as program:
        pg.frames(program, inputs(), ToPictures(outputs()))
    os.utime("a/in.0003.png")
    with summed() as program:
        summary = pg.frames(program, inputs(), ToPictures(outputs()), resume=True)
    assert (summary.written, summary.kept, summary.remade) == (3, 2, 3)
    assert [value(path) for path in outputs().values()] == [10, 30, 60, 100, 150]


def test_pictures_in_memory_are_known_by_their_pixels() -> None:
    pictures = [picture(number) for number in FRAMES]

    def written() -> int:
        with inverted() as program:
            return pg.frames(program, Arrays(pictures), ToPictures(outputs()), resume=True).written

    assert [written(), written()] == [5, 0]
    pictures[2] = picture(99)
    assert written() == 1 and value(outputs()[3]) == 156


@pytest.mark.parametrize(
    "text", [b"", b"\xff\x00", b"null\n[]\n3\n", b'{"file": 1}\n', b'{"file": "1.png", "key": ""', b"[" * 100_000]
)
def test_a_record_that_says_nothing_is_no_error(text: bytes) -> None:
    scaled({"gain": 1.0})
    Path("out", NAME).write_bytes(text)
    assert scaled({"gain": 1.0}) == (5, 0, 5)
    assert scaled({"gain": 1.0}) == (0, 5, 0)


def test_a_line_that_was_cut_does_not_harm_those_after_it() -> None:
    scaled({"gain": 1.0})
    record = Path("out", NAME)
    record.write_bytes(record.read_bytes()[:-30])
    assert scaled({"gain": 1.0}) == (1, 4, 1)
    assert scaled({"gain": 1.0}) == (0, 5, 0)


def test_a_record_that_cannot_be_written_ends_nothing() -> None:
    Path("out", NAME).mkdir()
    assert scaled({"gain": 1.0}) == (5, 0, 0)
    assert scaled({"gain": 1.0}) == (5, 0, 5)


def test_a_record_of_many_runs_is_written_anew(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(record, "_MOST_OLD", 4)
    for gain in range(1, 8):
        scaled({"gain": float(gain)})
    lines = Path("out", NAME).read_text().split("\n")
    assert len([line for line in lines if line]) <= 2 * 5 + 4 + 5
    assert all(json.loads(line)["file"].endswith(".png") for line in lines if line)
    assert scaled({"gain": 7.0}) == (0, 5, 0)


def test_frames_of_a_film_follow_each_other(tmp_path: Path) -> None:
    made, film = Made(), tmp_path / "b.mp4"
    for number, key in enumerate("abc", 1):
        made.add_frame(film, number, key)
    made.add_frame(film, 2, "x")
    made.add_frame(film, 9, "y")  # without those before it, it tells nothing
    made.close()
    assert Made().film_keys(film) == made.film_keys(film) == ["a", "x"]
    film.write_bytes(b"whole")
    made.add(film, "x", 2)
    made.close()
    assert Made().film_keys(film) == [] and Made().frames(film) == 2
    assert Made().holds(film, "x", 2) and not Made().holds(film, "x", 3) and not Made().holds(film, "a", 2)


def test_digests_tell_values_apart() -> None:
    array = np.arange(6, dtype=np.float32)
    different: list[Any] = [
        None, True, 1, 1.0, "1", b"1", [1], [[1]], {"a": 1}, {"b": 1}, {"a": 2}, array, array[::2], array.reshape(2, 3),
        array.astype(">f4"), array.view(np.int32), "", [], {},
    ]  # fmt: skip
    digests = [digest(item) for item in different]
    assert len({*digests}) == len(different)
    assert digests == [digest(item) for item in different]
    assert digest(array) == digest(array.copy()) and digest(np.float32(1)) == digest(1.0)
    assert digest(object()) != digest(object()) and digest(np.array([object()])) != digest(np.array([object()]))


def test_a_layer_of_a_file_is_another_picture() -> None:
    pg.save("a.exr", picture(1).astype(np.float32))
    plain, layer = file_state("a.exr"), file_state("a.exr:diffuse")
    assert plain is not None and layer is not None and plain != layer and plain[1:] == layer[1:]
    assert file_state("nowhere.png") is None


def test_the_command_says_what_it_replaced(capsys: pytest.CaptureFixture[str]) -> None:
    bright = ["apply", "black-and-white", "a", "-o", "out", "-b", "reference"]
    assert run(bright) == 0
    for path in ("out/in.0002.png", "out/in.0003.png"):
        Path(path).unlink()
    os.utime("a/in.0005.png")
    capsys.readouterr()
    assert run([*bright, "--resume"]) == 0
    told = capsys.readouterr().out
    assert told.startswith("out: 3 frames ")
    assert told.endswith(", 2 frames there already, 1 frame replaced (made otherwise, or not whole)\n")
