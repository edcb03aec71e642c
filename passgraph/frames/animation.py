"""Frames of animated pictures: GIF (gif.py), APNG (apng.py), and WebP through Pillow."""

from __future__ import annotations

import io
import os
import struct
from collections.abc import Iterator
from fractions import Fraction
from itertools import accumulate, pairwise
from typing import Any

import numpy as np

from passgraph import arguments
from passgraph.errors import InputError
from passgraph.frames import apng, gif
from passgraph.frames.animation_times import times_of
from passgraph.frames.frame import Frame
from passgraph.pictures import MAX_BYTES, check_size
from passgraph.reading import read_bytes

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
        kinds = {b"GIF": gif.pictures_of, b"\x89PN": apng.pictures_of}
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
