"""OpenGL contexts: our own off screen, the current one, and checks that a context is still the same."""

from __future__ import annotations

import ctypes
import ctypes.util
import secrets
import sys
import threading
import weakref
from collections import deque
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from types import TracebackType
from typing import Any, ClassVar

from passgraph.backends.gl import gl_functions as g
from passgraph.backends.gl.gl_functions import Functions
from passgraph.backends.gl.state import Bound
from passgraph.backends.gl.windowing import GONE, Egl, Glx, State, System, loaded_glx
from passgraph.backends.turn import Turn, open_driver
from passgraph.errors import BackendError, DeviceMissingError


class OtherContextError(BackendError):
    """The current context is not the one in which an object was created."""


class Canary:
    """A shader object that is never compiled.  Shaders are shared between contexts, can be queried without being bound,
    and keep their source: another context has no shader with this number, or one with another source."""

    def __init__(self, gl: Functions) -> None:
        self.gl = gl
        self.text = f"// passgraph {secrets.token_hex(8)}".encode()
        self.name: int = gl.CreateShader(g.FRAGMENT_SHADER)
        source = ctypes.c_char_p(self.text)
        gl.ShaderSource(self.name, 1, ctypes.byref(source), None)
        self._room = ctypes.create_string_buffer(len(self.text) + 1)

    def lives(self) -> bool:
        """Return True if the current context shares objects with the one in which it was created."""
        if not self.gl.IsShader(self.name):
            return False
        self.gl.GetShaderSource(self.name, len(self._room), None, self._room)
        return self._room.value == self.text

    def look(self) -> None:
        """Raise OtherContextError if it does not."""
        if not self.lives():
            raise OtherContextError(
                "gl: the OpenGL context that this host was made in no longer exists; another one replaced it. Close "
                "this host and call Host.current() again"
            )

    def release(self) -> None:
        self.gl.DeleteShader(self.name)


@cache
def library(name: str) -> str | None:
    """Return the file of a system library, or None; cached, since Python starts a process to find it."""
    return ctypes.util.find_library(name)


class Current:
    """Queries and changes the current context of the calling thread."""

    def __init__(self, path: str | None = None) -> None:
        if path is None and sys.platform.startswith("linux"):
            path = library("EGL")
        #: Without EGL nothing can be queried here.
        self.egl = None if path is None else Egl(ctypes.CDLL(path))
        self.glx: Glx | None = None
        self.look_for_glx()

    def look_for_glx(self) -> None:
        if self.egl is not None and self.glx is None:
            self.glx = loaded_glx()

    def state(self) -> State | None:
        """Return the current context and its surfaces, or None."""
        if self.egl is None:
            return None
        return self.egl.state() or (self.glx.state() if self.glx is not None else None)

    def change(self, before: State | None, after: State | None) -> None:
        """Make ``after`` current in the place of ``before``; None stands for no context.

        Raises
        ------
        BackendError
            If the system fails; ``before`` is current again then.
        """
        if before == after:
            return
        self._clear(before, after)
        if after is None:
            return
        refused = self.system(after).make(after)
        if refused:
            self.put_back(None, before)
            raise _context_error("making its context current", refused)

    def put_back(self, now: State | None, before: State | None) -> None:
        """Make ``before`` current again; if its owner has destroyed it, no context is current."""
        if now == before:
            return
        self._clear(now, before)
        if before is not None:
            refused = self.system(before).make(before)
            if refused == GONE:
                self._clear(now, None)
            elif refused:
                raise _context_error("making the host program's context current again", refused)

    def _clear(self, before: State | None, after: State | None) -> None:
        """Unbind ``before``, unless its system does that when it makes ``after`` current."""
        if before is not None and (after is None or before.system != after.system):
            refused = self.system(before).make(State(before.system, before.display, None, None, None))
            if refused:
                raise _context_error("putting the current context aside", refused)

    def system(self, state: State) -> System:
        """Return the window system that made a context."""
        system = self.egl if state.system == "egl" else self.glx
        assert system is not None
        return system


def _context_error(doing: str, refused: str) -> BackendError:
    return BackendError(
        f"gl: {doing} failed: {refused}. The host program may hold this thread's context in a way that cannot be "
        "put aside; release it there around calls of passgraph, or call passgraph in a thread of its own"
    )


INSTALL = "pip install 'passgraph[gl]'"
INSTALL_DRIVER = "apt-get install libegl1 libgl1-mesa-dri libgles2 libgl1"
#: Most EGL devices to list.
MAX_DEVICES = 16

#: Contexts are created and destroyed one at a time.
_making = threading.Lock()
#: Contexts without owner.  A finalizer may run in any thread, between any two calls of a host program, so it only puts
#: them here; they are destroyed when one of our contexts is next opened or used.
_left: deque[Any] = deque()


def _glcontext() -> Any:
    try:
        import glcontext  # type: ignore[import-untyped]
    except ImportError as error:
        raise DeviceMissingError(f"the gl backend needs moderngl ({error}): {INSTALL}") from None
    return glcontext


def destroy_left() -> None:
    """Destroy the contexts that finalizers have put aside."""
    while _left:
        destroy_now(_left.popleft())


def destroy_later(native: Any) -> None:
    """Put a context aside for destruction; safe to call from finalizers."""
    _left.append(native)


def destroy_now(native: Any) -> None:
    with _making:
        native.release()


class Context:
    """``with context:`` makes it current in this thread, for one thread at a time; then restores the previous context.

    All OpenGL calls of this backend happen inside.
    """

    gl: Functions
    #: Description, for reports about a program's context.
    about = ""

    def __init__(self, turn: Turn | None) -> None:
        self.turn = turn or Turn("gl")
        self.closed = False
        self.bound = Bound()
        self._depth = 0

    def __enter__(self) -> Functions:
        self.turn.__enter__()
        try:
            self.check_open()
            if self._depth == 0:
                self._make_current()
        except BaseException:
            self.turn.__exit__()
            raise
        self._depth += 1
        # The code inside may change what the last pass has set.
        self.bound.forget()
        return self.gl

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._depth -= 1
        try:
            # After a fork inside, the context belongs to the parent process.
            if self._depth == 0 and not self.turn.lost:
                self._put_back()
        finally:
            self.turn.__exit__()

    def check_open(self) -> None:
        if self.closed:
            raise BackendError(f"this {self.turn.name} backend was closed; open another one")

    def check_current(self) -> None:
        """Raise BackendError if the context cannot be entered."""
        self.check_open()

    @contextmanager
    def looking(self) -> Iterator[Functions]:
        """Enter it for queries that do not depend on the content of pictures."""
        with self as gl:
            yield gl

    def _make_current(self) -> None:
        raise NotImplementedError

    def _put_back(self) -> None:
        """Make no context current; another thread could not use this one otherwise."""
        raise NotImplementedError

    def release(self) -> None:
        """Destroy our own context; other current contexts stay.  Not inside ``with context``."""
        raise NotImplementedError


class OwnContext(Context):
    """An off-screen context used by no other program: here of desktop OpenGL, made by glcontext.

    Attributes
    ----------
    api : what it is called in messages
    most_devices : the most devices to look for; elsewhere than on Linux the system chooses one
    """

    api: ClassVar[str] = "OpenGL"
    most_devices: ClassVar[int] = MAX_DEVICES if sys.platform.startswith("linux") else 1

    def __init__(self, index: int = 0, turn: Turn | None = None) -> None:
        # One name for all: they share a driver, and none survives a fork.
        open_driver("gl")
        destroy_left()
        super().__init__(turn)
        self.current = self._current_with(index)
        self._before: State | None = None
        before = self.current.state()
        self.current.change(before, None)
        try:
            self.native = self._new_context(index)
            self._finalizer = weakref.finalize(self, destroy_later, self.native)
            self._finalizer.atexit = False
            self._state = self._own_state()
            if before is not None and before.has_context_of(self._state):
                before = None  # its owner had destroyed it while it was current, and ours now has its address
            self.gl = Functions(self.native.load_opengl_function, self.turn.name)
        finally:
            self.current.put_back(self.current.state(), before)
        # Loading OpenGL may have loaded GLX, which a host may then use.
        self.current.look_for_glx()

    def _current_with(self, index: int) -> Current:
        """Return what changes the current context of the device's library."""
        return Current()

    def _new_context(self, index: int) -> Any:
        """Return glcontext's object; the thread's rendering API stays as the host has set it."""
        glcontext, linux, egl = _glcontext(), sys.platform.startswith("linux"), self.current.egl
        api = egl.query_api() if egl is not None else 0
        try:
            with _making:
                if linux:
                    return glcontext.get_backend_by_name("egl")(
                        glversion=330, mode="standalone", device_index=index, libgl=library("GL"), libegl=library("EGL")
                    )
                return glcontext.default_backend()(glversion=330, mode="standalone")
        except Exception as error:  # glcontext raises plain Exception, and ImportError for absent libraries
            raise DeviceMissingError(
                f"no OpenGL 3.3 context on device {index}: {error}; install a driver: {INSTALL_DRIVER}"
            ) from None
        finally:
            if egl is not None and api and egl.query_api() != api:
                egl.bind_api(api)

    def _own_state(self) -> State | None:
        state = self.current.state()
        if self.current.egl is not None and (state is None or state.system != "egl"):
            raise BackendError(
                f"{self.turn.name}: the new context could not be made current; a context of the host program holds "
                "this thread. Release it there around calls of passgraph, or call passgraph in a thread of its own"
            )
        return state

    def _make_current(self) -> None:
        if _left:
            destroy_left()
        if self._state is None:
            self.native.__enter__()
            return
        before = self.current.state()
        self.current.change(before, self._state)
        self._before = before

    def _put_back(self) -> None:
        if self._state is None:
            self.native.__exit__()
            return
        before, self._before = self._before, None
        self.current.put_back(self.current.state(), before)

    def release(self) -> None:
        self.closed = True
        if self._finalizer.detach() is not None:
            destroy_now(self.native)


def device_names(kind: type[OwnContext] = OwnContext) -> list[tuple[str, str, str]]:
    """Renderer, vendor and version of each device, in the order of their numbers."""
    names: list[tuple[str, str, str]] = []
    for index in range(kind.most_devices):
        try:
            context = kind(index)
        except DeviceMissingError:
            if not names:
                raise
            break
        with context as gl:
            names.append(device_texts(gl))
        context.release()
    return names


def device_texts(gl: Any) -> tuple[str, str, str]:
    """Renderer, vendor and version of the current context."""
    from passgraph.backends.gl import gl_functions as g

    return gl.text(g.RENDERER), gl.text(g.VENDOR), gl.text(g.VERSION)
