"""Every OpenGL object of one backend, so that closing leaves none alive; framebuffers made when needed."""

from __future__ import annotations

import ctypes
from collections.abc import Sequence

from passgraph.backends.gl import functions as g
from passgraph.backends.gl.functions import Functions
from passgraph.backends.gl.surfaces import attach
from passgraph.backends.gl.textures import Surface, Texture
from passgraph.errors import BackendError

#: Sampler parameters: the mean of four texels, clamped to the edge, no comparison of depth.
_LINEAR = {0x2801: g.LINEAR, 0x2800: g.LINEAR, 0x2802: 0x812F, 0x2803: 0x812F, 0x884C: 0}


class Objects:
    """Names of live objects by kind."""

    def __init__(self, gl: Functions) -> None:
        self.gl = gl
        self.alive: set[tuple[str, int]] = set()
        self.framebuffers: dict[tuple[tuple[int, ...], int], int] = {}
        #: For pictures that are not ours, and how many are attached to it.
        self.for_foreign = self.attached = 0
        self._linear = self._table = 0

    def table(self) -> int:
        """A buffer for what one pass of a run counts; whoever uses it says what it holds."""
        if not self._table:
            self._table = self.new("Buffer")
        return self._table

    def linear_sampler(self) -> int:
        """In the place of a texture's own parameters: bilinear, clamped to the edge."""
        if not self._linear:
            self._linear = self.new("Sampler")
            for parameter, value in _LINEAR.items():
                self.gl.SamplerParameteri(self._linear, parameter, value)
            if self.gl.has.skips_decoding:
                self.gl.SamplerParameteri(self._linear, g.SRGB_DECODE, g.SKIP_DECODE)
        return self._linear

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
        self._linear = self._table = 0
        for kind, name in list(self.alive):
            self.delete(kind, name)

    def framebuffer(self, colours: Sequence[Texture], depth: Texture | None) -> int:
        """The framebuffer object over these textures."""
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
            raise BackendError(f"gl: this driver cannot draw into {formats} together (status {status:#x})")
        return name

    def _foreign_framebuffer(self, colours: Sequence[Texture]) -> int:
        """One framebuffer for all that is not ours, attached anew for each pass: the host may have deleted a texture,
        and the driver have given its name to another."""
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
            raise BackendError(f"gl: this driver cannot draw into the host's {formats} (status {status:#x})")
        return self.for_foreign

    def _attach(self, colours: Sequence[Texture]) -> int:
        """Have the bound framebuffer draw into these, and the first of its draw buffers."""
        count = max(1, len(colours))
        buffers = (ctypes.c_uint * count)(*(g.COLOR_ATTACHMENT0 + k for k in range(len(colours))))
        for point, texture in zip(buffers, colours, strict=False):
            attach(self.gl, g.FRAMEBUFFER, point, texture.surface or Surface("texture", texture.name))
        self.gl.DrawBuffers(count, buffers)
        return buffers[0]

    def detach(self) -> None:
        """Nothing of a host's stays attached to ours; the framebuffer for it is bound."""
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
