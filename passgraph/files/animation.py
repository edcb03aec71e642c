"""Frames of animated pictures: GIF (gif.py), APNG, and WebP through Pillow."""

from __future__ import annotations

import io
import os
import struct
import zlib
from collections.abc import Iterator
from fractions import Fraction
from itertools import accumulate, pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from passgraph import arguments
from passgraph.errors import InputError
from passgraph.files import gif
from passgraph.files.animation_times import times_of
from passgraph.files.frame import Frame
from passgraph.pictures import MAX_BYTES, check_size
from passgraph.reading import read_bytes

_SIGNATURE = b"\x89PNG\r\n\x1a\n"
#: Kinds of chunks that pictures hang on.
_READ = (b"IHDR", b"PLTE", b"tRNS", b"IDAT", b"fcTL", b"fdAT")
#: How a frame is left: all of it seen through, or as it was before; and how it is laid on what is there.
_GOES, _BACK, _OVER = 1, 2, 1


class _Control(NamedTuple):
    """Of a frame: its place in the file's order, size, place, length, what becomes of it and how it is laid."""

    number: int
    width: int
    height: int
    left: int
    upper: int
    time: int
    units: int
    dispose: int
    blend: int


def pictures_of(data: bytes, size: tuple[int, int]) -> Iterator[NDArray[np.uint8]]:
    """Whole pictures (h, w, 4); raises ValueError, or whatever Pillow does, where the file is damaged."""
    shown = np.zeros((size[1], size[0], 4), np.uint8)
    for number, (control, part) in enumerate(_frames(data)):
        left, upper = control.left, control.upper
        place = shown[upper : upper + control.height, left : left + control.width]
        before = shown.copy() if control.dispose == _BACK else None
        place[:] = _over(part, place) if control.blend == _OVER and number else part
        yield shown.copy()
        if control.dispose == _GOES or (control.dispose == _BACK and not number):
            place[:] = 0
        elif before is not None:
            shown = before


def _over(new: NDArray[np.uint8], old: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Colours over others, neither multiplied by alpha."""
    made = np.where(new[..., 3:] == 255, new, old)
    mixed = (new[..., 3] > 0) & (new[..., 3] < 255)
    one, other = new[mixed].astype(np.float32), old[mixed].astype(np.float32)
    share, rest = one[:, 3:] / 255, other[:, 3:] / 255 * (1 - one[:, 3:] / 255)
    made[mixed, :3] = (one[:, :3] * share + other[:, :3] * rest) / (share + rest) + 0.5
    made[mixed, 3:] = (share + rest) * 255 + 0.5
    return made


def _frames(data: bytes) -> Iterator[tuple[_Control, NDArray[np.uint8]]]:
    """Each frame's control and pixels."""
    head: dict[bytes, bytes] = {}
    control, order = None, 0
    pixels: list[bytes] = []
    for kind, body in _chunks(data):
        if kind in (b"fcTL", b"IEND"):
            if control is not None:
                yield control, _unpacked(control, head, b"".join(pixels))
            control, pixels = None, []
        if kind in (b"fcTL", b"fdAT"):
            if int.from_bytes(body[:4], "big") != order:
                raise ValueError("frames are out of order")
            order += 1
        if kind == b"fcTL":
            control = _Control._make(struct.unpack(">IIIIIHHBB", body))
            width, height = struct.unpack(">II", head[b"IHDR"][:8])
            if control.left + control.width > width or control.upper + control.height > height:
                raise ValueError("the frame lies beyond the picture")
        elif kind in (b"IDAT", b"fdAT") and control is not None:
            pixels.append(body if kind == b"IDAT" else body[4:])
        elif kind in (b"IHDR", b"PLTE", b"tRNS"):
            head[kind] = body
    raise ValueError("the file ends within a frame" if control is not None else "there are no more frames")


def _chunks(data: bytes) -> Iterator[tuple[bytes, bytes]]:
    at = len(_SIGNATURE)
    while at + 12 <= len(data):
        length, kind = struct.unpack_from(">I4s", data, at)
        body, end = data[at + 8 : at + 8 + length], data[at + 8 + length : at + 12 + length]
        if len(end) < 4:
            return
        if zlib.crc32(kind + body) != int.from_bytes(end, "big") and kind in _READ:
            raise ValueError(f"the chunk {kind.decode('latin-1')!r} is damaged")
        yield kind, body
        at += 12 + length


def _chunk(kind: bytes, body: bytes) -> bytes:
    return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))


def _unpacked(control: _Control, head: dict[bytes, bytes], pixels: bytes) -> NDArray[np.uint8]:
    """(h, w, 4), out of a PNG of this frame."""
    from PIL import Image

    chunks = {**head, b"IHDR": struct.pack(">II", control.width, control.height) + head[b"IHDR"][8:], b"IDAT": pixels}
    file = _SIGNATURE + b"".join(_chunk(kind, body) for kind, body in chunks.items()) + _chunk(b"IEND", b"")
    with Image.open(io.BytesIO(file), formats=["PNG"]) as image:
        return np.asarray(image.convert("RGBA"))


#: Units of times, which hundredths, thousandths and usual rates are whole numbers of (that of MPEG).
TIME_BASE = Fraction(1, 90000)
#: Bytes a pixel that decoders hold beside the frame: the picture until now, and copies of it.
_HELD = 16


class Animation:
    """Frames of a GIF, APNG or WebP file: (h, w, 4) uint8, whole pictures whatever the file stores of each.

    A frame that is shown for 10 ms or less lasts 100 ms, as in browsers.

    Attributes
    ----------
    path : the file
    size : (width, height) of its pictures
    rate : frames a second on average
    time_base : what one unit of ``pts`` and ``duration`` in a frame's metadata is, in seconds
    plays : how often it is shown, 0 for without end

    Raises
    ------
    InputError : the file is missing, no animation, or too large.
    """

    def __init__(self, path: str | os.PathLike[str]) -> None:
        self.path = arguments.path(path, "an animation")
        data = read_bytes(self.path, "an animation", MAX_BYTES)
        times = times_of(data)
        if times is None or not times.seconds:
            raise InputError(f"{self.path}: is no animation of several frames; expected a GIF, APNG or WebP that moves")
        if not times.whole and data.startswith(b"RIFF"):  # a decoder takes no file that goes on beyond its end
            data = data[:4] + struct.pack("<I", times.until - 8) + data[8 : times.until]
        self._data, self._times = data, times
        image = self._opened()
        width, height = (max(sides) for sides in zip(image.size, times.reach, strict=True))
        check_size(self.path, width, height, len(data) + _HELD * width * height, MAX_BYTES)
        if image.mode.startswith("I"):
            raise InputError(f"{self.path}: has frames of 16 bits; expected 8 bits a channel; convert it")
        self.size: tuple[int, int] = image.size
        self.time_base, self.plays = TIME_BASE, times.plays
        self.rate = len(times.seconds) / sum(times.seconds)

    @property
    def name(self) -> str:
        return os.fspath(self.path)

    @property
    def count(self) -> int:
        return len(self._times.seconds)

    def __iter__(self) -> Iterator[Frame]:
        kinds = {b"GIF": gif.pictures_of, b"\x89PN": pictures_of}
        known = kinds.get(self._data[:3])
        shown = self._pictures() if known is None else known(self._data, self.size)
        ends = [round(end / TIME_BASE) for end in accumulate(self._times.seconds, initial=Fraction(0))]
        for number, (start, end) in enumerate(pairwise(ends), 1):
            picture = self._decoded(shown, number)
            metadata = {"pts": start, "duration": end - start, "time_base": TIME_BASE}
            yield Frame(number, f"{self.path}, frame {number}", lambda picture=picture: picture, metadata)  # type: ignore[misc]
        if not self._times.whole or self.count < self._times.said:
            raise InputError(f"{self.path}: truncated; {_until(self.count)}")

    def _opened(self) -> Any:
        from PIL import Image as pillow

        try:
            return pillow.open(io.BytesIO(self._data), formats=("GIF", "PNG", "WEBP"))
        except Exception as error:
            raise InputError(f"{self.path}: truncated or corrupt ({_text(error)}); make or copy it again") from error

    def _pictures(self) -> Iterator[Any]:
        """Whole pictures, which Pillow puts together from what the file stores."""
        image = self._opened()
        for number in range(self.count):
            image.seek(number)
            picture = np.asarray(image.convert("RGBA"))
            yield picture[: self.size[1], : self.size[0]]

    def _decoded(self, shown: Iterator[Any], number: int) -> Any:
        try:
            return next(shown)
        except Exception as error:  # decoders meet broken bytes with errors of every kind
            raise InputError(
                f"{self.path}: truncated or corrupt from frame {number} on ({_text(error)}); {_until(number - 1)}"
            ) from error


def _text(error: Exception) -> str:
    return " ".join(str(error).split()) or type(error).__name__


def _until(count: int) -> str:
    return f"the {count} frames until there are done" if count != 1 else "the one frame until there is done"
