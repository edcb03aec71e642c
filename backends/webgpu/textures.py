"""Textures: how WebGPU stores each format."""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import count
from typing import Any

import numpy as np

from passgraph.formats import Format, format_spelling

#: What a channel of a format holds (`Format.number`) → the ending of WebGPU's name, and that of NumPy's dtype.
_SPELLINGS = {
    "u1": ("8unorm", "u1"),
    "u2": ("16unorm", "u2"),
    "f2": ("16float", "f2"),
    "f4": ("32float", "f4"),
}
#: Three channels are stored as four; nothing else is drawn into.
_LETTERS = {1: "r", 2: "rg", 3: "rgba", 4: "rgba"}
_serials = count(1)


@dataclass(frozen=True, slots=True)
class Stored:
    """How a format is stored: WebGPU's name, and what one channel is in memory."""

    name: str
    dtype: np.dtype[Any]
    channels: int

    @property
    def steps(self) -> int:
        """Return the number by which the device divides what it reads; 0 for floats."""
        return int(np.iinfo(self.dtype).max) if self.dtype.kind == "u" else 0


def stored_as(format_: Format, has_norm16: bool) -> Stored:
    """A format that the device lacks is stored wider: 16-bit fractions as float32, which holds all of them.

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
    """One storage.

    Depth cannot be copied into a depth texture.  What was uploaded is in ``values``, a texture of float32, until a
    draw needs it as depth.
    """

    format: Format
    size: tuple[int, int]
    stored: Stored
    texture: Any
    view: Any
    #: What passes read: of depth with a stencil, the depth.
    read_view: Any
    values: Texture | None = None
    is_uploaded: bool = False
    #: Names it in caches of bind groups.
    serial: int = field(default_factory=_serials.__next__)

    @property
    def padded(self) -> bool:
        return self.stored.channels > self.format.channels

    @property
    def readable(self) -> Texture:
        """The texture that holds its content."""
        return self.values if self.is_uploaded and self.values is not None else self
