"""Frames to an animated picture: GIF, or APNG, which keeps every colour and alpha."""

from __future__ import annotations

import os
from fractions import Fraction
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from passgraph.errors import InputError
from passgraph.files import gif
from passgraph.files.animation import Animation
from passgraph.files.film import Film
from passgraph.files.frame import Frame, Source, Stored
from passgraph.files.names import WRITTEN_ANIMATIONS
from passgraph.files.stored import with_channels

if TYPE_CHECKING:
    from PIL.Image import Image


#: Units of a second that a format counts in, and the fewest of them that players do not show for longer.
_UNITS = {"GIF": (100, gif.LEAST), "PNG": (1000, 11)}
#: Colours of a GIF's frame.
_COLOURS = 256


class ToAnimation(Film):
    """Frames to one animated picture, which has its name when it is whole.

    Parameters
    ----------
    path : .gif or .apng
    rate : frames a second of pictures; frames of an animation or a video keep their times

    Each frame of a GIF has 256 colours: its own where it has no more, else the nearest of a choice, dithered; alpha is
    there or not, from one half on.  An .apng holds 8 bits of each channel.  Frames are in memory until the end.  One
    that would be shown for less than 20 ms (in .apng 11 ms), which players show for longer, is left out, and the frame
    before it lasts so much longer.  All are shown as often as those of the animation they come from, else without end.
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
        #: Pictures that are kept, and when each begins, in the format's units; and when the last one ends.
        self._kept: list[tuple[int, Image | gif.Paletted]] = []
        self._end = Fraction(0)

    def in_bytes(self, source: Source) -> bool:
        return True

    def stores(self, frame: Frame, size: tuple[int, int]) -> np.dtype[Any]:
        self._check_size(frame, size)
        return np.dtype(np.uint8)

    def prepare(self, frame: Frame, picture: Stored) -> Image | gif.Paletted:
        from PIL import Image as pillow

        pixels = np.ascontiguousarray(with_channels(picture, 4))
        return _of_few_colours(pixels) if self._format == "GIF" else pillow.fromarray(pixels)

    def take(self, frame: Frame, prepared: Image | gif.Paletted) -> None:
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
        assert self._made is not None
        with self._made.temporary.open("xb") as stream:
            if self._format == "GIF":
                gif.write_gif(stream, pictures, lengths, self._plays)
            else:
                more: dict[str, Any] = {"append_images": pictures[1:], "duration": lengths, "loop": self._plays}
                pictures[0].save(stream, "PNG", save_all=True, **more)
        self._renamed()

    def abandon(self) -> None:
        self._kept = []
        if self._made is not None:
            self._made.discard()
            self._made = None


def _of_few_colours(pixels: NDArray[np.uint8]) -> gif.Paletted:
    """A picture (h, w, 4) with a palette; one more entry is what cannot be seen."""
    from PIL import Image as pillow

    seen = pixels[..., 3] >= 128
    numbers = pixels[..., 0].astype(np.uint32) << 16 | pixels[..., 1].astype(np.uint32) << 8 | pixels[..., 2]
    own, places = np.unique(numbers[seen], return_inverse=True)
    most = _COLOURS - (0 if seen.all() else 1)
    if len(own) <= most:
        colours = np.stack([own >> 16, own >> 8 & 255, own & 255], axis=-1).astype(np.uint8)
        indices = np.full(seen.shape, len(own) % _COLOURS, np.uint8)
        indices[seen] = places
    else:
        # What is not seen takes part in no choice of colours.
        plain = np.where(seen[..., None], pixels[..., :3], pixels[seen][0, :3])
        image = pillow.fromarray(np.ascontiguousarray(plain))
        chosen = image.quantize(most, method=pillow.Quantize.MEDIANCUT)
        colours = np.array(chosen.getpalette(), np.uint8).reshape(-1, 3)[:most]
        dithered = image.quantize(palette=chosen, dither=pillow.Dither.FLOYDSTEINBERG)
        indices = np.where(seen, np.asarray(dithered), np.uint8(len(colours) % _COLOURS))
    return gif.Paletted(indices, colours, None if seen.all() else len(colours))
