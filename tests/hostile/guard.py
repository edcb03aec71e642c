"""Arrays of the numpy backend between pages that nobody may touch: native code that leaves its own memory dies at once.

What is a wrong number or a later crash elsewhere in a plain process is a segmentation fault here, at the instruction
that reads or writes too far, in the process that runs the case.
"""

from __future__ import annotations

import ctypes
import importlib
import mmap
import pkgutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import ModuleType
from typing import Any
from unittest.mock import patch

import numpy as np

import passgraph.backends.numpy as backend
from passgraph.backends.numpy.machine.workers import ROOM

PAGE = mmap.PAGESIZE
_mprotect = ctypes.CDLL(None, use_errno=True).mprotect
_mprotect.argtypes = (ctypes.c_void_p, ctypes.c_size_t, ctypes.c_int)
_NOTHING_ALLOWED = 0
#: Functions whose results are moved between guards; ``zeros`` and ``empty`` make them there.
MOVED = ("arange", "array", "ascontiguousarray", "concatenate", "flatnonzero", "full", "tile")
#: The bytes behind the end of an array that may be read there, but not written.
CANARY = 0xA5
#: Rooms behind arrays that were made since they were last looked at.
_rooms: list[np.ndarray[Any, Any]] = []


def guarded_zeros(shape: Any, dtype: Any = float) -> np.ndarray[Any, Any]:
    """Zeros whose last byte is followed by a page that cannot be touched; one lies before the first too."""
    kind = np.dtype(dtype)
    size = int(np.prod(shape)) * kind.itemsize
    pages = -(-max(size, 1) // PAGE)
    # A forked process gets memory of its own, as of any array.
    memory = mmap.mmap(-1, (pages + 2) * PAGE, flags=mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS)
    whole = np.frombuffer(memory, np.uint8)
    for page in (0, pages + 1):
        if _mprotect(whole.ctypes.data + page * PAGE, PAGE, _NOTHING_ALLOWED):
            raise OSError(ctypes.get_errno(), "mprotect")
    end = (pages + 1) * PAGE
    return whole[end - size : end].view(kind).reshape(shape)


def guarded_aligned_zeros(count: int, dtype: Any = np.float32) -> np.ndarray[Any, Any]:
    """As memory.py's: what may be read behind the last number is there, and :func:`check_rooms` sees writes to it."""
    whole = guarded_zeros(count + ROOM, dtype)
    room = whole[count:].view(np.uint8)
    room[...] = CANARY
    _rooms.append(room)
    return whole[:count]


def check_rooms() -> None:
    """Nothing was written behind the end of an array made since the last call."""
    for room in _rooms:
        assert (room == CANARY).all(), "something was written behind an array"
    _rooms.clear()


class GuardedNumpy(ModuleType):
    """NumPy, but for arrays that are made new."""

    def __init__(self) -> None:
        super().__init__("guarded_numpy")
        self.zeros = self.empty = guarded_zeros
        for name in MOVED:
            setattr(self, name, _moved(getattr(np, name)))

    def __getattr__(self, name: str) -> Any:
        return getattr(np, name)


def _moved(function: Callable[..., Any]) -> Callable[..., Any]:
    def call(*given: Any, **named: Any) -> Any:
        return guarded_copy(function(*given, **named))

    return call


def guarded_copy(array: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
    """The same numbers between guards; what cannot lie there (objects, names) stays where it is."""
    if array.dtype.kind not in "biuf":
        return array
    made = guarded_zeros(array.shape, array.dtype)
    made[...] = array
    return made


@contextmanager
def guarded() -> Iterator[None]:
    """The numpy backend makes its arrays guarded while this lasts."""
    names = [found.name for found in pkgutil.walk_packages(backend.__path__, f"{backend.__name__}.")]
    modules = [importlib.import_module(name) for name in names]
    numpy = GuardedNumpy()
    made = [patch.object(module, "np", numpy) for module in modules if hasattr(module, "np")]
    made += [
        patch.object(module, "aligned_zeros", guarded_aligned_zeros)
        for module in modules
        if hasattr(module, "aligned_zeros")
    ]
    _rooms.clear()
    for one in made:
        one.start()
    try:
        yield
    finally:
        for one in made:
            one.stop()
    check_rooms()
