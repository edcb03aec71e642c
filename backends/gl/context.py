"""An OpenGL context of our own, off screen, made current around each use and put aside afterwards.

glcontext (moderngl's way to contexts) makes it.  No ``moderngl.Context`` is made: that one is global to the
process and would take the place of the host program's own.
"""

from __future__ import annotations

import ctypes
import ctypes.util
import sys
from types import TracebackType
from typing import Any, TypeAlias

from passgraph.backends.gl.bound import Bound
from passgraph.backends.gl.functions import Functions
from passgraph.errors import DeviceMissingError

INSTALL = "pip install 'passgraph[gl]'"
INSTALL_DRIVER = "apt-get install libegl1 libgl1-mesa-dri libgles2 libgl1"
#: No machine known to us has more EGL devices.
MAX_DEVICES = 16
#: Display, surface to draw to, surface to read from, context.
State: TypeAlias = tuple[int | None, int | None, int | None, int | None]
_EGL_DRAW, _EGL_READ = 0x3059, 0x305A


def _glcontext() -> Any:
    try:
        import glcontext  # type: ignore[import-untyped]
    except ImportError as error:
        raise DeviceMissingError(f"the gl backend needs moderngl ({error}): {INSTALL}") from None
    return glcontext


class _Current:
    """What is current in this thread: display, surfaces and context, to be put back later."""

    def __init__(self) -> None:
        # Elsewhere than on Linux a context is made current each time and the one before is not known.
        library = ctypes.util.find_library("EGL") if sys.platform.startswith("linux") else None
        self.egl = None if library is None else ctypes.CDLL(library)
        if self.egl is None:
            return
        for name in ("eglGetCurrentContext", "eglGetCurrentDisplay", "eglGetCurrentSurface"):
            getattr(self.egl, name).restype = ctypes.c_void_p
        self.egl.eglMakeCurrent.argtypes = [ctypes.c_void_p] * 4

    def context(self) -> int | None:
        return None if self.egl is None else self.egl.eglGetCurrentContext()

    def state(self) -> State | None:
        """Arguments for :meth:`make`, or None where nothing is current."""
        if self.egl is None or not self.egl.eglGetCurrentContext():
            return None
        draw, read = (self.egl.eglGetCurrentSurface(which) for which in (_EGL_DRAW, _EGL_READ))
        return self.egl.eglGetCurrentDisplay(), draw, read, self.egl.eglGetCurrentContext()

    def make(self, state: State) -> None:
        if self.egl is not None:
            self.egl.eglMakeCurrent(*state)


class Context:
    """``with context:`` makes it current in this thread; one that was current before comes back after it."""

    def __init__(self, index: int = 0) -> None:
        glcontext = _glcontext()
        self._current = _Current()
        before = self._current.state()
        try:
            if sys.platform.startswith("linux"):
                self.native = glcontext.get_backend_by_name("egl")(glversion=330, mode="standalone", device_index=index)
            else:
                self.native = glcontext.default_backend()(glversion=330, mode="standalone")
        except Exception as error:  # glcontext raises plain Exception, and ImportError for absent libraries
            raise DeviceMissingError(
                f"no OpenGL 3.3 context on device {index}: {error}; install a driver: {INSTALL_DRIVER}"
            ) from None
        self._state = self._current.state()
        self._depth = 0
        self._before: State | None = None
        self.gl = Functions(self.native.load_opengl_function)
        self.bound = Bound()
        if before is not None:
            self._current.make(before)

    def __enter__(self) -> Functions:
        if self._depth == 0 and (self._state is None or self._current.context() != self._state[3]):
            # Where nothing is current, ours stays so afterwards: putting a context aside flushes it.
            self._before = self._current.state()
            if self._state is None:
                self.native.__enter__()
            else:
                self._current.make(self._state)
        self._depth += 1
        # Whoever enters may change what the last pass has set.
        self.bound.forget()
        return self.gl

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._depth -= 1
        if self._depth == 0 and self._before is not None:
            before, self._before = self._before, None
            self._current.make(before)

    def release(self) -> None:
        """Destroy the context; whatever else is current stays so."""
        if self._state is not None and self._current.context() == self._state[3]:
            self._current.make((self._state[0], None, None, None))
        self.native.release()


def device_names() -> list[tuple[str, str, str]]:
    """Renderer, vendor and version of each device, in the order of their numbers."""
    from passgraph.backends.gl import functions as g

    found: list[tuple[str, str, str]] = []
    for index in range(MAX_DEVICES if sys.platform.startswith("linux") else 1):
        try:
            context = Context(index)
        except DeviceMissingError:
            if not found:
                raise
            break
        with context as gl:
            found.append((gl.text(g.RENDERER), gl.text(g.VENDOR), gl.text(g.VERSION)))
        context.release()
    return found
