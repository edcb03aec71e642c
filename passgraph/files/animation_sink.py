"""A sink that writes an animation with Pillow: GIF, or APNG, which keeps every color and alpha."""

from __future__ import annotations

import os
from fractions import Fraction
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from passgraph.color_tags import ColorSpace, Recoded
from passgraph.errors import InputError
from passgraph.files.animation import Animation
from passgraph.files.film import Film
from passgraph.files.frame import Frame, Source, Stored
from passgraph.files.names import WRITTEN_ANIMATIONS
from passgraph.files.sequences import source_metadata
from passgraph.files.stored import with_channels

if TYPE_CHECKING:
    from PIL.Image import Image

#: Units of time a second, and the shortest duration in them that players do not lengthen.
_UNITS = {"GIF": (100, 2), "PNG": (1000, 11)}
#: The largest 16-bit number: the limit of a GIF's repetitions, and of a frame's duration in units.
_MOST = 65_535
#: Most colors of a frame; the palette's entry after them is transparent.
_COLORS = 255


class ToAnimation(Film):
    """A sink that writes an animation, which appears under its name when it is complete.

    Parameters
    ----------
    path : .gif or .apng
    rate : frames a second of sources without times; frames of an animation or a video keep theirs
    color : the color space of the results, as for `passgraph.save`; by default an .apng keeps the source's profile

    A frame of a GIF has at most 255 colors; a frame with more is dithered to an adaptive palette. Its alpha is 0 or 1,
    with the threshold at one half. An .apng holds 8 bits a channel. All frames are in memory until the end. Players
    lengthen frames shorter than 20 ms (in .apng 11 ms), so such a frame is dropped and the one before it lasts longer.
    The animation repeats as often as the source animation, else endlessly.
    """

    kind = "an animation"

    def __init__(
        self,
        path: str | os.PathLike[str],
        *,
        rate: Fraction | None = None,
        color: ColorSpace | Recoded | str | None = None,
    ) -> None:
        super().__init__(path, rate)
        self.color = ColorSpace(color, color) if isinstance(color, str) else color
        format = WRITTEN_ANIMATIONS.get(self.path.suffix.lower())
        if format is None:
            expected = " or ".join(WRITTEN_ANIMATIONS)
            raise InputError(f"{self.path}: unknown suffix {self.path.suffix!r} of an animation; expected {expected}")
        self._format = format

    def begin(self, source: Source) -> None:
        super().begin(source)
        self._plays = source.plays if isinstance(source, Animation) else 0
        self._profile = b"" if self.color is not None or self._format == "GIF" else source_metadata(source).profile
        #: The start of each frame to write, in the format's units, and its picture.
        self._kept: list[tuple[int, Image]] = []
        #: The end of the last frame, in seconds.
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
        assert self._new_file is not None
        with self._new_file as new_file:
            with new_file.temporary.open("xb") as stream:
                pictures[0].save(
                    stream,
                    self._format,
                    save_all=True,
                    append_images=pictures[1:],
                    optimize=False,
                    duration=[length * 1000 // units for length in lengths],
                    **({"icc_profile": self._profile} if self._profile else {}),
                    **self._repeats(),
                    **_disposal(pictures),
                )
            self._complete_file()

    def _repeats(self) -> dict[str, int]:
        if self._format != "GIF":
            return {"loop": self._plays}
        return {} if self._plays == 1 else {"loop": min(self._plays - 1, _MOST) if self._plays else 0}

    def abandon(self) -> None:
        self._kept = []
        super().abandon()


def _disposal(pictures: tuple[Image, ...]) -> dict[str, int]:
    """Return options to clear each frame before the next if any has transparent pixels, which would show the last."""
    has_holes = any("transparency" in picture.info and picture.getextrema()[1] == _COLORS for picture in pictures)
    return {"disposal": 2} if has_holes else {}


def _paletted(pixels: NDArray[np.uint8]) -> Image:
    """Convert (h, w, 4) pixels to a paletted picture; transparent pixels get the last entry."""
    from PIL import Image as pillow

    visible = pixels[..., 3] >= 128
    numbers = pixels[..., 0].astype(np.uint32) << 16 | pixels[..., 1].astype(np.uint32) << 8 | pixels[..., 2]
    own_colors, own_indices = np.unique(numbers[visible], return_inverse=True)
    indices = np.full(visible.shape, _COLORS, np.uint8)
    palette = np.zeros((_COLORS + 1, 3), np.uint8)
    if len(own_colors) <= _COLORS:
        palette[: len(own_colors)] = np.stack([own_colors >> 16, own_colors >> 8 & 255, own_colors & 255], axis=-1)
        indices[visible] = own_indices
    else:
        # Transparent pixels must not influence the palette.
        opaque = np.where(visible[..., None], pixels[..., :3], pixels[visible][0, :3])
        image = pillow.fromarray(np.ascontiguousarray(opaque))
        quantized = image.quantize(_COLORS, method=pillow.Quantize.MEDIANCUT)
        colors = np.array(quantized.getpalette(), np.uint8).reshape(-1, 3)[:_COLORS]
        palette[: len(colors)] = colors
        dithered = image.quantize(palette=quantized, dither=pillow.Dither.FLOYDSTEINBERG)
        indices[visible] = np.asarray(dithered)[visible]
    picture = pillow.fromarray(indices)
    picture.putpalette(palette.tobytes())
    picture.info["transparency"] = _COLORS
    return picture
