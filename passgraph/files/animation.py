"""Animated pictures: GIF, APNG and WebP, decoded by Pillow."""

from __future__ import annotations

import io
import os
from collections.abc import Iterator
from dataclasses import replace
from fractions import Fraction
from itertools import accumulate, pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from passgraph import arguments
from passgraph.errors import InputError, reason
from passgraph.files.frame import Frame
from passgraph.image_files import MAX_BYTES
from passgraph.image_formats import Metadata
from passgraph.pictures import check_size
from passgraph.reading import read_bytes

if TYPE_CHECKING:
    from PIL.ImageFile import ImageFile

#: Suffixes of files that may be animations.
ANIMATION_SUFFIXES = (".gif", ".png", ".apng", ".webp")
#: Browsers show a frame of at most the first duration (in seconds) for the second one; files use 0 as the default.
SHORTEST, USUAL = Fraction(10, 1000), Fraction(100, 1000)
#: The unit of times, as in MPEG; hundredths, thousandths and the frame times of common rates are multiples of it.
TIME_BASE = Fraction(1, 90000)
#: Bytes a pixel that decoders need besides the frame: the composed picture, and copies of it.
_DECODER_BYTES = 16
#: Enough of a PNG to find the chunk "acTL", which comes before the pixels.
_PNG_HEAD = 1 << 16


def is_animated(path: Path) -> bool:
    """Return True if a file is an animation of several frames; False if it cannot be read."""
    if path.suffix.lower() not in ANIMATION_SUFFIXES or not path.is_file():
        return False
    try:
        with path.open("rb") as stream:
            head = stream.read(_PNG_HEAD)
        # Most files are still pictures, which are recognized without importing Pillow.
        if (head.startswith(b"\x89PNG") and b"acTL" not in head) or (head[:4] == b"RIFF" and head[12:16] != b"VP8X"):
            return False
        with _opened(path) as image:
            return bool(getattr(image, "is_animated", False))
    except Exception:  # decoders raise errors of any type for damaged files
        return False


def _opened(source: Path | io.BytesIO) -> ImageFile:
    from PIL import Image

    return Image.open(source, formats=("GIF", "PNG", "WEBP"))


class Animation:
    """A source that reads a GIF, APNG or WebP file: (h, w, 4) uint8 frames, each composed with those before it.

    A frame that is shown for 10 ms or less lasts 100 ms, as in browsers.

    Attributes
    ----------
    path : the file
    size : (width, height) of its pictures
    count : number of frames
    rate : frames a second on average
    time_base : the unit of ``pts`` and ``duration`` in a frame's metadata, in seconds
    plays : how often the animation plays, 0 for endlessly

    Raises
    ------
    InputError : the file is missing, no animation, or too large.
    """

    time_base = TIME_BASE

    def __init__(self, path: str | os.PathLike[str]) -> None:
        self.path = arguments.path(path, "an animation")
        self._data = read_bytes(self.path, "an animation", MAX_BYTES)
        self._problem = ""
        try:
            with _opened(io.BytesIO(self._data)) as image:
                self._check(image)
                self.size: tuple[int, int] = image.size
                self.plays = _plays_of(image)
                self._profile = np.frombuffer(image.info.get("icc_profile") or b"", np.uint8)
                self._seconds = self._times(image)
        except InputError:
            raise
        except Exception as error:
            raise InputError(f"{self.path}: truncated or corrupt ({reason(error)}); make or copy it again") from error
        self.count = len(self._seconds)
        self.rate = self.count / sum(self._seconds)

    @property
    def name(self) -> str:
        return os.fspath(self.path)

    @property
    def picture_metadata(self) -> Metadata:
        """Return the metadata of pictures that are made of its frames: the color profile."""
        is_rgb = bytes(self._profile[16:20]) == b"RGB "  # ICC.1:2022, section 7.2.6
        return Metadata((("ICCProfile", f"uint8[{self._profile.size}]", self._profile),) if is_rgb else ())

    def __iter__(self) -> Iterator[Frame]:
        pictures = self._pictures()
        ends = [round(end / TIME_BASE) for end in accumulate(self._seconds, initial=Fraction(0))]
        for number, (start, end) in enumerate(pairwise(ends), 1):
            try:
                picture = next(pictures)
            except Exception as error:  # decoders raise errors of any type for damaged files
                raise InputError(
                    f"{self.path}: truncated or corrupt from frame {number} on ({reason(error)}); {_done(number - 1)}"
                ) from error
            metadata = {"pts": start, "duration": end - start, "time_base": TIME_BASE}
            unread = Frame.unread(self.path, number)
            yield replace(unread, read=lambda picture=picture: picture, metadata=metadata)  # type: ignore[misc]
        if self._problem:
            raise InputError(f"{self.path}: truncated or corrupt ({self._problem}); {_done(self.count)}")

    def _check(self, image: ImageFile) -> None:
        if not getattr(image, "is_animated", False):
            raise InputError(f"{self.path}: is no animation of several frames; expected a GIF, APNG or WebP that moves")
        width, height = image.size
        check_size(self.path, width, height, len(self._data) + _DECODER_BYTES * width * height, MAX_BYTES)
        if image.mode.startswith("I"):
            raise InputError(f"{self.path}: has frames of 16 bits; expected 8 bits a channel; convert it")

    def _times(self, image: ImageFile) -> list[Fraction]:
        """Return each frame's duration in seconds; of a damaged file, only those before the damage."""
        seconds: list[Fraction] = []
        try:
            for number in _numbers(image):
                image.seek(number)
                image.load()  # Pillow knows a WebP frame's duration only after decoding it
                shown = Fraction(image.info.get("duration", 0)).limit_denominator(1 << 16) / 1000
                seconds.append(shown if shown > SHORTEST else USUAL)
        except Exception as error:
            if not seconds:
                raise
            self._problem = reason(error)
        return seconds

    def _pictures(self) -> Iterator[NDArray[np.uint8]]:
        with _opened(io.BytesIO(self._data)) as image:
            for number in _numbers(image):
                image.seek(number)
                # A frame that lies beyond the picture enlarges Pillow's.
                yield np.asarray(image.convert("RGBA"))[: self.size[1], : self.size[0]]


def _numbers(image: Any) -> range:
    """Return the numbers of the frames, without the default image of an APNG that is not part of the animation."""
    return range(1 if getattr(image, "default_image", False) else 0, image.n_frames)


def _plays_of(image: ImageFile) -> int:
    """Return how often an animation plays; a GIF stores the number of repetitions, if any."""
    if image.format != "GIF":
        return int(image.info.get("loop", 0))
    if "loop" not in image.info:
        return 1
    return int(image.info["loop"]) + 1 if image.info["loop"] else 0


def _done(count: int) -> str:
    return f"the {count} frames before are done" if count != 1 else "the one frame before is done"
