"""EGL and GLX, the systems that create OpenGL contexts."""

from __future__ import annotations

import atexit
import ctypes
import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import Any, Protocol, TypeAlias

from passgraph.backends.gl.capabilities import version_of
from passgraph.errors import BackendError
from passgraph.records import dataclass

#: An address from a driver; None for null.
Handle: TypeAlias = "int | None"
#: The error of `System.make` if the context's owner has destroyed it.
GONE = "no such context"


@dataclass(frozen=True)
class State:
    """A current context with its surfaces: all that is needed to make it current again."""

    system: str  # "egl" or "glx"
    display: Handle
    draw: Handle
    read: Handle
    context: Handle

    def has_context_of(self, other: State | None) -> bool:
        """Return True if both name one context, with any surfaces."""
        return other is not None and (self.system, self.context) == (other.system, other.context)


class System(Protocol):
    """A window system.  ``address`` finds OpenGL's functions."""

    address: Callable[[str], int]

    def state(self) -> State | None:
        """Return this thread's current state."""

    def make(self, state: State) -> str:
        """Make it current; return an empty text, or the error."""

    def share(self, host: State) -> Handle:
        """Return a context that shares objects with the host's, of the same API; it is not made current.

        Raises
        ------
        BackendError
            If the system cannot create one.
        """

    def destroy(self, host: State, context: Handle) -> None:
        """Destroy a context; it exists until it is no longer current anywhere."""

    def lives(self, host: State) -> Callable[[], bool]:
        """Return a function that returns True while the window system knows the host's display. Once it is False, no
        function may be called for objects created there."""

    def surface_size(self, state: State) -> tuple[int, int] | None:
        """Return (width, height) of framebuffer 0, if there is one and the system reports it."""


def function(library: ctypes.CDLL, name: str, result: Any, *arguments: Any) -> Callable[..., Any]:
    # Our own prototype: attributes of a library are shared with other code that loads it.
    return ctypes.CFUNCTYPE(result, *arguments)((name, library))


def addresses(library: ctypes.CDLL, name: str) -> Callable[[str], int]:
    """Return a function that finds the addresses of OpenGL's functions."""
    find = function(library, name, ctypes.c_void_p, ctypes.c_char_p)
    return lambda name_: find(name_.encode()) or 0


_LIBRARY = "libX11.so.6"
_ON_CLOSE = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_void_p, ctypes.c_void_p)


@contextmanager
def x_errors_kept() -> Iterator[list[int]]:
    """Collect X errors in a list; otherwise they end the process."""
    errors: list[int] = []

    def note(display: int, event: int) -> int:
        errors.append(1)
        return 0

    keep = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_void_p, ctypes.c_void_p)(note)
    change = function(ctypes.CDLL(_LIBRARY), "XSetErrorHandler", ctypes.c_void_p, ctypes.c_void_p)
    before = change(ctypes.cast(keep, ctypes.c_void_p))
    try:
        yield errors
    finally:
        change(before)


def sync(display: Handle) -> None:
    function(ctypes.CDLL(_LIBRARY), "XSync", ctypes.c_int, ctypes.c_void_p, ctypes.c_int)(display, 0)


def free(memory: Handle) -> None:
    """Free memory allocated by Xlib."""
    function(ctypes.CDLL(_LIBRARY), "XFree", ctypes.c_int, ctypes.c_void_p)(memory)


class _Display:
    """A display that other code has opened.  Xlib calls back when it is closed: using it after that ends the process,
    and its address may be reused."""

    def __init__(self, address: int) -> None:
        self.address, self.is_open = address, True
        library, handle, number = ctypes.CDLL(_LIBRARY), ctypes.c_void_p, ctypes.c_int
        add = function(library, "XAddExtension", ctypes.POINTER(number), handle)
        self._tell = function(library, "XESetCloseDisplay", handle, handle, number, handle)
        self._extension = add(address)[0]

        def closed(display: int, codes: int) -> int:
            self.is_open = False
            return 0

        self._closed = _ON_CLOSE(closed)
        self._tell(address, self._extension, ctypes.cast(self._closed, handle))

    def forget(self) -> None:
        if self.is_open:
            self._tell(self.address, self._extension, None)


#: By address.  Closed displays stay until their address is reused: Xlib still needs the callback meanwhile.
_displays: dict[int, _Display] = {}


def is_open(address: int) -> Callable[[], bool]:
    """Return a function that tells if a display, open now, is still open."""
    if not _displays:
        atexit.register(_forget_all)
    display = _displays.get(address)
    if display is None or not display.is_open:
        display = _displays[address] = _Display(address)
    return lambda: display.is_open


def _forget_all() -> None:
    """Remove the callbacks when Python exits, as displays may be closed later."""
    for display in _displays.values():
        display.forget()


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

    def function(self, name: str, result: Any, *arguments: Any) -> Callable[..., Any]:
        """Return a function of EGL, or of an extension that it has."""
        with suppress(AttributeError):
            return function(self._library, name, result, *arguments)
        return ctypes.CFUNCTYPE(result, *arguments)(self.address(name))

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
        attributes = {}
        for what in (_EGL_CONFIG_ID, _EGL_CLIENT_TYPE, _EGL_CLIENT_VERSION):
            found = number(0)
            query(host.display, host.context, what, ctypes.byref(found))
            attributes[what] = found.value
        config, count = handle(), number(0)
        if attributes[_EGL_CONFIG_ID]:
            wanted = (number * 3)(_EGL_CONFIG_ID, attributes[_EGL_CONFIG_ID], _EGL_NONE)
            choose(host.display, wanted, ctypes.byref(config), 1, ctypes.byref(count))
        versions: list[tuple[int, ...]] = [(_EGL_MAJOR, 3, _EGL_MINOR, 3, _EGL_PROFILE, 1, _EGL_NONE)]
        if attributes[_EGL_CLIENT_TYPE] != _EGL_OPENGL:
            # The same version as the host's, for its features; before EGL 1.5 a version could not be requested.
            major, minor = self._version()
            versions = [
                (_EGL_MAJOR, major, _EGL_MINOR, minor, _EGL_NONE),
                (_EGL_MAJOR, attributes[_EGL_CLIENT_VERSION], _EGL_NONE),
            ]
        shared: Handle = None
        api = self.query_api()
        try:
            self.bind_api(attributes[_EGL_CLIENT_TYPE])
            for version in versions:
                shared = shared or create(host.display, config, host.context, (number * len(version))(*version))
        finally:
            self.bind_api(api)
        if not shared:
            raise BackendError(f"gl: EGL makes no context that shares with the current one: {self.last_error()}")
        return shared

    def _version(self) -> tuple[int, int]:
        """Return the version of the current context; drivers often give a newer one than was requested."""
        text = ctypes.CFUNCTYPE(ctypes.c_char_p, ctypes.c_uint)(self.address("glGetString"))(_GL_VERSION)
        return version_of((text or b"").decode(errors="replace"))[1]

    def destroy(self, host: State, context: Handle) -> None:
        """Destroy a context; it exists until no longer current anywhere.  No effect if the display is gone."""
        function(self._library, "eglDestroyContext", ctypes.c_uint, *[ctypes.c_void_p] * 2)(host.display, context)

    def lives(self, host: State) -> Callable[[], bool]:
        return lambda: True  # EGL keeps track of its displays, and handles closed ones

    def surface_size(self, state: State) -> tuple[int, int] | None:
        if not state.draw:
            return None
        handle, number = ctypes.c_void_p, ctypes.c_int
        query = function(self._library, "eglQuerySurface", ctypes.c_uint, handle, handle, number, handle)
        return _surface_size(query, state, _EGL_SIDES, number)


def _surface_size(query: Callable[..., Any], state: State, sides: tuple[int, int], number: Any) -> tuple[int, int]:
    found = number(0), number(0)
    for what, room in zip(sides, found, strict=True):
        query(state.display, state.draw, what, ctypes.byref(room))
    return found[0].value, found[1].value


_GLX_CONFIG_ID, _GLX_SCREEN, _GLX_SIDES = 0x8013, 0x800C, (0x801D, 0x801E)
_GLX_MAJOR, _GLX_MINOR, _GLX_PROFILE = 0x2091, 0x2092, 0x9126
#: Libraries with GLX's functions; first the dispatcher that drivers share.
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
            shared: Handle = create(host.display, first, host.context, 1, version)
            sync(host.display)
        free(configs)
        if not shared or errors:
            raise BackendError("gl: GLX makes no context that shares with the current one")
        return shared

    def destroy(self, host: State, context: Handle) -> None:
        function(self._library, "glXDestroyContext", None, *[ctypes.c_void_p] * 2)(host.display, context)

    def lives(self, host: State) -> Callable[[], bool]:
        return is_open(host.display or 0)

    def surface_size(self, state: State) -> tuple[int, int] | None:
        if not state.draw:
            return None
        handle, number = ctypes.c_void_p, ctypes.c_uint
        query = function(self._library, "glXQueryDrawable", None, handle, ctypes.c_ulong, ctypes.c_int, handle)
        return _surface_size(query, state, _GLX_SIDES, number)


def loaded_glx() -> Glx | None:
    """Return GLX if this process has already loaded it; it is never loaded here."""
    if sys.platform != "win32":
        for name in _GLX_LIBRARIES:
            with suppress(OSError, AttributeError):
                return Glx(ctypes.CDLL(name, mode=os.RTLD_NOLOAD | os.RTLD_LAZY))
    return None
