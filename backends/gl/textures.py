"""Textures and framebuffers: storage formats, row order, and the objects to delete on close."""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from passgraph.backends.gl import gl_functions as g
from passgraph.backends.gl.gl_functions import Functions
from passgraph.errors import BackendError
from passgraph.formats import Format, format_spelling
from passgraph.records import dataclass


@dataclass(frozen=True, slots=True)
class Placement:
    """The layout of a picture in its texture, as far as shader text depends on it; the origin and size of a part are
    uniforms."""

    bottom_up: bool = False
    is_part: bool = False


PLAIN = Placement()


@dataclass(frozen=True, slots=True)
class Placements:
    """Placements of a pass: one for each image of the program, and one for all outputs."""

    images: tuple[Placement, ...] = ()
    output: Placement = PLAIN

    def placement(self, image: int) -> Placement:
        return self.images[image] if self.images else PLAIN


ALL_PLAIN = Placements()


def placements_of(outputs: Sequence[Texture], images: Sequence[Texture]) -> Placements:
    """Return the placements of a pass; ``ALL_PLAIN`` if every picture is plain."""
    for texture in (*outputs, *images):
        if texture.placement is not PLAIN:
            break
    else:
        return ALL_PLAIN
    return Placements(tuple([t.placement for t in images]), outputs[0].placement if outputs else PLAIN)


FLOAT_TYPE = 0x1406
#: Channel type (`Format.number`) → OpenGL's type, and internal formats of one to four channels.
_SPELLINGS: dict[str, tuple[int, tuple[int, ...]]] = {
    "u1": (0x1401, (0x8229, 0x822B, 0x8051, 0x8058)),
    "u2": (0x1403, (0x822A, 0x822C, 0x8054, 0x805B)),
    "f2": (0x140B, (0x822D, 0x822F, 0x881B, 0x881A)),
    "f4": (FLOAT_TYPE, (0x822E, 0x8230, 0x8815, 0x8814)),
}
RGBA = 0x1908
_EXTERNAL = (0x1903, 0x8227, 0x1907, RGBA)  # red, rg, rgb, rgba
#: Internal format, and format and type of transfers.
_DEPTHS = {"depth32f": (0x8CAC, 0x1902, FLOAT_TYPE), "depth32f_stencil8": (0x8CAD, 0x84F9, 0x8DAD)}
#: One pixel of a depth-stencil picture in OpenGL's transfer format.
DEPTH_AND_STENCIL = np.dtype([("depth", np.float32), ("stencil", np.uint32)])


@dataclass(frozen=True, slots=True)
class GLFormat:
    """OpenGL's constants for numbers of a format: internal format, and format and type of transfers."""

    stored: Format
    internal: int
    external: int
    type: int

    @property
    def dtype(self) -> np.dtype[Any]:
        """Return the type of one channel in transfers."""
        return DEPTH_AND_STENCIL if self.stored.stencil else np.dtype(self.stored.number)


@cache
def gl_format_of(format_: Format) -> GLFormat:
    if format_.is_depth:
        return GLFormat(format_, *_DEPTHS[format_.name])
    kind, internal = format_spelling(format_, _SPELLINGS, __file__)
    return GLFormat(format_, internal[format_.channels - 1], _EXTERNAL[format_.channels - 1], kind)


@dataclass(frozen=True, slots=True)
class Surface:
    """A framebuffer attachment: a level (and layer) of a texture, a renderbuffer, or a buffer of the window, which has
    no name."""

    kind: str  # "texture", "renderbuffer" or "window"
    name: int = 0
    target: int = 0x0DE1  # texture target
    level: int = 0
    layer: int = -1
    #: For the window: one of its buffers.
    buffer: int = 0x405


@dataclass(frozen=True, eq=False, slots=True)
class Texture:
    """A storage.  ``name`` is OpenGL's name of the texture, usable by other code in the same context.

    For foreign pictures (:mod:`passgraph.hosts.gl_pictures`) further fields describe the object and the picture in it.
    """

    name: int
    format: Format
    size: tuple[int, int]
    gl_format: GLFormat
    placement: Placement = PLAIN
    #: The picture's lower left pixel in the texture.
    origin: tuple[int, int] = (0, 0)
    #: The surface to draw into for a foreign picture; None for our own textures.
    surface: Surface | None = None
    #: Our sampler object that overrides the texture's parameters, or 0.
    sampler: int = 0

    @property
    def padded(self) -> bool:
        """Return True if three channels are stored as four, as the driver cannot draw into three."""
        return self.gl_format.stored.channels > self.format.channels


def with_stencil(depth: NDArray[np.float32]) -> NDArray[Any]:
    """Return a depth picture with a stencil of 0 in OpenGL's transfer format: (height, width, 1)."""
    packed: NDArray[Any] = np.zeros(depth.shape, DEPTH_AND_STENCIL)
    packed["depth"] = depth
    return packed


#: Framebuffer 0's buffers: names for drawing and reading → names of attachments.
WINDOW_BUFFERS = {0x404: 0x400, 0x405: 0x402, 0x400: 0x400, 0x402: 0x402}
DEPTH_OF_WINDOW = 0x1801
#: Texture targets of which one layer is attached.
_LAYERED = (0x8C1A, 0x806F, 0x9102, 0x9009)


def in_words(surface: Surface) -> str:
    return "framebuffer 0" if surface.kind == "window" else f"{surface.kind} {surface.name}"


def attachment_points(gl: Functions, surface: Surface) -> tuple[int, int]:
    """Return the attachment points of a surface for depth and for color."""
    if surface.kind == "window":
        if gl.has.is_es:  # it has one buffer to draw into, and no left and right
            return DEPTH_OF_WINDOW, surface.buffer
        return DEPTH_OF_WINDOW, WINDOW_BUFFERS.get(surface.buffer, surface.buffer)
    return g.DEPTH_ATTACHMENT, g.COLOR_ATTACHMENT0


def bind_surface(gl: Functions, target: int, scratch: int, surface: Surface, points: Sequence[int]) -> None:
    """Bind our framebuffer with a surface at these points; or framebuffer 0 for the window's buffers."""
    if surface.kind == "window":
        gl.BindFramebuffer(target, 0)
        return
    gl.BindFramebuffer(target, scratch)
    for point in points:
        attach(gl, target, point, surface)


def unbind_surface(gl: Functions, target: int, surface: Surface, points: Sequence[int]) -> None:
    """Detach the host's surface from our framebuffer."""
    if surface.kind != "window":
        for point in points:
            gl.FramebufferTexture2D(target, point, g.TEXTURE_2D, 0, 0)
    gl.BindFramebuffer(target, 0)


def attach(gl: Functions, target: int, point: int, surface: Surface) -> None:
    if surface.kind == "renderbuffer":
        gl.FramebufferRenderbuffer(target, point, g.RENDERBUFFER, surface.name)
    elif surface.layer >= 0 and surface.target in _LAYERED:
        gl.FramebufferTextureLayer(target, point, surface.name, surface.level, surface.layer)
    else:
        gl.FramebufferTexture2D(target, point, surface.target, surface.name, surface.level)


#: Sampler parameters: bilinear, no depth comparison.  The border's color is 0 by default.
_LINEAR = {0x2801: g.LINEAR, 0x2800: g.LINEAR, 0x884C: 0}
#: Border rule → wrap mode that means the same: to the edge, to the border's color, repeated, mirrored.
WRAP_MODES = {"clamp": 0x812F, "zero": 0x812D, "repeat": 0x2901, "mirror": 0x8370}


class Objects:
    """Names of live objects by kind."""

    def __init__(self, gl: Functions) -> None:
        self.gl = gl
        self.alive: set[tuple[str, int]] = set()
        self.framebuffers: dict[tuple[tuple[int, ...], int], int] = {}
        #: Framebuffer for foreign pictures, and its number of attachments.
        self.for_foreign = self.attached = 0
        self._table = 0
        self._linear: dict[str, int] = {}  # samplers by border rule

    def table(self) -> int:
        """Return a buffer for the counts of one pass of a run; the pass sets its content."""
        if not self._table:
            self._table = self.new("Buffer")
        return self._table

    def linear_sampler(self, border: str) -> int:
        """Return a sampler that overrides a texture's parameters: bilinear, with a border rule."""
        if border not in self._linear:
            sampler = self._linear[border] = self.new("Sampler")
            for parameter, value in {**_LINEAR, 0x2802: WRAP_MODES[border], 0x2803: WRAP_MODES[border]}.items():
                self.gl.SamplerParameteri(sampler, parameter, value)
            if self.gl.has.skips_decoding:
                self.gl.SamplerParameteri(sampler, g.SRGB_DECODE, g.SKIP_DECODE)
        return self._linear[border]

    def new(self, kind: str) -> int:
        name = self.gl.new(kind)
        self.alive.add((kind, name))
        return name

    def delete(self, kind: str, name: int) -> None:
        if (kind, name) in self.alive:
            self.alive.remove((kind, name))
            self.gl.delete(kind, name)

    def delete_all(self) -> None:
        self.framebuffers.clear()
        self._table = 0
        self._linear.clear()
        for kind, name in list(self.alive):
            self.delete(kind, name)

    def framebuffer(self, colours: Sequence[Texture], depth: Texture | None) -> int:
        """Return the framebuffer object with these attachments."""
        for texture in colours:
            if texture.surface is not None:
                return self._foreign_framebuffer(colours)
        key = (tuple([t.name for t in colours]), 0 if depth is None else depth.name)
        if key not in self.framebuffers:
            self.framebuffers[key] = self._make_framebuffer(colours, depth)
        return self.framebuffers[key]

    def _make_framebuffer(self, colours: Sequence[Texture], depth: Texture | None) -> int:
        gl, name = self.gl, self.new("Framebuffer")
        gl.BindFramebuffer(g.FRAMEBUFFER, name)
        if depth is not None:
            attachment = g.DEPTH_STENCIL_ATTACHMENT if depth.format.stencil else g.DEPTH_ATTACHMENT
            gl.FramebufferTexture2D(g.FRAMEBUFFER, attachment, g.TEXTURE_2D, depth.name, 0)
        gl.ReadBuffer(self._attach(colours))
        status = gl.CheckFramebufferStatus(g.FRAMEBUFFER)
        if status != g.FRAMEBUFFER_COMPLETE:
            self.delete("Framebuffer", name)
            formats = ", ".join(t.format.name for t in (*colours, *(() if depth is None else (depth,))))
            raise BackendError(f"{gl.backend}: this driver cannot draw into {formats} together (status {status:#x})")
        return name

    def _foreign_framebuffer(self, colours: Sequence[Texture]) -> int:
        """Return the framebuffer for foreign pictures, attached again for each pass: the host may have deleted a
        texture, and the driver may have reused its name."""
        gl, first = self.gl, colours[0].surface
        if first is not None and first.kind == "window":
            gl.BindFramebuffer(g.FRAMEBUFFER, 0)
            gl.draw_buffer(first.buffer)
            return 0
        if not self.for_foreign:
            self.for_foreign = self.new("Framebuffer")
        gl.BindFramebuffer(g.FRAMEBUFFER, self.for_foreign)
        self.detach()
        self._attach(colours)
        self.attached = len(colours)
        status = gl.CheckFramebufferStatus(g.FRAMEBUFFER)
        if status != g.FRAMEBUFFER_COMPLETE:
            formats = ", ".join(t.format.name for t in colours)
            raise BackendError(f"{gl.backend}: this driver cannot draw into the host's {formats} (status {status:#x})")
        return self.for_foreign

    def _attach(self, colours: Sequence[Texture]) -> int:
        """Attach these surfaces to the bound framebuffer, and select its draw buffers."""
        count = max(1, len(colours))
        buffers = (ctypes.c_uint * count)(*(g.COLOR_ATTACHMENT0 + k for k in range(len(colours))))
        for point, texture in zip(buffers, colours, strict=False):
            attach(self.gl, g.FRAMEBUFFER, point, texture.surface or Surface("texture", texture.name))
        self.gl.DrawBuffers(count, buffers)
        return buffers[0]

    def detach(self) -> None:
        """Detach the host's surfaces; their framebuffer is bound."""
        for k in range(self.attached):
            self.gl.FramebufferTexture2D(g.FRAMEBUFFER, g.COLOR_ATTACHMENT0 + k, g.TEXTURE_2D, 0, 0)
        self.attached = 0

    def forget(self, texture: Texture) -> None:
        """Delete a texture and the framebuffers over it."""
        for key, name in list(self.framebuffers.items()):
            if texture.name in key[0] or texture.name == key[1]:
                del self.framebuffers[key]
                self.delete("Framebuffer", name)
        self.delete("Texture", texture.name)
