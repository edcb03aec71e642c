"""Passes of one run share what the context is set to: each sets what differs, and nothing leaks into the next."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from typing import Any

import moderngl
import numpy as np
import pytest

import passgraph as pg
from passgraph.backends.gl import GLBackend
from passgraph.graph.draw_state import Blend, Stencil
from tests.backends.test_uploads import CountedFunctions
from tests.corners import placed
from tests.offscreen import offscreen

pytestmark = pytest.mark.gl

SIZE, SMALL = (24, 16), (12, 10)
KERNELS = placed("""
def paint(corner: Corner) -> vec4:
    return vec4(0.25, 0.5, 0.75, 0.5)
""")
PLACE, PAINT = (pg.vertex(source=KERNELS, name="place"), pg.fragment(source=KERNELS, name="paint"))
HALF = pg.kernel(source="def half(c: Image) -> vec4: return c[-3, 1] * 0.5")
SUM = pg.kernel(source="def sum(c: Image, d: Image) -> vec4: return c[0, 0] + d.texel(ivec2(3, 2))")
FLIPPED = pg.kernel(source="def flipped(c: Image) -> vec4: return c.texel(output_size() - 1 - pixel())")
LOW = [[-1, -1, 0.5], [0.5, -1, 0.5], [-1, 0.5, 0.5]]
HIGH = [[1, 1, -0.5], [-0.5, 1, -0.5], [1, -0.5, -0.5]]
WIDE = [[-3, -1, 0.0], [1, -1, 0.0], [1, 3, 0.0]]

#: States that would show in the next pass if they stayed.
STATES: dict[str, dict[str, Any]] = {
    "plain": {},
    "blended": {"blend": Blend("source_alpha", "one")},
    "culled": {"cull": "front"},
    "other side": {"cull": "back"},
    "masked": {"color_mask": (True, False, True, False)},
    "depth kept": {"depth_write": False},
    "never": {"depth_compare": "never"},
    "stencilled": {"stencil": Stencil("equal", reference=3, write_mask=5, passed="invert")},
}


def drawn(corners: list[list[float]], name: str, state: str, size: tuple[int, int] = SIZE) -> pg.Target:
    into = pg.target(name, "rgba32f", size, clear=(0.125, 0.25, 0.5, 1.0))
    mesh = pg.Mesh.make(corners, [[0, 1, 2]])
    depth = pg.target(f"{name} depth", "depth32f_stencil8", size)
    made: pg.Target = pg.draw(mesh, vertex=PLACE, fragment=PAINT, into=into, depth=depth, **STATES[state])
    return made


def passed(kernel: Any, *images: pg.Target, name: str, size: tuple[int, int] = SIZE) -> pg.Target:
    made: pg.Target = kernel(*images, into=pg.target(name, "rgba32f", size))
    return made


def graph(first: str, second: str) -> dict[str, pg.Target]:
    """Draws of two states and of several meshes and sizes, passes before, between and behind them."""
    frame = pg.Input("frame", "rgba32f", SIZE)
    before = passed(HALF, frame, name="before")
    one = drawn(WIDE, "one", first)
    between = passed(SUM, before, one, name="between")
    two = drawn(HIGH, "two", second, SMALL)
    small = passed(FLIPPED, two, name="small", size=SMALL)
    three = drawn(LOW, "three", first)
    behind = passed(SUM, three, small, name="behind")
    targets = (before, one, between, two, small, three, behind)
    return {target.name: target for target in targets}


def picture() -> Any:
    return np.random.default_rng(3).random((SIZE[1], SIZE[0], 4), np.float32)


@pytest.mark.sampled
@pytest.mark.parametrize("order", [True, False], ids=["planned order", "order of writing"])
@pytest.mark.parametrize("second", STATES)
@pytest.mark.parametrize("first", ["plain", "blended", "culled", "masked", "stencilled"])
def test_a_run_gives_what_its_passes_give_alone(first: str, second: str, order: bool, gl: GLBackend) -> None:
    """Looked at behind every step, each pass is a run of its own, which sets everything."""
    options = pg.Options(fuse=False, static=False, order=order)
    with pg.compile(graph(first, second), backend=gl, options=options) as program:
        alone: dict[str, Any] = {}
        program.run(lambda _, pictures: alone.update(pictures), frame=picture())
        for _ in range(2):
            got = program(frame=picture())
            for name in got:
                np.testing.assert_array_equal(got[name], alone[name], err_msg=name)


@pytest.fixture(scope="module")
def gl() -> Any:
    with GLBackend() as backend:
        yield backend


def chain(passes: int) -> pg.Target:
    target: Any = pg.Input("frame", "rgba32f", SIZE)
    for number in range(passes):
        target = passed(HALF, target, name=f"pass {number}")
    made: pg.Target = target
    return made


def calls_of_a_run(backend: GLBackend, passes: int) -> Counter[str]:
    with pg.compile(chain(passes), backend=backend, options=pg.Options(fuse=False)) as program:
        program.run(frame=picture())
        counted = CountedFunctions(backend.context.gl)
        backend.context.gl = counted  # type: ignore[assignment]
        program.run(frame=picture())
        backend.context.gl = counted.inner
    return counted.calls


def test_a_further_pass_binds_its_target_and_image_and_draws() -> None:
    with GLBackend() as backend:
        one, four = (calls_of_a_run(backend, passes) for passes in (1, 4))
    more = four - one
    # and asks whether that went well
    assert more == {"BindFramebuffer": 3, "BindTexture": 3, "DrawArrays": 3, "check": 3}


def test_what_a_host_does_between_two_runs_changes_nothing() -> None:
    with GLBackend() as backend, pg.compile(graph("blended", "masked"), backend=backend) as program:
        expected = dict(program(frame=picture()))
        with backend.context as gl:
            host = moderngl.create_context(context=backend.context.native)
            texture = host.texture((4, 4), 4, dtype="f4")
            texture.use(0)
            host.framebuffer([texture]).use()
            host.viewport = (1, 1, 2, 2)
            host.sampler(repeat_x=True, repeat_y=True, texture=texture).use(0)
            host.enable(moderngl.BLEND | moderngl.CULL_FACE | moderngl.DEPTH_TEST)
            gl.ColorMask(0, 1, 0, 1)
            gl.BindVertexArray(0)
            program.run(frame=picture())
        for name, made in program.read().items():
            np.testing.assert_array_equal(made, expected[name], err_msg=name)


def test_a_host_that_enters_the_context_during_a_run_changes_nothing() -> None:
    """Derived values are computed when a pass first asks for them."""
    times = pg.kernel(source="def times(c: Image, by: float) -> vec4: return c[0, 0] * by")
    meddled: list[bool] = []

    def meddle(by: float) -> float:
        with backend.context as gl:
            gl.Enable(0x8C89)  # nothing is rasterised
            gl.Viewport(0, 0, 1, 1)
            gl.UseProgram(0)
        meddled.append(backend.in_run)
        return by

    value = pg.Value("by", float).map(meddle)
    first = passed(HALF, pg.Input("frame", "rgba32f", SIZE), name="first")
    last: pg.Target = times(first, value, into=pg.target("last", "rgba32f", SIZE))
    with GLBackend() as backend, pg.compile(last, backend=backend, options=pg.Options(fuse=False)) as program:
        got = program(frame=picture(), by=2.0)["last"]
    assert meddled == [True]
    shifted = picture()[np.minimum(np.arange(SIZE[1]) + 1, SIZE[1] - 1)][:, np.maximum(np.arange(SIZE[0]) - 3, 0)]
    np.testing.assert_array_equal(got, shifted)


def test_a_run_makes_the_context_current_once(monkeypatch: pytest.MonkeyPatch) -> None:
    with GLBackend() as backend, pg.compile(chain(5), backend=backend, options=pg.Options(fuse=False)) as program:
        program.run(frame=picture())
        with offscreen():
            current = backend.context.current
            before = current.state()
            changes: list[object] = []
            for name in ("change", "put_back"):
                whole = getattr(current, name)

                def count(now: object, after: object, whole: Callable[..., None] = whole) -> None:
                    changes.append(after)
                    whole(now, after)

                monkeypatch.setattr(current, name, count)
            program.run(frame=picture())
            # there and back, for the upload of the picture and all passes together
            assert changes == [backend.context._state, before]
            assert current.state() == before


def test_a_failing_pass_leaves_nothing_behind(monkeypatch: pytest.MonkeyPatch) -> None:
    with GLBackend() as backend, pg.compile(chain(2), backend=backend, options=pg.Options(fuse=False)) as program:
        expected = program(frame=picture())["pass 1"]
        with monkeypatch.context() as patch:
            patch.setattr(backend.context.gl, "DrawArrays", lambda *_: 1 / 0)
            with pytest.raises(ZeroDivisionError):
                program.run(frame=picture())
        assert not backend.in_run
        np.testing.assert_array_equal(program(frame=picture())["pass 1"], expected)
