"""Read and write frames on streams: concatenated PNG files, or raw pixels."""

from __future__ import annotations

import re
from collections.abc import Iterator
from fractions import Fraction
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from passgraph.color_tags import ColorSpace, Recoded
from passgraph.errors import InputError
from passgraph.files.digests import digest
from passgraph.files.frame import Frame, Sink, Source, Stored
from passgraph.files.sequences import result_metadata
from passgraph.files.stored import with_channels
from passgraph.graph.targets import MAX_SIDE
from passgraph.image_files import MAX_BYTES
from passgraph.pictures import encode_png, load_stored, metadata_of
from passgraph.records import dataclass

_SIGNATURE = b"\x89PNG\r\n\x1a\n"


@dataclass(frozen=True)
class Layout:
    """The layout of raw pixels: the dtype, and the channels of a pixel in order."""

    dtype: np.dtype[Any]
    order: tuple[int, ...]

    @property
    def channels(self) -> int:
        return len(self.order)

    def ordered(self, pixels: Stored) -> Stored:
        """Reorder channels from this layout to RGBA, or from RGBA to this layout; both are the same permutation."""
        return pixels if self.order == tuple(range(self.channels)) else pixels[..., self.order]


_BYTE, _WORD = np.dtype(np.uint8), np.dtype("<u2")
#: Layouts by ffmpeg's names.
LAYOUTS = {
    "gray": Layout(_BYTE, (0,)),
    "rgb24": Layout(_BYTE, (0, 1, 2)),
    "bgr24": Layout(_BYTE, (2, 1, 0)),
    "rgba": Layout(_BYTE, (0, 1, 2, 3)),
    "bgra": Layout(_BYTE, (2, 1, 0, 3)),
    "gray16le": Layout(_WORD, (0,)),
    "rgb48le": Layout(_WORD, (0, 1, 2)),
    "rgba64le": Layout(_WORD, (0, 1, 2, 3)),
}
_RAW = re.compile(r"(?:(\d{1,6})x(\d{1,6}):)?(\w+)(?:@(\d{1,6}(?:/\d{1,6}|\.\d{1,6})?))?", re.ASCII)


@dataclass(frozen=True)
class Raw:
    """Raw pixels without a header, row by row: layout, size, and frames a second for writing a video.

    >>> Raw.parsed("1920x1080:rgb24@30000/1001").rate
    Fraction(30000, 1001)
    """

    layout: str
    size: tuple[int, int] | None = None
    rate: Fraction | None = None

    @staticmethod
    def parsed(text: str) -> Raw:
        """Parse ``WxH:LAYOUT@RATE``; size and rate may be left out."""
        match = _RAW.fullmatch(text)
        if match is None or match[3] not in LAYOUTS:
            raise InputError(
                f"{text!r} is not a layout of raw pixels; write WxH:LAYOUT@RATE, such as 1920x1080:rgb24@25, with one "
                f"of {', '.join(LAYOUTS)}"
            )
        size = None if match[1] is None else (int(match[1]), int(match[2]))
        if size is not None and not all(1 <= side <= MAX_SIDE for side in size):
            raise InputError(f"{text!r}: each side must be 1 to {MAX_SIDE} pixels")
        rate = None if match[4] is None or match[4].endswith("/0") else Fraction(match[4])
        if match[4] is not None and not rate:
            raise InputError(f"{text!r}: the rate must be above 0")
        return Raw(match[3], size, rate)


class Pipe:
    """A source that reads a stream such as ``sys.stdin.buffer`` until it ends: PNG files, or raw pixels."""

    count = None

    def __init__(self, stream: BinaryIO, raw: Raw | None = None, name: str = "standard input") -> None:
        if raw is not None and raw.size is None:
            raise InputError(f"{name}: raw pixels have no size of their own; write it, such as 640x480:{raw.layout}")
        self.stream, self.raw, self.name = stream, raw, name
        self.has_alpha = raw is None or LAYOUTS[raw.layout].channels == 4

    def __iter__(self) -> Iterator[Frame]:
        number = 0
        while data := self._next(number):
            number += 1
            yield self._frame(number, data)
        if number == 0:
            raise InputError(f"{self.name}: is empty; expected {'raw pixels' if self.raw else 'PNG pictures'}")

    def _frame(self, number: int, data: bytes) -> Frame:
        name = f"{self.name}, picture {number}"
        if self.raw is None:
            return Frame(
                number, name, lambda: load_stored(Path(name), data),
                read_light=lambda: load_stored(Path(name), data, linear=True),
                described=lambda: metadata_of(Path(name), data), state=lambda: digest(data),
            )  # fmt: skip
        assert self.raw.size is not None
        (width, height), layout = self.raw.size, LAYOUTS[self.raw.layout]
        pixels = np.frombuffer(data, layout.dtype).reshape(height, width, layout.channels)
        return Frame.from_picture(number, name, layout.ordered(pixels))

    def _next(self, number: int) -> bytes:
        """Return the bytes of the next picture; none at the end."""
        if self.raw is None:
            return self._next_png(number)
        assert self.raw.size is not None
        (width, height), layout = self.raw.size, LAYOUTS[self.raw.layout]
        size = width * height * layout.channels * layout.dtype.itemsize
        data = self._read(size)
        if 0 < len(data) < size:
            raise InputError(
                f"{self.name}: ends inside picture {number + 1}, {len(data)} of {size} bytes; check size and layout"
            )
        return data

    def _next_png(self, number: int) -> bytes:
        where = f"{self.name}, picture {number + 1}"
        data = self._read(8)
        if not data:
            return b""
        if data != _SIGNATURE:
            raise InputError(
                f"{where}: is no PNG; expected PNG files one behind the other, or raw pixels with --raw; got bytes "
                f"that begin with {data!r}"
            )
        parts, size = [data], 8
        while True:
            head = self._read(8)
            length = int.from_bytes(head[:4], "big") + 4  # and the checksum
            size += length + 8
            if size > MAX_BYTES:
                raise InputError(f"{where}: is larger than {MAX_BYTES} bytes; make it smaller")
            body = self._read(length) if len(head) == 8 else b""
            if len(body) < length:
                raise InputError(f"{where}: truncated; the stream ends inside it")
            parts += head, body
            if head[4:] == b"IEND":
                return b"".join(parts)

    def _read(self, count: int) -> bytes:
        """Read ``count`` bytes, or those up to the end; a stream may return fewer in one call."""
        parts, received = list[bytes](), 0
        while received < count and (part := self.stream.read(min(count - received, 1 << 24))):
            parts.append(part)
            received += len(part)
        return parts[0] if len(parts) == 1 else b"".join(parts)


class ToPipe(Sink):
    """A sink that writes to a stream such as ``sys.stdout.buffer``: PNG files, or raw pixels of one size.

    ``color`` is the color space of the results, as for `passgraph.save`; by default PNG files keep the source's color
    tags and metadata.
    """

    def __init__(
        self,
        stream: BinaryIO,
        raw: Raw | None = None,
        name: str = "standard output",
        color: ColorSpace | Recoded | str | None = None,
    ) -> None:
        self.stream, self.raw, self._name = stream, raw, name
        self.color = ColorSpace(color, color) if isinstance(color, str) else color
        self._source: Source | None = None
        self._size = None if raw is None else raw.size

    @property
    def name(self) -> str:
        return self._name

    def begin(self, source: Source) -> None:
        self._source = source

    def in_bytes(self, source: Source) -> bool:
        return self.raw is None or LAYOUTS[self.raw.layout].dtype == np.uint8

    def stores(self, frame: Frame, size: tuple[int, int]) -> np.dtype[Any]:
        if self.raw is None:
            return np.dtype(np.uint8)
        self._size = self._size or size
        if self._size != size:
            raise InputError(
                f"{frame.name}: makes {size[0]}x{size[1]} pixels, and {self.name} holds {self._size[0]}x"
                f"{self._size[1]}; raw pixels have one size"
            )
        return LAYOUTS[self.raw.layout].dtype

    def prepare(self, frame: Frame, picture: Stored) -> bytes:
        if self.raw is None:
            return encode_png(Path(frame.name), picture, result_metadata(frame, self._source, self.color))
        layout = LAYOUTS[self.raw.layout]
        return layout.ordered(with_channels(picture, layout.channels)).tobytes()

    def take(self, frame: Frame, prepared: bytes) -> None:
        self.stream.write(prepared)

    def finish(self) -> None:
        self.stream.flush()
