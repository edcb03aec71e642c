"""Colours go through every kind of video: where a file cannot say how they are coded, as readers take them to be."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from passgraph.errors import InputError
from passgraph.files import ToVideo, Video

av: Any = pytest.importorskip("av")
SIZE = 64, 48


def write(path: Path, codec: str, format: str, values: tuple[int, ...], matrix: int = 2, colour_range: int = 0) -> Path:
    """Two frames of one colour: bytes of each plane, or of one pixel where there is one plane."""
    with av.open(str(path), "w") as container:
        stream = container.add_stream(codec, rate=25)
        (stream.width, stream.height), stream.pix_fmt = SIZE, format
        stream.codec_context.colorspace, stream.codec_context.color_range = matrix, colour_range
        for number in range(2):
            frame = av.VideoFrame(*SIZE, format)
            frame.colorspace, frame.color_range, frame.pts = matrix, colour_range, number
            for plane, value in zip(frame.planes, values if len(frame.planes) > 1 else [values], strict=True):
                plane.update(np.resize(np.array(value, np.uint8), plane.buffer_size).tobytes())
            container.mux(stream.encode(frame))
        container.mux(stream.encode())
    return path


def copied(source: Path, path: Path, codec: str) -> Path:
    video, sink = Video(source), ToVideo(path, codec=codec)
    sink.begin(video)
    for frame in video:
        pixels = frame.read()
        assert sink.stores(frame, video.size) == pixels.dtype
        sink.take(frame, sink.prepare(frame, pixels))
    sink.finish()
    return path


def colour(path: Path) -> Any:
    """The mean of all pixels, from 0 to 255."""
    found = np.stack([frame.read() for frame in Video(path)])
    return found.reshape(-1, 4).mean(axis=0) / (np.iinfo(found.dtype).max / 255)


def said(path: Path) -> tuple[str, int, int]:
    with av.open(str(path)) as container:
        frame = next(container.decode(video=0))
        return frame.format.name, int(frame.colorspace), int(frame.color_range)


YUV = (120, 90, 200)
SOURCES: dict[str, tuple[Any, ...]] = {
    "BT.709": ("ffv1", "yuv420p", YUV, 1, 1),
    "BT.709, full": ("ffv1", "yuv420p", YUV, 1, 2),
    "BT.470": ("ffv1", "yuv420p", YUV, 5, 1),
    "RGB": ("ffv1", "bgr0", (50, 100, 200, 0)),
    "RGB, said": ("libx264rgb", "rgb24", (200, 100, 50)),
    "grey": ("ffv1", "gray", (200,)),
}
#: Encoders that say their colours' coding, say half of it, say none, and have one.
TARGETS = [
    ("libx264", ".mp4"), ("libx264", ".mkv"), ("libx264rgb", ".mkv"), ("libx265", ".mkv"), ("libvpx", ".webm"),
    ("libvpx-vp9", ".webm"), ("ffv1", ".mkv"), ("ffv1", ".mp4"), ("mpeg4", ".mp4"), ("mpeg2video", ".mkv"),
    ("mjpeg", ".mkv"), ("prores_ks", ".mov"), ("flv", ".flv"), ("wmv2", ".asf"), ("v210", ".mov"), ("png", ".mov"),
    ("qtrle", ".mov"), ("huffyuv", ".avi"), ("libx264", ".avi"),
]  # fmt: skip


@pytest.mark.sampled
@pytest.mark.parametrize("source", SOURCES)
def test_colours_come_back_from_every_encoder(tmp_path: Path, source: str) -> None:
    given = write(tmp_path / "given.mkv", *SOURCES[source])
    wanted, wrong = colour(given), []
    for codec, suffix in TARGETS:
        made = copied(given, tmp_path / f"{codec}{suffix}", codec)
        found, (format_, matrix, _) = colour(made), said(made)
        # That pixels are R'G'B' may be said of such only.
        if np.abs(found - wanted).max() > 2.5 or (format_.startswith("yuv") and matrix == 0):
            wrong.append(f"{codec} {suffix}: {found.round(1)} {said(made)}")
    assert wrong == []


def test_what_no_matrix_of_ours_makes_colours_of_is_told(tmp_path: Path) -> None:
    """ICtCp (14): no picture, and no error of libav's own without a file's name."""
    given = write(tmp_path / "a.mkv", "ffv1", "yuv420p", YUV, 14, 1)
    with pytest.raises(
        InputError, match=r"a\.mkv, frame 1: its colours cannot be read .* yuv420p, matrix 14 of H\.273"
    ):
        colour(given)


def test_a_choice_of_colours_is_not_what_pixels_are_brought_into(tmp_path: Path) -> None:
    """Nothing makes such a choice; so what had one becomes R'G'B' or Y'CbCr."""
    with av.open(str(tmp_path / "a.mov"), "w") as container:
        stream = container.add_stream("png", rate=25)
        (stream.width, stream.height), stream.pix_fmt = SIZE, "pal8"
        frame, entries = av.VideoFrame(*SIZE, "pal8"), np.full((256, 4), (200, 90, 9, 255), np.uint8)
        for plane, content in zip(
            frame.planes, (np.zeros(frame.planes[0].buffer_size, np.uint8), entries), strict=True
        ):
            plane.update(content.tobytes())
        container.mux(stream.encode(frame))
        container.mux(stream.encode())
    made = colour(copied(tmp_path / "a.mov", tmp_path / "b.mov", "png"))
    assert np.abs(made - (9, 90, 200, 255)).max() <= 2


def test_an_avi_counts_frames(tmp_path: Path) -> None:
    """Of a source that counts milliseconds: each frame once, in order, and the file is whole."""
    made = Video(copied(write(tmp_path / "a.mkv", *SOURCES["BT.709"]), tmp_path / "b.avi", "libx264"))
    times = [frame.metadata["pts"] * frame.metadata["time_base"] for frame in made]
    assert (made.rate, made.count, times[1] - times[0]) == (25, 2, Fraction(1, 25))


def gray_video(path: Path, format: str, black: int, white: int, colour_range: int) -> Path:
    """Black on the left and white on the right, without loss."""
    kind = np.uint8 if format in ("gray", "ya8") else np.uint16
    with av.open(str(path), "w") as container:
        stream = container.add_stream("ffv1", rate=25)
        (stream.width, stream.height), stream.pix_fmt = SIZE, format
        stream.codec_context.color_range = colour_range
        frame = av.VideoFrame(*SIZE, format)
        frame.color_range = colour_range
        plane = frame.planes[0]
        channels = 2 if format.startswith("ya") else 1
        rows = np.full((plane.height, plane.line_size // np.dtype(kind).itemsize), np.iinfo(kind).max, kind)
        rows[:, : SIZE[0] * channels : channels] = np.repeat([black, white], SIZE[0] // 2).astype(kind)
        plane.update(rows.tobytes())
        container.mux(stream.encode(frame))
        container.mux(stream.encode())
    return path


@pytest.mark.parametrize("format", ["gray", "ya8", "gray9le", "gray10le", "gray12le", "gray14le", "gray16le"])
@pytest.mark.parametrize("colour_range", [0, 1, 2])
def test_gray_goes_from_black_to_white(tmp_path: Path, format: str, colour_range: int) -> None:
    """Of limited range too, and to the last step. swscale leaves 16 and 235, and shifts 1023 to 65472."""
    bits = int("".join(filter(str.isdigit, format)) or 8)
    bits = 8 if format == "ya8" else bits
    step = 1 << (bits - 8)
    black, white = (16 * step, 235 * step) if colour_range == 1 else (0, 256 * step - 1)
    given = gray_video(tmp_path / "a.mkv", format, black, white, colour_range)
    picture = next(iter(Video(given))).read()
    most = 255 if bits == 8 else 65535
    assert picture[0, [0, -1]].tolist() == [[0, 0, 0, most], [most] * 4]


@pytest.mark.parametrize(("codec", "suffix"), [
    ("r210", ".mov"), ("v410", ".mov"), ("r10k", ".mov"), ("v210", ".mov"), ("dpx", ".mov"), ("ffv1", ".mkv"),
    ("prores_ks", ".mov"),
])  # fmt: skip
def test_white_of_bytes_is_white_of_more_bits(tmp_path: Path, codec: str, suffix: str) -> None:
    """swscale shifts 255 to 1020 of 1023 in RGB of 10 bits."""
    try:
        av.Codec(codec, "w")
    except av.codec.codec.UnknownCodecError:
        pytest.skip(f"this FFmpeg has no encoder {codec}")
    given = write(tmp_path / "a.mkv", "ffv1", "bgr0", (255, 255, 255, 0))
    made = Video(copied(given, tmp_path / f"b{suffix}", codec))
    least = next(iter(made)).read()[..., :3].min()
    assert least >= (65535 if made.deep and codec != "prores_ks" else 255 if not made.deep else 65400)
