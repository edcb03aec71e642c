"""Textures: WebGPU's storage of each format."""

from __future__ import annotations

from dataclasses import field
from itertools import count
from typing import Any

from passgraph.formats import Format, float_format, format_spelling, padded
from passgraph.records import dataclass

#: Channel type (`Format.number`) → suffix of WebGPU's name.
_SPELLINGS = {"u1": "8unorm", "u2": "16unorm", "f2": "16float", "f4": "32float"}
_serials = count(1)


@dataclass(frozen=True, slots=True)
class Stored:
    """The storage of a format: WebGPU's name, and the format of the numbers in it."""

    name: str
    format: Format


def stored_as(format_: Format, has_norm16: bool) -> Stored:
    """Return the storage of a format.

    Three channels are stored as four, since no format of three can be drawn into; 16-bit normalized formats that a
    device lacks as float32, which is exact.

    >>> from passgraph.formats import FORMATS
    >>> stored_as(FORMATS["rgb16"], True).name, stored_as(FORMATS["rg16"], False).name
    ('rgba16unorm', 'rg32float')
    """
    if format_.is_depth:
        return Stored("depth32float-stencil8" if format_.stencil else "depth32float", format_)
    stored = padded(format_)
    if format_spelling(stored, _SPELLINGS, __file__) == "16unorm" and not has_norm16:
        stored = float_format(stored.channels)
    return Stored("rgba"[: stored.channels] + _SPELLINGS[stored.number], stored)


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
        return self.stored.format.channels > self.format.channels

    @property
    def readable(self) -> Texture:
        """Return the texture that holds the current content."""
        return self.values if self.is_uploaded and self.values is not None else self
