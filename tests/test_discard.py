"""discard() in pixel kernels: zeros in every target, whatever it held, fused or not; in draws from functions too."""

from __future__ import annotations

from collections.abc import Iterator
from types import SimpleNamespace

import numpy as np
import pytest
from numpy.typing import NDArray

import passgraph as pg
from passgraph.backends.base import Backend
from passgraph.backends.registry import open_backend

HELD = np.random.default_rng(3).uniform(-2, 2, (11, 19, 4)).astype(np.float32)
CUT = """
def kept(value: float, least: float) -> float:
    if value < least: discard()
    return value

def cut(c: Image, least: float) -> vec4:
    p = c[0, 0]
    for i in range(clamp(int(p.y * 3.0), 0, 4)):
        p.z += kept(p.x, least) + float(i)
    if p.w > 1.5: discard()
    return p + 1.0
"""
TWICE = "def twice(c: Image) -> vec4: return c[0, 0] * 2.0 + vec4(1.0, 0.0, 0.0, 0.0)"


@pytest.fixture(scope="module", params=["reference", "numpy", "gl", "opencl", "webgpu"])
def backend(request: pytest.FixtureRequest) -> Iterator[Backend]:
    with open_backend(request.param) as opened:
        yield opened


def expected(picture: NDArray[np.float32], least: float) -> NDArray[np.float32]:
    made = picture.copy()
    trips = np.clip(np.trunc(picture[..., 1] * np.float32(3)), 0, 4).astype(int)
    for i in range(4):
        added = made[..., 2] + (picture[..., 0] + np.float32(i))
        made[..., 2] = np.where(i < trips, added, made[..., 2])
    gone = ((trips > 0) & (picture[..., 0] < np.float32(least))) | (picture[..., 3] > np.float32(1.5))
    return np.where(gone[..., None], np.float32(0), made + np.float32(1))


@pytest.mark.parametrize("fuse", [True, False])
def test_a_discarded_pixel_is_zero_and_its_readers_see_zeros(backend: Backend, fuse: bool) -> None:
    first = pg.kernel(source=CUT, name="cut")(
        pg.Input("c", "rgba32f", (19, 11)), least=0.25, into=pg.target("first", "rgba32f")
    )
    second = pg.kernel(source=TWICE)(first, into=pg.target("second", "rgba32f"))
    with pg.compile(second, backend, options=pg.Options(fuse=fuse)) as program:
        # The reference fuses nothing.
        assert len(program.plan.steps) == (1 if fuse and backend.name != "reference" else 2)
        found = np.asarray(program(c=HELD)["second"])
    wanted = expected(HELD, 0.25) * np.float32(2) + np.array([1, 0, 0, 0], np.float32)
    assert 0.2 < (expected(HELD, 0.25) == 0).all(-1).mean() < 0.8
    np.testing.assert_allclose(found, wanted, rtol=3e-7, atol=1e-6)


def test_a_discarded_pixel_forgets_what_a_target_held_the_run_before(backend: Backend) -> None:
    cut = pg.kernel(source=CUT, name="cut")
    made = cut(pg.Input("c"), least=pg.Value("least", float), into=pg.target("out", "rgba32f"))
    with pg.compile(made, backend) as program:
        program(c=HELD, least=-9.0)
        found = np.asarray(program(c=HELD, least=0.25)["out"])
    assert np.array_equal(found == 0, expected(HELD, 0.25) == 0)


DRAWN = """
class Corner:
    position: vec4
    uv: vec2

def place(v: Vertex) -> Corner: return Corner(vec4(v.position, 1.0), v.uv)
"""
HOLES = """
class Corner:
    position: vec4
    uv: vec2

def hole(uv: vec2, c: Image) -> float:
    total = 0.0
    for x in range(c.size.x):
        total += c.texel(ivec2(x, int(uv.y * 4.0))).x
    if total > 2.0: discard()
    return total

def holes(corner: Corner, c: Image) -> vec4: return vec4(hole(corner.uv, c), 1.0, 0.0, 1.0)
"""


def test_a_function_discards_a_fragment_after_a_loop_over_an_image(backend: Backend) -> None:
    corners = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], np.float32)
    uv = np.array([[0, 1], [1, 1], [1, 0], [0, 0]], np.float32)
    mesh = SimpleNamespace(positions=corners, triangles=np.array([[0, 1, 2], [0, 2, 3]], np.int32), uvs=uv)
    rows = np.array([[0, 1, 1], [1, 1, 1], [0, 0, 0], [2, 1, 0]], np.float32)
    picture = np.repeat(rows[..., None], 4, axis=-1)
    drawn = pg.draw(
        mesh, vertex=pg.vertex(source=DRAWN, name="place"), fragment=pg.fragment(source=HOLES, name="holes"),
        values={"c": pg.Input("c")}, into=pg.target("out", "rgba32f", size=(8, 8), clear=(0.5, 0.5, 0.5, 0.5)),
    )  # fmt: skip
    with pg.compile(drawn, backend) as program:
        found = np.asarray(program(c=picture)["out"])
    assert np.array_equal(found[::2, 0, 0], np.array([2.0, 0.5, 0.0, 0.5], np.float32))
