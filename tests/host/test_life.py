"""How hosts begin and end: in the right thread and context, or with an error that says what to do; what the engine
makes anew is seen anew; nothing of ours outlives a host, and nothing of the engine's is taken for ours."""

from __future__ import annotations

import gc
import threading
import tracemalloc
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import passgraph as pg
from passgraph.backends.gl import gl_functions as g
from passgraph.backends.gl.context import Current
from passgraph.errors import BackendError, InputError
from tests.host.application import BYTES, DEPTH, FLOATS, HEIGHT, RGBA, WIDTH, Application
from tests.host.gl_state import objects
from tests.host.test_reading import ISOLATIONS
from tests.host.test_writing import ROWS, blurred, expected

pytestmark = pytest.mark.gl


def compiled(host: pg.gl.Host) -> pg.Program:
    return pg.compile(blurred(pg.target("picture", "rgba8")), backend=host)


def target_of(app: Application) -> int:
    return app.of_texture(app.texture(0x8058, RGBA, BYTES, None))


def run_once(app: Application, host: pg.gl.Host, program: pg.Program, rows: Any = ROWS) -> Any:
    size = rows.shape[1::-1]
    framebuffer = app.of_texture(app.texture(0x8058, RGBA, BYTES, None, size))
    program.run(
        frame=host.texture(app.texture(0x8058, RGBA, BYTES, rows, size)),
        into={"picture": host.framebuffer(framebuffer)},
    )
    return app.pixels(framebuffer, size=size)


def test_nothing_is_current() -> None:
    said: list[str] = []

    def ask() -> None:
        try:
            pg.gl.Host.current()
        except BackendError as error:
            said.append(str(error))

    thread = threading.Thread(target=ask)
    thread.start()
    thread.join()
    assert "no OpenGL context is current in this thread" in said[0]


@pytest.mark.parametrize("isolation", ISOLATIONS)
def test_another_threads_use_is_refused(app: Application, isolation: Any) -> None:
    errors: list[BaseException] = []

    def use(program: pg.Program) -> None:
        try:
            program(frame=ROWS)
        except BackendError as error:
            errors.append(error)

    with pg.gl.Host.current(isolation) as host, compiled(host) as program:
        thread = threading.Thread(target=use, args=(program,))
        thread.start()
        thread.join()
        assert "no OpenGL context is current in this thread" in str(errors[0])
        np.testing.assert_array_equal(run_once(app, host, program), expected())


@pytest.mark.parametrize("isolation", ISOLATIONS)
def test_another_context_is_refused_and_left_alone(app: Application, isolation: Any) -> None:
    """One made in place of the host's, as when a window goes fullscreen."""
    host = pg.gl.Host.current(isolation)
    program = compiled(host)
    assert run_once(app, host, program).any()
    other = Application()
    theirs = [other.texture(0x8058, RGBA, BYTES, ROWS) for _ in range(40)]
    before = objects(other.gl)
    for use in (lambda: program(frame=ROWS), lambda: host.texture(theirs[0]), lambda: host.framebuffer()):
        with pytest.raises(BackendError, match=r"Host.current\(\) anew"):
            use()
    program.close()
    host.close()
    assert objects(other.gl) == before
    other.close()
    app.enter()


@pytest.mark.parametrize("isolation", ISOLATIONS)
def test_a_context_at_the_same_address_is_another(
    app: Application, isolation: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    host = pg.gl.Host.current(isolation)
    program = compiled(host)
    other = Application()
    for _ in range(40):
        other.texture(0x8058, RGBA, BYTES, ROWS)
    before = objects(other.gl)
    now = Current().state()
    monkeypatch.setattr(host.context, "host", now)
    with pytest.raises(BackendError, match="no longer exists; another one replaced it"):
        program(frame=ROWS)
    program.close()
    host.close()
    assert objects(other.gl) == before
    assert other.gl.GetError() == g.NO_ERROR
    other.close()
    app.enter()


@pytest.mark.sampled
@pytest.mark.parametrize("isolation", ISOLATIONS)
@pytest.mark.parametrize("order", ["program first", "host first", "engine first", "nobody closes"])
def test_nothing_of_ours_is_left(app: Application, isolation: Any, order: str) -> None:
    app.gl.drain()
    before = objects(app.gl)
    host = pg.gl.Host.current(isolation)
    program = compiled(host)
    program(frame=ROWS)
    if order == "program first":
        program.close()
        host.close()
        host.close()
    elif order == "host first":
        host.close()
        program.close()
    elif order == "engine first":
        app.close()
        program.close()
        host.close()
        return
    else:
        del program, host
        gc.collect()
        with pg.gl.Host.current(isolation):  # what was dropped goes when OpenGL is next used
            pass
    if not (order == "nobody closes" and isolation == "guard"):
        assert objects(app.gl) == before


def test_a_closed_host_says_so(app: Application) -> None:
    host = pg.gl.Host.current()
    program = compiled(host)
    host.close()
    with pytest.raises(BackendError, match="closed"):
        program(frame=ROWS)
    with pytest.raises(BackendError, match="closed"):
        host.framebuffer()


@pytest.mark.parametrize("isolation", ISOLATIONS)
def test_frames_of_another_size(app: Application, isolation: Any) -> None:
    with pg.gl.Host.current(isolation) as host, compiled(host) as program:
        for size in ((WIDTH, HEIGHT), (5, 3), (1, 1), (64, 40)):
            rows = np.random.default_rng(size[0]).integers(0, 256, (*size[::-1], 4), np.uint8)
            got = run_once(app, host, program, rows)
            with pg.compile(blurred(pg.target("picture", "rgba8")), backend="gl", results="stored") as own:
                np.testing.assert_array_equal(got, own(frame=rows)["picture"])


@pytest.mark.slow
@pytest.mark.parametrize("isolation", ISOLATIONS)
def test_frame_after_frame_nothing_grows(app: Application, isolation: Any) -> None:
    """Neither objects in the engine's context nor memory of ours; the engine makes its textures anew now and then."""
    with pg.gl.Host.current(isolation) as host, compiled(host) as program:
        source, framebuffer = app.texture(0x8058, RGBA, BYTES, ROWS), target_of(app)
        multisampled = app.of_renderbuffer(0x8058, framebuffer, 4)

        def frames(count: int) -> tuple[int, int]:
            for number in range(count):
                program.run(frame=host.texture(source), into={"picture": host.framebuffer(framebuffer)})
                program.run(frame=host.framebuffer(framebuffer), into={"picture": host.framebuffer(framebuffer)})
                program.run(frame=host.framebuffer(multisampled), into={"picture": host.framebuffer(multisampled)})
                if number % 10 == 0:
                    name = app.texture(0x8058, RGBA, BYTES, ROWS)
                    program.run(frame=host.texture(name), into={"picture": host.texture(name)})
                    app.gl.delete("Texture", name)
            gc.collect()
            return len(objects(app.gl)), len(host.objects.alive)

        frames(20)
        tracemalloc.start()
        counted = frames(10)
        before = tracemalloc.get_traced_memory()[0]
        assert frames(30) == counted
        assert tracemalloc.get_traced_memory()[0] - before < 20_000
        tracemalloc.stop()


def test_a_texture_that_is_made_anew_under_its_name(app: Application) -> None:
    """What we have kept of a name is worth nothing when the engine has filled it again."""
    rows = np.random.default_rng(9).integers(0, 256, (HEIGHT + 2, WIDTH, 4), np.uint8)
    size = rows.shape[1::-1]
    with pg.gl.Host.current() as host, compiled(host) as program:
        name = app.texture(0x8058, RGBA, BYTES, None)
        old = host.texture(name)
        program.run(frame=ROWS, into={"picture": old})
        app.gl.BindTexture(g.TEXTURE_2D, name)
        app.gl.TexImage2D(g.TEXTURE_2D, 0, 0x8058, *size, 0, RGBA, BYTES, None)
        for given in ({"frame": old}, {"frame": ROWS, "into": {"picture": old}}):
            with pytest.raises(InputError, match="has 23x19 pixels now, and had 23x17"):
                program.run(**given)
        program.run(frame=rows, into={"picture": host.texture(name)})
        with pg.compile(blurred(pg.target("picture", "rgba8")), backend="gl", results="stored") as own:
            np.testing.assert_array_equal(app.pixels(app.of_texture(name), size=size), own(frame=rows)["picture"])
        app.gl.delete("Texture", name)
        for given in ({"frame": old}, {"frame": ROWS, "into": {"picture": old}}):
            with pytest.raises(InputError, match="is gone, and had 23x17"):
                program.run(**given)


@pytest.mark.parametrize("isolation", ISOLATIONS)
def test_two_programs_and_two_hosts_in_one_context(app: Application, isolation: Any) -> None:
    with pg.gl.Host.current(isolation) as one, pg.gl.Host.current("sibling") as other:
        programs = [(host, compiled(host)) for host in (one, one, other)]
        for _ in range(2):
            for host, program in programs:
                np.testing.assert_array_equal(run_once(app, host, program), expected())


def test_two_engines_in_one_process(app: Application) -> None:
    first, second = app, Application()
    hosts = []
    for engine in (first, second):
        engine.enter()
        host = pg.gl.Host.current()
        hosts.append((engine, host, compiled(host)))
    for _ in range(2):
        for engine, host, program in hosts:
            engine.enter()
            np.testing.assert_array_equal(run_once(engine, host, program), expected())
    picture = hosts[1][1].texture(second.texture(0x8058, RGBA, BYTES, ROWS))
    first.enter()
    with pytest.raises(InputError, match="is of another host"):
        hosts[0][2].run(frame=picture)
    for _, host, _ in hosts:
        host.close()
    second.close()
    app.enter()


@pytest.mark.parametrize("isolation", ISOLATIONS)
def test_an_error_in_a_run_leaves_the_engines_context(app: Application, isolation: Any) -> None:
    scaled = pg.kernel(source="def scaled(c: Image, by: float) -> vec4: return c[0, 0] * by")
    before = Current().state()

    def broken(_: Any) -> float:
        raise RuntimeError("no value today")

    value = pg.Value("by", float)
    graph = scaled(pg.Input("frame", "rgba8"), value.map(broken), into=pg.target("picture", "rgba8"))
    with pg.gl.Host.current(isolation) as host, pg.compile(graph, backend=host) as program:
        with pytest.raises(RuntimeError, match="no value today"):
            program.run(frame=ROWS, by=1.0, into={"picture": host.framebuffer(target_of(app))})
        assert Current().state() == before
        with compiled(host) as another:
            np.testing.assert_array_equal(run_once(app, host, another), expected())


#: What is wrong → what is done, and what is said.
WRONG: dict[str, tuple[Callable[[Application, pg.gl.Host], Any], str]] = {
    "no such texture": (lambda app, host: host.texture(4711), "there is no texture 4711"),
    "whole numbers": (
        lambda app, host: host.texture(app.texture(0x8D8E, 0x8D99, BYTES, None)), "holds whole numbers",
    ),
    "a region outside": (
        lambda app, host: host.texture(app.texture(0x8058, RGBA, BYTES, None), region=(1, 0, WIDTH, HEIGHT)),
        "is not inside of texture",
    ),
    "an origin": (
        lambda app, host: host.texture(app.texture(0x8058, RGBA, BYTES, None), origin="left"), "origin",
    ),
    "another size": (
        lambda app, host: compiled(host).run(
            frame=ROWS, into={"picture": host.texture(app.texture(0x8058, RGBA, BYTES, None, (8, 8)))}
        ),
        "takes a picture of 23x17 pixels, got 8x8",
    ),
    "depth as a result": (
        lambda app, host: compiled(host).run(
            frame=ROWS, into={"picture": host.texture(app.texture(0x81A6, DEPTH, FLOATS, None))}
        ),
        "is depth, which no pass writes",
    ),
    "too few channels": (
        lambda app, host: compiled(host).run(
            frame=ROWS, into={"picture": host.texture(app.texture(0x8229, 0x1903, BYTES, None))}
        ),
        r"8/0/0/0 bits for target format rgba8, which has 4 channel\(s\)",
    ),
    "an input of one channel": (
        lambda app, host: compiled(host).run(frame=host.texture(app.texture(0x8229, 0x1903, BYTES, None))),
        "is rgba8 with 4 channel",
    ),
    "one picture for two results": (lambda app, host: _twice(app, host), "for two outputs"),
    "an isolation": (lambda app, host: pg.gl.Host.current("none"), "isolation"),  # type: ignore[arg-type]
    "on another backend": (
        lambda app, host: pg.compile(blurred(pg.target("p", "rgba8")), backend="numpy").run(
            frame=host.texture(app.texture(0x8058, RGBA, BYTES, ROWS))
        ),
        "must be an array",
    ),
}  # fmt: skip


def _twice(app: Application, host: pg.gl.Host) -> None:
    frame = pg.Input("frame", "rgba8")
    same = pg.kernel(source="def same(c: Image) -> vec4: return c[0, 0]")
    graph = {name: same(frame, into=pg.target(name, "rgba8")) for name in ("a", "b")}
    picture = host.texture(app.texture(0x8058, RGBA, BYTES, None))
    pg.compile(graph, backend=host).run(frame=ROWS, into={"a": picture, "b": picture})


@pytest.mark.parametrize("name", WRONG)
def test_what_is_wrong_is_said(app: Application, name: str) -> None:
    do, said = WRONG[name]
    before = Current().state()
    with pg.gl.Host.current() as host, pytest.raises((InputError, BackendError, pg.GraphError), match=said):
        do(app, host)
    assert Current().state() == before
    assert app.gl.GetError() == g.NO_ERROR
