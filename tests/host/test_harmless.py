"""The engine notices nothing: its state is as it was, its objects too, and its state changes none of our pictures."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import passgraph as pg
from passgraph.backends.gl.guard import Guard
from passgraph.errors import BackendError
from tests.host.application import BYTES, HEIGHT, KEPT, RGBA, WIDTH, Application, Kept
from tests.host.gl_state import Dump, differences, objects, texture_parameters
from tests.host.hostile import OLD_STATES, STATES, More, make_hostile
from tests.host.test_reading import ISOLATIONS, of_host
from tests.host.test_writing import ROWS, blue, blurred, corner, expected

pytestmark = pytest.mark.gl


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
