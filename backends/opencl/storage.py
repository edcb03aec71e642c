"""Pictures on an OpenCL device: plain buffers in the layout of their format."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from passgraph.backends.base import FloatBlock
from passgraph.backends.steps import numbers_of
from passgraph.errors import InputError
from passgraph.formats import Format


@dataclass(eq=False)
class Storage:
    """Interleaved channels, rows from the top, without padding; the stencil in a buffer of its own."""

    format: Format
    size: tuple[int, int]
    buffer: Any
    stencil: Any = None
    released: bool = field(default=False, init=False)

    @property
    def shape(self) -> tuple[int, int, int]:
        return self.size[1], self.size[0], self.format.channels

    @cached_property
    def layout(self) -> ImageLayout:
        return ImageLayout(self.format, self.size)


@dataclass(frozen=True)
class ImageLayout:
    """What generated code must know about a storage."""

    format: Format
    size: tuple[int, int]

    @property
    def channels(self) -> int:
        return self.format.channels

    @property
    def bytes(self) -> int:
        return self.size[0] * self.size[1] * self.channels * self.format.bits // 8


def encode(picture: FloatBlock, storage: Storage) -> NDArray[Any]:
    """A host picture in a storage's layout, quantised to the nearest value, halves to even.

    Raises
    ------
    InputError
        When the shape is not that of the storage.
    """
    array = np.asarray(picture, np.float32)
    if array.shape != storage.shape:
        raise InputError(
            f"a picture of shape {array.shape} cannot go into {storage.format.name} of {storage.size[0]}x"
            f"{storage.size[1]} pixels; expected shape {storage.shape}"
        )
    return numbers_of(array, storage.format)
