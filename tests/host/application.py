"""A program of somebody else's with an OpenGL context of its own: pictures of every kind that an engine keeps."""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from passgraph.backends.gl import gl_functions as g
from passgraph.backends.gl.context import Current
from passgraph.backends.gl.gl_functions import Functions
from passgraph.backends.gl.windowing import function

RGBA, RED, RG, RGB, BYTES, FLOATS, HALVES, SHORTS = 0x1908, 0x1903, 0x8227, 0x1907, 0x1401, 0x1406, 0x140B, 0x1403
INTS = 0x1405
DEPTH, RENDERBUFFER = 0x1902, 0x8D41
SIZE = (23, 17)
WIDTH, HEIGHT = SIZE


#: Of a context: the compatibility profile, as most windows have it; no reports of errors (KHR_no_error).
COMPATIBLE, NO_ERROR = (0x30FD, 2), (0x30FD, 1, 0x31B3, 1)


class _Other:
    """A context with other attributes in the place of one of ours."""

    def __init__(self, core: Any, asked: tuple[int, ...]) -> None:
        self.core, self.load_opengl_function = core, core.load_opengl_function
        self.current = Current()
        state = self.current.state()
        assert state is not None and self.current.egl is not None
        make = function(self.current.egl._library, "eglCreateContext", *[ctypes.c_void_p] * 5)
        attributes = (0x3098, 3, 0x30FB, 3, *asked, 0x3038)
        made = make(state.display, None, None, (ctypes.c_int * len(attributes))(*attributes))
        assert made
        self.state = replace(state, context=made)
        self.__enter__()

    def __enter__(self) -> None:
        self.current.change(self.current.state(), self.state)

    def release(self) -> None:
        assert self.current.egl is not None
        self.current.egl.make(replace(self.state, context=None))
        self.current.egl.destroy(self.state, self.state.context)
        self.core.release()


class Application:
    """Its context is current in this thread from here on; ``close`` ends it."""

    def __init__(self, native: Any = None, compatible: bool = False, asked: tuple[int, ...] = ()) -> None:
        import glcontext  # type: ignore[import-untyped]

        self.native: Any = native or glcontext.get_backend_by_name("egl")(glversion=330, mode="standalone")
        if compatible or asked:
            self.native = _Other(self.native, asked or COMPATIBLE)
        self.gl = Functions(self.native.load_opengl_function)
        make = ctypes.CFUNCTYPE
        u, i, p = ctypes.c_uint, ctypes.c_int, ctypes.c_void_p
        self.RenderbufferStorageMultisample = make(None, u, i, u, i, i)(
            self.native.load_opengl_function("glRenderbufferStorageMultisample")
        )
        self.make_samples = make(None, u, i, u, i, i, ctypes.c_ubyte)(
            self.native.load_opengl_function("glTexImage2DMultisample")
        )
        self.TexImage3D = make(None, u, i, i, i, i, i, i, u, u, p)(self.native.load_opengl_function("glTexImage3D"))
        #: Texture → a framebuffer over it.
        self.objects: dict[int, int] = {}

    def enter(self) -> None:
        self.native.__enter__()

    def close(self) -> None:
        self.native.release()

    def texture(
        self, internal: int, external: int, type_: int, rows: NDArray[Any] | None, size: tuple[int, int] = SIZE,
        target: int = g.TEXTURE_2D, level: int = 0,
    ) -> int:  # fmt: skip
        """A texture; ``rows`` from the top, which OpenGL gets from the bottom."""
        gl, name = self.gl, self.gl.new("Texture")
        gl.BindTexture(target, name)
        gl.PixelStorei(0xCF5, 1)
        data = None if rows is None else np.ascontiguousarray(rows[::-1])
        for k in range(level + 1):
            width, height = (max(1, side << (level - k)) for side in size)
            last = k == level and data is not None
            gl.TexImage2D(target, k, internal, width, height, 0, external, type_, data.ctypes.data if last else None)  # type: ignore[union-attr]
        if level:
            gl.TexParameteri(target, 0x813C, level)  # the base level
        # As engines have it: what would spoil a pass that used their parameters.
        gl.TexParameteri(target, 0x2801, 0x2601 if target != g.TEXTURE_2D else 0x2703)
        gl.TexParameteri(target, 0x2800, 0x2601)
        gl.PixelStorei(0xCF5, 4)
        gl.BindTexture(target, 0)
        return name

    def layer(self, rows: NDArray[Any]) -> int:
        """The second of three layers of an array, RGBA8."""
        gl, name = self.gl, self.gl.new("Texture")
        data = np.zeros((3, HEIGHT, WIDTH, 4), np.uint8)
        data[1] = rows[::-1]
        gl.BindTexture(0x8C1A, name)
        self.TexImage3D(0x8C1A, 0, 0x8058, WIDTH, HEIGHT, 3, 0, RGBA, BYTES, data.ctypes.data)
        gl.BindTexture(0x8C1A, 0)
        return name

    def framebuffer(self, attach: Callable[[], None], depth: bool = False) -> int:
        gl, name = self.gl, self.gl.new("Framebuffer")
        gl.BindFramebuffer(g.FRAMEBUFFER, name)
        attach()
        if depth:
            gl.DrawBuffers(1, (ctypes.c_uint * 1)(0))
            gl.ReadBuffer(0)
        assert gl.CheckFramebufferStatus(g.FRAMEBUFFER) == g.FRAMEBUFFER_COMPLETE
        return name

    def of_texture(self, name: int, target: int = g.TEXTURE_2D, level: int = 0, depth: int = 0) -> int:
        """A framebuffer that draws into a texture; ``depth``: at that attachment."""
        point = depth or g.COLOR_ATTACHMENT0
        return self.framebuffer(
            lambda: self.gl.FramebufferTexture2D(g.FRAMEBUFFER, point, target, name, level), depth != 0
        )

    def of_layer(self, name: int, layer: int) -> int:
        attach = self.gl.FramebufferTextureLayer
        return self.framebuffer(lambda: attach(g.FRAMEBUFFER, g.COLOR_ATTACHMENT0, name, 0, layer))

    def of_renderbuffer(self, internal: int, source: int, samples: int = 0, depth: int = 0) -> int:
        """One over a renderbuffer that holds what framebuffer ``source`` does."""
        gl, name = self.gl, ctypes.c_uint(0)
        make = ctypes.CFUNCTYPE(None, ctypes.c_int, ctypes.c_void_p)(
            self.native.load_opengl_function("glGenRenderbuffers")
        )
        make(1, ctypes.byref(name))
        gl.BindRenderbuffer(RENDERBUFFER, name.value)
        self.RenderbufferStorageMultisample(RENDERBUFFER, samples, internal, WIDTH, HEIGHT)
        gl.BindRenderbuffer(RENDERBUFFER, 0)
        point = depth or g.COLOR_ATTACHMENT0
        made = self.framebuffer(
            lambda: gl.FramebufferRenderbuffer(g.FRAMEBUFFER, point, RENDERBUFFER, name.value), depth != 0
        )
        self.blit(source, made, depth != 0)
        return made

    def of_samples(self, internal: int, source: int) -> int:
        """One over a texture of four samples a pixel that holds what framebuffer ``source`` does."""
        gl, name = self.gl, self.gl.new("Texture")
        gl.BindTexture(0x9100, name)
        self.make_samples(0x9100, 4, internal, WIDTH, HEIGHT, 1)
        gl.BindTexture(0x9100, 0)
        made = self.of_texture(name, 0x9100)
        self.blit(source, made, False)
        return made

    def blit(self, source: int, destination: int, depth: bool) -> None:
        gl = self.gl
        gl.BindFramebuffer(g.READ_FRAMEBUFFER, source)
        gl.BindFramebuffer(g.DRAW_FRAMEBUFFER, destination)
        bits = g.DEPTH_BUFFER_BIT if depth else g.COLOR_BUFFER_BIT
        gl.BlitFramebuffer(0, 0, WIDTH, HEIGHT, 0, 0, WIDTH, HEIGHT, bits, g.NEAREST)
        gl.BindFramebuffer(g.FRAMEBUFFER, destination)
        gl.check("blitting")

    def pixels(self, framebuffer: int, type_: int = BYTES, size: tuple[int, int] = SIZE) -> NDArray[Any]:
        """What a framebuffer of one sample holds, RGBA, rows from the top."""
        gl = self.gl
        gl.BindFramebuffer(g.READ_FRAMEBUFFER, framebuffer)
        gl.ReadBuffer(g.COLOR_ATTACHMENT0)
        read = np.zeros((*size[::-1], 4), np.uint8 if type_ == BYTES else np.float32)
        gl.PixelStorei(0xD05, 1)
        gl.ReadPixels(0, 0, *size, RGBA, type_, read.ctypes.data)
        gl.PixelStorei(0xD05, 4)
        gl.check("reading")
        return read[::-1]


@dataclass(frozen=True)
class Kept:
    """A picture that an application keeps, and what a kernel is to read of it."""

    framebuffer: int
    values: NDArray[np.float32]
    format: str
    depth: bool = False


def _noise(channels: int, dtype: Any) -> NDArray[Any]:
    random = np.random.default_rng(7)
    shape = (HEIGHT, WIDTH, channels)
    if np.dtype(dtype).kind == "u":
        return random.integers(0, np.iinfo(dtype).max + 1, shape, dtype)
    return random.normal(0.3, 2.0, shape).astype(dtype)


def _coloured(format_: str, internal: int, external: int, type_: int, dtype: Any, channels: int) -> Any:
    def make(app: Application) -> Kept:
        rows = _noise(channels, dtype)
        values = rows / np.float32(np.iinfo(dtype).max) if rows.dtype.kind == "u" else rows
        name = app.texture(internal, external, type_, rows)
        return Kept(app.of_texture(name), values.astype(np.float32), format_)

    return make


def _through(change: Callable[[Application, int], int], format_: str = "rgba8", internal: int = 0x8058) -> Any:
    """RGBA8 that comes there by a blit."""

    def make(app: Application) -> Kept:
        rows = _noise(4, np.uint8)
        if format_ == "rgb8":
            rows[..., 3] = 255
        source = app.of_texture(app.texture(0x8058, RGBA, BYTES, rows))
        values = (rows / np.float32(255)).astype(np.float32)
        return Kept(change(app, source), values[..., :3] if format_ == "rgb8" else values, format_)

    return make


def _depths(internal: int, attachment: int, bits: int, kind: str = "texture", samples: int = 0) -> Any:
    def make(app: Application) -> Kept:
        external, type_ = {0x88F0: (0x84F9, 0x84FA), 0x8CAC: (DEPTH, FLOATS)}.get(internal, (DEPTH, INTS))
        values = np.random.default_rng(3).random((HEIGHT, WIDTH, 1), np.float32)
        if bits < 32:
            steps = np.float64(2**bits - 1)
            values = (np.round(values * steps) / steps).astype(np.float32)
        rows: NDArray[Any] = values
        if type_ == INTS:
            rows = np.round(values.astype(np.float64) * (2**32 - 1)).astype(np.uint32)
        if internal == 0x88F0:
            rows = (np.round(values.astype(np.float64) * (2**24 - 1)).astype(np.uint32) << 8) | 5
        made = app.of_texture(app.texture(internal, external, type_, rows), depth=attachment)
        if kind == "renderbuffer":
            made = app.of_renderbuffer(internal, made, samples, depth=attachment)
        return Kept(made, values, "r32f", depth=True)

    return make


def _rectangle(app: Application) -> Kept:
    rows = _noise(4, np.uint8)
    name = app.texture(0x8058, RGBA, BYTES, rows, target=0x84F5)
    return Kept(app.of_texture(name, 0x84F5), (rows / np.float32(255)).astype(np.float32), "rgba8")


def _levelled(app: Application) -> Kept:
    rows = _noise(4, np.uint8)
    name = app.texture(0x8058, RGBA, BYTES, rows, level=2)
    return Kept(app.of_texture(name, level=2), (rows / np.float32(255)).astype(np.float32), "rgba8")


def _layered(app: Application) -> Kept:
    rows = _noise(4, np.uint8)
    return Kept(app.of_layer(app.layer(rows), 1), (rows / np.float32(255)).astype(np.float32), "rgba8")


def _tens(app: Application) -> Kept:
    whole = np.random.default_rng(5).integers(0, 2**32, (HEIGHT, WIDTH, 1), np.uint32)
    parts = [((whole >> (10 * k)) & 1023) / np.float32(1023) for k in range(3)] + [(whole >> 30) / np.float32(3)]
    name = app.texture(0x8059, RGBA, 0x8368, whole)
    return Kept(app.of_texture(name), np.concatenate(parts, axis=2).astype(np.float32), "rgba32f")


#: Name → what makes it.
KEPT: dict[str, Callable[[Application], Kept]] = {
    "RGBA8": _coloured("rgba8", 0x8058, RGBA, BYTES, np.uint8, 4),
    "RGB8": _coloured("rgb8", 0x8051, RGB, BYTES, np.uint8, 3),
    "R8": _coloured("r8", 0x8229, RED, BYTES, np.uint8, 1),
    "RG16": _coloured("rg16", 0x822C, RG, SHORTS, np.uint16, 2),
    "RGBA16F": _coloured("rgba16f", 0x881A, RGBA, HALVES, np.float16, 4),
    "RGBA32F": _coloured("rgba32f", 0x8814, RGBA, FLOATS, np.float32, 4),
    "unsized RGBA": _coloured("rgba8", RGBA, RGBA, BYTES, np.uint8, 4),
    "unsized RGB": _coloured("rgb8", RGB, RGB, BYTES, np.uint8, 3),
    "10 bits": _tens,
    "a rectangle": _rectangle,
    "a level of a mip chain": _levelled,
    "a layer of an array": _layered,
    "a renderbuffer": _through(lambda app, source: app.of_renderbuffer(0x8058, source)),
    "a renderbuffer of four samples": _through(lambda app, source: app.of_renderbuffer(0x8058, source, 4)),
    "a texture of four samples": _through(lambda app, source: app.of_samples(0x8058, source)),
    "depth 16": _depths(0x81A5, g.DEPTH_ATTACHMENT, 16),
    "depth 24": _depths(0x81A6, g.DEPTH_ATTACHMENT, 24),
    "depth 24 stencil 8": _depths(0x88F0, g.DEPTH_STENCIL_ATTACHMENT, 24),
    "depth 32F": _depths(0x8CAC, g.DEPTH_ATTACHMENT, 32),
    "unsized depth": _depths(0x1902, g.DEPTH_ATTACHMENT, 24),
    "depth 16 in a renderbuffer": _depths(0x81A5, g.DEPTH_ATTACHMENT, 16, "renderbuffer"),
    "depth 24 stencil 8 in a renderbuffer": _depths(0x88F0, g.DEPTH_STENCIL_ATTACHMENT, 24, "renderbuffer"),
    "depth 24 of four samples": _depths(0x81A6, g.DEPTH_ATTACHMENT, 24, "renderbuffer", 4),
}
