"""EGL: contexts of Linux without and with a window, of Android and of ANGLE."""

from __future__ import annotations

import ctypes
from collections.abc import Callable

from passgraph.backends.gl.capabilities import version_of
from passgraph.backends.gl.windowing import GONE, Handle, State, addresses, function
from passgraph.errors import BackendError

_EGL_DRAW, _EGL_READ = 0x3059, 0x305A
_EGL_CONFIG_ID, _EGL_CLIENT_TYPE, _EGL_CLIENT_VERSION, _EGL_NONE = 0x3028, 0x3097, 0x3098, 0x3038
_GL_VERSION = 0x1F02
_EGL_MAJOR, _EGL_MINOR, _EGL_PROFILE, _EGL_OPENGL, _EGL_SIDES = 0x3098, 0x30FB, 0x30FD, 0x30A2, (0x3057, 0x3056)
_EGL_ERRORS = {
    0x3001: "not initialised", 0x3002: "the context is current in another thread", 0x3003: "out of memory",
    0x3006: GONE, 0x3008: "no such display", 0x300B: "no such window", 0x300D: "no such surface",
    0x300E: "context lost",
}  # fmt: skip


class Egl:
    def __init__(self, library: ctypes.CDLL) -> None:
        handle, number = ctypes.c_void_p, ctypes.c_uint
        self.context = function(library, "eglGetCurrentContext", handle)
        self.display = function(library, "eglGetCurrentDisplay", handle)
        self.surface = function(library, "eglGetCurrentSurface", handle, ctypes.c_int)
        self._make = function(library, "eglMakeCurrent", number, *[handle] * 4)
        self.error = function(library, "eglGetError", ctypes.c_int)
        self.query_api = function(library, "eglQueryAPI", number)
        self.bind_api = function(library, "eglBindAPI", number, number)
        self.address = addresses(library, "eglGetProcAddress")
        self._library = library

    def state(self) -> State | None:
        context = self.context()
        if not context:
            return None
        return State("egl", self.display(), self.surface(_EGL_DRAW), self.surface(_EGL_READ), context)

    def make(self, state: State) -> str:
        if self._make(state.display, state.draw, state.read, state.context):
            return ""
        return self.last_error()

    def last_error(self) -> str:
        error = self.error()
        return _EGL_ERRORS.get(error, f"EGL error {error:#x}")

    def share(self, host: State) -> Handle:
        handle, number = ctypes.c_void_p, ctypes.c_int
        query = function(self._library, "eglQueryContext", ctypes.c_uint, handle, handle, number, handle)
        choose = function(self._library, "eglChooseConfig", ctypes.c_uint, handle, handle, handle, number, handle)
        create = function(self._library, "eglCreateContext", handle, handle, handle, handle, handle)
        asked = {}
        for what in (_EGL_CONFIG_ID, _EGL_CLIENT_TYPE, _EGL_CLIENT_VERSION):
            found = number(0)
            query(host.display, host.context, what, ctypes.byref(found))
            asked[what] = found.value
        config, count = handle(), number(0)
        if asked[_EGL_CONFIG_ID]:
            wanted = (number * 3)(_EGL_CONFIG_ID, asked[_EGL_CONFIG_ID], _EGL_NONE)
            choose(host.display, wanted, ctypes.byref(config), 1, ctypes.byref(count))
        versions: list[tuple[int, ...]] = [(_EGL_MAJOR, 3, _EGL_MINOR, 3, _EGL_PROFILE, 1, _EGL_NONE)]
        if asked[_EGL_CLIENT_TYPE] != _EGL_OPENGL:
            # As new as the host's, for what that has; before EGL 1.5 there was no way to say so.
            major, minor = self._version()
            versions = [
                (_EGL_MAJOR, major, _EGL_MINOR, minor, _EGL_NONE), (_EGL_MAJOR, asked[_EGL_CLIENT_VERSION], _EGL_NONE)
            ]  # fmt: skip
        made: Handle = None
        api = self.query_api()
        try:
            self.bind_api(asked[_EGL_CLIENT_TYPE])
            for version in versions:
                made = made or create(host.display, config, host.context, (number * len(version))(*version))
        finally:
            self.bind_api(api)
        if not made:
            raise BackendError(f"gl: EGL makes no context that shares with the current one: {self.last_error()}")
        return made

    def _version(self) -> tuple[int, int]:
        """Of the current context, as it says itself: many are newer than what was asked for."""
        text = ctypes.CFUNCTYPE(ctypes.c_char_p, ctypes.c_uint)(self.address("glGetString"))(_GL_VERSION)
        return version_of((text or b"").decode(errors="replace"))[1]

    def destroy(self, host: State, context: Handle) -> None:
        """It is gone when it is no longer current anywhere; nothing happens where the display is gone."""
        function(self._library, "eglDestroyContext", ctypes.c_uint, *[ctypes.c_void_p] * 2)(host.display, context)

    def lives(self, host: State) -> Callable[[], bool]:
        return lambda: True  # EGL knows its displays, and answers for those that are gone

    def surface_size(self, state: State) -> tuple[int, int] | None:
        if not state.draw:
            return None
        handle, number = ctypes.c_void_p, ctypes.c_int
        query = function(self._library, "eglQuerySurface", ctypes.c_uint, handle, handle, number, handle)
        found = [number(0), number(0)]
        for what, room in zip(_EGL_SIDES, found, strict=True):
            query(state.display, state.draw, what, ctypes.byref(room))
        return found[0].value, found[1].value
