"""Where pictures live, and how colour becomes what a target holds."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from passgraph.backends.base import quantised
from passgraph.formats import Format
from passgraph.srgb import linear_to_srgb, srgb_to_linear

Float32 = NDArray[np.float32]
Float64 = NDArray[np.float64]


@dataclass(eq=False)
class Storage:
    """A picture as stored: (height, width, channels) float32 with row 0 on top.

    ``stencil`` is (height, width) bytes, for formats that have one.
    """

    format: Format
    size: tuple[int, int]
    pixels: Float32
    stencil: NDArray[np.uint8] | None = None

    @classmethod
    def make(cls, format_: Format, size: tuple[int, int]) -> Storage:
        width, height = size
        stencil = np.zeros((height, width), np.uint8) if format_.stencil else None
        return cls(format_, size, np.zeros((height, width, format_.channels), np.float32), stencil)

    @property
    def flat(self) -> Float32:
        """The pixels row by row, (pixels, channels): a view."""
        return self.pixels.reshape(-1, self.format.channels)


def encode_srgb(linear: NDArray[Any]) -> Float64:
    """In float64, of [0, 1]; beyond is clamped."""
    return linear_to_srgb(np.clip(np.asarray(linear, np.float64), 0.0, 1.0))


def decode_srgb(encoded: NDArray[Any]) -> Float64:
    """In float64."""
    return srgb_to_linear(np.asarray(encoded, np.float64))


def stored(format_: Format, values: NDArray[Any]) -> Float32:
    """What a kernel's result (…, channels) becomes in a target: sRGB formats hold encoded colour."""
    if format_.srgb:
        values = np.concatenate([encode_srgb(values[..., :3]), values[..., 3:]], axis=-1)
    return quantised(values, format_)
