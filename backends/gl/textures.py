"""Textures: how each format is stored, and how pictures get there and back.

Pictures are quantised and expanded on the host, so that no driver's rounding takes part.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from passgraph.backends.base import FloatBlock, clear_colour
from passgraph.backends.steps import UNORM_ONE, steps_of
from passgraph.formats import Format

_TYPES: dict[str, tuple[int, Any]] = {
    "unorm8": (0x1401, np.uint8),
    "unorm16": (0x1403, np.uint16),
    "half": (0x140B, np.float16),
    "float": (0x1406, np.float32),
    "depth": (0x1406, np.float32),
}
_INTERNAL = {
    "unorm8": (0x8229, 0x822B, 0x8051, 0x8058),
    "unorm16": (0x822A, 0x822C, 0x8054, 0x805B),
    "half": (0x822D, 0x822F, 0x881B, 0x881A),
    "float": (0x822E, 0x8230, 0x8815, 0x8814),
}
_EXTERNAL = (0x1903, 0x8227, 0x1907, 0x1908)  # red, rg, rgb, rgba
_DEPTH_COMPONENT, _DEPTH_STENCIL, _FLOAT_AND_STENCIL = 0x1902, 0x84F9, 0x8DAD
_DEPTH32F, _DEPTH32F_STENCIL8 = 0x8CAC, 0x8CAD
#: One pixel of a depth-stencil picture as OpenGL hands it over.
_DEPTH_AND_STENCIL = np.dtype([("depth", np.float32), ("stencil", np.uint32)])


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
        return GLFormat(_DEPTH32F_STENCIL8, _DEPTH_STENCIL, _FLOAT_AND_STENCIL, _DEPTH_AND_STENCIL, 1)
    if format_.is_depth:
        return GLFormat(_DEPTH32F, _DEPTH_COMPONENT, 0x1406, np.float32, 1)
    channels = 4 if padded else format_.channels
    type_, dtype = _TYPES[format_.kind]
    return GLFormat(_INTERNAL[format_.kind][channels - 1], _EXTERNAL[channels - 1], type_, dtype, channels)


@dataclass(frozen=True, eq=False, slots=True)
class Texture:
    """One storage.  ``name`` is OpenGL's name of the texture, usable by others in the same context."""

    name: int
    format: Format
    size: tuple[int, int]
    gl_format: GLFormat

    @property
    def padded(self) -> bool:
        return self.gl_format.channels > self.format.channels


def encoded(picture: FloatBlock, texture: Texture) -> NDArray[Any]:
    """A host picture as the bytes of a texture: (h, w, channels) of the format's type."""
    width, height = texture.size
    values = np.ascontiguousarray(picture, np.float32).reshape(height, width, texture.format.channels)
    if texture.format.stencil:
        packed: NDArray[Any] = np.zeros((height, width), _DEPTH_AND_STENCIL)
        packed["depth"] = values[..., 0]
        return packed
    if texture.padded:
        values = np.concatenate([values, np.ones((height, width, 1), np.float32)], axis=-1)
    if texture.format.kind in UNORM_ONE:
        return steps_of(values, texture.format.kind)
    with np.errstate(over="ignore"):
        return np.ascontiguousarray(values.astype(texture.gl_format.dtype, copy=False))


def decoded(stored: NDArray[Any], texture: Texture) -> FloatBlock:
    """The bytes of a texture as a host picture."""
    if texture.format.stencil:
        return np.ascontiguousarray(stored["depth"][..., None])
    values = stored.astype(np.float32, copy=False)
    one = UNORM_ONE.get(texture.format.kind)
    if one is not None:
        values = values / np.float32(one)
    return np.ascontiguousarray(values[..., : texture.format.channels])


def stencil_of(stored: NDArray[Any]) -> NDArray[np.uint8]:
    return (stored["stencil"] & 0xFF).astype(np.uint8)


def empty(texture: Texture) -> NDArray[Any]:
    """Room for the bytes of a texture."""
    width, height = texture.size
    if texture.format.stencil:
        return np.empty((height, width), _DEPTH_AND_STENCIL)
    return np.empty((height, width, texture.gl_format.channels), texture.gl_format.dtype)


def stored_clear(value: tuple[float, ...], texture: Texture) -> NDArray[np.float32]:
    """A clear colour as four floats that the format holds exactly."""
    four = np.array([0, 0, 0, 1], np.float32)
    four[: texture.format.channels] = clear_colour(value, texture.format.channels, texture.format.srgb)
    one = UNORM_ONE.get(texture.format.kind)
    if one is not None:
        four = np.rint(np.clip(four, 0, 1) * np.float32(one)) / np.float32(one)
    elif texture.format.kind == "half":
        with np.errstate(over="ignore"):
            four = four.astype(np.float16).astype(np.float32)
    return np.ascontiguousarray(four, np.float32)
