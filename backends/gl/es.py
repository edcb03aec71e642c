"""The ``gles`` backend: OpenGL ES 3.0 and newer in a context of its own, made through EGL.

Passes are those of the ``gl`` backend, whose engine's context may be OpenGL ES too.
"""

from __future__ import annotations

import ctypes
import os
import sys
from collections.abc import Iterator
from itertools import islice
from typing import Any, ClassVar

from passgraph.backends.gl.backend import GLBackend
from passgraph.backends.gl.context import INSTALL_DRIVER, Current, OwnContext, library
from passgraph.backends.gl.windowing import Egl, Handle, State
from passgraph.errors import DeviceMissingError

_HANDLE, _NUMBER, _NONE, _ES_API = ctypes.c_void_p, ctypes.c_int, 0x3038, 0x30A0
_EXTENSIONS, _MOST_DEVICES = 0x3055, 16
_DEVICE_PLATFORM, _SURFACELESS_PLATFORM = 0x313F, 0x31DD
#: Environment variable with the path of an EGL library besides the system's.
EGL_VARIABLE = "PASSGRAPH_EGL"
#: A configuration for pbuffers and OpenGL ES 3; nothing is drawn into a surface.
_CONFIGURATION = (0x3033, 1, 0x3040, 0x40)
#: Newest first: some drivers give the version that is requested, others their newest.
_VERSIONS = ((3, 2), (3, 1), (3, 0))


class Native:
    """A context of OpenGL ES that is current in this thread, with the methods of glcontext's objects that are used."""

    def __init__(self, egl: Egl, display: Handle) -> None:
        self._egl, self.load_opengl_function = egl, egl.address
        config, count = _HANDLE(), _NUMBER(0)
        choose = egl.function("eglChooseConfig", ctypes.c_uint, *[_HANDLE] * 3, _NUMBER, _HANDLE)
        choose(display, _attributes(*_CONFIGURATION), ctypes.byref(config), 1, ctypes.byref(count))
        create = egl.function("eglCreateContext", *[_HANDLE] * 5)
        context: Handle = None
        for major, minor in _VERSIONS:
            context = context or create(display, config, None, _attributes(0x3098, major, 0x30FB, minor))
        self._state = State("egl", display, None, None, context)
        refused = egl.last_error() if context is None else egl.make(self._state)
        if refused:
            raise DeviceMissingError(f"gles: EGL makes no context of OpenGL ES 3: {refused}; {INSTALL_DRIVER}")

    def release(self) -> None:
        self._egl.destroy(self._state, self._state.context)


def _displays(egl: Egl) -> list[Handle]:
    """Return the displays of a library on which contexts need no window: one for each device, ready to use."""
    query = egl.function("eglQueryString", ctypes.c_char_p, _HANDLE, _NUMBER)
    extensions = (query(None, _EXTENSIONS) or b"").decode().split()
    platform = egl.function("eglGetPlatformDisplayEXT", _HANDLE, ctypes.c_uint, _HANDLE, _HANDLE)
    if "EGL_EXT_platform_device" in extensions:
        devices, count = (_HANDLE * _MOST_DEVICES)(), _NUMBER(0)
        list_devices = egl.function("eglQueryDevicesEXT", ctypes.c_uint, _NUMBER, _HANDLE, _HANDLE)
        list_devices(_MOST_DEVICES, devices, ctypes.byref(count))
        found = [platform(_DEVICE_PLATFORM, device, None) for device in devices[: count.value]]
    elif "EGL_MESA_platform_surfaceless" in extensions:  # ANGLE on Linux, which has one display in a process
        found = [platform(_SURFACELESS_PLATFORM, None, None)]
    else:
        found = [egl.function("eglGetDisplay", _HANDLE, _HANDLE)(None)]
    initialize = egl.function("eglInitialize", ctypes.c_uint, *[_HANDLE] * 3)
    return [display for display in found if display and initialize(display, None, None)]


def _attributes(*numbers: int) -> Any:
    return (_NUMBER * (len(numbers) + 1))(*numbers, _NONE)


def _libraries() -> Iterator[str]:
    """Yield the EGL libraries: the system's, then the one that the user names."""
    system, other = library("EGL") if sys.platform.startswith("linux") else None, os.environ.get(EGL_VARIABLE)
    yield from (path for path in (system, other) if path)


def _devices() -> Iterator[tuple[str, Handle]]:
    """Yield the EGL library and display of each device; a library is loaded when it is reached."""
    for path in _libraries():
        try:
            egl = Egl(ctypes.CDLL(path))
        except (OSError, AttributeError) as error:
            raise DeviceMissingError(
                f"gles: the EGL library does not load: {error}; set {EGL_VARIABLE} to another one, or unset it"
            ) from None
        yield from ((path, display) for display in _displays(egl))


class EsContext(OwnContext):
    """An off-screen context of OpenGL ES."""

    api: ClassVar[str] = "OpenGL ES"
    most_devices: ClassVar[int] = _MOST_DEVICES
    _display: Handle

    def _current_with(self, index: int) -> Current:
        found = next(islice(_devices(), index, None), None)
        if found is None:
            raise DeviceMissingError(
                f"gles: there is no OpenGL ES device {index}; install a driver: {INSTALL_DRIVER}; or name the EGL "
                f"library of another one, such as ANGLE's, in {EGL_VARIABLE}"
            )
        path, self._display = found
        return Current(path)

    def _new_context(self, index: int) -> Any:
        egl = self.current.egl
        assert egl is not None
        api = egl.query_api()
        egl.bind_api(_ES_API)
        try:
            return Native(egl, self._display)
        finally:
            egl.bind_api(api)


class GLESBackend(GLBackend):
    """OpenGL ES off screen."""

    name: ClassVar[str] = "gles"
    contexts: ClassVar[type[OwnContext]] = EsContext
