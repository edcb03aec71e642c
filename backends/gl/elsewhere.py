"""WGL of Windows and CGL of macOS: what is current there, so that a host's own context can be used.

Not run by our tests, which have neither; no context is made beside a host's, so hosts are guarded there.
"""

from __future__ import annotations

import ctypes
import sys
from collections.abc import Callable
from typing import Any

from passgraph.backends.gl.windowing import Handle, State, System, function
from passgraph.errors import BackendError

_FRAMEWORK = "/System/Library/Frameworks/OpenGL.framework/OpenGL"
#: What wglGetProcAddress gives besides 0 for what it does not know.
_NO_ADDRESS = (0, 1, 2, 3, -1)


class _Elsewhere:
    """What both do not do."""

    def make(self, state: State) -> str:
        return "not known how on this system"

    def share(self, host: State) -> Handle:
        raise BackendError("gl: no context is made beside a host's on this system; ask for isolation='guard'")

    def destroy(self, host: State, context: Handle) -> None:
        return

    def lives(self, host: State) -> Callable[[], bool]:
        return lambda: True

    def surface_size(self, state: State) -> tuple[int, int] | None:
        return None


class Wgl(_Elsewhere):
    def __init__(self, library: Any) -> None:
        self._library = library
        self._context = function(library, "wglGetCurrentContext", ctypes.c_void_p)
        self._device = function(library, "wglGetCurrentDC", ctypes.c_void_p)
        self._find = function(library, "wglGetProcAddress", ctypes.c_void_p, ctypes.c_char_p)

    def state(self) -> State | None:
        context = self._context()
        return State("wgl", self._device(), None, None, context) if context else None

    def address(self, name: str) -> int:
        """Functions of OpenGL 1.1 are the library's own."""
        found = self._find(name.encode())
        if found not in _NO_ADDRESS and found is not None:
            return int(found)
        own = getattr(self._library, name, None)
        return 0 if own is None else ctypes.cast(own, ctypes.c_void_p).value or 0


class Cgl(_Elsewhere):
    def __init__(self, library: Any) -> None:
        self._library = library
        self._context = function(library, "CGLGetCurrentContext", ctypes.c_void_p)

    def state(self) -> State | None:
        context = self._context()
        return State("cgl", None, None, None, context) if context else None

    def address(self, name: str) -> int:
        own = getattr(self._library, name, None)
        return 0 if own is None else ctypes.cast(own, ctypes.c_void_p).value or 0


def system_elsewhere() -> System | None:
    """This platform's, or None."""
    if sys.platform == "win32":
        return Wgl(ctypes.WinDLL("opengl32"))
    if sys.platform == "darwin":
        return Cgl(ctypes.CDLL(_FRAMEWORK))
    return None
