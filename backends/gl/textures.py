"""Textures: how each format is stored, and OpenGL's words for it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from passgraph.backends.base import clear_colour
from passgraph.backends.gl.placement import PLAIN, Placement
from passgraph.backends.steps import quantised
from passgraph.formats import Format

#: What a channel holds (`Format.number`) → OpenGL's type, and internal formats of one to four channels.
FLOAT_TYPE = 0x1406
_TYPES = {"u1": 0x1401, "u2": 0x1403, "f2": 0x140B, "f4": FLOAT_TYPE}
_INTERNAL = {
    "u1": (0x8229, 0x822B, 0x8051, 0x8058),
    "u2": (0x822A, 0x822C, 0x8054, 0x805B),
    "f2": (0x822D, 0x822F, 0x881B, 0x881A),
    "f4": (0x822E, 0x8230, 0x8815, 0x8814),
}
RGBA = 0x1908
_EXTERNAL = (0x1903, 0x8227, 0x1907, RGBA)  # red, rg, rgb, rgba
_DEPTH_COMPONENT, _DEPTH_STENCIL, _FLOAT_AND_STENCIL = 0x1902, 0x84F9, 0x8DAD
_DEPTH32F, _DEPTH32F_STENCIL8 = 0x8CAC, 0x8CAD
#: One pixel of a depth-stencil picture as OpenGL hands it over.
DEPTH_AND_STENCIL = np.dtype([("depth", np.float32), ("stencil", np.uint32)])


@dataclass(frozen=True, slots=True)
class GLFormat:
    """OpenGL's words for a storage format: internal format, and format and type of what goes in and out."""

    internal: int
    external: int
    type: int
    dtype: Any
    channels: int


def gl_format_of(format_: Format, padded: bool) -> GLFormat:
    """``padded``: three channels stored as four, where a driver cannot draw into three."""
    if format_.stencil:
        return GLFormat(_DEPTH32F_STENCIL8, _DEPTH_STENCIL, _FLOAT_AND_STENCIL, DEPTH_AND_STENCIL, 1)
    if format_.is_depth:
        return GLFormat(_DEPTH32F, _DEPTH_COMPONENT, FLOAT_TYPE, np.float32, 1)
    channels = 4 if padded else format_.channels
    number = format_.number
    internal = _INTERNAL[number][channels - 1]
    return GLFormat(internal, _EXTERNAL[channels - 1], _TYPES[number], np.dtype(number), channels)


@dataclass(frozen=True, slots=True)
class Surface:
    """Something that a framebuffer can have attached: a level (and layer) of a texture, a renderbuffer, or a buffer of
    the window, which has no name."""

    kind: str  # "texture", "renderbuffer" or "window"
    name: int = 0
    target: int = 0x0DE1  # what kind of texture
    level: int = 0
    layer: int = -1
    #: Of the window: which of its buffers.
    buffer: int = 0x405


@dataclass(frozen=True, eq=False, slots=True)
class Texture:
    """One storage.  ``name`` is OpenGL's name of the texture, usable by others in the same context.

    Of what is not ours (:mod:`passgraph.backends.gl.foreign`) the rest says what it is and how the picture lies in it.
    """

    name: int
    format: Format
    size: tuple[int, int]
    gl_format: GLFormat
    placement: Placement = PLAIN
    #: The picture's lowest left pixel, from the texture's.
    origin: tuple[int, int] = (0, 0)
    #: What is drawn into where it is not ours; None is our own texture.
    surface: Surface | None = None
    #: An own sampler object in the place of the texture's parameters, or 0.
    sampler: int = 0

    @property
    def padded(self) -> bool:
        return self.gl_format.channels > self.format.channels


def external_of(format_: Format, *, stencil: bool = True) -> tuple[int, int]:
    """OpenGL's format and type of what goes in and out: the channels that the format has, however it is stored; of a
    depth-stencil format both parts, or the depth alone."""
    if format_.is_depth and not stencil:
        return _DEPTH_COMPONENT, FLOAT_TYPE
    made = gl_format_of(format_, padded=False)
    return made.external, made.type


def with_stencil(depth: NDArray[np.float32]) -> NDArray[Any]:
    """A depth picture with a stencil of 0, as OpenGL takes both: (height, width, 1)."""
    packed: NDArray[Any] = np.zeros(depth.shape, DEPTH_AND_STENCIL)
    packed["depth"] = depth
    return packed


def stencil_of(stored: NDArray[Any]) -> NDArray[np.uint8]:
    return (stored["stencil"] & 0xFF).astype(np.uint8)


def stored_clear(value: tuple[float, ...], texture: Texture) -> NDArray[np.float32]:
    """A clear colour as four floats that the format holds exactly."""
    four = np.array([0, 0, 0, 1], np.float32)
    four[: texture.format.channels] = clear_colour(value, texture.format.channels, texture.format.srgb)
    return quantised(four, texture.format)
