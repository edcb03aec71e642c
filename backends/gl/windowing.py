"""What the systems that make OpenGL contexts (EGL, GLX) have in common."""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol, TypeAlias

#: An address that a driver gave; None is none.
Handle: TypeAlias = "int | None"
#: What `System.make` says where the context's owner has destroyed it.
GONE = "no such context"


@dataclass(frozen=True)
class State:
    """What is current: all that it takes to make it so again."""

    system: str  # "egl" or "glx"
    display: Handle
    draw: Handle
    read: Handle
    context: Handle


class System(Protocol):
    """One of them.  ``address`` finds OpenGL's functions."""

    address: Callable[[str], int]

    def state(self) -> State | None:
        """What it has current in this thread."""

    def make(self, state: State) -> str:
        """Make it current; empty, or why it was refused."""

    def share(self, host: State) -> Handle:
        """A context that shares objects with the host's, of the same API; it is not made current.

        Raises
        ------
        BackendError
            Where the system makes none.
        """

    def destroy(self, host: State, context: Handle) -> None:
        """It is gone when it is no longer current anywhere."""

    def lives(self, host: State) -> Callable[[], bool]:
        """What tells, from now on, whether the system still knows the display of the host that is current now; where
        it does not, no function may be called for what was made in it."""

    def surface_size(self, state: State) -> tuple[int, int] | None:
        """(width, height) of what framebuffer 0 is, where there is one and the system tells."""


def function(library: ctypes.CDLL, name: str, result: Any, *arguments: Any) -> Callable[..., Any]:
    # A prototype of our own: attributes of a library are shared with whoever else loads it.
    return ctypes.CFUNCTYPE(result, *arguments)((name, library))


def addresses(library: ctypes.CDLL, name: str) -> Callable[[str], int]:
    """Where OpenGL's functions are."""
    find = function(library, name, ctypes.c_void_p, ctypes.c_char_p)
    return lambda name_: find(name_.encode()) or 0
