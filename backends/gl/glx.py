"""GLX: contexts of X11."""

from __future__ import annotations

import ctypes
import os
from collections.abc import Callable

from passgraph.backends.gl.windowing import Handle, State, addresses, function
from passgraph.backends.gl.x11 import free, is_open, sync, x_errors_kept
from passgraph.errors import BackendError

_GLX_CONFIG_ID, _GLX_SCREEN, _GLX_SIDES = 0x8013, 0x800C, (0x801D, 0x801E)
_GLX_MAJOR, _GLX_MINOR, _GLX_PROFILE = 0x2091, 0x2092, 0x9126
#: Where GLX's functions are, first where drivers share a dispatcher.
_GLX_LIBRARIES = ("libGLX.so.0", "libGL.so.1")


class Glx:
    def __init__(self, library: ctypes.CDLL) -> None:
        handle, drawable = ctypes.c_void_p, ctypes.c_ulong
        self.context = function(library, "glXGetCurrentContext", handle)
        self.display = function(library, "glXGetCurrentDisplay", handle)
        self.draw = function(library, "glXGetCurrentDrawable", drawable)
        self.read = function(library, "glXGetCurrentReadDrawable", drawable)
        self._make = function(library, "glXMakeContextCurrent", ctypes.c_int, handle, drawable, drawable, handle)
        self.address = addresses(library, "glXGetProcAddressARB")
        self._library = library

    def state(self) -> State | None:
        context = self.context()
        return State("glx", self.display(), self.draw(), self.read(), context) if context else None

    def make(self, state: State) -> str:
        if self._make(state.display, state.draw or 0, state.read or 0, state.context):
            return ""
        return "GLX refuses it"

    def share(self, host: State) -> Handle:
        handle, number = ctypes.c_void_p, ctypes.c_int
        query = function(self._library, "glXQueryContext", number, handle, handle, number, handle)
        choose = function(self._library, "glXChooseFBConfig", handle, handle, number, handle, handle)
        create = ctypes.CFUNCTYPE(handle, handle, handle, handle, number, handle)(
            self.address("glXCreateContextAttribsARB")
        )
        config, screen, count = number(0), number(0), number(0)
        query(host.display, host.context, _GLX_CONFIG_ID, ctypes.byref(config))
        query(host.display, host.context, _GLX_SCREEN, ctypes.byref(screen))
        wanted = (number * 3)(_GLX_CONFIG_ID, config.value, 0)
        configs = choose(host.display, screen.value, wanted, ctypes.byref(count))
        if not configs or not count.value:
            raise BackendError(f"gl: GLX has no configuration {config.value}, which the current context was made with")
        first = ctypes.cast(configs, ctypes.POINTER(ctypes.c_void_p))[0]
        version = (number * 7)(_GLX_MAJOR, 3, _GLX_MINOR, 3, _GLX_PROFILE, 1, 0)
        with x_errors_kept() as errors:
            made: Handle = create(host.display, first, host.context, 1, version)
            sync(host.display)
        free(configs)
        if not made or errors:
            raise BackendError("gl: GLX makes no context that shares with the current one")
        return made

    def destroy(self, host: State, context: Handle) -> None:
        function(self._library, "glXDestroyContext", None, *[ctypes.c_void_p] * 2)(host.display, context)

    def lives(self, host: State) -> Callable[[], bool]:
        return is_open(host.display or 0)

    def surface_size(self, state: State) -> tuple[int, int] | None:
        if not state.draw:
            return None
        handle, number = ctypes.c_void_p, ctypes.c_uint
        query = function(self._library, "glXQueryDrawable", None, handle, ctypes.c_ulong, ctypes.c_int, handle)
        found = [number(0), number(0)]
        for what, room in zip(_GLX_SIDES, found, strict=True):
            query(state.display, state.draw, what, ctypes.byref(room))
        return found[0].value, found[1].value


def loaded_glx() -> Glx | None:
    """GLX, where something in this process has loaded it: it is not loaded for our sake."""
    for name in _GLX_LIBRARIES:
        try:
            return Glx(ctypes.CDLL(name, mode=os.RTLD_NOLOAD | os.RTLD_LAZY))
        except (OSError, AttributeError):
            continue
    return None
