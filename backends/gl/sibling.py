"""A context of our own beside a host program's: it shares textures and the like, and has a state of its own.

Made through EGL or GLX, whichever made the host's.  Nothing that is set or bound in it is seen by the host.  Objects
that hold others (framebuffers, vertex arrays) are not shared, so that the host's textures are attached to our own.
"""

from __future__ import annotations

import weakref
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import Any

from passgraph.backends.gl.canary import Canary
from passgraph.backends.gl.context import destroy_later, destroy_now
from passgraph.backends.gl.current import Current
from passgraph.backends.gl.functions import Functions
from passgraph.backends.gl.host_context import HostContext
from passgraph.backends.gl.windowing import State
from passgraph.backends.turn import Turn
from passgraph.errors import BackendError

_COMMANDS_COMPLETE, _NO_TIMEOUT = 0x9117, 0xFFFFFFFFFFFFFFFF


class _Shared:
    """A native context made from another, and what is ours in what both share."""

    def __init__(self, current: Current, host: State) -> None:
        self.current, self.host = current, host
        self.handle = current.system(host).share(host)
        self._display_lives = current.system(host).lives(host)
        self.delete: Callable[[], None] = lambda: None

    def state(self, host: State) -> State:
        """With the surfaces that the host draws to now, so that they are framebuffer 0 here too."""
        return State(host.system, host.display, host.draw, host.read, self.handle)

    def release(self) -> None:
        """What is shared would outlive this context, so it is deleted first, in it: the host's may be gone, or be
        current in another thread.  With the host's display, all of it has gone."""
        if not self._display_lives():
            return
        before = self.current.state()
        with suppress(BackendError):
            self.current.change(before, State(self.host.system, self.host.display, None, None, self.handle))
            try:
                self.delete()
            finally:
                self.current.put_back(self.current.state(), before)
        self.current.system(self.host).destroy(self.host, self.handle)


class SiblingContext(HostContext):
    """Entered where the host's context is current, which is current again behind it."""

    def __init__(self, turn: Turn | None = None) -> None:
        super().__init__(turn)
        self._before: State | None = None
        #: Whether what one context has drawn is awaited by the other.
        self._waits = True
        self._shared = _Shared(self.current, self.host)
        self._finalizer = weakref.finalize(self, destroy_later, self._shared)
        self._finalizer.atexit = False
        try:
            self.current.change(self.host, self._shared.state(self.host))
            try:
                self.gl = Functions(self.current.system(self.host).address)
                self.canary = Canary(self.gl)
                self._shared.delete = self.canary.release
            finally:
                self.current.put_back(self.current.state(), self.host)
        except BaseException:
            self.release()
            raise
        system = self.host.system.upper()
        self.about = f"a context beside the host's that shares its objects and has its own state ({system})"

    @contextmanager
    def looking(self) -> Iterator[Functions]:
        waits, self._waits = self._waits, False
        try:
            with self as gl:
                yield gl
        finally:
            self._waits = waits

    def _make_current(self) -> None:
        now = self.found()
        fence = self._fence()
        self.current.change(now, self._shared.state(now))
        self._before = now
        self._wait(fence)

    def _put_back(self) -> None:
        fence = self._fence()
        before, self._before = self._before, None
        self.current.put_back(self.current.state(), before)
        self._wait(fence)

    def _fence(self) -> Any:
        """What this context was told to do, as something that the other waits for: on the device, not here."""
        return self.gl.FenceSync(_COMMANDS_COMPLETE, 0) if self._waits else None

    def _wait(self, fence: Any) -> None:
        if fence:
            self.gl.WaitSync(fence, 0, _NO_TIMEOUT)
            self.gl.DeleteSync(fence)

    def at_release(self, delete: Callable[[], None]) -> None:
        canary = self.canary  # nothing here may know this object: it is collected before

        def both() -> None:
            delete()
            canary.release()

        self._shared.delete = both

    def release(self) -> None:
        self.closed = True
        if self._finalizer.detach() is not None:
            destroy_now(self._shared)
