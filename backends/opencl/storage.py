"""Pictures on an OpenCL device: plain buffers in the layout of their format."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from passgraph.backends.base import FloatBlock
from passgraph.backends.steps import UNORM_ONE, steps_of
from passgraph.errors import InputError
from passgraph.formats import Format

DTYPES: dict[str, type[np.generic]] = {
    "float": np.float32,
    "depth": np.float32,
    "half": np.float16,
    "unorm8": np.uint8,
    "unorm16": np.uint16,
}


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
        return ImageLayout(self.format.kind, self.format.channels, self.size, self.format.srgb)


@dataclass(frozen=True)
class ImageLayout:
    """What generated code must know about a storage."""

    kind: str
    channels: int
    size: tuple[int, int]
    srgb: bool = False  # colours are encoded by the kernel; what is cleared must be encoded too

    @property
    def bytes(self) -> int:
        return self.size[0] * self.size[1] * self.channels * np.dtype(DTYPES[self.kind]).itemsize


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
    kind = storage.format.kind
    if kind in UNORM_ONE:
        return steps_of(array, kind)
    with np.errstate(over="ignore"):  # above 65504 a half is infinite
        return np.ascontiguousarray(array, DTYPES[kind])


def decode(stored: NDArray[Any], kind: str) -> FloatBlock:
    """Stored values as float32; unorm values are k / 255 or k / 65535, rounded once."""
    array: FloatBlock = stored.astype(np.float32, copy=False)
    return array / np.float32(UNORM_ONE[kind]) if kind in UNORM_ONE else array
