"""What both ways to work beside a host program have in common: whose context it is, and that it still is the one."""

from __future__ import annotations

from collections.abc import Callable

from passgraph.backends.gl.canary import Canary, OtherContextError
from passgraph.backends.gl.context import Context, destroy_left
from passgraph.backends.gl.current import Current
from passgraph.backends.gl.windowing import State
from passgraph.backends.turn import Turn, open_driver
from passgraph.errors import BackendError

NO_CONTEXT = (
    "no OpenGL context is current in this thread; ask for the host where the engine draws: in its draw callback, or "
    "after it has made its context current"
)
NO_SYSTEM = (
    "an engine's OpenGL context is found through EGL or GLX, and this system has no EGL; install it (libegl1 on "
    "Debian), or pass pictures through arrays: pg.compile(…, backend='gl')"
)
OTHER_CONTEXT = (
    "gl: another OpenGL context is current in this thread than the one that this host was made in; make that current, "
    "or, where the engine has made a new one (a window moved or went fullscreen), close this host and ask for "
    "Host.current() anew"
)


def current_state(current: Current) -> State:
    """What is current in this thread.

    Raises
    ------
    BackendError
        Where nothing is, or where there is no EGL to ask.
    """
    if current.egl is None:
        raise BackendError(f"gl: {NO_SYSTEM}")
    state = current.state()
    if state is None:
        raise BackendError(f"gl: {NO_CONTEXT}")
    return state


class HostContext(Context):
    """Entered where the host's context is current.

    Attributes
    ----------
    current : reads and changes what is current
    host : the host's context as it was when this was made
    canary : tells that context from another at its address
    """

    canary: Canary

    def __init__(self, turn: Turn | None = None) -> None:
        open_driver("gl")
        destroy_left()
        super().__init__(turn)
        self.current = Current()
        self.host = current_state(self.current)

    def check_current(self) -> None:
        super().check_current()
        self.found()

    def found(self) -> State:
        """The host's context as it is current now, with the surfaces that it draws to.

        Raises
        ------
        BackendError
            Where none is, or another.
        """
        now = current_state(self.current)
        if (now.context, now.display) != (self.host.context, self.host.display):
            raise OtherContextError(OTHER_CONTEXT)
        self.canary.look()
        return now

    def at_release(self, delete: Callable[[], None]) -> None:
        """Have this done, in the context, when it is released: what is ours in what both share."""
        raise NotImplementedError
