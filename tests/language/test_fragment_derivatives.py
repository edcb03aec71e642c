"""Derivatives in fragment kernels: against the plane that a ray of each pixel meets, and against OpenGL's own."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

import moderngl
import numpy as np
import pytest
from numpy.typing import NDArray

import passgraph as pg
from passgraph.verify.compare import compare
from tests.conftest import DEVICES, present_devices, require
from tests.offscreen import offscreen

Numbers = NDArray[Any]
KERNELS = """
class Seen:
    position: vec4
    uv: vec2

def place(vertex: Vertex, camera: mat4) -> Seen:
    return Seen(camera * vec4(vertex.position, 1.0), vertex.uv)

def slopes(seen: Seen, picture: Image) -> tuple[vec4, vec4, vec4]:
    v = seen.uv.x * seen.uv.y
    deep = vec3(dfdx(fragment_depth()), dfdy(fragment_depth()), fragment_depth())
    product = vec4(dfdx(v), dfdy(v), fwidth(v), dfdx(dfdy(v)))
    return vec4(dfdx(seen.uv), dfdy(seen.uv)), product, vec4(deep, picture.lod(seen.uv))

def mipped(seen: Seen, picture: Image) -> vec4:
    return picture.sample(seen.uv, lod=picture.lod(seen.uv))

def branched(seen: Seen) -> vec4:
    v = seen.uv
    if (pixel().x // 2) % 2 == 0:
        discard()
    if v.x > v.y:
        v = v.yx * 2.0 + dfdx(v)
    return vec4(dfdy(v), fwidth(v))
"""
NEAR, FAR, SIZE, REPEATS = 0.5, 30.0, (45, 31), 3.0
#: A floor that leads away from the eye, turned: its corners, which lie at different distances and outside the view too.
CORNERS = np.array([[-2.0, -1.0, -1.0], [1.5, -0.8, -1.5], [-3.0, 0.3, -9.0], [4.0, 0.6, -12.0]])


def camera() -> Numbers:
    """Looks along -z; a pixel's ray goes through ((x + 0.5) / width * 2 - 1, 1 - (y + 0.5) / height * 2, -1)."""
    deep = -(FAR + NEAR) / (FAR - NEAR), -2.0 * FAR * NEAR / (FAR - NEAR)
    return np.array([[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, *deep], [0, 0, -1, 0]], np.float64)


def plane() -> tuple[Numbers, Numbers]:
    """Three corners of the floor and their texture coordinates; the fourth corner is made to lie in their plane."""
    uvs = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]) * REPEATS
    return CORNERS[:3], uvs


def floor() -> pg.Mesh:
    places, uvs = plane()
    whole = np.vstack([places, places[1] + places[2] - places[0]])
    return pg.Mesh.make(whole, [[0, 1, 2], [2, 1, 3]], uvs=np.vstack([uvs, uvs[1] + uvs[2] - uvs[0]]))


def met(x: Numbers, y: Numbers) -> Numbers:
    """Texture coordinates and depth where the rays of pixels meet the floor's plane, (h, w, 3)."""
    (a, b, c), uvs = plane()
    ray = np.stack([(x + 0.5) / SIZE[0] * 2 - 1, 1 - (y + 0.5) / SIZE[1] * 2, np.full(x.shape, -1.0)], axis=-1)
    # a + s (b - a) + t (c - a) = r ray
    sides = np.stack(np.broadcast_arrays(b - a, c - a, -ray), axis=-1)
    s, t, r = np.moveaxis(np.linalg.solve(sides, np.broadcast_to(-a, ray.shape)[..., None])[..., 0], -1, 0)
    uv = uvs[0] + s[..., None] * (uvs[1] - uvs[0]) + t[..., None] * (uvs[2] - uvs[0])
    depth = (camera()[2, 2] * -r + camera()[2, 3]) / r * 0.5 + 0.5
    return np.concatenate([uv, np.clip(depth, 0.0, 1.0)[..., None]], axis=-1)


def grown(value: Callable[[Numbers, Numbers], Numbers], axis: int) -> Numbers:
    """At the odd pixel of each quad less at the even one."""
    y, x = np.mgrid[0 : SIZE[1], 0 : SIZE[0]]
    odd = (x | 1, y) if axis == 0 else (x, y | 1)
    even = (x & ~1, y) if axis == 0 else (x, y & ~1)
    return np.asarray(value(*odd) - value(*even))


def drawn(name: str, **values: object) -> dict[str, pg.Target]:
    """The targets of a fragment kernel, -99 where there is no fragment."""
    place, fragment = pg.vertex(source=KERNELS, name="place"), pg.fragment(source=KERNELS, name=name)
    names = ("steps", "product", "rest") if name == "slopes" else ("out",)
    into = tuple(pg.target(target, "rgba32f", clear=(-99.0, -99.0, -99.0, -99.0)) for target in names)
    made = pg.draw(
        floor(), vertex=place, fragment=fragment, into=into, depth=pg.target("depth", "depth32f"), camera=camera(),
        **values,
    )  # fmt: skip
    return dict(zip(names, made if len(into) > 1 else (made,), strict=True))


@cache
def slopes(backend: str) -> tuple[dict[str, Numbers], Numbers]:
    """What a backend computes, and where there are fragments."""
    given = pg.Input("picture", "rgba8", (64, 16), default=np.zeros((16, 64, 4), np.float32))
    with pg.compile(drawn("slopes", picture=given), backend=backend, size=SIZE) as program:
        made = {name: np.asarray(target, np.float64) for name, target in program().items()}
    there = made["steps"][..., 0] > -99.0
    assert 0.2 < there.mean() < 0.95
    return made, there


@pytest.mark.parametrize("backend", ["reference", *DEVICES])
def test_a_plane_in_perspective_grows_as_rays_meet_it(backend: str) -> None:
    require(backend)

    def product(x: Numbers, y: Numbers) -> Numbers:
        return np.asarray(met(x, y)[..., 0] * met(x, y)[..., 1])

    across, down = grown(met, 0), grown(met, 1)
    of_both = grown(product, 0), grown(product, 1)
    made, there = slopes(backend)
    for name, expected in (
        ("steps", np.concatenate([across[..., :2], down[..., :2]], axis=-1)),
        ("product", np.stack([*of_both, abs(of_both[0]) + abs(of_both[1])], axis=-1)),
        ("rest", np.stack([across[..., 2], down[..., 2]], axis=-1)),
    ):
        # Corners are rounded to 1/256 pixel, and drivers place them as finely as they like.
        made_there = made[name][there][:, : expected.shape[-1]]
        np.testing.assert_allclose(made_there, expected[there], rtol=0.01, atol=5e-4)


@pytest.mark.parametrize("backend", ["reference", *DEVICES])
def test_the_level_of_detail_is_that_of_the_plane(backend: str) -> None:
    require(backend)
    steps = [grown(lambda x, y: met(x, y)[..., :2] * (64, 16), axis) for axis in (0, 1)]
    expected = np.log2(np.maximum(*(np.linalg.norm(step, axis=-1) for step in steps)))
    made, there = slopes(backend)
    np.testing.assert_allclose(made["rest"][there][:, 3], expected[there], atol=0.03)
    assert np.ptp(expected[there]) > 2.0


@pytest.mark.gl
def test_shaders_of_opengl_have_the_same() -> None:
    """Of the driver's own varyings and their fine derivatives, written in GLSL 4.50; row 0 of both is the top one."""
    mesh = floor()
    with offscreen() as context:
        program = context.program(
            vertex_shader="""#version 450
            layout(location = 0) in vec3 at; layout(location = 1) in vec2 given; uniform mat4 camera; out vec2 uv;
            void main() { gl_Position = vec4(1, -1, 1, 1) * (camera * vec4(at, 1)); uv = given; }""",
            fragment_shader="""#version 450
            in vec2 uv; layout(location = 0) out vec4 steps; layout(location = 1) out vec4 product;
            void main() {
                float v = uv.x * uv.y;
                steps = vec4(dFdxFine(uv), dFdyFine(uv));
                product = vec4(dFdxFine(v), dFdyFine(v), fwidthFine(v), dFdxFine(dFdyFine(v)));
            }""",
        )
        program["camera"].write(camera().T.astype(np.float32).tobytes())  # type: ignore[union-attr]
        corners = np.column_stack([mesh.positions, mesh.uvs]).astype(np.float32)[mesh.triangles.reshape(-1)]
        targets = [context.texture(SIZE, 4, dtype="f4") for _ in range(2)]
        context.framebuffer(targets).use()
        context.clear(-99.0, -99.0, -99.0, -99.0)
        vertices = context.vertex_array(program, [(context.buffer(corners.tobytes()), "3f 2f", "at", "given")])
        vertices.render(moderngl.TRIANGLES)
        theirs = [np.frombuffer(made.read(), np.float32).reshape(SIZE[1], SIZE[0], 4) for made in targets]
    ours, there = slopes("gl")
    np.testing.assert_array_equal(there, theirs[0][..., 0] > -99.0)
    for name, made in zip(("steps", "product"), theirs, strict=True):
        np.testing.assert_allclose(ours[name][there], made[there], rtol=2e-3, atol=1e-4)


@pytest.mark.parametrize(("name", "size"), [("branched", (1, 1)), ("branched", (45, 31)), ("mipped", (21, 13))])
def test_backends_agree_beside_holes_and_edges(name: str, size: tuple[int, int]) -> None:
    texels = np.random.default_rng(1).random((7, 9, 4), np.float32)
    given = pg.Input("picture", "rgba8", (9, 7), default=texels).border("repeat").mipmaps()
    report = compare(
        drawn(name, **({"picture": given} if name == "mipped" else {})), backends=present_devices(), size=size
    )
    assert all(ran.passed for ran in report.backends), str(report)


@pytest.mark.parametrize("backend", ["reference", *DEVICES])
def test_depths_end_at_0_and_1_whatever_their_offset(backend: str) -> None:
    """The depth plane of what is behind an offset goes on, what a fragment has of it does not."""
    require(backend)
    text = KERNELS + "\ndef run(seen: Seen) -> vec4: return vec4(fragment_depth(), dfdx(fragment_depth()), 0.0, 1.0)"
    made = pg.draw(
        floor(), vertex=pg.vertex(source=text, name="place"), fragment=pg.fragment(source=text, name="run"),
        into=pg.target("out", "rgba32f"), depth=pg.target("depth", "depth32f"), camera=camera(), depth_compare="always",
        polygon_offset=(50.0, 0.0),
    )  # fmt: skip
    with pg.compile(made, backend=backend, size=SIZE) as program:
        picture = program()["out"]
    assert picture[..., 0].max() == 1.0
    ended = (picture[..., 0] == 1.0)[:, 10:20].all(axis=1)
    assert (picture[ended, 10:20, 1] == 0.0).all()
    assert ended.any()


def test_kernels_of_fragments_with_derivatives_travel() -> None:
    with pg.compile(drawn("branched"), backend="reference", size=SIZE) as program:
        expected, data = program()["out"], program.to_data()
    with pg.compile(pg.from_data(data), backend="reference", size=SIZE) as program:
        np.testing.assert_array_equal(program()["out"], expected)
