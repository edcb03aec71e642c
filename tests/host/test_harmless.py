"""The engine notices nothing: its state is as it was, its objects too, and its state changes none of our pictures."""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import passgraph as pg
from passgraph.backends.gl import gl_functions
from passgraph.backends.gl import gl_functions as g
from passgraph.backends.gl.capabilities import NEVER_OURS, OFF
from passgraph.backends.gl.gl_functions import Functions
from passgraph.errors import BackendError
from passgraph.hosts.gl_isolation import Guard
from tests.host.application import BYTES, HEIGHT, KEPT, NO_ERROR, RGBA, WIDTH, Application, Kept
from tests.host.es import EsApplication
from tests.host.gl_state import Dump, differences, objects, texture_parameters
from tests.host.hostile import OLD_STATES, STATES, More, make_hostile
from tests.host.test_life import compiled
from tests.host.test_reading import ISOLATIONS, READERS, of_host, read_program
from tests.host.test_writing import ROWS, blue, blurred, corner, expected

pytestmark = [pytest.mark.gl, pytest.mark.slow]


def drawn(target: pg.TargetSpec) -> pg.Target:
    """A draw that sets all that draws set."""
    mesh = pg.Mesh.make([(-0.9, -0.8, 0), (0.8, -0.3, 0), (-0.2, 0.9, 0)], [(0, 1, 2)])
    return pg.draw(
        mesh, vertex=corner, fragment=blue, into=target,
        depth=pg.target("depth", "depth32f_stencil8"), cull="back", depth_compare="less_equal",
        stencil=pg.Stencil(compare="always", reference=3, passed="replace"), blend=pg.Blend("source_alpha", "one"),
        polygon_offset=(1.0, 2.0),
    )  # fmt: skip


def a_life(app: Application, isolation: Any, source: int, target: int, kept: tuple[Kept, Kept]) -> None:
    """Of a host and its programs, with every way in and out."""
    framebuffer = app.objects[target]
    with pg.gl.Host.current(isolation) as host:
        with pg.compile(blurred(pg.target("picture", "rgba8")), backend=host) as program:
            program.run(frame=host.texture(source), into={"picture": host.texture(target)})
            program.run(frame=host.framebuffer(framebuffer), into={"picture": host.framebuffer(framebuffer)})
            program(frame=ROWS)
            program.run(frame=of_host(app, host, kept[0]), into={"picture": host.texture(target)})
        same = pg.kernel(source="def same(d: Image) -> float: return d[0, 0].r")
        with pg.compile(same(pg.Input("depth"), into=pg.target("d", "r32f")), backend=host) as program:
            program(depth=of_host(app, host, kept[1]))
        counts = pg.histogram(pg.Input("frame"), 5)
        with pg.compile(counts, backend=host) as program:
            assert program(frame=host.texture(source))["frame.histogram"].sum() == WIDTH * HEIGHT
        with pg.compile(drawn(pg.target("picture", "rgba8")), backend=host, size=(WIDTH, HEIGHT)) as program:
            program.run(into={"picture": host.texture(target)})


def an_engine(app: Application) -> tuple[int, int, tuple[Kept, Kept]]:
    source, target = (app.texture(0x8058, RGBA, BYTES, ROWS) for _ in range(2))
    app.objects[target] = app.of_texture(target)
    names = ("a renderbuffer of four samples", "depth 24 stencil 8 in a renderbuffer")
    one, other = (KEPT[name](app) for name in names)
    return source, target, (one, other)


@pytest.mark.parametrize("isolation", ISOLATIONS)
@pytest.mark.parametrize("profile", ["core", "compatibility"])
def test_all_state_is_as_it_was(profile: str, isolation: Any) -> None:
    """Ten states after ten, each staying."""
    app = Application(compatible=profile == "compatibility")
    states = STATES | (OLD_STATES if profile == "compatibility" else {})
    more, dump = More(app), Dump(app.gl)
    source, target, kept = an_engine(app)
    for part in batched(states.items(), 10):
        for _, change in part:
            change(app, more)
            app.gl.drain()
        before, parameters, own = dump(), texture_parameters(app.gl, 0x0DE1, source), objects(app.gl)
        a_life(app, isolation, source, target, kept)
        assert not differences(before, dump()), [name for name, _ in part]
        assert texture_parameters(app.gl, 0x0DE1, source) == parameters
        assert objects(app.gl) == own
    app.close()


def batched(items: Any, count: int) -> Any:
    rest = list(items)
    return [rest[k : k + count] for k in range(0, len(rest), count)]


@pytest.mark.parametrize("isolation", ISOLATIONS)
@pytest.mark.parametrize("profile", ["core", "compatibility"])
def test_nothing_that_an_engine_has_set_changes_a_picture(profile: str, isolation: Any) -> None:
    app = Application(compatible=profile == "compatibility")
    framebuffer = app.of_texture(app.texture(0x8058, RGBA, BYTES, ROWS))
    with pg.gl.Host.current(isolation) as host:
        program = pg.compile(blurred(pg.target("picture", "rgba8")), backend=host, results="stored")
        reader = pg.compile(same_program(), backend=host, results="stored")
        found = host.framebuffer(framebuffer)
        make_hostile(app)
        if profile == "compatibility":
            for change in OLD_STATES.values():
                change(app, More(app))
        program.run(frame=found, into={"picture": found})
        np.testing.assert_array_equal(reader(frame=found)["same"], expected())
        np.testing.assert_array_equal(program(frame=ROWS)["picture"], expected())
        program.close()
        reader.close()
    app.close()


def same_program() -> pg.Target:
    same = pg.kernel(source="def same(c: Image) -> vec4: return c[0, 0]")
    return same(pg.Input("frame", "rgba8"), into=pg.target("same", "rgba8"))


@pytest.mark.parametrize(
    "part", ["_bindings", "_buffers", "_textures", "_switches", "_colours", "_geometry", "_stencil"]
)
def test_a_guard_that_forgets_something_is_found(app: Application, part: str, monkeypatch: pytest.MonkeyPatch) -> None:
    engine = an_engine(app)
    make_hostile(app)
    dump = Dump(app.gl)
    before = dump()
    monkeypatch.setattr(Guard, part, lambda _: ())
    a_life(app, "guard", *engine)
    assert differences(before, dump())


def all_kept(app: Application) -> list[Kept]:
    return [make(app) for make in KEPT.values()]


def read_all(app: Application, isolation: Any, kept: list[Kept]) -> None:
    with pg.gl.Host.current(isolation) as host:
        for each in kept:
            with read_program(READERS["here"], "clamp", host) as program:
                program(frame=of_host(app, host, each))


class Messages:
    """What OpenGL tells an engine's debug callback."""

    def __init__(self, app: Application) -> None:
        self.texts: list[str] = []
        kind = ctypes.CFUNCTYPE(None, *[ctypes.c_uint] * 4, ctypes.c_int, ctypes.c_char_p, ctypes.c_void_p)
        self._callback = kind(lambda *told: self.texts.append(told[5].decode()))
        install = ctypes.CFUNCTYPE(None, kind, ctypes.c_void_p)
        install(app.native.load_opengl_function("glDebugMessageCallback"))(self._callback, None)
        for switch in (0x92E0, 0x8242):  # messages, and in the thread and call that they are of
            app.gl.Enable(switch)


@pytest.mark.parametrize("isolation", ISOLATIONS)
@pytest.mark.parametrize("profile", ["core", "compatibility"])
def test_an_engine_s_debug_callback_hears_nothing(profile: str, isolation: Any) -> None:
    app = Application(compatible=profile == "compatibility")
    engine, kept = an_engine(app), all_kept(app)
    messages = Messages(app)
    a_life(app, isolation, *engine)
    read_all(app, isolation, kept)
    assert messages.texts == []
    app.gl.Enable(0xFFFF)
    assert len(messages.texts) == 1, "and hears of its own errors"
    app.close()


def _incomplete(app: Application) -> None:
    app.gl.BindFramebuffer(g.FRAMEBUFFER, app.gl.new("Framebuffer"))
    app.gl.DrawArrays(g.TRIANGLES, 0, 3)


ERRORS: dict[int, Callable[[Application], Any]] = {
    0x500: lambda app: app.gl.Enable(0xFFFF),
    0x501: lambda app: app.gl.Viewport(0, 0, -1, -1),
    0x502: lambda app: app.gl.UseProgram(app.gl.CreateShader(g.VERTEX_SHADER)),
    0x506: _incomplete,
}


@pytest.mark.parametrize("isolation", ISOLATIONS)
@pytest.mark.parametrize("error", ERRORS, ids=hex)
def test_an_engine_finds_its_own_error(app: Application, error: int, isolation: Any) -> None:
    """Which it has caused before, and asks for behind a run."""
    framebuffer = app.of_texture(app.texture(0x8058, RGBA, BYTES, ROWS))
    ERRORS[error](app)
    with pg.gl.Host.current(isolation) as host, compiled(host) as program:
        assert app.gl.GetError() == error
        assert app.gl.GetError() == g.NO_ERROR
        found = host.framebuffer(framebuffer)
        ERRORS[error](app)
        program.run(frame=found, into={"picture": found})
        assert app.gl.GetError() == error
        assert app.gl.GetError() == g.NO_ERROR
    np.testing.assert_array_equal(app.pixels(framebuffer), expected())


@pytest.mark.parametrize("isolation", ["guard", "auto"])
def test_a_context_without_errors_is_asked_for_none(isolation: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """In such a context (KHR_no_error) a call that is wrong may do anything.  The same calls are right in another."""
    app = Application(asked=NO_ERROR)
    assert app.gl.integer(0x821E) & 8
    a_life(app, isolation, *an_engine(app))
    app.close()

    app = Application()
    engine = an_engine(app)
    whole, prototype = Functions.integer, gl_functions._prototype
    monkeypatch.setattr(Functions, "integer", lambda gl, what: whole(gl, what) | (8 if what == 0x821E else 0))
    errors: list[int] = []

    def spying(entry: str) -> tuple[str, Callable[[int], Any]]:
        name, kind = prototype(entry)
        if name != "GetError":
            return name, kind
        return name, lambda address: lambda: errors.append(found := kind(address)()) or found

    monkeypatch.setattr(gl_functions, "_prototype", spying)
    kept = all_kept(app)
    a_life(app, "guard", *engine)
    read_all(app, "guard", kept)
    assert len(errors) > 10 and not any(errors)
    app.close()


def test_an_engine_that_records_vertices_is_not_interrupted(app: Application) -> None:
    """Nothing can be drawn in the middle of a guarded host's transform feedback."""
    guard = pg.gl.Host.current("guard")
    program = pg.compile(blurred(pg.target("picture", "rgba8")), backend=guard)
    whole = guard.context.gl.integer
    guard.context.gl.integer = lambda what: 1 if what == 0x8E24 else whole(what)  # type: ignore[method-assign]
    with pytest.raises(BackendError, match="transform feedback is active"):
        program(frame=ROWS)
    guard.context.gl.integer = whole  # type: ignore[method-assign]
    program(frame=ROWS)
    guard.close()


@pytest.mark.parametrize("make", [Application, lambda: Application(compatible=True), EsApplication])
def test_switches_are_those_that_a_context_knows(make: Callable[[], Application]) -> None:
    """Found from versions and extensions, without an error; here asked for with errors, which says the same."""
    app = make()
    switches = [*OFF, *NEVER_OURS, 0x0BC0, *range(0x3000, 0x3008)]
    known = [switch for switch in switches if (app.gl.IsEnabled(switch), app.gl.drain())[1] == []]
    assert sorted(known) == sorted((*app.gl.has.off, *app.gl.has.never_ours))
    assert app.gl.has.is_compatible == (0x0BC0 in known)
    app.close()
