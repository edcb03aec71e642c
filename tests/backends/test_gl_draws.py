"""Draws of the gl backend, held against the reference and against what can be counted by hand."""

from __future__ import annotations

import sys
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

import passgraph as pg
from passgraph import vec2, vec3, vec4
from passgraph.backends.gl import GLBackend
from passgraph.errors import BackendError
from passgraph.graph.draw_state import Blend, Stencil
from passgraph.verify.compare import compare

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
def sides(painted: Painted) -> vec2:
    return vec2(1.0 if pg.front_facing() else 0.0, pg.fragment_depth())


@pg.fragment
def holes(painted: Painted) -> vec4:
    if pg.pixel().x % 2 == 1:
        pg.discard()
    return painted.color


@pg.fragment
def where(painted: Painted) -> vec2:
    return vec2(pg.pixel())


@pg.fragment
def twice(painted: Painted) -> tuple[vec4, vec4]:
    return painted.color, painted.color * 0.5


def run(targets: dict[str, Any], backend: str = "gl") -> dict[str, np.ndarray]:
    with pg.compile(targets, backend=backend, size=SIZE) as program:
        return dict(program())


def drawn(
    mesh: Soup, fragment: Any = paint, *, format: str = "rgba32f", backend: str = "gl", **state: Any
) -> np.ndarray:
    into = pg.target("color", format=format)
    target = pg.draw(mesh, vertex=place, fragment=fragment, into=into, **state)
    return run({"color": target}, backend)["color"]


def agree(build: Any) -> dict[str, np.ndarray]:
    """The same on gl and on the reference."""
    got, expected = run(build(), "gl"), run(build(), "reference")
    for name, picture in expected.items():
        np.testing.assert_array_equal(got[name], picture, err_msg=name)
    return got


def conform(targets: dict[str, Any]) -> None:
    """What the oracle allows."""
    (report,) = compare(targets, ["gl"], size=SIZE).backends
    assert report.within_bounds, report.failed or str(report.first_divergence)


# Where pixels are


def test_row_0_is_on_top() -> None:
    got = drawn(Soup(box(2, 1, 5, 3)))
    assert np.argwhere(got[..., 0] == 1).tolist() == [[y, x] for y in (1, 2) for x in (2, 3, 4)]


def test_pixel_positions_count_from_the_top() -> None:
    got = drawn(Soup(box(0, 0, 16, 12)), where, format="rg32f")
    assert got[0, 0].tolist() == [0, 0] and got[11, 15].tolist() == [15, 11]


def test_edges_through_pixel_centres_belong_to_top_and_left() -> None:
    got = drawn(Soup(box(1.5, 1.5, 4.5, 4.5)))
    assert np.argwhere(got[..., 0] == 1).tolist() == [[y, x] for y in (1, 2, 3) for x in (1, 2, 3)]


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


def test_shared_edges_are_hit_once() -> None:
    rim = [(8 + 7 * np.cos(angle), 6 + 5 * np.sin(angle)) for angle in range(7)]
    fan = [corner for pair in pairwise(rim) for corner in ((8, 6), *pair)]
    assert drawn(Soup(fan), blend="add")[..., 0].max() == 1


# Facing


def test_counter_clockwise_is_front() -> None:
    assert drawn(Soup(box(0, 0, 16, 12)), sides, format="rg32f")[..., 0].all()
    assert not drawn(Soup(box(0, 0, 16, 12)[::-1]), sides, format="rg32f")[..., 0].any()


@pytest.mark.parametrize(("cull", "fronts", "backs"), [("none", 1, 1), ("back", 1, 0), ("front", 0, 1)])
def test_culling_drops_a_side(cull: str, fronts: int, backs: int) -> None:
    got = drawn(Soup(box(0, 0, 8, 12) + box(8, 0, 16, 12)[::-1]), cull=cull)
    assert (got[5, 3, 0], got[5, 12, 0]) == (fronts, backs)


# Varyings


def test_varyings_are_interpolated_as_the_reference_does() -> None:
    colors = np.random.default_rng(2).random((6, 4), np.float32)
    conform({"color": pg.draw(Soup(box(1, 1, 15, 11), colors), vertex=place, fragment=paint,
                                    into=pg.target("color", format="rgba32f"))})  # fmt: skip


@pg.struct
class Many:
    position: vec4
    a: vec3
    b: vec3
    c: float


@pg.vertex
def spread(vertex: pg.Vertex) -> Many:
    return Many(vec4(vertex.position, 1.0), vertex.color.rgb, vertex.color.gbr, vertex.color.a)


@pg.fragment
def gathered(many: Many) -> vec4:
    return vec4(many.a.x, many.b.y, many.a.z, many.c)


def test_varyings_are_packed_across_vectors() -> None:
    mesh = Soup(box(0, 0, 16, 12), (0.25, 0.5, 0.75, 0.125))
    target = pg.draw(mesh, vertex=spread, fragment=gathered, into=pg.target("color", format="rgba32f"))
    assert run({"color": target})["color"][3, 3].tolist() == [0.25, 0.75, 0.75, 0.125]


@pg.vertex
def tilted(vertex: pg.Vertex, w: float) -> Painted:
    p = vertex.position
    return Painted(vec4(p, 1.0) * (1.0 + w * (p.x + 1.0)), vertex.color)


def test_varyings_are_perspective_correct() -> None:
    colors = np.random.default_rng(2).random((6, 4), np.float32)
    conform({"color": pg.draw(Soup(box(1, 1, 15, 11), colors), vertex=tilted, fragment=paint, w=2.0,
                                    into=pg.target("color", format="rgba32f"))})  # fmt: skip


def test_attributes_that_a_mesh_lacks_have_their_default() -> None:
    mesh = Soup(box(0, 0, 16, 12))
    del mesh.colors
    assert drawn(mesh)[0, 0].tolist() == [1, 1, 1, 1]


# Depth


def two_boxes() -> tuple[Soup, Soup]:
    return Soup(box(0, 0, 10, 12), RED, 0.25), Soup(box(6, 0, 16, 12), GREEN, 0.75)


@pytest.mark.parametrize(
    "compare", ["never", "less", "equal", "less_equal", "greater", "not_equal", "greater_equal", "always"]
)
def test_depth_compares_as_the_reference_does(compare: str) -> None:
    def build() -> dict[str, Any]:
        near, far = two_boxes()
        first = pg.draw(near, vertex=place, fragment=paint, into=pg.target("color", format="rgba32f"),
                        depth=pg.target("depth", format="depth32f"), depth_compare="always")  # fmt: skip
        second = pg.draw(far, vertex=place, fragment=paint, into=first, depth=first.depth, depth_compare=compare)
        return {"color": second, "depth": second.depth}

    agree(build)


def test_depth_stays_when_it_is_not_written() -> None:
    mesh = Soup(box(0, 0, 16, 12), RED, 0.25)
    target = pg.draw(mesh, vertex=place, fragment=paint, into=pg.target("color", format="rgba32f"),
                     depth=pg.target("depth", format="depth32f"), depth_write=False)  # fmt: skip
    assert (run({"depth": target.depth})["depth"] == 1).all()


def test_a_depth_only_draw_needs_no_fragment_kernel() -> None:
    target = pg.draw(Soup(box(2, 1, 5, 3), depth=0.25), vertex=place, depth=pg.target("depth", format="depth32f"))
    got = run({"depth": target})["depth"][..., 0]
    assert got[1, 2] == 0.25 and got[0, 0] == 1 and np.count_nonzero(got == 0.25) == 6


def test_a_depth_target_is_read_by_a_later_pass() -> None:
    depth = pg.draw(Soup(box(2, 1, 5, 3), depth=0.25), vertex=place, depth=pg.target("depth", format="depth32f"))
    copy = pg.kernel(source="def copy(image: Image) -> float: return image[0, 0].r")
    got = run({"copy": copy(depth, into=pg.target("copy", format="r32f"))})["copy"][..., 0]
    assert got[1, 2] == 0.25 and got[0, 0] == 1


def test_the_fragment_depth_is_the_stored_one() -> None:
    assert drawn(Soup(box(0, 0, 16, 12), depth=0.375), sides, format="rg32f")[5, 5, 1] == 0.375


def test_the_near_plane_cuts() -> None:
    corners, depth = box(1, 1, 15, 11), [-0.5, -0.5, 1.0, -0.5, 1.0, 1.0]
    conform({"depth": pg.draw(Soup(corners, depth=depth), vertex=place,
                                    depth=pg.target("depth", format="depth32f"))})  # fmt: skip


@pytest.mark.parametrize("offset", [(1.0, 0.0), (0.0, 4.0), (-2.0, 100.0)])
def test_polygon_offset_moves_depth_as_the_reference_does(offset: tuple[float, float]) -> None:
    depth = [0.2, 0.2, 0.8, 0.2, 0.8, 0.8]
    conform({"depth": pg.draw(Soup(box(0, 0, 16, 12), depth=depth), vertex=place, polygon_offset=offset,
                                    depth=pg.target("depth", format="depth32f"))})  # fmt: skip


# Discard, masks, several targets


def test_discarded_fragments_change_nothing() -> None:
    got = drawn(Soup(box(0, 0, 16, 12)), holes)[..., 0]
    assert got[:, ::2].all() and not got[:, 1::2].any()


def test_masks_hold_channels_back() -> None:
    got = drawn(Soup(box(0, 0, 16, 12), (0.25, 0.5, 0.75, 1.0)), color_mask=(True, False, True, False))
    assert got[4, 4].tolist() == [0.25, 0.0, 0.75, 0.0]


def test_a_mask_of_one_draw_does_not_reach_the_next() -> None:
    mesh = Soup(box(0, 0, 16, 12), (0.25, 0.5, 0.75, 1.0))
    masked = pg.draw(mesh, vertex=place, fragment=paint, into=pg.target("a", format="rgba32f"), color_mask=(False,) * 4)
    plain = pg.draw(mesh, vertex=place, fragment=paint, into=pg.target("b", format="rgba32f"))
    got = run({"a": masked, "b": plain})
    assert not got["a"].any() and got["b"][4, 4].tolist() == [0.25, 0.5, 0.75, 1.0]


def test_several_targets_are_drawn_at_once() -> None:
    into = (pg.target("a", format="rgba32f"), pg.target("b", format="rgba16f"))
    first, second = pg.draw(Soup(box(0, 0, 16, 12), HALF_BLUE), vertex=place, fragment=twice, into=into)
    got = run({"a": first, "b": second})
    assert got["a"][0, 0].tolist() == [0, 0, 1, 0.5] and got["b"][0, 0].tolist() == [0, 0, 0.5, 0.25]


def test_a_target_is_cleared_to_its_colour() -> None:
    into = pg.target("color", format="rgba32f", clear=(0.1, 0.2, 0.3, 0.4))
    target = pg.draw(Soup(box(0, 0, 1, 1)), vertex=place, fragment=paint, into=into)
    np.testing.assert_array_equal(run({"color": target})["color"][5, 5], np.array([0.1, 0.2, 0.3, 0.4], np.float32))


def test_drawing_over_a_handle_keeps_what_was_there() -> None:
    first = pg.draw(
        Soup(box(0, 0, 8, 12), RED), vertex=place, fragment=paint, into=pg.target("color", format="rgba32f")
    )
    second = pg.draw(Soup(box(8, 0, 16, 12), GREEN), vertex=place, fragment=paint, into=first)
    got = run({"color": second})["color"]
    assert got[5, 3].tolist() == list(RED) and got[5, 12].tolist() == list(GREEN)


# Blending

BLENDS = [
    "add", "alpha", "premultiplied", "multiply", "min", "max",
    Blend("destination_alpha", "one_minus_destination_alpha"),
    Blend("source_alpha", "destination_color", "subtract", "one", "zero", "add"),
    Blend("one", "one", "reverse_subtract"),
]  # fmt: skip


@pytest.mark.sampled
@pytest.mark.parametrize("blend", BLENDS, ids=str)
@pytest.mark.parametrize("format_", ["rgba32f", "rgba16f", "rgba8"])
def test_blends_combine_as_the_reference_does(blend: Any, format_: str) -> None:
    under = Soup(box(0, 0, 12, 12), (0.5, 0.25, 0.75, 0.5))
    over = Soup(box(4, 0, 16, 12), (0.25, 0.5, 0.5, 0.75))
    first = pg.draw(under, vertex=place, fragment=paint, into=pg.target("color", format=format_))
    conform({"color": pg.draw(over, vertex=place, fragment=paint, into=first, blend=blend)})


@pg.fragment
def paint_rgb(painted: Painted) -> vec3:
    return painted.color.rgb


def test_the_alpha_that_a_target_lacks_is_one() -> None:
    def build() -> dict[str, Any]:
        into = pg.target("color", format="rgb32f")
        first = pg.draw(Soup(box(0, 0, 16, 12), (0.5, 0.25, 0.75, 0.5)), vertex=place, fragment=paint_rgb, into=into)
        blend = Blend("one_minus_destination_alpha", "destination_alpha")
        over = Soup(box(4, 0, 16, 12), (0.25, 0.5, 0.5, 0.75))
        return {"color": pg.draw(over, vertex=place, fragment=paint_rgb, into=first, blend=blend)}

    conform(build())


def test_targets_are_blended_each_in_its_way() -> None:
    def build() -> dict[str, Any]:
        into = (
            pg.target("a", format="rgba32f", clear=(0.5, 0.5, 0.5, 0.5)),
            pg.target("b", format="rgba32f", clear=(0.5,) * 4),
        )
        mesh = Soup(box(0, 0, 8, 12), HALF_BLUE)
        a, b = pg.draw(mesh, vertex=place, fragment=twice, into=into, blend=("add", "alpha"))
        return {"a": a, "b": b}

    conform(build())


def test_one_of_two_targets_is_blended() -> None:
    into = (
        pg.target("a", format="rgba32f", clear=(1.0,) * 4),
        pg.target("b", format="rgba32f", clear=(1.0,) * 4),
    )
    a, b = pg.draw(Soup(box(0, 0, 16, 12), RED), vertex=place, fragment=twice, into=into, blend=("add", None))
    got = run({"a": a, "b": b})
    assert got["a"][0, 0].tolist() == [2, 1, 1, 2] and got["b"][0, 0].tolist() == [0.5, 0, 0, 0.5]


def test_different_blends_are_refused_where_the_driver_has_none(monkeypatch: pytest.MonkeyPatch) -> None:
    into = (pg.target("a", format="rgba32f"), pg.target("b", format="rgba32f"))
    a, b = pg.draw(Soup(box(0, 0, 8, 12)), vertex=place, fragment=twice, into=into, blend=("add", "alpha"))
    with GLBackend() as backend:
        monkeypatch.setattr(backend.context.gl, "BlendFuncSeparatei", None)
        with pytest.raises(BackendError, match=r"blends its targets in different ways, which takes OpenGL 4\.0"):
            pg.compile({"a": a, "b": b}, backend=backend, size=SIZE)()


# Stencil


@pytest.mark.sampled
@pytest.mark.parametrize(
    "operation",
    ["keep", "zero", "replace", "increment", "increment_wrap", "decrement", "decrement_wrap", "invert"],
)
@pytest.mark.parametrize("event", ["fail", "depth_fail", "passed"])
def test_stencil_operations_are_the_reference_s(operation: str, event: str) -> None:
    def build() -> dict[str, Any]:
        compare = "never" if event == "fail" else "always"
        stencil = Stencil(compare, 7, **{event: operation})
        first = pg.draw(
            Soup(box(0, 0, 10, 12), RED),
            vertex=place,
            fragment=paint,
            into=pg.target("color", format="rgba32f"),
            depth=pg.target("depth", format="depth32f_stencil8"),
            depth_compare="never" if event == "depth_fail" else "less",
            stencil=stencil,
            clear_stencil=255,
        )
        # What the stencil holds decides where this one shows: once for each bit.
        second = first
        for bit in range(8):
            test = Stencil("equal", 255, read_mask=1 << bit)
            mesh = Soup(box(0, 0, 16, 12), (float(1 << bit), 0.0, 0.0, 0.0))
            second = pg.draw(mesh, vertex=place, fragment=paint, into=second, depth=second.depth,
                             depth_compare="always", stencil=test, blend="add")  # fmt: skip
        return {"color": second}

    agree(build)


def test_a_write_mask_keeps_the_other_bits_of_the_stencil() -> None:
    stencil = Stencil("always", 5, write_mask=0x0D, passed="replace")
    into, depth = pg.target("color", format="rgba32f"), pg.target("depth", format="depth32f_stencil8")
    target = pg.draw(Soup(box(0, 0, 8, 12), (0.0,) * 4), vertex=place, fragment=paint, into=into, depth=depth,
                     stencil=stencil, clear_stencil=2)  # fmt: skip
    for bit in range(8):
        mesh = Soup(box(0, 0, 16, 12), (float(1 << bit), 0.0, 0.0, 0.0))
        target = pg.draw(mesh, vertex=place, fragment=paint, into=target, depth=target.depth, depth_compare="always",
                         stencil=Stencil("equal", 255, read_mask=1 << bit), blend="add")  # fmt: skip
    with pg.compile(target, backend="gl", size=SIZE) as program:
        got = program()["color"][..., 0]
    assert got[3, 3] == 7 and got[3, 12] == 2


# Both stages, and what others leave behind


@pg.vertex
def lifted(vertex: pg.Vertex, lift: float, n: int) -> Painted:
    return Painted(vec4(vertex.position.xy, lift * float(n), 1.0), vertex.color)


@pg.fragment
def tinted(painted: Painted, heights: pg.Image, tints: pg.Image, strength: float) -> vec4:
    tint = tints.texel(pg.ivec2(0, 0))
    return painted.color * tint * strength + vec4(0.0, heights.texel(pg.ivec2(0, 0)).r, 0.0, 0.0)


def test_both_stages_have_uniforms_of_their_own_and_images_keep_their_order() -> None:
    heights, tints = (
        pg.Input("heights", format="r32f", size=(2, 1)),
        pg.Input("tints", format="rgba32f", size=(1, 1)),
    )
    target = pg.draw(
        Soup(box(0, 0, 16, 12)),
        vertex=lifted,
        fragment=tinted,
        into=pg.target("color", format="rgba32f"),
        depth=pg.target("depth", format="depth32f"),
        values={"heights": heights, "tints": tints, "lift": 0.125, "n": 2, "strength": 2.0},
    )
    with pg.compile({"color": target, "depth": target.depth}, backend="gl", size=SIZE) as program:
        got = program(heights=np.array([[[0.25], [0.5]]], np.float32), tints=np.array([[[0.25, 1, 1, 1]]], np.float32))
    assert got["color"][3, 3].tolist() == [0.5, 0.25, 0.0, 2.0] and got["depth"][3, 3, 0] == 0.625


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
