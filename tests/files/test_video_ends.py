"""Videos that were cut: FFmpeg reads what there is, without an error."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from passgraph.errors import InputError
from passgraph.files import Video
from tests.commands.told import Outcome

av: Any = pytest.importorskip("av")

#: Names of files, their encoders, and what their containers are told.
KINDS = {
    "a.mkv": ("libx264", {}), "a.webm": ("libvpx-vp9", {}),
    "a.mp4": ("libx264", {"movflags": "faststart"}),
    "fragments.mp4": ("libx264", {"movflags": "frag_keyframe+empty_moov"}),
    "a.mov": ("mjpeg", {"movflags": "faststart"}), "a.avi": ("libx264", {}), "moving.avi": ("mjpeg", {}),
    "a.flv": ("flv", {}),
}  # fmt: skip
FRAMES = 30


def made(path: Path, *, sound: bool) -> bytes:
    """Frames of noise, so that each takes room, with silence beside them that lasts a little longer."""
    codec, options = KINDS[path.name]
    with av.open(str(path), "w", options=options) as container:
        stream = container.add_stream(codec, rate=25, options={"g": "10"} if codec == "libx264" else {})
        stream.width, stream.height, stream.pix_fmt = 32, 32, "yuvj420p" if codec == "mjpeg" else "yuv420p"
        heard = (
            container.add_stream("libopus" if path.suffix == ".webm" else "aac", rate=48000, layout="mono")
            if sound
            else None
        )
        rng = np.random.default_rng(1)
        for i in range(FRAMES):
            frame = av.VideoFrame.from_ndarray(rng.integers(0, 255, (32, 32, 3), np.uint8), "rgb24")
            frame.pts, frame.time_base = i, Fraction(1, 25)
            container.mux(stream.encode(frame.reformat(format=stream.pix_fmt)))
        container.mux(stream.encode())
        if heard is not None:
            for i in range(FRAMES + 1):
                wave = av.AudioFrame.from_ndarray(np.zeros((1, 1920), np.int16), "s16", "mono")
                wave.sample_rate, wave.pts, wave.time_base = 48000, 1920 * i, Fraction(1, 48000)
                container.mux(heard.encode(wave))
            container.mux(heard.encode())
    return path.read_bytes()


def read(path: Path) -> tuple[int, str]:
    """How many frames are read, and what is said at the end."""
    count = 0
    try:
        for frame in Video(path):
            try:
                frame.read()
            except InputError:
                continue
            count += 1
    except InputError as error:
        return count, str(error)
    return count, ""


@pytest.mark.parametrize("sound", [False, True])
@pytest.mark.parametrize("name", KINDS)
def test_a_video_that_breaks_off_is_told(tmp_path: Path, name: str, sound: bool) -> None:
    path = tmp_path / name
    whole = made(path, sound=sound)
    assert read(path) == (FRAMES, "")
    for share in (8, 6):
        path.write_bytes(whole[: len(whole) * share // 10])
        count, told = read(path)
        assert FRAMES * (share - 3) // 10 <= count <= FRAMES
        assert told.startswith(f"{path}: truncated; it ")
        assert "frames until there are done" in told


def test_frames_until_the_end_are_kept_and_the_status_says_so(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    whole = made(Path("a.avi"), sound=False)
    Path("a.avi").write_bytes(whole[: len(whole) * 9 // 10])
    outcome = Outcome(capsys, "apply", "black-and-white", "-b", "reference", "a.avi", "-o", "b.mkv")
    assert outcome.status == 1
    assert "a.avi: truncated; it " in outcome.err
    assert "ended early" in outcome.out
    assert len(list(Video("b.mkv"))) >= FRAMES * 8 // 10
