"""Two clips on one command line: what a picture parameter takes, and where one of them ends."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
import pytest

import passgraph as pg
from passgraph import frames
from passgraph.commands.entry import run
from passgraph.files import Pictures, Video
from passgraph.files.video_sink import ToVideo
from passgraph.pictures import load_stored

DISSOLVE = "vec4 transition(vec2 uv) { return mix(getFromColor(uv), getToColor(uv), progress); }"


@pytest.fixture(autouse=True)
def clips(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Input pictures 0, 1, 2 of gray 0; others of 85, 170, 255 (exact in limited range) and a video of these."""
    monkeypatch.chdir(tmp_path)
    Path("mix.glsl").write_text(DISSOLVE)
    Path("b").mkdir()
    for n in range(3):
        pg.save(f"a_{n}.png", np.zeros((8, 16, 3), np.uint8))
        pg.save(f"b/b_{n}.png", np.full((8, 16, 3), 85 * (n + 1), np.uint8))
    one = pg.kernel(source="def one(c: Image) -> vec4: return c[0, 0]")
    with pg.compile(one(pg.Input("c")), "numpy") as program:
        frames(program, Pictures(sorted(Path("b").iterdir())), ToVideo("b.mkv", codec="ffv1"))
        frames(program, Pictures(sorted(Path("b").iterdir())), "b.apng")
    shown = [frame.read()[0, 0, 0] for frame in Video("b.mkv")]
    assert shown == [85, 170, 255]


def applied(*arguments: str) -> int:
    return run(["apply", "mix.glsl", *arguments, "--progress", "1", "-b", "numpy"])


def values(folder: str = ".") -> list[int]:
    return [int(load_stored(path)[0, 0, 0]) for path in sorted(Path(folder).glob("out_*.png"))]


@pytest.mark.parametrize("to", ["b/b_%d.png", "b/b_#.png", "b/", "b", "b/*.png", "b.mkv", "b.apng"])
def test_a_further_picture_takes_what_the_input_takes(to: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert applied("a_%d.png", "--to", to, "-o", "out_%d.png") == 0
    assert values() == [85, 170, 255]
    assert capsys.readouterr().err == ""


def test_one_picture_still_goes_with_every_frame() -> None:
    assert applied("a_%d.png", "--to", "b/b_1.png", "-o", "out_%d.png") == 0
    assert values() == [170, 170, 170]


def test_a_stream(monkeypatch: pytest.MonkeyPatch) -> None:
    data = b"".join(path.read_bytes() for path in sorted(Path("b").iterdir()))
    monkeypatch.setattr("sys.stdin", io.TextIOWrapper(io.BytesIO(data)))
    assert applied("a_%d.png", "--to", "-", "-o", "out_%d.png") == 0
    assert values() == [85, 170, 255]


def test_a_shorter_clip_holds_its_last_frame(capsys: pytest.CaptureFixture[str]) -> None:
    Path("b/b_2.png").unlink()
    assert applied("a_%d.png", "--to", "b/b_%d.png", "-o", "out_%d.png") == 0
    assert values() == [85, 170, 170]
    expected = "passgraph: warning: b/b_%d.png: ends after 2 frames; its last one goes with those that follow\n"
    assert capsys.readouterr().err == expected


def test_a_longer_clip_is_cut(capsys: pytest.CaptureFixture[str]) -> None:
    Path("a_2.png").unlink()
    assert applied("a_%d.png", "--to", "b.mkv", "-o", "out_%d.png") == 0
    assert values() == [85, 170]
    assert capsys.readouterr().err == ""
    assert applied("a_0.png", "--to", "b.mkv", "-o", "first.png") == 0
    assert load_stored(Path("first.png"))[0, 0, 0] == 85


def test_clips_of_other_sizes_meet() -> None:
    for path in Path("b").iterdir():
        pg.save(path, np.full((4, 4, 3), 200, np.uint8))
    assert applied("a_%d.png", "--to", "b/b_%d.png", "-o", "out_%d.png") == 0
    assert values() == [200, 200, 200]


def test_what_cannot_be(capsys: pytest.CaptureFixture[str]) -> None:
    assert applied("a_%d.png", "--to", "missing.png", "-o", "out_%d.png") == 2
    assert "missing.png" in capsys.readouterr().err
    assert applied("a_%d.png", "--to", "b/b_%d.png", "-o", "b/b_%d.png") == 2
    assert "would overwrite the input b/b_0.png" in capsys.readouterr().err
