"""Which OpenGL context is current in this thread, ours or a host program's, made by EGL or by GLX.

A thread has one current context whoever made it; EGL refuses to make another current while GLX holds the thread, so a
GLX context is put aside through GLX.  Elsewhere than on Linux the context before ours is not known.
"""

from __future__ import annotations

import ctypes
import ctypes.util
import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, TypeAlias

from passgraph.backends.gl.capabilities import version_of
from passgraph.errors import BackendError

#: An address that a driver gave; None is none.
Handle: TypeAlias = "int | None"
_EGL_DRAW, _EGL_READ = 0x3059, 0x305A
_EGL_CONFIG_ID, _EGL_CLIENT_TYPE, _EGL_CLIENT_VERSION, _EGL_NONE = 0x3028, 0x3097, 0x3098, 0x3038
_GL_VERSION = 0x1F02
_EGL_MAJOR, _EGL_MINOR, _EGL_PROFILE, _EGL_OPENGL, _EGL_SIDES = 0x3098, 0x30FB, 0x30FD, 0x30A2, (0x3057, 0x3056)
_GLX_CONFIG_ID, _GLX_SCREEN, _GLX_SIDES = 0x8013, 0x800C, (0x801D, 0x801E)
_GLX_MAJOR, _GLX_MINOR, _GLX_PROFILE = 0x2091, 0x2092, 0x9126
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


def _addresses(library: ctypes.CDLL, name: str) -> Callable[[str], int]:
    """Where OpenGL's functions are."""
    find = _function(library, name, ctypes.c_void_p, ctypes.c_char_p)
    return lambda function: find(function.encode()) or 0


@contextmanager
def _x_errors_kept() -> Iterator[list[int]]:
    """What X refuses inside comes into a list; else it ends the process."""
    errors: list[int] = []

    def note(display: int, event: int) -> int:
        errors.append(1)
        return 0

    keep = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_void_p, ctypes.c_void_p)(note)
    library = ctypes.CDLL("libX11.so.6")
    change = _function(library, "XSetErrorHandler", ctypes.c_void_p, ctypes.c_void_p)
    before = change(ctypes.cast(keep, ctypes.c_void_p))
    try:
        yield errors
    finally:
        change(before)


def _sync(display: Handle) -> None:
    _function(ctypes.CDLL("libX11.so.6"), "XSync", ctypes.c_int, ctypes.c_void_p, ctypes.c_int)(display, 0)


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
        self.address = _addresses(library, "eglGetProcAddress")
        self._library = library

    def state(self) -> State | None:
        context = self.context()
        if not context:
            return None
        return State("egl", self.display(), self.surface(_EGL_DRAW), self.surface(_EGL_READ), context)

    def make(self, state: State) -> str:
        """Empty, or why it was refused."""
        if self._make(state.display, state.draw, state.read, state.context):
            return ""
        return self.last_error()

    def last_error(self) -> str:
        error = self.error()
        return _EGL_ERRORS.get(error, f"EGL error {error:#x}")

    def share(self, host: State) -> Handle:
        """A context that shares objects with the host's, of the same API; it is not made current.

        Raises
        ------
        BackendError
            Where the system makes none.
        """
        handle, number = ctypes.c_void_p, ctypes.c_int
        query = _function(self._library, "eglQueryContext", ctypes.c_uint, handle, handle, number, handle)
        choose = _function(self._library, "eglChooseConfig", ctypes.c_uint, handle, handle, handle, number, handle)
        create = _function(self._library, "eglCreateContext", handle, handle, handle, handle, handle)
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
        _function(self._library, "eglDestroyContext", ctypes.c_uint, *[ctypes.c_void_p] * 2)(host.display, context)

    def surface_size(self, state: State) -> tuple[int, int] | None:
        """(width, height) of what framebuffer 0 is, where there is one."""
        if not state.draw:
            return None
        handle, number = ctypes.c_void_p, ctypes.c_int
        query = _function(self._library, "eglQuerySurface", ctypes.c_uint, handle, handle, number, handle)
        found = [number(0), number(0)]
        for what, room in zip(_EGL_SIDES, found, strict=True):
            query(state.display, state.draw, what, ctypes.byref(room))
        return found[0].value, found[1].value


class _Glx:
    def __init__(self, library: ctypes.CDLL) -> None:
        handle, drawable = ctypes.c_void_p, ctypes.c_ulong
        self.context = _function(library, "glXGetCurrentContext", handle)
        self.display = _function(library, "glXGetCurrentDisplay", handle)
        self.draw = _function(library, "glXGetCurrentDrawable", drawable)
        self.read = _function(library, "glXGetCurrentReadDrawable", drawable)
        self._make = _function(library, "glXMakeContextCurrent", ctypes.c_int, handle, drawable, drawable, handle)
        self.address = _addresses(library, "glXGetProcAddressARB")
        self._library = library

    def state(self) -> State | None:
        context = self.context()
        return State("glx", self.display(), self.draw(), self.read(), context) if context else None

    def make(self, state: State) -> str:
        if self._make(state.display, state.draw or 0, state.read or 0, state.context):
            return ""
        return "GLX refuses it"

    def share(self, host: State) -> Handle:
        """A context that shares objects with the host's; it is not made current.

        Raises
        ------
        BackendError
            Where the system makes none.
        """
        handle, number = ctypes.c_void_p, ctypes.c_int
        query = _function(self._library, "glXQueryContext", number, handle, handle, number, handle)
        choose = _function(self._library, "glXChooseFBConfig", handle, handle, number, handle, handle)
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
        with _x_errors_kept() as errors:
            made: Handle = create(host.display, first, host.context, 1, version)
            _sync(host.display)
        _function(ctypes.CDLL("libX11.so.6"), "XFree", number, handle)(configs)
        if not made or errors:
            raise BackendError("gl: GLX makes no context that shares with the current one")
        return made

    def destroy(self, host: State, context: Handle) -> None:
        """It is gone when it is no longer current anywhere.  Only while the host draws: a closed display is memory
        that is gone too, and nothing tells."""
        if self.display() == host.display:
            _function(self._library, "glXDestroyContext", None, *[ctypes.c_void_p] * 2)(host.display, context)

    def surface_size(self, state: State) -> tuple[int, int] | None:
        """(width, height) of what framebuffer 0 is, where there is one."""
        if not state.draw:
            return None
        handle, number = ctypes.c_void_p, ctypes.c_uint
        query = _function(self._library, "glXQueryDrawable", None, handle, ctypes.c_ulong, ctypes.c_int, handle)
        found = [number(0), number(0)]
        for what, room in zip(_GLX_SIDES, found, strict=True):
            query(state.display, state.draw, what, ctypes.byref(room))
        return found[0].value, found[1].value


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
        refused = self.system(after).make(after)
        if refused:
            self.put_back(None, before)
            raise _refusal("making its context current", refused)

    def put_back(self, now: State | None, before: State | None) -> None:
        """Make ``before`` current again, unless its owner has destroyed it: then nothing is current."""
        if now == before:
            return
        self._clear(now, before)
        if before is not None:
            refused = self.system(before).make(before)
            if refused == _GONE:
                self._clear(now, None)
            elif refused:
                raise _refusal("making the host program's context current again", refused)

    def _clear(self, before: State | None, after: State | None) -> None:
        """Nothing of ``before`` is current, where its system does not do that itself when it makes ``after`` so."""
        if before is not None and (after is None or before.system != after.system):
            refused = self.system(before).make(State(before.system, before.display, None, None, None))
            if refused:
                raise _refusal("putting the current context aside", refused)

    def system(self, state: State) -> _Egl | _Glx:
        """Who made it."""
        system = self.egl if state.system == "egl" else self.glx
        assert system is not None
        return system


def _refusal(doing: str, refused: str) -> BackendError:
    return BackendError(
        f"gl: {doing} failed: {refused}. The host program may hold this thread's context in a way that cannot be "
        "put aside; release it there around calls of passgraph, or call passgraph in a thread of its own"
    )
