"""Every state of a draw on every backend against the reference: same coverage, same order, same result.

A pixel may differ where a depth or stencil comparison ties within rounding, or where a triangle's edge passes
within 1/256 pixel of a centre; how many such pixels a case has is counted and has a ceiling.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

import passgraph as pg
from passgraph.draw_state import BLENDS, COMPARE, EQUATIONS, FACTORS, STENCIL_OPERATIONS, Blend, Stencil
from passgraph.language.kernel import Kernel, kernel_from_text

sys.path.insert(0, str(Path(__file__).parent))
from meshes import Soup, quad, soup

SIZE = (83, 61)
#: Interpolated colours and depths: a few operations in float32 on numbers below 1 (rasterisation rule 5).
INTERPOLATION = 64 * 2.0**-24
#: A driver may evaluate a triangle's planes at corners that it has not rounded to 1/256 pixel (llvmpipe does): each of
#: three corners is off by up to half of that on either axis.
SNAPPING = 3 * 2 * (1 / 512)
#: Share of pixels that may differ because a comparison ties within that; the ceiling keeps the check from going empty.
AMBIGUOUS_SHARE = 0.004

KERNELS = """
class Corner:
    position: vec4
    color: vec4

def place(vertex: Vertex) -> Corner:
    return Corner(vec4(vertex.position, 1.0), vertex.color)

def lean(vertex: Vertex) -> Corner:
    w = 1.5 + vertex.position.x
    return Corner(vec4(vertex.position.xy, vertex.position.z * w, w), vertex.color)

def paint(corner: Corner) -> vec4:
    return corner.color

def holes(corner: Corner) -> vec4:
    if (pixel().x + pixel().y) % 3 == 0:
        discard()
    return corner.color

def two(corner: Corner) -> tuple[vec4, float]:
    return corner.color, 1.0 if front_facing() else 0.25
"""


def stage(name: str) -> Kernel:
    kind = "vertex" if name in ("place", "lean") else "fragment"
    return Kernel(kernel_from_text(KERNELS, kind, name), kind)


def draw_twice(name: str, **state: object) -> dict[str, pg.Target]:
    """A cleared draw, and one over it in the state under test."""
    fragment = stage(str(state.pop("fragment", "paint")))
    vertex = stage(str(state.pop("vertex", "place")))
    mesh = state.pop("mesh", None) or soup(40, seed=11)
    color_format, depth_format = str(state.pop("format", "rgba32f")), "depth32f_stencil8"
    base = pg.draw(
        soup(12, seed=5), vertex=stage("place"), fragment=stage("paint"),
        into=pg.target("color", color_format, clear=0.25),
        depth=pg.target("depth", depth_format), name="base", stencil=Stencil(passed="increment"),
    )  # fmt: skip
    over = pg.draw(mesh, vertex=vertex, fragment=fragment, into=base, depth=base.depth, name=name, **state)
    return {"color": over, "depth": over.depth}


def run(outputs: dict[str, pg.Target], backend: str) -> dict[str, NDArray[np.float32]]:
    with pg.compile(outputs, backend=backend, size=SIZE) as program:
        return dict(program())


def slope(picture: NDArray[np.float32]) -> NDArray[np.float64]:
    """The largest change from a pixel to a neighbour, over channels."""
    padded = np.pad(picture.astype(np.float64), ((1, 1), (1, 1), (0, 0)), "edge")
    middle = padded[1:-1, 1:-1]
    sides = (padded[:-2, 1:-1], padded[2:, 1:-1], padded[1:-1, :-2], padded[1:-1, 2:])
    steps = np.stack([np.abs(side - middle).max(axis=-1) for side in sides])
    return np.asarray(steps.max(axis=0))


def assert_agree(outputs: dict[str, pg.Target], backend: str, quantum: float = 0.0) -> None:
    expected, got = run(outputs, "reference"), run(outputs, backend)
    for name in expected:
        bound = INTERPOLATION + quantum + SNAPPING * slope(expected[name])
        wrong = np.abs(got[name] - expected[name]).max(axis=-1) > bound
        assert wrong.mean() <= AMBIGUOUS_SHARE, (
            f"{name}: {wrong.sum()} pixels differ, first (y, x) = {np.argwhere(wrong)[0]}"
        )
    assert np.ptp(expected["color"]) > 0.1, "an empty picture proves nothing"
    again = run(outputs, backend)
    for name in got:
        np.testing.assert_array_equal(got[name], again[name])


@pytest.mark.parametrize("cull", ["none", "back", "front"])
@pytest.mark.parametrize("vertex", ["place", "lean"])
def test_cull(cull: str, vertex: str, backend_name: str) -> None:
    assert_agree(draw_twice("over", cull=cull, vertex=vertex), backend_name)


@pytest.mark.parametrize("write", [True, False])
@pytest.mark.parametrize("compare", COMPARE)
def test_depth(compare: str, write: bool, backend_name: str) -> None:
    assert_agree(draw_twice("over", depth_compare=compare, depth_write=write), backend_name)


@pytest.mark.parametrize("compare", COMPARE)
def test_stencil_compare(compare: str, backend_name: str) -> None:
    stencil = Stencil(compare, reference=1, read_mask=3, passed="invert")
    assert_agree(draw_twice("over", stencil=stencil), backend_name)


@pytest.mark.parametrize("operation", STENCIL_OPERATIONS)
@pytest.mark.parametrize("moment", ["fail", "depth_fail", "passed"])
def test_stencil_operation(operation: str, moment: str, backend_name: str) -> None:
    """The operation leaves its mark in the stencil, which a last draw makes visible."""
    stencil = Stencil("less_equal", reference=2, write_mask=0x0F, **{moment: operation})  # type: ignore[arg-type]
    over = draw_twice("over", stencil=stencil)["color"]
    seen = over
    for value in range(4):
        mark = quad(color=(value / 4, 1 - value / 4, 0.5, 1))
        seen = pg.draw(
            mark, vertex=stage("place"), fragment=stage("paint"), into=seen, depth=seen.depth, name=f"mark {value}",
            depth_compare="always", depth_write=False, stencil=Stencil("equal", reference=value, read_mask=3),
        )  # fmt: skip
    assert_agree({"color": seen, "depth": seen.depth}, backend_name)


@pytest.mark.parametrize("factor", FACTORS)
def test_blend_factor(factor: str, backend_name: str) -> None:
    blend = Blend(factor, "one_minus_source_alpha", source_alpha="one", destination_alpha=factor)
    assert_agree(draw_twice("over", blend=blend, depth_compare="always"), backend_name, quantum=2.0**-18)


@pytest.mark.parametrize("equation", EQUATIONS)
def test_blend_equation(equation: str, backend_name: str) -> None:
    blend = Blend("source_alpha", "destination_color", equation)
    assert_agree(draw_twice("over", blend=blend, depth_compare="always"), backend_name, quantum=2.0**-18)


@pytest.mark.parametrize(("format", "quantum"), [("rgba8", 2 / 255), ("rgba16f", 2.0**-10), ("rgba16", 2 / 65535)])
def test_blend_into_format(format: str, quantum: float, backend_name: str) -> None:
    """Blending quantises after each triangle: a rounding that falls the other way is a step, and may meet a second."""
    outputs = draw_twice("over", blend="alpha", format=format, mesh=soup(6, 3))
    assert_agree(outputs, backend_name, quantum)


@pytest.mark.parametrize("name", BLENDS)
def test_named_blend(name: str, backend_name: str) -> None:
    assert_agree(draw_twice("over", blend=name, mesh=soup(8, 9)), backend_name, quantum=2.0**-18)


@pytest.mark.parametrize("mask", [(True, False, True, False), (False, False, False, False), (False, True, True, True)])
def test_color_mask(mask: tuple[bool, ...], backend_name: str) -> None:
    assert_agree(draw_twice("over", color_mask=mask), backend_name)


@pytest.mark.parametrize("offset", [(0.0, 4000.0), (1.5, 0.0), (-2.0, -8000.0)])
def test_polygon_offset(offset: tuple[float, float], backend_name: str) -> None:
    # The slope is multiplied by the factor: its rounding too.
    assert_agree(draw_twice("over", polygon_offset=offset, depth_compare="less_equal"), backend_name, quantum=2.0**-18)


def test_discard(backend_name: str) -> None:
    outputs = draw_twice("over", fragment="holes", stencil=Stencil("always", passed="increment", depth_fail="zero"))
    assert_agree(outputs, backend_name)


def test_several_targets(backend_name: str) -> None:
    color, facing = pg.draw(
        soup(30, 2), vertex=stage("lean"), fragment=stage("two"), depth=pg.target("depth", "depth32f"),
        into=(pg.target("color", "rgba32f"), pg.target("facing", "r8")),
    )  # fmt: skip
    assert_agree({"color": color, "facing": facing, "depth": color.depth}, backend_name)


def test_depth_only(backend_name: str) -> None:
    depth = pg.draw(soup(30, 2), vertex=stage("lean"), depth=pg.target("depth", "depth32f"))
    expected, got = run({"depth": depth}, "reference"), run({"depth": depth}, backend_name)
    bound = INTERPOLATION + SNAPPING * slope(expected["depth"])
    assert (np.abs(got["depth"] - expected["depth"])[..., 0] > bound).mean() <= AMBIGUOUS_SHARE
    assert (expected["depth"] < 1).mean() > 0.2


def test_every_pixel_of_a_quad_is_hit_once(backend_name: str) -> None:
    """Two triangles that share an edge, added: 1 everywhere, not 0 and not 2."""
    seam = pg.draw(
        quad(),
        vertex=stage("place"),
        fragment=stage("paint"),
        into=pg.target("color", "rgba32f"),
        blend="add",
    )
    np.testing.assert_array_equal(run({"color": seam}, backend_name)["color"], 1.0)


def test_a_fan_of_slivers_is_hit_once(backend_name: str) -> None:
    """Hundreds of thin triangles around a point inside the picture: no pixel twice, none missed."""
    random = np.random.default_rng(0)
    angles = np.sort(random.uniform(0, 2 * np.pi, 400))
    rim = np.stack([np.cos(angles) * 3, np.sin(angles) * 3, np.zeros_like(angles)], -1)
    positions = np.concatenate([[[0.013, -0.021, 0.0]], rim]).astype(np.float32)
    k = np.arange(400, dtype=np.int32)
    fan = Soup(positions, np.stack([np.zeros_like(k), 1 + k, 1 + (k + 1) % 400], -1), np.ones((401, 4), np.float32))
    hit = pg.draw(fan, vertex=stage("place"), fragment=stage("paint"), into=pg.target("color", "rgba32f"), blend="add")
    np.testing.assert_array_equal(run({"color": hit}, backend_name)["color"], 1.0)


def test_near_plane_and_guard_band_clip(backend_name: str) -> None:
    """Triangles through the eye and far outside the picture."""
    mesh = soup(30, seed=4, size=30.0, depth=(-3.0, 3.0))
    assert_agree(draw_twice("over", mesh=mesh, vertex="lean"), backend_name, quantum=2.0**-12)


def test_degenerate_triangles_draw_nothing(backend_name: str) -> None:
    flat = Soup(np.zeros((3, 3), np.float32), np.array([[0, 1, 2], [0, 0, 1]], np.int32), np.ones((3, 4), np.float32))
    out = pg.draw(flat, vertex=stage("place"), fragment=stage("paint"), into=pg.target("color", "rgba32f"))
    assert not run({"color": out}, backend_name)["color"].any()


@pytest.mark.parametrize("size", [(1, 1), (1, 7), (65, 1), (64, 64), (129, 3)])
def test_any_size(size: tuple[int, int], backend_name: str) -> None:
    out = pg.draw(
        quad(color=(1, 0.5, 0.25, 1)),
        vertex=stage("place"),
        fragment=stage("paint"),
        into=pg.target("color", "rgba32f"),
    )
    with pg.compile(out, backend=backend_name, size=size) as program:
        picture = program()["color"]
    assert picture.shape == (size[1], size[0], 4)
    np.testing.assert_allclose(picture, np.broadcast_to(np.float32([1, 0.5, 0.25, 1]), picture.shape), atol=2.0**-22)


def test_row_zero_is_on_top(backend_name: str) -> None:
    top = Soup(
        np.array([[-1, 0, 0], [1, 0, 0], [1, 1, 0], [-1, 1, 0]], np.float32),
        np.array([[0, 1, 2], [0, 2, 3]], np.int32), np.ones((4, 4), np.float32),
    )  # fmt: skip
    out = pg.draw(top, vertex=stage("place"), fragment=stage("paint"), into=pg.target("color", "rgba32f"), cull="back")
    with pg.compile(out, backend=backend_name, size=(8, 8)) as program:
        picture = program()["color"][..., 0]
    np.testing.assert_array_equal(picture[:4], 1.0)
    np.testing.assert_array_equal(picture[4:], 0.0)
