"""Which OpenGL context is current in this thread, ours or a host program's, made by EGL or by GLX.

A thread has one current context whoever made it; EGL refuses to make another current while GLX holds the thread, so a
GLX context is put aside through GLX.  Elsewhere than on Linux the context before ours is not known.
"""

from __future__ import annotations

import ctypes
import ctypes.util
import os
import sys
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, TypeAlias

from passgraph.errors import BackendError

#: An address that a driver gave; None is none.
Handle: TypeAlias = "int | None"
_EGL_DRAW, _EGL_READ = 0x3059, 0x305A
_GONE = "no such context"
_EGL_ERRORS = {
    0x3001: "not initialised", 0x3002: "the context is current in another thread", 0x3003: "out of memory",
    0x3006: _GONE, 0x3008: "no such display", 0x300B: "no such window", 0x300D: "no such surface",
    0x300E: "context lost",
}  # fmt: skip
#: Where GLX's functions are, first where drivers share a dispatcher.
_GLX_LIBRARIES = ("libGLX.so.0", "libGL.so.1")


@dataclass(frozen=True)
class State:
    """What is current: all that it takes to make it so again."""

    system: str  # "egl" or "glx"
    display: Handle
    draw: Handle
    read: Handle
    context: Handle


def _function(library: ctypes.CDLL, name: str, result: Any, *arguments: Any) -> Callable[..., Any]:
    # A prototype of our own: attributes of a library are shared with whoever else loads it.
    return ctypes.CFUNCTYPE(result, *arguments)((name, library))


class _Egl:
    def __init__(self, library: ctypes.CDLL) -> None:
        handle, number = ctypes.c_void_p, ctypes.c_uint
        self.context = _function(library, "eglGetCurrentContext", handle)
        self.display = _function(library, "eglGetCurrentDisplay", handle)
        self.surface = _function(library, "eglGetCurrentSurface", handle, ctypes.c_int)
        self._make = _function(library, "eglMakeCurrent", number, *[handle] * 4)
        self.error = _function(library, "eglGetError", ctypes.c_int)
        self.query_api = _function(library, "eglQueryAPI", number)
        self.bind_api = _function(library, "eglBindAPI", number, number)

    def state(self) -> State | None:
        context = self.context()
        if not context:
            return None
        return State("egl", self.display(), self.surface(_EGL_DRAW), self.surface(_EGL_READ), context)

    def make(self, state: State) -> str:
        """Empty, or why it was refused."""
        if self._make(state.display, state.draw, state.read, state.context):
            return ""
        error = self.error()
        return _EGL_ERRORS.get(error, f"EGL error {error:#x}")


class _Glx:
    def __init__(self, library: ctypes.CDLL) -> None:
        handle, drawable = ctypes.c_void_p, ctypes.c_ulong
        self.context = _function(library, "glXGetCurrentContext", handle)
        self.display = _function(library, "glXGetCurrentDisplay", handle)
        self.draw = _function(library, "glXGetCurrentDrawable", drawable)
        self.read = _function(library, "glXGetCurrentReadDrawable", drawable)
        self._make = _function(library, "glXMakeContextCurrent", ctypes.c_int, handle, drawable, drawable, handle)

    def state(self) -> State | None:
        context = self.context()
        return State("glx", self.display(), self.draw(), self.read(), context) if context else None

    def make(self, state: State) -> str:
        if self._make(state.display, state.draw or 0, state.read or 0, state.context):
            return ""
        return "GLX refuses it"


def _loaded_glx() -> _Glx | None:
    """GLX, where something in this process has loaded it: it is not loaded for our sake."""
    for name in _GLX_LIBRARIES:
        try:
            return _Glx(ctypes.CDLL(name, mode=os.RTLD_NOLOAD | os.RTLD_LAZY))
        except (OSError, AttributeError):
            continue
    return None


class Current:
    """Reads and changes what is current in the calling thread."""

    def __init__(self) -> None:
        path = ctypes.util.find_library("EGL") if sys.platform.startswith("linux") else None
        #: Without it nothing here is known.
        self.egl = None if path is None else _Egl(ctypes.CDLL(path))
        self.glx: _Glx | None = None
        self.look_for_glx()

    def look_for_glx(self) -> None:
        if self.egl is not None and self.glx is None:
            self.glx = _loaded_glx()

    def state(self) -> State | None:
        """What is current, or None."""
        if self.egl is None:
            return None
        return self.egl.state() or (self.glx.state() if self.glx is not None else None)

    def change(self, before: State | None, after: State | None) -> None:
        """Make ``after`` current where ``before`` is; None is nothing.

        Raises
        ------
        BackendError
            Where the system refuses; ``before`` is current again then.
        """
        if before == after:
            return
        self._clear(before, after)
        if after is None:
            return
        refused = self._of(after).make(after)
        if refused:
            self.put_back(None, before)
            raise _refusal("making its context current", refused)

    def put_back(self, now: State | None, before: State | None) -> None:
        """Make ``before`` current again, unless its owner has destroyed it: then nothing is current."""
        if now == before:
            return
        self._clear(now, before)
        if before is not None:
            refused = self._of(before).make(before)
            if refused == _GONE:
                self._clear(now, None)
            elif refused:
                raise _refusal("making the host program's context current again", refused)

    def _clear(self, before: State | None, after: State | None) -> None:
        """Nothing of ``before`` is current, where its system does not do that itself when it makes ``after`` so."""
        if before is not None and (after is None or before.system != after.system):
            refused = self._of(before).make(State(before.system, before.display, None, None, None))
            if refused:
                raise _refusal("putting the current context aside", refused)

    def _of(self, state: State) -> _Egl | _Glx:
        system = self.egl if state.system == "egl" else self.glx
        assert system is not None
        return system


def _refusal(doing: str, refused: str) -> BackendError:
    return BackendError(
        f"gl: {doing} failed: {refused}. The host program may hold this thread's context in a way that cannot be "
        "put aside; release it there around calls of passgraph, or call passgraph in a thread of its own"
    )
