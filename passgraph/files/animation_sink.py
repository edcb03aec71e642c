"""Frames to an animated picture, written by Pillow: GIF, or APNG, which keeps every color and alpha."""

from __future__ import annotations

import os
from fractions import Fraction
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from passgraph.errors import InputError
from passgraph.files.animation import Animation
from passgraph.files.film import Film
from passgraph.files.frame import Frame, Source, Stored
from passgraph.files.names import WRITTEN_ANIMATIONS
from passgraph.files.stored import with_channels

if TYPE_CHECKING:
    from PIL.Image import Image

#: Units of time a second, and the fewest that players do not show for longer.
_UNITS = {"GIF": (100, 2), "PNG": (1000, 11)}
#: The largest number of two bytes: repetitions of a GIF, and hundredths of a second for one frame.
_MOST = 65_535
#: Colors of a frame; the entry behind them is transparent.
_COLORS = 255


class ToAnimation(Film):
    """Frames to one animated picture, which gets its name when it is complete.

    Parameters
    ----------
    path : .gif or .apng
    rate : frames a second of pictures; frames of an animation or a video keep their times

    Each frame of a GIF has 255 colors: its own if it has no more, else a dithered choice. Alpha is 0 or 1, split at
    one half. An .apng holds 8 bits a channel. All frames are in memory until the end. A frame that would be shown for
    less than 20 ms (in .apng 11 ms), which players show for longer, is dropped, and the one before it lasts longer.
    The animation repeats as often as the one it comes from, else without end.
    """

    kind = "an animation"

    def __init__(self, path: str | os.PathLike[str], *, rate: Fraction | None = None) -> None:
        super().__init__(path, rate)
        found = WRITTEN_ANIMATIONS.get(self.path.suffix.lower())
        if found is None:
            expected = " or ".join(WRITTEN_ANIMATIONS)
            raise InputError(f"{self.path}: unknown suffix {self.path.suffix!r} of an animation; expected {expected}")
        self._format = found

    def begin(self, source: Source) -> None:
        super().begin(source)
        self._plays = source.plays if isinstance(source, Animation) else 0
        #: The frames to write and when each begins, in the format's units; and when the last one ends.
        self._kept: list[tuple[int, Image]] = []
        self._end = Fraction(0)

    def in_bytes(self, source: Source) -> bool:
        return True

    def stores(self, frame: Frame, size: tuple[int, int]) -> np.dtype[Any]:
        self._check_size(frame, size)
        return np.dtype(np.uint8)

    def prepare(self, frame: Frame, picture: Stored) -> Image:
        from PIL import Image as pillow

        pixels = np.ascontiguousarray(with_channels(picture, 4))
        return _paletted(pixels) if self._format == "GIF" else pillow.fromarray(pixels)

    def take(self, frame: Frame, prepared: Image) -> None:
        units, least = _UNITS[self._format]
        start = self._start_of(frame)
        begins, self._end = round(start * units), start + self._length_of(frame)
        if not self._kept or begins - self._kept[-1][0] >= least:
            self._kept.append((begins, prepared))

    def finish(self) -> None:
        units, least = _UNITS[self._format]
        begins, pictures = zip(*self._kept, strict=True)
        ends = max(round(self._end * units), begins[-1] + least)
        lengths = [after - before for before, after in pairwise((*begins, ends))]
        if max(lengths) > _MOST:
            raise InputError(
                f"{self.path}: shows a frame for {max(lengths) / units:g} s; expected at most {_MOST / units:g} s; "
                "write a video, or give a higher --rate"
            )
        assert self._made is not None
        with self._made.temporary.open("xb") as stream:
            pictures[0].save(
                stream, self._format, save_all=True, append_images=pictures[1:],
                optimize=False,
                duration=[length * 1000 // units for length in lengths], **self._repeats(), **_disposal(pictures),
            )  # fmt: skip
        self._renamed()

    def _repeats(self) -> dict[str, int]:
        if self._format != "GIF":
            return {"loop": self._plays}
        return {} if self._plays == 1 else {"loop": min(self._plays - 1, _MOST) if self._plays else 0}

    def abandon(self) -> None:
        self._kept = []
        if self._made is not None:
            self._made.discard()
            self._made = None


def _disposal(pictures: tuple[Image, ...]) -> dict[str, int]:
    """Clear each frame of a GIF with transparent pixels, so that the one before does not show through."""
    has_holes = any("transparency" in picture.info and picture.getextrema()[1] == _COLORS for picture in pictures)
    return {"disposal": 2} if has_holes else {}


def _paletted(pixels: NDArray[np.uint8]) -> Image:
    """Return a picture (h, w, 4) with a palette; transparent pixels have its last entry."""
    from PIL import Image as pillow

    seen = pixels[..., 3] >= 128
    numbers = pixels[..., 0].astype(np.uint32) << 16 | pixels[..., 1].astype(np.uint32) << 8 | pixels[..., 2]
    own, places = np.unique(numbers[seen], return_inverse=True)
    indices = np.full(seen.shape, _COLORS, np.uint8)
    palette = np.zeros((_COLORS + 1, 3), np.uint8)
    if len(own) <= _COLORS:
        palette[: len(own)] = np.stack([own >> 16, own >> 8 & 255, own & 255], axis=-1)
        indices[seen] = places
    else:
        # Transparent pixels take part in no choice of colors.
        opaque = np.where(seen[..., None], pixels[..., :3], pixels[seen][0, :3])
        image = pillow.fromarray(np.ascontiguousarray(opaque))
        chosen = image.quantize(_COLORS, method=pillow.Quantize.MEDIANCUT)
        colors = np.array(chosen.getpalette(), np.uint8).reshape(-1, 3)[:_COLORS]
        palette[: len(colors)] = colors
        dithered = image.quantize(palette=chosen, dither=pillow.Dither.FLOYDSTEINBERG)
        indices[seen] = np.asarray(dithered)[seen]
    picture = pillow.fromarray(indices)
    picture.putpalette(palette.tobytes())
    picture.info["transparency"] = _COLORS
    return picture
