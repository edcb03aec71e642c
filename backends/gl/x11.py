"""Of Xlib: errors that would end the process, and displays that their owner closes."""

from __future__ import annotations

import atexit
import ctypes
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from passgraph.backends.gl.windowing import Handle, function

_LIBRARY = "libX11.so.6"
_ON_CLOSE = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_void_p, ctypes.c_void_p)


@contextmanager
def x_errors_kept() -> Iterator[list[int]]:
    """What X refuses inside comes into a list; else it ends the process."""
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
    """Give back what Xlib has made."""
    function(ctypes.CDLL(_LIBRARY), "XFree", ctypes.c_int, ctypes.c_void_p)(memory)


class _Display:
    """One that somebody has opened.  Xlib calls back when it is closed: any use of it after that ends the process, and
    its address may be another's."""

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


#: By address.  Those that are closed stay until another has their address: what Xlib calls must not go meanwhile.
_displays: dict[int, _Display] = {}


def is_open(address: int) -> Callable[[], bool]:
    """What tells, from now on, whether a display that is open now still is."""
    if not _displays:
        atexit.register(_forget_all)
    display = _displays.get(address)
    if display is None or not display.is_open:
        display = _displays[address] = _Display(address)
    return lambda: display.is_open


def _forget_all() -> None:
    """Displays that are closed after Python has ended call nothing of it."""
    for display in _displays.values():
        display.forget()
