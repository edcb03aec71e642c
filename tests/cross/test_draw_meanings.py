"""What draws do on every backend, rule by rule (docs/rasterization.md), against what can be counted by hand."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import passgraph as pg
from passgraph.backends.base import Backend
from passgraph.language import Image, Vertex, discard, fragment_depth, front_facing, ivec2, pixel, vec2, vec4

SIZE = (16, 12)


@dataclass(frozen=True)
class Triangles:
    """Positions used as clip coordinates; colours as they are."""

    positions: NDArray[np.float32]
    triangles: NDArray[np.int32]
    colors: NDArray[np.float32] | None = None


@pg.struct
class Sent:
    position: vec4
    color: vec4


@pg.vertex
def flat(vertex: Vertex) -> Sent:
    return Sent(vec4(vertex.position, 1.0), vertex.color)


@pg.vertex
def deep(vertex: Vertex) -> Sent:
    """z is used as w too: depth is constant, distance is not."""
    return Sent(vec4(vertex.position.xy, 0.0, vertex.position.z), vertex.color)


@pg.vertex
def perspective(vertex: Vertex) -> Sent:
    """Near plane 1, far plane infinite."""
    p = vertex.position
    return Sent(vec4(p.xy, -p.z - 2.0, -p.z), vertex.color)


@pg.fragment
def painted(sent: Sent) -> vec4:
    return sent.color


@pg.fragment
def white(sent: Sent) -> vec4:
    return vec4(1.0)


@pg.fragment
def sides(sent: Sent) -> vec4:
    return vec4(1.0 if front_facing() else 0.0, fragment_depth(), 0.0, 1.0)


def mesh(corners: Sequence[Sequence[float]], triangles: Sequence[Sequence[int]], colors: Any = None) -> Triangles:
    made = None if colors is None else np.array(colors, np.float32)
    return Triangles(np.array(corners, np.float32), np.array(triangles, np.int32), made)


def quad(z: float = 0.0, color: Sequence[float] = (1, 1, 1, 1), half: float = 1.0) -> Triangles:
    """A square around the middle, counter-clockwise."""
    corners = [(-half, -half, z), (half, -half, z), (half, half, z), (-half, half, z)]
    return mesh(corners, [(0, 1, 2), (0, 2, 3)], [color] * 4)


def rows(z: float = 0.0) -> Triangles:
    """The lower half of the picture."""
    return mesh([(-1, -1, z), (1, -1, z), (1, 0, z), (-1, 0, z)], [(0, 1, 2), (0, 2, 3)])


def colour(format: str = "rgba32f", **more: Any) -> Any:
    return pg.target("color", format, SIZE, **more)


def depth_target(format: str = "depth32f", **more: Any) -> Any:
    return pg.target("depth", format, SIZE, **more)


def run(device: Backend, target: Any) -> NDArray[np.float32]:
    with pg.compile(target, backend=device) as program:
        result = program()
        return result[next(iter(result))]


def pixel_corner(x: float, y: float) -> tuple[float, float, float]:
    """Clip coordinates of a place in pixels from the top left."""
    return x / SIZE[0] * 2 - 1, 1 - y / SIZE[1] * 2, 0.0


def test_shared_edges_are_hit_once(device: Backend) -> None:
    drawn = run(device, pg.draw(quad(), vertex=flat, fragment=white, into=colour(), blend="add"))
    np.testing.assert_array_equal(drawn, 1)


def test_a_fan_around_odd_places_covers_each_pixel_once(device: Backend) -> None:
    rng = np.random.default_rng(1)
    inner = (*rng.uniform(-0.5, 0.5, 2), 0.0)
    angles = np.linspace(0, 2 * np.pi, 23, endpoint=False)
    corners = [inner, *((3 * np.cos(a), 3 * np.sin(a), 0.0) for a in angles)]
    fan = mesh(corners, [(0, 1 + i, 1 + (i + 1) % 23) for i in range(23)])
    drawn = run(device, pg.draw(fan, vertex=flat, fragment=white, into=colour(), blend="add"))
    np.testing.assert_array_equal(drawn, 1)


def test_centres_on_top_and_left_edges_are_inside(device: Backend) -> None:
    square = [pixel_corner(x, y) for x, y in ((2.5, 3.5), (6.5, 3.5), (6.5, 7.5), (2.5, 7.5))]
    drawn = run(device, pg.draw(mesh(square, [(0, 1, 2), (0, 2, 3)]), vertex=flat, fragment=white, into=colour()))
    expected = np.zeros((SIZE[1], SIZE[0]))
    expected[3:7, 2:6] = 1
    np.testing.assert_array_equal(drawn[..., 0], expected)


def test_positions_are_rounded_to_a_256th_of_a_pixel(device: Backend) -> None:
    """The left edge at 2.5 + 1/600 rounds back to 2.5, which covers the centre; 2.5 + 1/300 does not."""
    covered = []
    for shift in (1 / 600, 1 / 300):
        square = [pixel_corner(x, y) for x, y in ((2.5 + shift, 3), (6, 3), (6, 7), (2.5 + shift, 7))]
        drawn = run(device, pg.draw(mesh(square, [(0, 1, 2), (0, 2, 3)]), vertex=flat, fragment=white, into=colour()))
        covered.append(bool(drawn[5, 2, 0]))
    assert covered == [True, False]


def test_row_0_is_on_top(device: Backend) -> None:
    drawn = run(device, pg.draw(rows(), vertex=flat, fragment=white, into=colour()))
    assert drawn[: SIZE[1] // 2].max() == 0
    assert drawn[SIZE[1] // 2 :].min() == 1


def test_the_near_plane_cuts_a_floor(device: Backend) -> None:
    """A floor below the eye, from behind it to far away, fills the lower half up to the near edge."""
    corners = [(-50, -0.5, 5), (50, -0.5, 5), (50, -0.5, -500), (-50, -0.5, -500)]
    floor = mesh(corners, [(0, 1, 2), (0, 2, 3)])
    drawn = run(device, pg.draw(floor, vertex=perspective, fragment=white, into=colour(), blend="add"))[..., 0]
    # The near edge projects to y = -0.5: three quarters down; the far one to the horizon.
    expected = np.zeros((SIZE[1], SIZE[0]))
    expected[6:9] = 1
    np.testing.assert_array_equal(drawn, expected)


def test_what_lies_behind_the_far_plane_is_cut(device: Backend) -> None:
    tilted = mesh([(-1, -1, 0), (1, -1, 0), (1, 1, 2), (-1, 1, 2)], [(0, 1, 2), (0, 2, 3)])
    drawn = run(device, pg.draw(tilted, vertex=flat, fragment=white, into=colour()))[..., 0]
    assert drawn[: SIZE[1] // 2].max() == 0
    assert drawn[SIZE[1] // 2 :].min() == 1


def test_huge_triangles_are_cut_at_the_guard_band(device: Backend) -> None:
    huge = mesh([(-1e6, -1e6, 0), (1e6, -1e6, 0), (0, 1e6, 0)], [(0, 1, 2)])
    drawn = run(device, pg.draw(huge, vertex=flat, fragment=white, into=colour(), blend="add"))
    np.testing.assert_array_equal(drawn, 1)


def test_a_vertex_at_nan_draws_nothing(device: Backend) -> None:
    """NaN made by the vertex kernel; what is handed in is checked before."""
    broken = mesh([(-1, -1, 0), (1, -1, 0), (0, 1, 0)], [(0, 1, 2)])
    drawn = run(device, pg.draw(broken, vertex=deep, fragment=white, into=colour()))
    np.testing.assert_array_equal(drawn, 0)


def test_culling_drops_a_side(device: Backend) -> None:
    both = mesh(
        [(-1, -1, 0), (0, -1, 0), (0, 1, 0), (-1, 1, 0), (1, -1, 0), (1, 1, 0)],
        [(0, 1, 2), (0, 2, 3), (1, 5, 4), (1, 2, 5)],
    )
    seen = {}
    for cull in ("none", "back", "front"):
        drawn = run(device, pg.draw(both, vertex=flat, fragment=sides, into=colour(), cull=cull))
        seen[cull] = (drawn[5, 3].tolist(), drawn[5, 12].tolist())
    front, back, nothing = [1, 0.5, 0, 1], [0, 0.5, 0, 1], [0, 0, 0, 0]
    assert seen == {"none": (front, back), "back": (front, nothing), "front": (nothing, back)}


def test_the_nearest_wins(device: Backend) -> None:
    near = pg.draw(quad(-0.5, (1, 0, 0, 1), 0.5), vertex=flat, fragment=painted, into=colour(), depth=depth_target())
    far = pg.draw(quad(0.5, (0, 1, 0, 1)), vertex=flat, fragment=painted, into=near, depth=near.depth)
    drawn = run(device, far)
    assert drawn[6, 8].tolist() == [1, 0, 0, 1]
    assert drawn[0, 0].tolist() == [0, 1, 0, 1]


def test_depth_without_writing_keeps_the_stored_depth(device: Backend) -> None:
    made = pg.draw(quad(-0.5), vertex=flat, fragment=white, into=colour(), depth=depth_target(), depth_write=False)
    np.testing.assert_array_equal(run(device, made.depth), 1)


def test_a_draw_without_fragment_kernel_writes_depth(device: Backend) -> None:
    np.testing.assert_array_equal(run(device, pg.draw(quad(-0.5), vertex=flat, depth=depth_target())), 0.25)


def test_polygon_offset_moves_by_steps_of_the_depth(device: Backend) -> None:
    made = pg.draw(quad(0.0), vertex=flat, depth=depth_target(), polygon_offset=(0.0, 4.0))
    # Depth 0.5 has exponent -1: a step is 2**-24.
    np.testing.assert_array_equal(run(device, made), np.float32(0.5 + 4 * 2.0**-24))


def test_polygon_offset_follows_the_slope(device: Backend) -> None:
    tilted = mesh([(-1, -1, -0.5), (1, -1, 0.5), (1, 1, 0.5), (-1, 1, -0.5)], [(0, 1, 2), (0, 2, 3)])
    plain = run(device, pg.draw(tilted, vertex=flat, depth=depth_target()))
    moved = run(device, pg.draw(tilted, vertex=flat, depth=depth_target(), polygon_offset=(1.0, 0.0)))
    np.testing.assert_allclose(moved - plain, 0.5 / SIZE[0], atol=1e-7)


def test_varyings_follow_the_perspective(device: Backend) -> None:
    """Along a strip from w = 1 to w = 4, the value in the middle of the picture is not the mean."""
    corners = [(-1, -1, 1), (-1, 1, 1), (4, 4, 4), (4, -4, 4)]
    strip = mesh(corners, [(0, 2, 1), (0, 3, 2)], [(0, 0, 0, 1), (0, 0, 0, 1), (1, 0, 0, 1), (1, 0, 0, 1)])
    drawn = run(device, pg.draw(strip, vertex=deep, fragment=painted, into=colour()))[6, :, 0]
    t = (np.arange(SIZE[0]) + 0.5) / SIZE[0]
    np.testing.assert_allclose(drawn, (t / 4) / ((1 - t) + t / 4), rtol=1e-5)


@pg.struct
class Many:
    position: vec4
    plain: vec4
    mixed: vec4
    last: vec2


@pg.vertex
def wide(vertex: Vertex) -> Many:
    """Ten numbers that are sums of the place on the screen, and a plane that near and far cut."""
    p = vertex.position
    plain, mixed = vec4(p.x, p.y, p.x + p.y, 1.0), vec4(2.0 * p.x, 3.0 * p.y, p.x - p.y, 2.0)
    return Many(vec4(p.xy, 1.2 * p.x, 1.0), plain, mixed, vec2(5.0 * p.y, 7.0 * p.x))


@pg.fragment
def tens(many: Many) -> tuple[vec4, vec4, vec4]:
    return many.plain, many.mixed, vec4(many.last, many.last)


def test_a_triangle_is_cut_with_all_its_varyings(device: Backend) -> None:
    """Against what the numbers are at each centre; corners lie beyond the guard band too, on a 256th of a pixel."""
    huge = mesh([(-20, -20, 0), (20, -20, 0), (0, 20, 0)], [(0, 1, 2)])
    into = tuple(pg.target(name, "rgba32f", SIZE) for name in ("plain", "mixed", "last"))
    made = pg.draw(huge, vertex=wide, fragment=tens, into=into)
    with pg.compile(list(made), backend=device) as program:
        drawn = np.concatenate([program()[name] for name in ("plain", "mixed", "last")], axis=-1)[..., :10]
    x = np.broadcast_to((np.arange(SIZE[0]) + 0.5) / SIZE[0] * 2 - 1, drawn.shape[:2])
    y = np.broadcast_to(1 - (np.arange(SIZE[1])[:, None] + 0.5) / SIZE[1] * 2, drawn.shape[:2])
    expected = np.stack([x, y, x + y, 1 + 0 * x, 2 * x, 3 * y, x - y, 2 + 0 * x, 5 * y, 7 * x], axis=-1)
    expected[np.abs(1.2 * x) > 1] = 0
    np.testing.assert_allclose(drawn, expected, atol=7 * 2 / 256 / min(SIZE))


def boxed(left: float, top: float, right: float, bottom: float, color: Sequence[float], z: float = 0.0) -> Triangles:
    """A rectangle between places in pixels, with z in clip space."""
    corners = [(*pixel_corner(x, y)[:2], z) for x, y in ((left, top), (left, bottom), (right, bottom), (right, top))]
    return mesh(corners, [(0, 1, 2), (0, 2, 3)], [color] * 4)


MIXED = (0.25, 0.5, 0.75, 1.0)
WHOLE = boxed(0, 0, *SIZE, MIXED)


@pg.fragment
def placed(sent: Sent) -> vec4:
    return vec4(vec2(pixel()), fragment_depth(), 1.0)


@pg.fragment
def holes(sent: Sent) -> vec4:
    if pixel().x % 2 == 1:
        discard()
    return sent.color


@pg.fragment
def twice(sent: Sent) -> tuple[vec4, vec4]:
    return sent.color, sent.color * 0.5


def test_fragments_know_their_pixel_and_depth(device: Backend) -> None:
    made = pg.draw(boxed(0, 0, *SIZE, MIXED, -0.25), vertex=flat, fragment=placed, into=colour())
    drawn = run(device, made)
    assert drawn[0, 0].tolist() == [0, 0, 0.375, 1] and drawn[11, 15].tolist() == [15, 11, 0.375, 1]


def test_a_color_that_a_mesh_lacks_is_white(device: Backend) -> None:
    plain = Triangles(WHOLE.positions, WHOLE.triangles)
    assert run(device, pg.draw(plain, vertex=flat, fragment=painted, into=colour()))[0, 0].tolist() == [1, 1, 1, 1]


def test_a_depth_target_is_read_by_a_later_pass(device: Backend) -> None:
    depth = pg.draw(boxed(2, 1, 5, 3, MIXED, -0.5), vertex=flat, depth=depth_target())
    copy = pg.kernel(source="def copy(image: Image) -> float: return image[0, 0].r")
    got = run(device, copy(depth, into=pg.target("copy", "r32f", SIZE)))[..., 0]
    assert got[0, 0] == 1 and np.argwhere(got == 0.25).tolist() == [[y, x] for y in (1, 2) for x in (2, 3, 4)]


def test_discarded_fragments_change_nothing(device: Backend) -> None:
    count, depth = pg.Stencil(passed="increment"), depth_target("depth32f_stencil8")
    made = pg.draw(WHOLE, vertex=flat, fragment=holes, into=colour(), depth=depth, stencil=count)
    with pg.compile([made, made.depth], device) as program:
        result = program()
    for picture, kept, drawn in (
        (result["color"], 0, 0.25),
        (result["depth"], 1, 0.5),
        (stencil_of(device, made), 0, 1),
    ):
        assert (picture[:, ::2, 0] == drawn).all() and (picture[:, 1::2, 0] == kept).all()


def test_masks_hold_channels_back_for_one_draw(device: Backend) -> None:
    masks = {"a": (True, False, True, False), "b": (False,) * 4, "c": (True,) * 4}
    made = {
        name: pg.draw(WHOLE, vertex=flat, fragment=painted, into=pg.target(name, "rgba32f", SIZE), color_mask=mask)
        for name, mask in masks.items()
    }
    with pg.compile(made, device) as program:
        got = {name: picture[4, 4].tolist() for name, picture in program().items()}
    assert got == {"a": [0.25, 0.0, 0.75, 0.0], "b": [0.0] * 4, "c": list(MIXED)}


def test_several_targets_are_drawn_at_once_and_blended_each_in_its_way(device: Backend) -> None:
    for blend, expected in (
        (None, ([0.25, 0.5, 0.75, 1.0], [0.125, 0.25, 0.375, 0.5])),
        (("add", None), ([1.25, 1.5, 1.75, 2.0], [0.125, 0.25, 0.375, 0.5])),
        (("add", "alpha"), ([1.25, 1.5, 1.75, 2.0], [0.5625, 0.625, 0.6875, 1.0])),
    ):
        into = tuple(pg.target(name, "rgba32f", SIZE, clear=(1.0,) * 4) for name in "ab")
        a, b = pg.draw(WHOLE, vertex=flat, fragment=twice, into=into, blend=blend)
        with pg.compile({"a": a, "b": b}, device) as program:
            made = program()
            assert (made["a"][0, 0].tolist(), made["b"][0, 0].tolist()) == expected, blend


def test_a_target_is_cleared_and_drawn_over(device: Backend) -> None:
    first = pg.draw(boxed(0, 0, 4, 12, MIXED), vertex=flat, fragment=painted, into=colour(clear=(0.5, 0.25, 0.125, 1)))
    drawn = run(device, pg.draw(boxed(12, 0, 16, 12, (0, 1, 0, 1)), vertex=flat, fragment=painted, into=first))
    assert [drawn[5, x].tolist() for x in (2, 8, 14)] == [list(MIXED), [0.5, 0.25, 0.125, 1], [0, 1, 0, 1]]


def stencil_of(device: Backend, made: Any) -> NDArray[np.float32]:
    """The stencil behind a draw, (height, width, 1): one draw for each of its bits, where that is set."""
    depth, into = made.depth, pg.target("stencil", "rgba32f", SIZE)
    for bit in range(8):
        into = pg.draw(
            boxed(0, 0, *SIZE, (float(1 << bit), 0.0, 0.0, 0.0)), vertex=flat, fragment=painted, into=into, blend="add",
            depth=depth, depth_compare="always", stencil=pg.Stencil("equal", 255, read_mask=1 << bit),
        )  # fmt: skip
        depth = into.depth
    return run(device, into)[..., :1]


@pytest.mark.parametrize(
    ("rule", "start", "stored"),
    [
        ({"passed": "increment"}, 255, 255), ({"passed": "increment_wrap"}, 255, 0), ({"passed": "decrement"}, 0, 0),
        ({"passed": "decrement_wrap"}, 0, 255), ({"passed": "increment"}, 6, 7), ({"passed": "invert"}, 0x0F, 0xF0),
        ({"reference": 0xFF, "passed": "replace", "write_mask": 0x0F}, 0xA0, 0xAF),
        ({"compare": "never", "reference": 9, "fail": "replace"}, 1, 9),
    ],
)  # fmt: skip
def test_a_stencil_holds_what_its_rule_says(device: Backend, rule: dict[str, Any], start: int, stored: int) -> None:
    depth = depth_target("depth32f_stencil8")
    made = pg.draw(boxed(0, 0, 8, 12, MIXED), vertex=flat, fragment=painted, into=colour(), depth=depth,
                   stencil=pg.Stencil(**rule), clear_stencil=start)  # fmt: skip
    held = stencil_of(device, made)[..., 0]
    assert held[3, 3] == stored and held[3, 12] == start


def test_a_failed_depth_test_has_its_own_operation(device: Backend) -> None:
    rule = pg.Stencil(reference=9, depth_fail="replace", passed="zero")
    made = pg.draw(WHOLE, vertex=flat, fragment=painted, into=colour(), depth=depth_target("depth32f_stencil8"),
                   stencil=rule, clear_stencil=1, depth_compare="never")  # fmt: skip
    assert (stencil_of(device, made) == 9).all()


def test_blending_happens_in_the_order_of_submission(device: Backend) -> None:
    corners = [*quad().positions, *quad().positions]
    colors = [(1, 0, 0, 0.5)] * 4 + [(0, 1, 0, 0.5)] * 4
    both = mesh(corners, [(0, 1, 2), (0, 2, 3), (4, 5, 6), (4, 6, 7)], colors)
    drawn = run(device, pg.draw(both, vertex=flat, fragment=painted, into=colour(), blend="alpha"))
    np.testing.assert_array_equal(drawn, np.broadcast_to([0.25, 0.5, 0, 0.75], drawn.shape))


def test_blending_quantises_behind_it(device: Backend) -> None:
    """0.3 + 0.3 in 8 bits: the sum of 0.3, which drivers may round first, and of what was stored."""
    first = pg.draw(quad(color=(0.3,) * 4), vertex=flat, fragment=painted, into=colour("rgba8"), blend="add")
    drawn = run(device, pg.draw(quad(color=(0.3,) * 4), vertex=flat, fragment=painted, into=first, blend="add"))
    stored = np.rint(np.float32(0.3) * 255) / 255
    assert abs(drawn[3, 3, 0] - (0.3 + stored)) * 255 < 0.51
    if device.name not in ("gl", "webgpu"):
        assert drawn[3, 3, 0] * 255 == pytest.approx(np.rint((0.3 + stored) * 255), abs=1e-4)


def test_unorm_targets_clamp_before_blending(device: Backend) -> None:
    low = quad(color=(-5, 0.5, 9, 1))
    drawn = run(device, pg.draw(low, vertex=flat, fragment=painted, into=colour("rgba8", clear=0.5), blend="add"))
    np.testing.assert_array_equal(np.rint(drawn[3, 3] * 255), [128, 255, 255, 255])


@pytest.mark.parametrize("format_", ["rgba8", "rgba16", "rgba16f", "rgba32f"])
def test_targets_of_each_kind_hold_what_was_drawn(device: Backend, format_: str) -> None:
    drawn = run(device, pg.draw(quad(color=(0.2, 0.4, 0.6, 1)), vertex=flat, fragment=painted, into=colour(format_)))
    np.testing.assert_allclose(drawn[3, 3], [0.2, 0.4, 0.6, 1], atol=2e-3)


@pg.vertex
def lifted(vertex: Vertex, lift: float, n: int) -> Sent:
    return Sent(vec4(vertex.position.xy, lift * float(n), 1.0), vertex.color)


@pg.fragment
def tinted(sent: Sent, heights: Image, tints: Image, strength: float) -> vec4:
    tint = tints.texel(ivec2(0, 0))
    return sent.color * tint * strength + vec4(0.0, heights.texel(ivec2(0, 0)).r, 0.0, 0.0)


def test_both_stages_have_uniforms_of_their_own_and_images_keep_their_order(device: Backend) -> None:
    heights, tints = pg.Input("heights", "r32f", (2, 1)), pg.Input("tints", "rgba32f", (1, 1))
    values = {"heights": heights, "tints": tints, "lift": 0.125, "n": 2, "strength": 2.0}
    made = pg.draw(WHOLE, vertex=lifted, fragment=tinted, into=colour(), depth=depth_target(), values=values)
    with pg.compile({"color": made, "depth": made.depth}, device) as program:
        got = program(heights=np.array([[[0.25], [0.5]]], np.float32), tints=np.array([[[0.25, 1, 1, 1]]], np.float32))
    assert got["color"][3, 3].tolist() == [0.125, 1.25, 1.5, 2.0] and got["depth"][3, 3, 0] == 0.625
