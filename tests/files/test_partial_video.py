"""An interrupted video plays, and ``resume`` goes on after its frames."""

from __future__ import annotations

import os
import subprocess
import sys
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import passgraph as pg
from passgraph.errors import InputError
from passgraph.files import Numbers, Outcome, Video
from passgraph.files.frame import Frame, Summary
from passgraph.files.made import NAME
from passgraph.files.partial_video import first_packets
from passgraph.files.video_sink import ToVideo
from passgraph.writing import NewFile
from tests.files.made import video
from tests.picture_files import names_in

av: Any = pytest.importorskip("av")

FRAMES = 80
#: A bar that moves, so that encoders predict frames from later ones.
BAR = pg.kernel(source="def bar(at: float) -> vec4: return vec4(vec3(0.2 + 0.6 * step(at, float(pixel().x))), 1.0)")
FADE = pg.kernel(source="def fade(color: Image, gain: float) -> vec4: return vec4(color[0, 0].rgb * gain, 1.0)")
ENCODERS = [
    ("a.mp4", "libx264"), ("a.mkv", "libx264"), ("a.mp4", "libx265"), ("a.mov", "prores_ks"), ("a.mkv", "ffv1"),
    ("a.webm", "libvpx-vp9"),
]  # fmt: skip


@pytest.fixture(autouse=True)
def _here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def moved(path: str, codec: str | None = None, *, stop: int = 0, speed: float = 1.0, **how: Any) -> Summary | None:
    """Write frames of a moving bar; stop after one of them, with None."""

    def watch(outcome: Outcome) -> None:
        if outcome.number == stop:
            raise KeyboardInterrupt

    graph = BAR(at=pg.Value("at"), into=pg.target("bar", "rgba8"))
    with pg.compile(graph, backend="numpy", size=(64, 48)) as program:
        try:
            return pg.frames(
                program, Numbers(FRAMES), ToVideo(path, codec=codec), values=lambda n: {"at": 10.0 + speed * n % 50},
                watch=watch, jobs=1, **how,
            )  # fmt: skip
        except KeyboardInterrupt:
            return None


def seen(path: str) -> tuple[list[float], np.ndarray[Any, Any]]:
    """The times of a video's frames, and their brightness."""
    with av.open(path) as container:
        frames = list(container.decode(video=0))
    return [float(frame.pts * frame.time_base) for frame in frames], np.stack(
        [frame.to_ndarray()[:48] for frame in frames]
    )


@pytest.mark.parametrize(("path", "codec"), ENCODERS)
@pytest.mark.parametrize("stop", [3, 60])
def test_an_interrupted_video_plays_and_is_gone_on_with(path: str, codec: str, stop: int) -> None:
    assert moved(path, codec, stop=stop) is None
    partial = path.replace("a.", "a.partial.")
    assert names_in() == [partial]
    times, begun = seen(partial)
    assert len(times) == stop
    summary = moved(path, codec, resume=True)
    assert summary is not None and summary.whole
    assert 0 < summary.kept < stop and summary.written + summary.kept == FRAMES
    assert names_in() == [path]
    moved("whole" + path[1:], codec)
    (times, frames), (expected, whole) = seen(path), seen("whole" + path[1:])
    assert times == expected and len(times) == FRAMES
    kept = summary.kept
    np.testing.assert_array_equal(frames[:kept], begun[:kept])  # copied, not encoded again
    off = np.abs(frames.astype(int) - whole).mean((1, 2))
    assert off.max() <= (0 if codec in ("ffv1", "prores_ks") else 255 * 0.02)
    again = moved(path, codec, resume=True)
    assert again is not None and (again.written, again.kept) == (0, FRAMES)


def test_it_may_be_interrupted_again() -> None:
    for stop in (20, 40, 41, 70):
        assert moved("a.mp4", stop=stop, resume=True) is None
        assert len(seen("a.partial.mp4")[0]) == stop and names_in() == ["a.partial.mp4"]
    assert moved("a.mp4", resume=True) and len(seen("a.mp4")[0]) == FRAMES and names_in() == ["a.mp4"]


@pytest.mark.parametrize("what", [{"speed": 2.0}, {"codec": "mpeg4"}, {"without": NAME}])
def test_a_video_of_something_else_is_begun_anew(what: dict[str, Any]) -> None:
    moved("a.mp4", stop=40)
    if "without" in what:
        Path(what["without"]).unlink()
        what = {}
    summary = moved("a.mp4", resume=True, **what)
    assert summary is not None and (summary.written, summary.kept) == (FRAMES, 0)
    assert len(seen("a.mp4")[0]) == FRAMES and names_in() == ["a.mp4"]


def test_a_whole_video_of_something_else_is_made_anew() -> None:
    moved("a.mp4")
    summary = moved("a.mp4", resume=True, speed=2.0)
    assert summary is not None and (summary.written, summary.kept, summary.remade) == (FRAMES, 0, FRAMES)


KILLED = """
import os, signal, sys
from tests.files.test_partial_video import moved
import passgraph.files.flow as flow
done = flow.Run._done
def killed(self, item):
    done(self, item)
    if self.written == 70:
        os.kill(os.getpid(), signal.SIGKILL)
flow.Run._done = killed
moved(sys.argv[1], sys.argv[2])
"""


@pytest.mark.parametrize(("path", "codec"), [("a.mov", "prores_ks"), ("a.mkv", "ffv1"), ("a.mp4", "mpeg4")])
def test_a_video_of_a_killed_process_plays_and_is_gone_on_with(path: str, codec: str) -> None:
    """Encoders that look ahead hold frames back, so those that do not are taken."""
    root = Path(pg.__file__).parents[1]
    environment = {**os.environ, "PYTHONPATH": os.fspath(root)}
    assert subprocess.run([sys.executable, "-c", KILLED, path, codec], env=environment).returncode == -9
    partial = path.replace("a.", "a.partial.")
    assert names_in() == [partial]
    playable = len(first_packets(Path(partial)))
    assert playable >= 20  # all but the last second or two
    summary = moved(path, codec, resume=True)
    assert summary is not None and (summary.kept, summary.written) == (playable, FRAMES - playable)
    assert len(seen(path)[0]) == FRAMES and names_in() == [path]


def packets(path: str, kind: str) -> list[tuple[float, bytes]]:
    with av.open(path) as container:
        stream = getattr(container.streams, kind)[0]
        return [(float(p.pts * p.time_base), bytes(p)) for p in container.demux(stream) if p.size]


def faded(path: str, *, stop: int = 0, resume: bool = False) -> Summary | None:
    def watch(outcome: Outcome) -> None:
        if outcome.number == stop:
            raise KeyboardInterrupt

    with pg.compile(FADE(pg.Input("frame"), gain=0.5), backend="numpy") as program:
        try:
            return pg.frames(program, "in.mp4", path, watch=watch, resume=resume, jobs=1)
        except KeyboardInterrupt:
            return None


def test_sound_and_times_of_a_source_are_as_without_interruption() -> None:
    rng = np.random.default_rng(1)
    times = [int(at) for at in np.cumsum(rng.integers(20, 60, FRAMES))]
    video(Path("in.mp4"), FRAMES, times=times, sound=True)
    faded("a.mp4", stop=50)
    summary = faded("a.mp4", resume=True)
    assert summary is not None and summary.kept > 30
    faded("whole.mp4")
    assert packets("a.mp4", "audio") == packets("whole.mp4", "audio")
    assert seen("a.mp4")[0] == seen("whole.mp4")[0]


def test_an_input_that_was_replaced_begins_the_video_anew() -> None:
    video(Path("in.mp4"), FRAMES)
    faded("a.mp4", stop=50)
    video(Path("in.mp4"), FRAMES, codec="mpeg4")
    summary = faded("a.mp4", resume=True)
    assert summary is not None and (summary.written, summary.kept) == (FRAMES, 0)


def test_the_incomplete_video_is_not_overwritten_while_it_is_read() -> None:
    video(Path("in.mp4"), 3)
    os.rename("in.mp4", "a.partial.mp4")
    with (
        pg.compile(FADE(pg.Input("frame"), gain=0.5), backend="numpy") as program,
        pytest.raises(InputError, match=r"a\.mp4: would be overwritten while it is read"),
    ):
        pg.frames(program, Video("a.partial.mp4"), "a.mp4")


def test_a_file_that_another_process_has_taken_is_not_completed() -> None:
    with NewFile("a.mp4") as new_file:
        new_file.temporary.write_bytes(b"mine")
        new_file.show_as(Path("a.partial.mp4"))
        Path("other").write_bytes(b"of another")
        os.replace("other", "a.partial.mp4")
        with pytest.raises(InputError, match=r"a\.mp4: another process writes .*a\.partial\.mp4 too; run them one"):
            new_file.complete()
    assert Path("a.partial.mp4").read_bytes() == b"of another" and not Path("a.mp4").exists()


@pytest.mark.parametrize("content", [b"", b"no video", b"\0" * 100])
def test_a_file_that_is_no_video_gives_no_frames(content: bytes) -> None:
    Path("a.partial.mp4").write_bytes(content)
    assert len(first_packets(Path("a.partial.mp4"))) == 0
    summary = moved("a.mp4", resume=True)
    assert summary is not None and summary.written == FRAMES


def test_kept_frames_without_a_new_one_leave_the_incomplete_video(monkeypatch: pytest.MonkeyPatch) -> None:
    moved("a.mp4", "mpeg4", stop=60)
    number = count()

    def fails(self: ToVideo, frame: Frame, size: tuple[int, int]) -> np.dtype[Any]:
        raise InputError(f"frame {next(number)}: does not fit")

    monkeypatch.setattr(ToVideo, "stores", fails)
    summary = moved("a.mp4", "mpeg4", resume=True)
    assert summary is not None and summary.kept == 59 and len(summary.failed) == FRAMES - 59
    assert names_in() == ["a.partial.mp4"] and len(seen("a.partial.mp4")[0]) == 60
