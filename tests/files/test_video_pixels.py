"""Colours of videos, against the definition of Y'CbCr and plain swscale."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from passgraph.files.video_pixels import FULL, LIMITED, Conversion

av: Any = pytest.importorskip("av")

#: Weights of red and blue in luma, ITU-T H.273 table 4.
WEIGHTS = {
    1: (0.2126, 0.0722),
    4: (0.3, 0.11),
    5: (0.299, 0.114),
    6: (0.299, 0.114),
    7: (0.212, 0.087),
    9: (0.2627, 0.0593),
}
CODES = [(matrix, colour_range) for matrix in WEIGHTS for colour_range in (LIMITED, FULL)]
RNG = np.random.default_rng(0)


def coded(colours: Any, matrix: int, colour_range: int) -> Any:
    """R'G'B' of 0 to 1 as Y'CbCr in steps of a byte, ITU-T H.273 equations 41 to 43 and 20 to 25, in float64."""
    red, blue = WEIGHTS[matrix]
    y = colours @ np.array([red, 1 - red - blue, blue])
    both = [(colours[..., 2] - y) / (2 - 2 * blue), (colours[..., 0] - y) / (2 - 2 * red)]
    zero, luma, chroma = (0, 255, 255) if colour_range == FULL else (16, 219, 224)
    return np.stack([zero + luma * y, *(128 + chroma * one for one in both)])


def decoded(planes: Any, matrix: int, colour_range: int) -> Any:
    """The other way, by the inverse of the matrix."""
    offset = coded(np.zeros(3), matrix, colour_range)
    columns = np.stack([coded(one, matrix, colour_range) - offset for one in np.eye(3)], -1)
    colours: Any = np.moveaxis(np.tensordot(np.linalg.inv(columns), planes - offset[:, None, None], 1), 0, -1)
    return colours.clip(0, 1) * 255


def frame_of(planes: Any, format: str, matrix: int, colour_range: int) -> Any:
    """A frame with room behind its rows."""
    frame = av.VideoFrame(planes[0].shape[1], planes[0].shape[0], format)
    for plane, given in zip(frame.planes, planes, strict=True):
        rows = np.full((plane.height, plane.line_size), 77, np.uint8)
        rows[:, : plane.width] = given
        plane.update(rows.tobytes())
    frame.colorspace, frame.color_range = matrix, colour_range
    return frame


def arrays(frame: Any) -> list[Any]:
    rows = [np.frombuffer(plane, np.uint8).reshape(plane.height, plane.line_size) for plane in frame.planes]
    return [row[:, : plane.width] for row, plane in zip(rows, frame.planes, strict=True)]


@pytest.mark.parametrize("format", ["yuv444p", "yuvj444p", "yuva444p"])
@pytest.mark.parametrize(("matrix", "colour_range"), CODES)
def test_every_byte_is_the_nearest(format: str, matrix: int, colour_range: int) -> None:
    """Half a step, and what float32 rounds; all 256 of each plane, and colours that are none."""
    planes = RNG.integers(0, 256, (3 + ("a" in format), 37, 51), np.uint8)
    planes[:, :5, :] = RNG.choice([0, 16, 128, 235, 240, 255], (len(planes), 5, 51))
    frame = frame_of(planes, format, matrix, colour_range)
    pixels = Conversion().pixels(frame, deep=False)
    assert np.abs(pixels[..., :3] - decoded(planes[:3].astype(float), matrix, colour_range)).max() <= 0.5 + 1e-4
    assert np.array_equal(pixels[..., 3], planes[3] if "a" in format else np.full((37, 51), 255))
    made = Conversion().frame(np.ascontiguousarray(pixels), format, matrix, colour_range)
    assert (made.format.name, made.colorspace, made.color_range) == (format, matrix, colour_range)
    exact = coded(pixels[..., :3] / 255, matrix, colour_range)
    assert np.abs(np.stack(arrays(made)[:3]) - exact).max() <= 0.5 + 1e-4
    if "a" in format:
        assert np.array_equal(arrays(made)[3], planes[3])


@pytest.mark.parametrize("format", ["yuv410p", "yuv411p", "yuv420p", "yuvj420p", "yuva420p", "yuv422p", "yuv440p"])
def test_smaller_chroma(format: str) -> None:
    """Colour that changes slowly comes through both ways as the formula says, without a shift of brightness."""
    y, x = np.mgrid[:96, :128]
    pixels = np.stack([90 + x / 2, 120 + y / 3, 200 - x / 4 - y / 4, 0 * x + 255], -1).astype(np.uint8)
    converted = Conversion()
    frame = converted.frame(pixels, format, 1, LIMITED)
    exact = coded(pixels[..., :3] / 255, 1, LIMITED)
    planes = arrays(frame)
    assert np.abs(planes[0] - exact[0]).max() <= 0.5 + 1e-4
    for plane, whole in zip(planes[1:3], exact[1:], strict=True):
        means = whole.reshape(plane.shape[0], 96 // plane.shape[0], plane.shape[1], -1).mean((1, 3))
        inner = np.s_[2:-2, 2:-2]
        assert abs((plane - means)[inner].mean()) < 0.3 and np.abs(plane - means)[inner].max() <= 2
    again = converted.pixels(frame, deep=False)
    error = again[4:-4, 4:-4].astype(int) - pixels[4:-4, 4:-4]
    assert np.abs(error).max() <= 6 and np.abs(error.mean((0, 1))).max() < 0.5


def deep_code(colours: Any, matrix: int, colour_range: int, bits: int) -> Any:
    """As `coded`, of any number of bits: ITU-T H.273 equations 20 to 25 with BitDepth, in float64."""
    full, step = coded(colours, matrix, FULL), 1 << (bits - 8)
    if colour_range == LIMITED:
        return coded(colours, matrix, LIMITED) * step
    most = (1 << bits) - 1
    return np.stack([full[0] / 255 * most, *(128 * step + (one - 128) / 255 * most for one in full[1:])])


DEEP = [*((f"yuv444p{bits}le", bits) for bits in (9, 10, 12, 14, 16)), *((f"yuva444p{n}le", n) for n in (10, 12, 16))]


@pytest.mark.parametrize(("format", "bits"), DEEP)
@pytest.mark.parametrize(("matrix", "colour_range"), CODES)
def test_every_deeper_number_is_the_nearest(format: str, bits: int, matrix: int, colour_range: int) -> None:
    """Half a step of 65535 one way and of the format the other, and what float32 rounds."""
    most, step = (1 << bits) - 1, 1 << (bits - 8)
    planes = RNG.integers(0, most + 1, (3 + ("a" in format), 37, 51), np.uint16)
    planes[:, :5, :] = RNG.choice(np.array([0, 16, 128, 235, 240, 255]) * step, (len(planes), 5, 51))
    planes[:, 5] = most
    frame = av.VideoFrame(51, 37, format)
    for plane, given in zip(frame.planes, planes, strict=True):
        rows = np.full((plane.height, plane.line_size // 2), 77, np.uint16)
        rows[:, :51] = given
        plane.update(rows.tobytes())
    frame.colorspace, frame.color_range = matrix, colour_range
    pixels = Conversion().pixels(frame, deep=True)
    assert pixels.dtype == np.uint16
    offset = deep_code(np.zeros(3), matrix, colour_range, bits)
    columns = np.stack([deep_code(one, matrix, colour_range, bits) - offset for one in np.eye(3)], -1)
    exact = np.tensordot(np.linalg.inv(columns), planes[:3].astype(float) - offset[:, None, None], 1)
    colours = np.moveaxis(exact, 0, -1).clip(0, 1) * 65535
    assert np.abs(pixels[..., :3] - colours).max() <= 0.5 + 0.02
    alpha = planes[3] / most * 65535 if "a" in format else np.full((37, 51), 65535)
    assert np.abs(pixels[..., 3] - alpha).max() <= 0.5
    made = Conversion().frame(np.ascontiguousarray(pixels), format, matrix, colour_range)
    assert (made.format.name, made.colorspace, made.color_range) == (format, matrix, colour_range)
    stored = [np.frombuffer(p, np.uint16).reshape(p.height, -1)[:, : p.width] for p in made.planes]
    wanted = deep_code(pixels[..., :3] / 65535, matrix, colour_range, bits).clip(0, most)
    assert np.abs(np.stack(stored[:3]) - wanted).max() <= 0.5 + 0.02
    if "a" in format:
        assert np.abs(stored[3] - pixels[..., 3] / 65535 * most).max() <= 0.5


@pytest.mark.parametrize("bits", [10, 12])
@pytest.mark.parametrize("way", ["20", "22", "40"])
def test_deep_luma_goes_through_where_chroma_is_smaller(way: str, bits: int) -> None:
    """White of limited range is white, and grays are right to half a step."""
    step = 1 << (bits - 8)
    frame = av.VideoFrame(64, 48, f"yuv4{way}p{bits}le")
    luma = np.linspace(16 * step, 235 * step, 64 * 48).round().astype(np.uint16).reshape(48, 64)
    for number, plane in enumerate(frame.planes):
        rows = np.full((plane.height, plane.line_size // 2), 128 * step, np.uint16)
        if number == 0:
            rows[:, :64] = luma
        plane.update(rows.tobytes())
    frame.colorspace, frame.color_range = 1, LIMITED
    pixels = Conversion().pixels(frame, deep=True)
    exact = (luma / step - 16) / 219 * 65535
    assert np.abs(pixels[..., :3] - exact[..., None]).max() <= 0.5 + 0.02
    assert pixels[-1, -1].tolist() == [65535] * 4
    again = Conversion().frame(pixels, f"yuv4{way}p{bits}le", 1, LIMITED)
    stored = np.frombuffer(again.planes[0], np.uint16).reshape(48, -1)[:, :64]
    assert np.array_equal(stored, luma)


def test_pictures_of_several_threads_do_not_meet() -> None:
    """What converts is kept, a frame of the other format too: by each thread its own."""
    from concurrent.futures import ThreadPoolExecutor

    converted = Conversion()
    given = [np.full((64, 96, 4), (n, 255 - n, 100, 255), np.uint8) for n in range(0, 250, 5)]

    def there_and_back(pixels: Any) -> Any:
        return converted.pixels(converted.frame(pixels, "yuv420p", 1, FULL), deep=False)

    with ThreadPoolExecutor(4) as threads:
        for pixels, made in zip(given, threads.map(there_and_back, given), strict=True):
            assert np.abs(made.astype(int) - pixels).max() <= 2


def in_fields(frame: Any) -> Any:
    """The same frame, said to be interlaced."""
    graph = av.filter.Graph()
    size = f"video_size={frame.width}x{frame.height}:pix_fmt={frame.format.name}:time_base=1/1"
    parts = graph.add("buffer", size), graph.add("setfield", "tff"), graph.add("buffersink")
    for one, other in pairwise(parts):
        one.link_to(other)
    graph.configure()
    graph.push(frame)
    made = graph.pull()
    made.colorspace, made.color_range = frame.colorspace, frame.color_range
    assert made.interlaced_frame
    return made


@pytest.mark.parametrize("interlaced", [False, True])
@pytest.mark.parametrize("format", ["nv12", "yuv420p10le"])
def test_pooled_conversions_give_the_bits_of_plain_ones(format: str, interlaced: bool) -> None:
    """What swscale converts: there and back, for every matrix and range."""
    size = 64, 48
    plain, pooled = av.video.reformatter.VideoReformatter(), Conversion().converted
    how = av.video.reformatter.Interpolation.BILINEAR
    if not format.endswith("10le"):
        how |= av.video.reformatter.Interpolation.ACCURATE_RND | av.video.reformatter.Interpolation.FULL_CHR_H_INT
    wide = "rgba64le" if format.endswith("10le") else "rgba"
    number = np.uint16 if wide == "rgba64le" else np.uint8
    pixels = np.random.default_rng(0).integers(0, np.iinfo(number).max, (size[1], size[0], 4)).astype(number)

    def both(frame: Any, wanted: str) -> Any:
        one, other = plain.reformat(frame, format=wanted, interpolation=how, threads=1), pooled(frame, wanted)
        assert (other.colorspace, other.color_range, other.pts) == (matrix, colour_range, 11)
        # Rows may have room behind them, which is nobody's.
        item = np.dtype(number).itemsize * (4 if wanted == wide else 1)
        for a, b in zip(one.planes, other.planes, strict=True):
            first, second = (np.frombuffer(p, np.uint8).reshape(p.height, p.line_size) for p in (a, b))
            assert np.array_equal(first[:, : a.width * item], second[:, : a.width * item])
        return other

    for matrix in (1, 4, 5, 6, 7, 9):
        for colour_range in (1, 2):
            frame = av.VideoFrame.from_ndarray(pixels, wide)
            frame.colorspace, frame.color_range, frame.pts = matrix, colour_range, 11
            frame = in_fields(frame) if interlaced else frame
            both(both(frame, format), wide)
            assert frame.pts == 11


@pytest.mark.parametrize("format", ["yuv420p", "yuv444p", "yuv422p10le"])
def test_what_pools_are_told_of_frames_is_true(format: str) -> None:
    """Of another matrix or range than it was told, libavfilter warns with each frame, and promises nothing."""
    pixels = np.zeros((48, 64, 4), np.uint8)
    before = av.logging.get_level()
    av.logging.set_level(av.logging.VERBOSE)
    try:
        with av.logging.Capture(local=False) as said:
            for matrix in (1, 4, 5, 6, 7, 9):
                for colour_range in (1, 2):
                    frame = av.VideoFrame.from_ndarray(pixels, "rgba").reformat(format=format)
                    frame.colorspace, frame.color_range, frame.pts = matrix, colour_range, 0
                    Conversion().pixels(frame, deep=False)
    finally:
        av.logging.set_level(before)
    assert [text for _, _, text in said if "on the fly" in text or "filter context" in text] == []
