"""Which OpenGL context is current in this thread, ours or a host program's, made by EGL or by GLX.

A thread has one current context whoever made it; EGL refuses to make another current while GLX holds the thread, so a
GLX context is put aside through GLX.  Without EGL, as on Windows and macOS, the context before ours is not known.
"""

from __future__ import annotations

import ctypes
import ctypes.util
import sys
from functools import cache

from passgraph.backends.gl.egl import Egl
from passgraph.backends.gl.glx import Glx, loaded_glx
from passgraph.backends.gl.windowing import GONE, State, System
from passgraph.errors import BackendError


@cache
def library(name: str) -> str | None:
    """The file of a library of the system, or None; asked once, since Python starts a process for the answer."""
    return ctypes.util.find_library(name)


class Current:
    """Reads and changes what is current in the calling thread."""

    def __init__(self) -> None:
        path = library("EGL") if sys.platform.startswith("linux") else None
        #: Without it nothing here is known.
        self.egl = None if path is None else Egl(ctypes.CDLL(path))
        self.glx: Glx | None = None
        self.look_for_glx()

    def look_for_glx(self) -> None:
        if self.egl is not None and self.glx is None:
            self.glx = loaded_glx()

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
            if refused == GONE:
                self._clear(now, None)
            elif refused:
                raise _refusal("making the host program's context current again", refused)

    def _clear(self, before: State | None, after: State | None) -> None:
        """Nothing of ``before`` is current, where its system does not do that itself when it makes ``after`` so."""
        if before is not None and (after is None or before.system != after.system):
            refused = self.system(before).make(State(before.system, before.display, None, None, None))
            if refused:
                raise _refusal("putting the current context aside", refused)

    def system(self, state: State) -> System:
        """Who made it."""
        system = self.egl if state.system == "egl" else self.glx
        assert system is not None
        return system


def _refusal(doing: str, refused: str) -> BackendError:
    return BackendError(
        f"gl: {doing} failed: {refused}. The host program may hold this thread's context in a way that cannot be "
        "put aside; release it there around calls of passgraph, or call passgraph in a thread of its own"
    )
