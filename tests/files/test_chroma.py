"""Chroma of subsampled video is read and written where the file, or its format, says that it lies.

Truth is the closed form: with ramps as chroma planes, the chroma at a luma sample is the ramp at that place. A chroma
sample k lies at 2 k from the left edge of luma if it is sited "left" (ITU-T H.264, figure E-1), and at 2 k + 1/2 at the
center.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from passgraph.files import ToVideo, Video
from passgraph.files.video_pixels import Conversion

av: Any = pytest.importorskip("av")
SIDE = 64
#: Where sample 0 of chroma lies, in luma samples across and down.
PLACES = {"left": (0.0, 0.5), "center": (0.5, 0.5), "topleft": (0.0, 0.0), "top": (0.5, 0.0)}
#: Change of the ramps from one luma sample to the next, of 255.
STEP = 2
LUMA = 120


def ramps(shape: tuple[int, int], across: int, down: int, place: tuple[float, float]) -> tuple[Any, Any]:
    """Blue-difference of a ramp across and red-difference of one down, as chroma samples at a place."""
    columns = np.arange(shape[1]) * across + place[0] * (across > 1)
    rows = np.arange(shape[0]) * down + place[1] * (down > 1)
    blue = np.broadcast_to(128 + STEP * (columns - SIDE / 2), shape)
    red = np.broadcast_to(128 + STEP * (rows - SIDE / 2)[:, None], shape)
    return blue, red


def ramp_frame(format: str, place: str, matrix: int = 1, full: bool = False) -> Any:
    frame = av.VideoFrame(SIDE, SIDE, format)
    frame.colorspace, frame.color_range = matrix, 2 if full else 1
    step = 1 << (frame.format.components[0].bits - 8)
    across, down = SIDE // frame.format.chroma_width(SIDE), SIDE // frame.format.chroma_height(SIDE)
    chroma = ramps((SIDE // down, SIDE // across), across, down, PLACES[place])
    planes: list[Any] = [np.full((SIDE, SIDE), LUMA), *chroma]
    if format in ("nv12", "p010le"):
        planes = [planes[0], np.stack(chroma, 2).reshape(SIDE // 2, SIDE)]
    elif format == "uyvy422":
        planes = [np.stack([chroma[0], planes[0][:, ::2], chroma[1], planes[0][:, 1::2]], 2).reshape(SIDE, -1)]
    for plane, values in zip(frame.planes, planes, strict=True):
        kind = np.uint8 if step == 1 else np.uint16
        rows = np.zeros((plane.height, plane.line_size // np.dtype(kind).itemsize), kind)
        rows[:, : values.shape[1]] = np.rint(values * step).astype(kind) << (6 if format == "p010le" else 0)
        plane.update(rows.tobytes())
    return frame


def made(path: Path, codec: str, format: str, place: str, said: str = "", matrix: int = 1, full: bool = False) -> Path:
    """A video of the ramps, with chroma at a place; ``said`` is what the encoder stores."""
    options = {"libx264": {"crf": "0"}, "libx265": {"x265-params": "lossless=1:log-level=none"}}.get(codec, {})
    options |= {"chroma_sample_location": said} if said else {}
    with av.open(str(path), "w") as container:
        stream = container.add_stream(codec, rate=25, options=options)
        stream.width, stream.height, stream.pix_fmt = SIDE, SIDE, format
        context = stream.codec_context
        context.colorspace, context.color_range = matrix, 2 if full else 1
        context.bit_rate, context.qmin, context.qmax = 40_000_000, 1, 2
        container.mux(stream.encode(ramp_frame(format, place, matrix, full)))
        container.mux(stream.encode())
    return path


def expected(full: bool = False, matrix: int = 1) -> Any:
    """Red and blue of the ramps, 0 to 1."""
    red_weight, blue_weight = {1: (0.2126, 0.0722), 5: (0.299, 0.114), 9: (0.2627, 0.0593)}[matrix]
    luma, span = (LUMA / 255, 255) if full else ((LUMA - 16) / 219, 224)
    blue, red = ramps((SIDE, SIDE), 1, 1, (0, 0))
    colors = [luma + 2 * (1 - red_weight) * (red - 128) / span, luma + 2 * (1 - blue_weight) * (blue - 128) / span]
    return np.clip(np.stack(colors, 2), 0, 1)


def displaced(path: Path, **coded: Any) -> tuple[float, float]:
    """How far chroma lies from its place, across and down, in luma samples."""
    return of_picture(next(iter(Video(path))).read(), **coded)


def of_picture(picture: Any, **coded: Any) -> tuple[float, float]:
    exact = expected(**coded)
    wrong = picture[..., [0, 2]] / np.iinfo(picture.dtype).max - exact
    used = (exact > 0.05) & (exact < 0.95)  # not clipped
    used[:4], used[-4:], used[:, :4], used[:, -4:] = False, False, False, False  # nor beside the edge
    slope = expected(**coded)[SIDE // 2, SIDE // 2] - expected(**coded)[SIDE // 2 - 1, SIDE // 2 - 1]
    down, across = (float(wrong[..., part][used[..., part]].mean() / slope[part]) for part in (0, 1))
    return across, down


#: Codec, suffix, pixel format, place of chroma, what the encoder stores, and the coding of colors.
READ: dict[str, tuple[Any, ...]] = {
    "H.264": ("libx264", ".mkv", "yuv420p", "left"),
    "H.264, center": ("libx264", ".mp4", "yuv420p", "center", "center"),
    "H.264, top left": ("libx264", ".mp4", "yuv420p", "topleft", "topleft"),
    "H.264, top": ("libx264", ".mkv", "yuv420p", "top", "top"),
    "H.264, 4:2:2": ("libx264", ".mkv", "yuv422p", "left"),
    "H.264, full": ("libx264", ".mkv", "yuv420p", "left", "", 1, True),
    "H.264, 10 bits": ("libx264", ".mkv", "yuv420p10le", "topleft", "topleft"),
    "H.265": ("libx265", ".mkv", "yuv420p", "left"),
    "H.265, HDR": ("libx265", ".mkv", "yuv420p10le", "topleft", "topleft", 9),
    "MPEG-1": ("mpeg1video", ".mpg", "yuv420p", "center", "", 5),
    "MPEG-2": ("mpeg2video", ".mpg", "yuv420p", "left"),
    "VP8": ("libvpx", ".webm", "yuv420p", "center", "", 5),
    "FFV1": ("ffv1", ".mkv", "yuv420p", "left"),
    "FFV1, said": ("ffv1", ".mkv", "yuv420p", "topleft", "topleft"),
    "FFV1, said center": ("ffv1", ".mkv", "yuv420p", "center", "center"),
    "VP9": ("libvpx-vp9", ".webm", "yuv420p", "left"),
    "VP9, said center": ("libvpx-vp9", ".webm", "yuv420p", "center", "center"),
    "FFV1, full": ("ffv1", ".mkv", "yuv420p", "center", "", 1, True),
    "FFV1, BT.2020": ("ffv1", ".mkv", "yuv420p10le", "topleft", "", 9),
    "FFV1, 4:1:1": ("ffv1", ".mkv", "yuv411p", "left"),
    "JPEG": ("mjpeg", ".mov", "yuvj420p", "center", "", 5, True),
    "ProRes": ("prores_ks", ".mov", "yuv422p10le", "left"),
    "nv12": ("rawvideo", ".nut", "nv12", "left", "", 5),
    "uyvy422": ("rawvideo", ".nut", "uyvy422", "left", "", 5),
}


@pytest.mark.parametrize("case", READ)
def test_chroma_is_read_where_it_lies(tmp_path: Path, case: str) -> None:
    codec, suffix, format, place, *coded = READ[case]
    _, matrix, full = (*coded, *("", 1, False)[len(coded) :])
    path = made(tmp_path / f"a{suffix}", codec, format, place, *coded)
    assert displaced(path, matrix=matrix, full=full) == pytest.approx((0, 0), abs=0.1)


@pytest.mark.parametrize("place", ["left", "topleft", "center"])
def test_frames_of_hardware_decoders_too(place: str) -> None:
    picture = Conversion().pixels(ramp_frame("p010le", place), True, place)
    assert of_picture(picture) == pytest.approx((0, 0), abs=0.1)


def written_chroma(path: Path) -> tuple[float, float]:
    """Where sample 0 of chroma lies in a file, of the ramps, across and down."""
    with av.open(str(path)) as container:
        frame = next(container.decode(video=0))
    width, height = frame.format.chroma_width(SIDE), frame.format.chroma_height(SIDE)
    deep = frame.format.components[0].bits > 8
    planes = [np.frombuffer(plane, np.uint16 if deep else np.uint8).reshape(plane.height, -1) for plane in frame.planes]
    scale = 1 << (frame.format.components[0].bits - 8)
    blue, red = (plane[4:-4, 4 : width - 4] / scale for plane in planes[1:])
    across, down = SIDE // width, SIDE // height
    columns = np.arange(4, width - 4) * across
    rows = np.arange(4, height - 4) * down
    place = (blue.mean(axis=0) - 128) / STEP + SIDE / 2 - columns, (red.mean(axis=1) - 128) / STEP + SIDE / 2 - rows
    return float(place[0].mean()), float(place[1].mean())


#: Source (as in READ), then codec, suffix and place of the result's chroma.
WRITTEN: dict[str, tuple[tuple[Any, ...], str, str, str]] = {
    "kept": (READ["H.264, top left"], "libx264", ".mp4", "topleft"),
    "center kept": (READ["H.264, center"], "libx264", ".mkv", "center"),
    "to H.265": (READ["H.264, top left"], "libx265", ".mkv", "topleft"),
    "to MPEG-2": (READ["H.264, top left"], "mpeg2video", ".mkv", "left"),
    "to FFV1": (READ["H.264, center"], "ffv1", ".mkv", "center"),
    "to Motion JPEG": (READ["H.264"], "mjpeg", ".mov", "center"),
    "to VP8": (READ["H.264"], "libvpx", ".webm", "center"),
    "to VP9": (READ["H.264, center"], "libvpx-vp9", ".webm", "center"),
    "to VP9 in MP4": (READ["H.264, center"], "libvpx-vp9", ".mp4", "left"),
    "HDR": (READ["H.265, HDR"], "libx265", ".mp4", "topleft"),
    "HDR to FFV1": (READ["H.265, HDR"], "ffv1", ".mkv", "topleft"),
    "4:2:2": (READ["H.264, 4:2:2"], "libx264", ".mkv", "left"),
}
#: Elements ChromaSitingHorz and ChromaSitingVert of Matroska (RFC 9559, 5.1.4.1.28): 1 is left or top, 2 half.
SITING = {"left": b"\x55\xb7\x81\x01\x55\xb8\x81\x02", "topleft": b"\x55\xb7\x81\x01\x55\xb8\x81\x01",
          "center": b"\x55\xb7\x81\x02\x55\xb8\x81\x02"}  # fmt: skip


@pytest.mark.parametrize("case", WRITTEN)
def test_chroma_is_written_where_readers_take_it(tmp_path: Path, case: str) -> None:
    (codec, suffix, *coded), encoder, result, place = WRITTEN[case]
    _, _, _, matrix, full = (*coded, *("", 1, False)[len(coded) - 2 :])
    video = Video(made(tmp_path / f"a{suffix}", codec, *coded))
    quality = {
        "libx264": {"crf": "0"},
        "libx265": {"x265-params": "lossless=1:log-level=none"},
        "ffv1": {},
        "libvpx-vp9": {"crf": "1"},
    }
    options = quality.get(encoder, {"b": "40000000", "qmin": "1", "qmax": "2"})
    sink = ToVideo(tmp_path / f"b{result}", codec=encoder, options=options)
    sink.begin(video)
    for frame in video:
        sink.stores(frame, video.size)
        sink.take(frame, sink.prepare(frame, frame.read()))
    sink.finish()
    assert displaced(sink.path, matrix=matrix, full=full) == pytest.approx((0, 0), abs=0.15)
    across, down = PLACES[place]
    assert written_chroma(sink.path) == pytest.approx((across, 0 if "422" in coded[0] else down), abs=0.15)
    if result == ".mkv":
        assert SITING[place] in sink.path.read_bytes()
