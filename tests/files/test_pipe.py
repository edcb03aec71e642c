"""Streams of PNG pictures and of raw pixels."""

from __future__ import annotations

import io
from collections.abc import Callable
from fractions import Fraction
from typing import Any

import numpy as np
import pytest

import passgraph as pg
from passgraph.errors import InputError
from passgraph.files import Arrays, Pipe, Raw, ToArrays, ToPipe
from passgraph.files.stored import with_channels
from tests.files.made import inverted, picture


def pngs(*pictures: Any) -> bytes:
    stream = io.BytesIO()
    with inverted() as program:
        pg.frames(program, Arrays([255 - p | np.uint8([0, 0, 0, 255]) for p in pictures]), ToPipe(stream))
    return stream.getvalue()


class Slowly(io.BytesIO):
    """Gives a few bytes at a time, as pipes may."""

    def read(self, size: int | None = -1, /) -> bytes:
        return super().read(min(7, size if size is not None and size >= 0 else 7))


@pytest.mark.parametrize("stream", [io.BytesIO, Slowly])
def test_pictures_go_through_streams(stream: Callable[[bytes], io.BytesIO]) -> None:
    data = pngs(*(picture(10 * i, (i + 1, 3)) for i in range(5)))
    frames = list(Pipe(stream(data)))
    assert [(frame.number, frame.read().shape) for frame in frames] == [(i + 1, (3, i + 1, 4)) for i in range(5)]
    assert [int(frame.read()[0, 0, 0]) for frame in frames] == [0, 10, 20, 30, 40]


def test_a_broken_picture_fails_alone() -> None:
    one, two = pngs(picture(1)), bytearray(pngs(picture(2)))
    two[two.index(b"IDAT") + 8] ^= 255  # in the pixels
    with inverted() as program:
        summary = pg.frames(program, Pipe(io.BytesIO(one + bytes(two) + one)), ToArrays())
    assert (summary.written, [f.number for f in summary.failed], summary.stopped) == (2, [2], "")
    assert summary.failed[0].reason.startswith("standard input, picture 2: truncated or corrupt")


@pytest.mark.parametrize(
    ("tail", "message"),
    [
        (b"\x89PNG\r\n\x1a\n", "standard input, picture 2: truncated; the stream ends inside it"),
        (b"\x89PN", "standard input, picture 2: is no PNG"),
        (b"\n", "standard input, picture 2: is no PNG; expected PNG files one behind the other"),
        (b"\x89PNG\r\n\x1a\n\xff\xff\xff\xffIDAT", "picture 2: is larger than 4294967296 bytes"),
        (b"\x89PNG\r\n\x1a\n\x00\xff\xff\xffIDAT", "picture 2: truncated"),
    ],
)
def test_a_stream_that_breaks_off_keeps_what_came_before(tail: bytes, message: str) -> None:
    with inverted() as program:
        summary = pg.frames(program, Pipe(io.BytesIO(pngs(picture(1)) + tail)), ToArrays())
    assert summary.written == 1
    assert message in summary.stopped


def test_an_empty_stream_is_an_error() -> None:
    with inverted() as program, pytest.raises(InputError, match="standard input: is empty; expected PNG pictures"):
        pg.frames(program, Pipe(io.BytesIO()), ToArrays())


@pytest.mark.parametrize(("layout", "dtype", "channels"), [
    ("gray", np.uint8, 1), ("rgb24", np.uint8, 3), ("rgba", np.uint8, 4), ("rgb48le", "<u2", 3), ("rgba64le", "<u2", 4),
    ("bgr24", np.uint8, 3), ("bgra", np.uint8, 4), ("gray16le", "<u2", 1),
])  # fmt: skip
def test_raw_pixels_go_through_streams(layout: str, dtype: Any, channels: int) -> None:
    given = np.random.default_rng(0).integers(0, np.iinfo(dtype).max, (3, 4, 5, channels)).astype(dtype)
    if channels == 4:
        given[..., 3] = np.iinfo(dtype).max
    out, raw = io.BytesIO(), Raw.parsed(f"5x4:{layout}")
    same = pg.kernel(source="def same(color: Image) -> vec4: return vec4(color[0, 0].rgb, 1.0)")
    if channels == 1:
        same = pg.kernel(source="def same(color: Image) -> vec4: return vec4(color[0, 0].r)")
    with pg.compile(same(pg.Input("frame")), backend="numpy") as program:
        summary = pg.frames(program, Pipe(io.BytesIO(given.tobytes()), raw), ToPipe(out, raw))
    assert summary.written == 3
    assert out.getvalue() == given.tobytes()


@pytest.mark.parametrize(("layout", "channels"), [("bgr24", 3), ("bgra", 4)])
def test_blue_may_come_first(layout: str, channels: int) -> None:
    """As OpenCV has it."""
    given = np.arange(2 * 3 * channels, dtype=np.uint8)
    frame = next(iter(Pipe(io.BytesIO(given.tobytes()), Raw.parsed(f"3x2:{layout}")))).read()
    assert frame[0, 0].tolist() == [2, 1, 0, 3][:channels]


def test_raw_pixels_that_end_inside_a_picture() -> None:
    with inverted() as program:
        summary = pg.frames(program, Pipe(io.BytesIO(bytes(100)), Raw.parsed("5x4:rgb24")), ToArrays())
    assert summary.written == 1
    assert summary.stopped == (
        "standard input: ends inside picture 2, 40 of 60 bytes; check size and layout"
    )  # fmt: skip


def test_raw_pixels_have_one_size() -> None:
    out = io.BytesIO()
    with inverted() as program:
        summary = pg.frames(program, Arrays([picture(1), picture(2, (3, 3)), picture(3)]), ToPipe(out, Raw("rgb24")))
    assert (summary.written, len(out.getvalue())) == (2, 2 * 6 * 4 * 3)
    assert "array 2: makes 3x3 pixels, and standard output holds 6x4" in summary.failed[0].reason


@pytest.mark.parametrize(
    ("text", "made"),
    [
        ("rgb24", Raw("rgb24")), ("64x48:rgba", Raw("rgba", (64, 48))), ("gray@25", Raw("gray", None, Fraction(25))),
        ("1x1:rgb24@23.976", Raw("rgb24", (1, 1), Fraction(23976, 1000))),
    ],
)  # fmt: skip
def test_layouts(text: str, made: Raw) -> None:
    assert Raw.parsed(text) == made


@pytest.mark.parametrize(
    "text",
    [
        "", "64x48", "64x48:", "64x48:yuv", "0x1:rgb24", "99999x1:rgb24", "1x1:rgb24@0", "1x1:rgb24@1/0",
        "1x1:rgb24@-1", "²x²:rgb24", "1x1:rgb24@", "1x1:rgb24 ",
    ],
)  # fmt: skip
def test_layouts_that_are_refused(text: str) -> None:
    with pytest.raises(InputError, match="'"):
        Raw.parsed(text)


def test_a_stream_of_raw_pixels_needs_a_size() -> None:
    with pytest.raises(InputError, match=r"raw pixels have no size of their own; write it, such as 640x480:rgb24"):
        Pipe(io.BytesIO(), Raw("rgb24"))


def test_channels() -> None:
    one = np.uint8([[[10, 20, 30, 40]]])
    assert with_channels(one, 3).tolist() == [[[10, 20, 30]]]
    assert with_channels(one, 1).tolist() == [[[round(2.126 + 14.304 + 2.166)]]]
    assert with_channels(one[..., :3], 4).tolist() == [[[10, 20, 30, 255]]]
    assert with_channels(one[..., :2], 4).tolist() == [[[10, 10, 10, 20]]]
    assert with_channels(one[..., :1].astype(np.float32), 4).tolist() == [[[10, 10, 10, 1]]]
