"""Videos that end before their containers say they do."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from passgraph.errors import InputError
from passgraph.files import Video
from passgraph.files.video import promised_end
from tests.commands.told import Outcome

av: Any = pytest.importorskip("av")

#: Names of files, their encoders, and what their containers are told.
KINDS = {
    "a.mkv": ("libx264", {}), "live.mkv": ("libx264", {"live": "1"}), "a.webm": ("libvpx-vp9", {}),
    "a.mp4": ("libx264", {"movflags": "faststart"}),
    "fragments.mp4": ("libx264", {"movflags": "frag_keyframe+empty_moov"}),
    "a.mov": ("mjpeg", {"movflags": "faststart"}), "a.avi": ("libx264", {}), "moving.avi": ("mjpeg", {}),
    "a.flv": ("flv", {}), "a.wmv": ("wmv2", {}),
}  # fmt: skip
FRAMES = 30


def made(path: Path, *, sound: bool) -> bytes:
    """Frames of noise, so that each takes room, with silence beside them that lasts a little longer."""
    codec, options = KINDS[path.name]
    with av.open(str(path), "w", options=options) as container:
        stream = container.add_stream(codec, rate=25, options={"g": "10"} if codec == "libx264" else {})
        stream.width, stream.height, stream.pix_fmt = 32, 32, "yuvj420p" if codec == "mjpeg" else "yuv420p"
        names = {".webm": "libopus", ".wmv": "libmp3lame"}
        heard = container.add_stream(names.get(path.suffix, "aac"), rate=48000, layout="mono") if sound else None
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
        assert told.startswith(f"{path}: truncated; it says it ")
        assert "frames until there are done" in told


def test_frames_until_the_end_are_kept_and_the_status_says_so(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    whole = made(Path("a.avi"), sound=False)
    Path("a.avi").write_bytes(whole[: len(whole) * 9 // 10])
    outcome = Outcome(capsys, "apply", "black-and-white", "-b", "reference", "a.avi", "-o", "b.mkv")
    assert outcome.status == 1
    assert (
        f"a.avi: truncated; it says it goes on to byte {len(whole)}, and it has {len(whole) * 9 // 10}" in outcome.err
    )
    assert "ended early" in outcome.out
    assert len(list(Video("b.mkv"))) >= FRAMES * 8 // 10


def test_what_says_nothing_of_its_end_is_whole(tmp_path: Path) -> None:
    """Boxes and chunks of no stated length, and bytes that others have put behind a file."""
    file = tmp_path / "a"
    for content in (
        b"", b"R", b"\0\0\0\x08ftyp", b"\0\0\0\x08ftyp\0\0\0\0mdat" + bytes(9),
        b"\0\0\0\x08ftyp\xff\xff\xff\xff\x01\x02",
        b"RIFF\0\0\0\0AVI " + bytes(9), b"RIFF\xff\xff\xff\xffAVI ", b"FLV\x01\x05\0\0\0\x09" + bytes(40),
        b"\x1aE\xdf\xa3\x80\x18\x53\x80\x67\x01" + b"\xff" * 7, b"\x1aE\xdf\xa3\xff", b"\x1aE\xdf\xa3\x00",
    ):  # fmt: skip
        file.write_bytes(content)
        assert promised_end(file) is None, content


@pytest.mark.parametrize(
    ("content", "end"),
    [
        (b"\0\0\0\x08ftyp\0\0\0\x64mdat", 108),
        (b"\0\0\0\x08ftyp\0\0\0\x01mdat\0\0\0\x01\0\0\0\0", 8 + (1 << 32)),
        (b"RIFF\x04\0\0\0AVI RIFF\x08\0\0\0AVIX", 28),
        (b"\x1aE\xdf\xa3\x80\x18\x53\x80\x67\xa0", 42),
        (b"FLV\x01\x05\0\0\0\x09\0\0\0\0\x09\0\0\x05", 33),
    ],
)
def test_where_a_part_ends_is_read(tmp_path: Path, content: bytes, end: int) -> None:
    (tmp_path / "a").write_bytes(content)
    assert promised_end(tmp_path / "a") == end


def test_hostile_bytes_end(tmp_path: Path) -> None:
    rng = np.random.default_rng(4)
    starts = (
        b"\0\0\0\x08ftyp",
        b"\x1aE\xdf\xa3",
        b"RIFF\x04\0\0\0AVI ",
        b"FLV",
        bytes.fromhex("3026b2758e66cf11a6d900aa0062ce6c"),
    )
    for start in starts:
        for _ in range(30):
            (tmp_path / "a").write_bytes(start + rng.integers(0, 256, 200).astype(np.uint8).tobytes())
            end = promised_end(tmp_path / "a")
            assert end is None or end > (tmp_path / "a").stat().st_size
    (tmp_path / "a").write_bytes(b"\x1aE\xdf\xa3\x80" * 20_000)
    assert promised_end(tmp_path / "a") is None
