"""A program of somebody else's with an OpenGL ES context of its own, made through EGL."""

from __future__ import annotations

import ctypes
import ctypes.util
from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from passgraph.backends.gl import gl_functions as g
from tests.host.application import BYTES, DEPTH, HEIGHT, INTS, RGBA, SIZE, WIDTH, Application
from tests.host.hostile import STATES, More, use_program

_HANDLE, _NUMBER = ctypes.c_void_p, ctypes.c_int
_SURFACELESS, _ES_API, _NONE = 0x31DD, 0x30A0, 0x3038
#: A pbuffer, OpenGL ES 3, eight bits a channel, 24 of depth, 8 of stencil.
_WANTED = (0x3033, 1, 0x3040, 0x40, 0x3024, 8, 0x3023, 8, 0x3022, 8, 0x3021, 8, 0x3025, 24, 0x3026, 8, _NONE)


def _egl(name: str, result: Any, *arguments: Any) -> Callable[..., Any]:
    library = ctypes.CDLL(ctypes.util.find_library("EGL"))
    return ctypes.CFUNCTYPE(result, *arguments)((name, library))


def _list(*numbers: int) -> Any:
    return (_NUMBER * len(numbers))(*numbers)


@cache
def _display() -> int:
    """One for all: it stays when contexts go."""
    get = _egl("eglGetPlatformDisplay", _HANDLE, ctypes.c_uint, _HANDLE, _HANDLE)
    display: int = get(_SURFACELESS, None, None)
    assert _egl("eglInitialize", ctypes.c_uint, _HANDLE, _HANDLE, _HANDLE)(display, None, None)
    return display


class EsContext:
    """What :class:`Application` runs in: OpenGL ES, drawing to a surface of 23x17 pixels.  ``asked`` is the version
    that is asked for, of which drivers make the newest that can do the same."""

    def __init__(self, asked: int = 3) -> None:
        display, config, count = _display(), _HANDLE(), _NUMBER(0)
        _egl("eglBindAPI", ctypes.c_uint, ctypes.c_uint)(_ES_API)
        choose = _egl("eglChooseConfig", ctypes.c_uint, _HANDLE, _HANDLE, _HANDLE, _NUMBER, _HANDLE)
        assert choose(display, _list(*_WANTED), ctypes.byref(config), 1, ctypes.byref(count)) and count.value
        make = _egl("eglCreateContext", _HANDLE, _HANDLE, _HANDLE, _HANDLE, _HANDLE)
        self.context = make(display, config, None, _list(0x3098, asked, _NONE))
        surface = _egl("eglCreatePbufferSurface", _HANDLE, _HANDLE, _HANDLE, _HANDLE)
        self.surface = surface(display, config, _list(0x3057, WIDTH, 0x3056, HEIGHT, _NONE))
        assert self.context and self.surface
        self.__enter__()

    def __enter__(self) -> None:
        make = _egl("eglMakeCurrent", ctypes.c_uint, *[_HANDLE] * 4)
        assert make(_display(), self.surface, self.surface, self.context)

    def release(self) -> None:
        _egl("eglMakeCurrent", ctypes.c_uint, *[_HANDLE] * 4)(_display(), None, None, None)
        _egl("eglDestroyContext", ctypes.c_uint, _HANDLE, _HANDLE)(_display(), self.context)
        _egl("eglDestroySurface", ctypes.c_uint, _HANDLE, _HANDLE)(_display(), self.surface)

    def load_opengl_function(self, name: str) -> int:
        return _egl("eglGetProcAddress", _HANDLE, ctypes.c_char_p)(name.encode()) or 0


class EsApplication(Application):
    """What OpenGL ES does otherwise than desktop OpenGL."""

    def __init__(self, asked: int = 3) -> None:
        super().__init__(native=EsContext(asked))
        u, i = ctypes.c_uint, ctypes.c_int
        self.make_samples = ctypes.CFUNCTYPE(None, u, i, u, i, i, ctypes.c_ubyte)(
            self.native.load_opengl_function("glTexStorage2DMultisample")
        )
        self.Scissor = ctypes.CFUNCTYPE(None, i, i, i, i)(self.native.load_opengl_function("glScissor"))

    def blit(self, source: int, destination: int, depth: bool) -> None:
        """Into several samples a pixel it is not allowed: there each pixel is cleared to what it is to hold."""
        gl = self.gl
        gl.BindFramebuffer(g.DRAW_FRAMEBUFFER, destination)
        if not gl.integer(0x80A9):
            super().blit(source, destination, depth)
            return
        values = self.depths(source) if depth else self.pixels(source)[::-1] / np.float32(255)
        gl.BindFramebuffer(g.FRAMEBUFFER, destination)
        gl.Enable(0xC11)
        for y, x in np.ndindex(HEIGHT, WIDTH):
            self.Scissor(x, y, 1, 1)
            value = np.ascontiguousarray(values[y, x], np.float32)
            gl.ClearBufferfv(g.DEPTH if depth else g.COLOR, 0, value.ctypes.data)
        gl.Disable(0xC11)
        gl.check("filling several samples")

    def depths(self, framebuffer: int) -> NDArray[np.float32]:
        """Rows from the bottom; by an extension of Mesa's."""
        gl, read = self.gl, np.zeros((HEIGHT, WIDTH, 1), np.uint32)
        gl.BindFramebuffer(g.READ_FRAMEBUFFER, framebuffer)
        gl.ReadPixels(0, 0, *SIZE, DEPTH, INTS, read.ctypes.data)
        gl.check("reading depth")
        return (read / np.float64(2**32 - 1)).astype(np.float32)

    def window(self, rows: NDArray[Any]) -> int:
        """Fill framebuffer 0."""
        self.blit(self.of_texture(self.texture(0x8058, RGBA, BYTES, rows)), 0, False)
        return 0

    def pixels(self, framebuffer: int, type_: int = BYTES, size: tuple[int, int] = SIZE) -> NDArray[Any]:
        if framebuffer:
            return super().pixels(framebuffer, type_, size)
        read = np.zeros((*size[::-1], 4), np.uint8)
        self.gl.BindFramebuffer(g.READ_FRAMEBUFFER, 0)
        self.gl.ReadPixels(0, 0, *size, RGBA, BYTES, read.ctypes.data)
        self.gl.check("reading")
        return read[::-1]


def _extension(name: str, *arguments: Any) -> Any:
    address = _egl("eglGetProcAddress", _HANDLE, ctypes.c_char_p)(name.encode())
    return ctypes.CFUNCTYPE(None, *arguments)(address)


def _blending_apart(app: Application, more: More) -> None:
    gl = app.gl
    if gl.Enablei is not None:
        gl.Disablei(0xBE2, 1)
        for buffer in range(8):
            gl.BlendFuncSeparatei(buffer, 0x302 + buffer % 3, 0x303, 1, buffer % 2)
            gl.BlendEquationSeparatei(buffer, 0x8006, 0x800A + buffer % 2)
            gl.ColorMaski(buffer, buffer & 1, buffer >> 1 & 1, buffer >> 2 & 1, 1)


def _viewports(app: Application, more: More) -> None:
    gl, four = app.gl, ctypes.c_float
    gl.Viewport(3, 2, 5, 4)
    gl.depth_range(0.25, 0.5)
    if gl.ViewportIndexedf is not None:
        for k in range(16):
            gl.ViewportIndexedf(k, 1.5 * k, 2.25, 3.0 + k, 4.5)
        _extension("glEnableiOES", ctypes.c_uint, ctypes.c_uint)(0xC11, 3)
        _extension("glDepthRangeIndexedfOES", ctypes.c_uint, four, four)(0, 0.25, 0.75)


def _clear_values(app: Application, more: More) -> None:
    more.ClearColor(0.5, 0.25, 1.0, 0.0)
    more.ClearStencil(7)
    _extension("glClearDepthf", ctypes.c_float)(0.25)


def _scissor(app: Application, more: More) -> None:
    app.gl.Enable(0xC11)
    _extension("glScissor", *[ctypes.c_int] * 4)(1, 1, 1, 1)


_SHADERS = (b"#version 300 es\nin vec4 a; uniform mat4 m; void main() { gl_Position = m * a; }",
            b"#version 300 es\nprecision highp float; uniform sampler2D s; out vec4 o;"
            b"void main() { o = texture(s, vec2(0)); }")  # fmt: skip
#: Of :data:`STATES` what OpenGL ES has.  What a context lacks of it is an error that is drained.
ES_STATES: dict[str, Callable[[Application, More], Any]] = {
    **{name: change for name, change in STATES.items() if name not in (
        "scissor of one viewport", "colour masks apart", "lines", "points", "logic operation", "smoothing",
        "provoking vertex", "seamless cubes and point size",
    )},
    "scissor": _scissor,
    "viewports": _viewports,
    "blending apart": _blending_apart,
    "sRGB": lambda app, more: app.gl.Disable(0x8DB9),
    "clip control": lambda app, more: app.gl.ClipControl and app.gl.ClipControl(0x8CA2, 0x935F),
    "clear values": _clear_values,
    "a program": lambda app, more: use_program(app, *_SHADERS),
}  # fmt: skip


def make_es_hostile(app: Application) -> None:
    """All of them."""
    more = More(app)
    for change in ES_STATES.values():
        change(app, more)
        app.gl.drain()
