"""The gl backend beside contexts of a host program: in any thread, whoever's context is current, nothing of theirs
changes and nothing of ours stays behind."""

from __future__ import annotations

import gc
import threading
import weakref
from collections.abc import Iterator
from typing import Any

import moderngl
import numpy as np
import pytest

import passgraph as pg
from passgraph.backends.gl import GLBackend, context
from passgraph.backends.gl import gl_functions as g
from passgraph.backends.gl.context import Current
from passgraph.backends.gl.gl_functions import Functions
from passgraph.backends.gl.windowing import State
from passgraph.errors import BackendError
from passgraph.formats import FORMATS
from tests.test_threads import at_once, child, expected, picture, shared_graph
from tests.xvfb import screen

pytestmark = pytest.mark.gl


class Host:
    """A host program's context with objects of every kind, their content known."""

    def __init__(self, native: Any) -> None:
        self.native, self.gl = native, Functions(native.load_opengl_function)
        self.before = Current().state()
        kinds = ("Texture", "Buffer", "Framebuffer", "VertexArray")
        # As many as a program of ours has, with the same names: deleting ours here would take them.
        self.objects = [(kind, self.gl.new(kind)) for kind in kinds for _ in range(12)]
        self.content = np.arange(64, dtype=np.float32).reshape(4, 4, 4)
        for kind, name in self.objects:
            self._fill(kind, name)
        self.gl.BindFramebuffer(g.FRAMEBUFFER, 0)
        self.gl.Viewport(1, 2, 3, 4)
        self.gl.check("making the host's objects")

    def _fill(self, kind: str, name: int) -> None:
        gl = self.gl
        if kind == "Texture":
            gl.BindTexture(g.TEXTURE_2D, name)
            gl.TexImage2D(g.TEXTURE_2D, 0, 0x8814, 4, 4, 0, 0x1908, g.FLOAT, self.content.ctypes.data)
        elif kind == "Buffer":
            gl.BindBuffer(g.ARRAY_BUFFER, name)
        elif kind == "Framebuffer":
            gl.BindFramebuffer(g.FRAMEBUFFER, name)
        else:
            gl.BindVertexArray(name)

    def check(self) -> None:
        """The host's context is current, nothing in it has changed, and no error waits in it."""
        gl = self.gl
        assert Current().state() == self.before
        assert all(getattr(gl, f"Is{kind}")(name) for kind, name in self.objects)
        for kind, name in self.objects:
            if kind == "Texture":
                read = np.zeros_like(self.content)
                gl.BindTexture(g.TEXTURE_2D, name)
                gl.GetTexImage(g.TEXTURE_2D, 0, 0x1908, g.FLOAT, read.ctypes.data)
                np.testing.assert_array_equal(read, self.content)
        viewport = (g.ctypes.c_int * 4)()
        gl.GetIntegerv(0x0BA2, viewport)
        assert list(viewport) == [1, 2, 3, 4]
        assert gl.GetError() == g.NO_ERROR


def used_in_front_of(host: Host) -> None:
    """A program's whole life while the host's context is current."""
    with pg.compile(shared_graph(), backend="gl") as program:
        host.check()
        np.testing.assert_array_equal(program(frame=picture(1), by=3.0)["out"], expected(picture(1), 3.0))
        host.check()
        program.run(lambda *_: host.check(), frame=picture(1), by=2.0)
    host.check()
    abandoned = pg.compile(shared_graph(), backend="gl")
    abandoned(frame=picture(1), by=3.0)
    del abandoned
    gc.collect()
    host.check()
    GLBackend().close()
    host.check()


def an_egl_host() -> None:
    made = moderngl.create_context(standalone=True, backend="egl").mglo  # what keeps the context
    import glcontext  # type: ignore[import-untyped]

    host = Host(glcontext.get_backend_by_name("egl")(glversion=330, mode="standalone"))
    used_in_front_of(host)
    assert made is not None


def a_glx_host() -> None:
    import glcontext

    host = Host(glcontext.default_backend()(glversion=330, mode="standalone"))
    assert host.before is not None and host.before.system == "glx"
    used_in_front_of(host)


def a_glx_host_that_holds_on() -> None:
    """Where GLX does not let go, or EGL refuses all the same: an error, and the host's context is as it was."""
    import glcontext

    own = pg.compile(shared_graph(), backend="gl")
    own(frame=picture(1), by=3.0)
    host = Host(glcontext.default_backend()(glversion=330, mode="standalone"))
    current = own.backend.context.current  # type: ignore[attr-defined]
    glx = current.glx
    current.glx = None  # as where the host's GLX is not found
    refused = r"gl: making its context current failed: the context is current in another thread\. The host program"
    with pytest.raises(BackendError, match=refused):
        own(frame=picture(1), by=3.0)
    with pytest.raises(BackendError, match=refused):
        own.read()
    current.glx = glx
    host.check()
    np.testing.assert_array_equal(own(frame=picture(1), by=4.0)["out"], expected(picture(1), 4.0))
    current.glx = None
    own.close()
    host.check()
    looked, Current.look_for_glx = Current.look_for_glx, lambda _: None  # type: ignore[method-assign]
    with pytest.raises(BackendError, match="the new context could not be made current; a context of the host program"):
        GLBackend()
    Current.look_for_glx = looked  # type: ignore[method-assign]
    host.check()


def test_an_egl_host_keeps_its_context_and_objects() -> None:
    child(an_egl_host)


def test_a_glx_host_keeps_its_context_and_objects() -> None:
    with screen() as name:
        child(a_glx_host, DISPLAY=name)


def test_a_glx_host_that_cannot_be_put_aside_is_an_error_and_nothing_else() -> None:
    with screen() as name:
        child(a_glx_host_that_holds_on, DISPLAY=name)


class CountedContext:
    """What glcontext made, and how often contexts were made and destroyed, in which thread."""

    made = 0
    destroyed: list[int] = []  # noqa: RUF012

    def __init__(self, inner: Any) -> None:
        self._inner = inner
        CountedContext.made += 1

    def __getattr__(self, name: str) -> Any:
        return getattr(self._inner, name)

    def release(self) -> None:
        CountedContext.destroyed.append(threading.get_ident())
        self._inner.release()


@pytest.fixture
def counted(monkeypatch: pytest.MonkeyPatch) -> type[CountedContext]:
    """Counts from here on; contexts that others left are destroyed before."""
    gc.collect()
    GLBackend().close()
    whole = context.OwnContext._new_context
    monkeypatch.setattr(context.OwnContext, "_new_context", lambda *given: CountedContext(whole(*given)))
    CountedContext.made, CountedContext.destroyed = 0, []
    return CountedContext


@pytest.fixture
def no_collector() -> Iterator[None]:
    """Nothing waits for the garbage collector, which may not come for a long time."""
    gc.disable()
    yield
    gc.enable()


@pytest.mark.usefixtures("no_collector")
def test_programs_that_nobody_closes_leave_no_context(counted: type[CountedContext]) -> None:
    for number in range(20):
        program = pg.compile(shared_graph(), backend="gl")
        np.testing.assert_array_equal(program(frame=picture(1), by=3.0)["out"], expected(picture(1), 3.0))
        alive = weakref.ref(program.backend)
        del program
        assert alive() is None
        assert (counted.made, len(counted.destroyed)) == (number + 1, number)
    GLBackend().close()
    assert len(counted.destroyed) == counted.made == 21


@pytest.mark.usefixtures("no_collector")
def test_programs_that_nobody_closes_leave_nothing_on_a_backend_that_stays() -> None:
    with GLBackend() as backend:
        counts = []
        for _ in range(6):
            program = pg.compile(shared_graph(), backend=backend)
            program(frame=picture(1), by=3.0)
            del program
            with backend.turn:
                counts.append(len(backend.objects.alive))
            with backend.context as gl:
                assert all(getattr(gl, f"Is{kind}")(name) for kind, name in backend.objects.alive)
        assert set(counts[1:]) == {counts[0]}


def test_a_program_dropped_in_another_thread_is_destroyed_in_one_that_uses_gl(counted: type[CountedContext]) -> None:
    """The last reference goes in a thread that never asked for OpenGL: nothing is asked of OpenGL there."""
    kept = [pg.compile(shared_graph(), backend="gl")]
    kept[0](frame=picture(1), by=3.0)
    at_once(lambda _: kept.clear(), 1)
    assert counted.destroyed == []
    with pg.compile(shared_graph(), backend="gl") as program:
        assert counted.destroyed == [threading.get_ident()]
        np.testing.assert_array_equal(program(frame=picture(1), by=3.0)["out"], expected(picture(1), 3.0))


def test_nothing_of_ours_stays_current() -> None:
    current = Current()
    before = current.state()
    with pg.compile(shared_graph(), backend="gl") as program:
        assert current.state() == before
        program(frame=picture(1), by=3.0)
        assert current.state() == before
        with pytest.raises(ZeroDivisionError), program.backend.context:  # type: ignore[attr-defined]
            1 / 0  # noqa: B018
        assert current.state() == before
    assert current.state() == before


def test_a_closed_backend_refuses_its_context() -> None:
    backend = GLBackend()
    storage = backend.make(FORMATS["r8"], (2, 2))
    backend.close()
    with pytest.raises(BackendError, match=r"^this gl backend was closed; open another one$"):
        backend.download(storage)
    backend.release(storage)
    backend.finish()


def test_a_host_that_destroyed_its_context_during_a_call_gets_none_back() -> None:
    made: list[Any] = []

    def work(_: int) -> None:
        import glcontext

        made.append(glcontext.get_backend_by_name("egl")(glversion=330, mode="standalone"))
        made[0].release()  # still current in this thread, and gone
        with pg.compile(shared_graph(), backend="gl") as program:
            np.testing.assert_array_equal(program(frame=picture(1), by=3.0)["out"], expected(picture(1), 3.0))
        assert Current().state() is None

    at_once(work, 1)


def test_a_context_at_the_address_of_a_destroyed_one_does_not_stay_current(monkeypatch: pytest.MonkeyPatch) -> None:
    """A driver frees a host's destroyed context when ours takes its place, and may give ours its memory (Mesa 26.1)."""

    def work(_: int) -> None:
        import glcontext

        native = glcontext.get_backend_by_name("egl")(glversion=330, mode="standalone")

        def at_that_address(*_: object) -> Any:
            native.__enter__()
            return native

        monkeypatch.setattr(context.OwnContext, "_new_context", at_that_address)
        backend = GLBackend()
        assert Current().state() is None
        backend.close()

    at_once(work, 1)


def test_a_refused_context_says_why() -> None:
    current = Current()
    with pytest.raises(BackendError, match=r"^gl: making its context current failed: no such (context|display)\. The"):
        current.change(current.state(), State("egl", None, None, None, 1))


def test_a_host_without_egl_is_refused_with_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("passgraph.backends.gl.context.library", lambda name: None)
    with pytest.raises(BackendError, match=r"no EGL.*libegl1"):
        pg.gl.Host.current()
