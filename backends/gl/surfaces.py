"""Surfaces of a host at framebuffers of ours."""

from __future__ import annotations

from collections.abc import Sequence

from passgraph.backends.gl import functions as g
from passgraph.backends.gl.functions import Functions
from passgraph.backends.gl.textures import Surface

#: Framebuffer 0's buffers: the names that draw and read buffers have → the name that attachments have.
WINDOW_BUFFERS = {0x404: 0x400, 0x405: 0x402, 0x400: 0x400, 0x402: 0x402}
DEPTH_OF_WINDOW = 0x1801
#: Kinds of textures of which one layer is attached.
_LAYERED = (0x8C1A, 0x806F, 0x9102, 0x9009)


def in_words(surface: Surface) -> str:
    return "framebuffer 0" if surface.kind == "window" else f"{surface.kind} {surface.name}"


def attachment_points(gl: Functions, surface: Surface) -> tuple[int, int]:
    """Where a surface is attached for depth and for colour."""
    if surface.kind == "window":
        if gl.has.is_es:  # it has one buffer to draw into, and no left and right
            return DEPTH_OF_WINDOW, surface.buffer
        return DEPTH_OF_WINDOW, WINDOW_BUFFERS.get(surface.buffer, surface.buffer)
    return g.DEPTH_ATTACHMENT, g.COLOR_ATTACHMENT0


def bind_surface(gl: Functions, target: int, scratch: int, surface: Surface, points: Sequence[int]) -> None:
    """Bind a framebuffer of ours with a surface at these points; or framebuffer 0, which has the window's."""
    if surface.kind == "window":
        gl.BindFramebuffer(target, 0)
        return
    gl.BindFramebuffer(target, scratch)
    for point in points:
        attach(gl, target, point, surface)


def unbind_surface(gl: Functions, target: int, surface: Surface, points: Sequence[int]) -> None:
    """Nothing of the host's stays attached to ours."""
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
