"""Draws as only OpenGL has them: drivers that lack something, and state that others leave behind."""

from __future__ import annotations

import sys
from typing import Any

import numpy as np
import pytest

import passgraph as pg
from passgraph import vec4
from passgraph.backends.gl import GLBackend
from passgraph.errors import BackendError

pytestmark = pytest.mark.gl
SIZE = (16, 12)
RED, GREEN, HALF_BLUE = (1.0, 0.0, 0.0, 1.0), (0.0, 1.0, 0.0, 1.0), (0.0, 0.0, 1.0, 0.5)


class Soup:
    """Triangles in window pixels, row 0 on top, with a depth in 0 to 1 and a colour for each vertex."""

    def __init__(self, corners: Any, colors: Any = RED, depth: Any = 0.5) -> None:
        corners = np.asarray(corners, np.float64).reshape(-1, 2)
        count = len(corners)
        x, y = corners[:, 0] / SIZE[0] * 2 - 1, 1 - corners[:, 1] / SIZE[1] * 2
        z = np.broadcast_to(np.asarray(depth, np.float64) * 2 - 1, (count,))
        self.positions = np.stack([x, y, z], 1).astype(np.float32)
        self.triangles = np.arange(count, dtype=np.int32).reshape(-1, 3)
        self.colors = np.broadcast_to(np.asarray(colors, np.float32), (count, 4)).copy()


def box(left: float, top: float, right: float, bottom: float) -> list[tuple[float, float]]:
    """Two triangles, counter-clockwise as seen with y up."""
    a, b, c, d = (left, top), (left, bottom), (right, bottom), (right, top)
    return [a, b, c, a, c, d]


@pg.struct
class Painted:
    position: vec4
    color: vec4


@pg.vertex
def place(vertex: pg.Vertex) -> Painted:
    return Painted(vec4(vertex.position, 1.0), vertex.color)


@pg.fragment
def paint(painted: Painted) -> vec4:
    return painted.color


@pg.fragment
def twice(painted: Painted) -> tuple[vec4, vec4]:
    return painted.color, painted.color * 0.5


def run(targets: dict[str, Any], backend: str = "gl") -> dict[str, np.ndarray]:
    with pg.compile(targets, backend=backend, size=SIZE) as program:
        return dict(program())


def agree(build: Any) -> dict[str, np.ndarray]:
    """The same on gl and on the reference."""
    got, expected = run(build(), "gl"), run(build(), "reference")
    for name, picture in expected.items():
        np.testing.assert_array_equal(got[name], picture, err_msg=name)
    return got


@pytest.mark.parametrize("size", [(16, 12), (15, 11)], ids=str)
@pytest.mark.parametrize("step", [1.0, 0.5, 0.25, 1 / 256])
def test_coverage_is_the_reference_s_on_the_subpixel_grid(
    step: float, size: tuple[int, int], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys.modules[__name__], "SIZE", size)
    # Some corners lie outside the target: cutting there would move edges.
    corners = np.round(np.random.default_rng(5).uniform(-4, 18, (600, 2)) / step) * step
    agree(lambda: {"count": pg.draw(Soup(corners), vertex=place, fragment=paint, blend="add",
                                    into=pg.target("count", format="rgba32f"))})  # fmt: skip


def test_different_blends_are_refused_where_the_driver_has_none(monkeypatch: pytest.MonkeyPatch) -> None:
    into = (pg.target("a", format="rgba32f"), pg.target("b", format="rgba32f"))
    a, b = pg.draw(Soup(box(0, 0, 8, 12)), vertex=place, fragment=twice, into=into, blend=("add", "alpha"))
    with GLBackend() as backend:
        monkeypatch.setattr(backend.context.gl, "BlendFuncSeparatei", None)
        with pytest.raises(BackendError, match=r"blends its targets in different ways, which takes OpenGL 4\.0"):
            pg.compile({"a": a, "b": b}, backend=backend, size=SIZE)()


def test_state_that_others_left_behind_changes_nothing() -> None:
    mesh = Soup(box(2, 1, 14, 11), (0.25, 0.5, 0.75, 1.0))
    with GLBackend() as backend:
        target = pg.draw(
            mesh,
            vertex=place,
            fragment=paint,
            into=pg.target("color", format="rgba32f"),
            depth=pg.target("depth", format="depth32f"),
        )
        copy = pg.kernel(source="def copy(image: Image) -> vec4: return image[0, 0]")
        copied = copy(target, into=pg.target("copy", format="rgba32f"))
        with pg.compile({"color": target, "copy": copied}, backend=backend, size=SIZE) as program:
            expected = dict(program())
        # Compiled again: what depends on no input runs once only.
        with pg.compile({"color": target, "copy": copied}, backend=backend, size=SIZE) as program:
            with backend.context as gl:
                for switch in (0xBE2, 0xB44, 0xB71, 0xB90, 0xC11, 0x8C89, 0x8037, 0xBF2, 0x3000):
                    gl.Enable(switch)
                gl.FrontFace(0x901)
                gl.CullFace(0x408)
                gl.DepthFunc(0x200)
                gl.DepthMask(0)
                gl.StencilFunc(0x200, 1, 0xFF)
                gl.ColorMask(0, 1, 0, 1)
                gl.PolygonMode(0x408, 0x1B01)
                gl.PolygonOffset(100.0, 100.0)
                gl.Viewport(3, 3, 2, 2)
                gl.PixelStorei(0xD02, 64)
                gl.PixelStorei(0xCF2, 64)
            got = dict(program())
    for name, picture in expected.items():
        np.testing.assert_array_equal(got[name], picture, err_msg=name)


def test_an_offset_is_the_same_where_the_driver_has_larger_units() -> None:
    """NVIDIA's units are twice Mesa's: a driver's own are measured, and the draw asks for fewer of them."""
    depths, units = [], []
    for times in (1.0, 2.0):
        with GLBackend() as backend:
            own = backend.context.gl.PolygonOffset
            backend.context.gl.PolygonOffset = lambda factor, units, own=own, times=times: own(factor, times * units)
            made = pg.draw(
                Soup(box(0, 0, *SIZE), depth=0.75), vertex=place, fragment=paint, into=pg.target("color", "rgba8"),
                depth=pg.target("depth", "depth32f"), depth_compare="always", polygon_offset=(0.0, 4000.0),
            )  # fmt: skip
            with pg.compile({"depth": made.depth, "color": made}, backend=backend, size=SIZE) as program:
                depths.append(program()["depth"])
            units.append(backend.offset_unit())
    assert units[1] == 2 * units[0]
    assert np.array_equal(*depths)
    assert depths[0].max() == np.float32(0.75 + 4000 * 2.0**-24)
