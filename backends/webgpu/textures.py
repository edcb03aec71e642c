"""Textures: WebGPU's storage of each format."""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import count
from typing import Any

import numpy as np

from passgraph.formats import Format, format_spelling

#: Channel type (`Format.number`) → suffix of WebGPU's name, and of NumPy's dtype.
_SPELLINGS = {
    "u1": ("8unorm", "u1"),
    "u2": ("16unorm", "u2"),
    "f2": ("16float", "f2"),
    "f4": ("32float", "f4"),
}
#: Three channels are stored as four, since no three-channel format can be drawn into.
_LETTERS = {1: "r", 2: "rg", 3: "rgba", 4: "rgba"}
_serials = count(1)


@dataclass(frozen=True, slots=True)
class Stored:
    """The storage of a format: WebGPU's name, and the type of a channel in memory."""

    name: str
    dtype: np.dtype[Any]
    channels: int

    @property
    def steps(self) -> int:
        """Return the number by which the device divides what it reads; 0 for floats."""
        return int(np.iinfo(self.dtype).max) if self.dtype.kind == "u" else 0


def stored_as(format_: Format, has_norm16: bool) -> Stored:
    """Return the storage of a format; 16-bit normalized formats that a device lacks are stored as float32, which is
    exact.

    >>> from passgraph.formats import FORMATS
    >>> stored_as(FORMATS["rgb16"], True).name, stored_as(FORMATS["rg16"], False).name
    ('rgba16unorm', 'rg32float')
    """
    if format_.is_depth:
        name = "depth32float-stencil8" if format_.stencil else "depth32float"
        return Stored(name, np.dtype(np.float32), 1)
    ending, dtype = format_spelling(format_, _SPELLINGS, __file__)
    if ending == "16unorm" and not has_norm16:
        ending, dtype = _SPELLINGS["f4"]
    letters = _LETTERS[format_.channels]
    return Stored(letters + ending, np.dtype(dtype), len(letters))


@dataclass(eq=False, slots=True)
class Texture:
    """A storage.

    Nothing can be copied into a depth texture, so uploads go to ``values``, a float32 texture, until a draw needs them
    as depth.
    """

    format: Format
    size: tuple[int, int]
    stored: Stored
    texture: Any
    view: Any
    #: The view that passes read: for a depth-stencil format, the depth.
    read_view: Any
    values: Texture | None = None
    is_uploaded: bool = False
    #: Key in caches of bind groups.
    serial: int = field(default_factory=_serials.__next__)

    @property
    def padded(self) -> bool:
        return self.stored.channels > self.format.channels

    @property
    def readable(self) -> Texture:
        """Return the texture that holds the current content."""
        return self.values if self.is_uploaded and self.values is not None else self
