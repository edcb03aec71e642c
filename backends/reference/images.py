"""Pictures as kernels read them: border rule, sRGB decoding, missing channels."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from passgraph.backends.reference.storage import Float32, decode_srgb
from passgraph.language.borders import BORDERS, border_place
from passgraph.language.lower import ImageFacts

Ints = NDArray[np.int64]

#: What the channels that a picture lacks read as.
MISSING = (0.0, 0.0, 0.0, 1.0)


class SampledImage:
    """A stored picture (height, width, channels) under the facts of one pass."""

    def __init__(self, pixels: Float32, facts: ImageFacts) -> None:
        self.height, self.width, self.channels = pixels.shape
        self.border = facts.border
        self.texels: NDArray[Any] = pixels.reshape(-1, self.channels)
        if facts.decode is not None:
            # Decoded once for all reads; 0 decodes to 0, so the order with the border rule does not matter.
            colour = decode_srgb(self.texels[:, :3])
            self.texels = np.concatenate([colour, self.texels[:, 3:]], axis=1)

    def fetch(self, x: Ints, y: Ints) -> NDArray[np.float64]:
        """Texels at integer positions, (lanes, 4) float64."""
        place = border_place(self.border, y, self.height) * self.width + border_place(self.border, x, self.width)
        result = np.empty((len(place), 4), np.float64)
        result[:, : self.channels] = self.texels[place]
        result[:, self.channels :] = MISSING[self.channels :]
        if BORDERS[self.border].blank:
            outside = (x < 0) | (x >= self.width) | (y < 0) | (y >= self.height)
            result[np.broadcast_to(outside, place.shape), : self.channels] = 0.0
        return result

    def everything(self) -> NDArray[np.float64]:
        """All that a read can give, one a row."""
        inside = self.fetch(*np.divmod(np.arange(self.width * self.height), self.width)[::-1])
        outside = self.fetch(np.array([-1]), np.array([-1]))
        return np.concatenate([inside, outside])


def blank_image() -> SampledImage:
    """Stands in for an image that only dead code reads."""
    return SampledImage(np.zeros((1, 1, 4), np.float32), ImageFacts())
