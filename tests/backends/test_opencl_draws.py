"""What draws do on OpenCL, rule by rule (docs/rasterisation.md)."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import passgraph as pg
from passgraph import discard, fragment_depth, front_facing, vec2, vec4
from passgraph.backends.base import Backend
from passgraph.backends.registry import open_backend
from tests.conftest import require

pytestmark = pytest.mark.opencl
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
def flat(vertex: pg.Vertex) -> Sent:
    return Sent(vec4(vertex.position, 1.0), vertex.color)


@pg.vertex
def deep(vertex: pg.Vertex) -> Sent:
    """z is used as w too: depth is constant, distance is not."""
    return Sent(vec4(vertex.position.xy, 0.0, vertex.position.z), vertex.color)


@pg.vertex
def perspective(vertex: pg.Vertex) -> Sent:
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


@pg.fragment
def left_half(sent: Sent) -> vec4:
    if pg.pixel().x >= 8:
        discard()
    return vec4(1.0)


@pg.fragment
def two(sent: Sent) -> tuple[vec4, vec2]:
    return sent.color, vec2(0.25, 0.5)


@pytest.fixture
def device() -> Iterator[Backend]:
    require("opencl")
    with open_backend("opencl") as opened:
        yield opened


def mesh(
    corners: Sequence[Sequence[float]], triangles: Sequence[Sequence[int]], colors: Any = None
) -> Triangles:
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
    drawn = run(
        device, pg.draw(mesh(square, [(0, 1, 2), (0, 2, 3)]), vertex=flat, fragment=white, into=colour())
    )
    expected = np.zeros((SIZE[1], SIZE[0]))
    expected[3:7, 2:6] = 1
    np.testing.assert_array_equal(drawn[..., 0], expected)


def test_positions_are_rounded_to_a_256th_of_a_pixel(device: Backend) -> None:
    """The left edge at 2.5 + 1/600 rounds back to 2.5, which covers the centre; 2.5 + 1/300 does not."""
    covered = []
    for shift in (1 / 600, 1 / 300):
        square = [pixel_corner(x, y) for x, y in ((2.5 + shift, 3), (6, 3), (6, 7), (2.5 + shift, 7))]
        drawn = run(
            device, pg.draw(mesh(square, [(0, 1, 2), (0, 2, 3)]), vertex=flat, fragment=white, into=colour())
        )
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
    drawn = run(device, pg.draw(floor, vertex=perspective, fragment=white, into=colour(), blend="add"))[
        ..., 0
    ]
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
    near = pg.draw(
        quad(-0.5, (1, 0, 0, 1), 0.5), vertex=flat, fragment=painted, into=colour(), depth=depth_target()
    )
    far = pg.draw(quad(0.5, (0, 1, 0, 1)), vertex=flat, fragment=painted, into=near, depth=near.depth)
    drawn = run(device, far)
    assert drawn[6, 8].tolist() == [1, 0, 0, 1]
    assert drawn[0, 0].tolist() == [0, 1, 0, 1]


def test_depth_without_writing_keeps_the_stored_depth(device: Backend) -> None:
    made = pg.draw(
        quad(-0.5), vertex=flat, fragment=white, into=colour(), depth=depth_target(), depth_write=False
    )
    np.testing.assert_array_equal(run(device, made.depth), 1)


def test_a_draw_without_fragment_kernel_writes_depth(device: Backend) -> None:
    np.testing.assert_array_equal(run(device, pg.draw(quad(-0.5), vertex=flat, depth=depth_target())), 0.25)


@pytest.mark.parametrize(
    ("compare", "passes"),
    [
        ("never", (0, 0, 0)),
        ("less", (1, 0, 0)),
        ("equal", (0, 1, 0)),
        ("less_equal", (1, 1, 0)),
        ("greater", (0, 0, 1)),
        ("not_equal", (1, 0, 1)),
        ("greater_equal", (0, 1, 1)),
        ("always", (1, 1, 1)),
    ],
)
def test_depth_compares(device: Backend, compare: str, passes: tuple[int, int, int]) -> None:
    found = []
    for z in (-0.5, 0.0, 0.5):
        drawn = pg.draw(
            quad(z),
            vertex=flat,
            fragment=white,
            into=colour(),
            depth=depth_target(clear=0.5),
            depth_compare=compare,
        )
        found.append(int(run(device, drawn)[3, 3, 0]))
    assert tuple(found) == passes


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


def test_stencil_counts_and_tests(device: Backend) -> None:
    depth = depth_target("depth32f_stencil8")
    count = pg.Stencil(passed="increment")
    once = pg.draw(quad(0.0), vertex=flat, fragment=white, into=colour(), depth=depth, stencil=count)
    again = pg.draw(
        rows(),
        vertex=flat,
        fragment=white,
        into=once,
        depth=once.depth,
        stencil=count,
        depth_compare="always",
    )
    equal_two = pg.Stencil(compare="equal", reference=2)
    red = quad(0.0, (1, 0, 0, 1))
    drawn = run(
        device,
        pg.draw(
            red,
            vertex=flat,
            fragment=painted,
            into=again,
            depth=again.depth,
            stencil=equal_two,
            depth_compare="always",
        ),
    )
    assert drawn[0, 0].tolist() == [1, 1, 1, 1]
    assert drawn[-1, 0].tolist() == [1, 0, 0, 1]


@pytest.mark.parametrize(
    ("operation", "stored"),
    [
        ("keep", 200), ("zero", 0), ("replace", 7), ("increment", 201), ("increment_wrap", 201),
        ("decrement", 199), ("decrement_wrap", 199), ("invert", 55),
    ],
)  # fmt: skip
def test_stencil_operations(device: Backend, operation: str, stored: int) -> None:
    assert stencil_behind(device, pg.Stencil(reference=7, passed=operation), 200) == stored


@pytest.mark.parametrize(
    ("operation", "start", "stored"),
    [("increment", 255, 255), ("increment_wrap", 255, 0), ("decrement", 0, 0), ("decrement_wrap", 0, 255)],
)
def test_stencil_ends(device: Backend, operation: str, start: int, stored: int) -> None:
    assert stencil_behind(device, pg.Stencil(passed=operation), start) == stored


def test_stencil_write_mask_keeps_bits(device: Backend) -> None:
    assert stencil_behind(device, pg.Stencil(reference=0xFF, passed="replace", write_mask=0x0F), 0xA0) == 0xAF


def test_stencil_depth_fail_is_its_own_operation(device: Backend) -> None:
    rule = pg.Stencil(reference=9, depth_fail="replace", passed="zero")
    assert stencil_behind(device, rule, 1, depth_compare="never") == 9


def stencil_behind(device: Backend, rule: Any, start: int, **more: Any) -> int:
    """The stencil of a pixel after one draw under a rule."""
    from passgraph.backends.opencl.backend import OpenCLBackend

    drawn = pg.draw(
        quad(),
        vertex=flat,
        depth=depth_target("depth32f_stencil8"),
        stencil=rule,
        clear_stencil=start,
        **more,
    )
    assert isinstance(device, OpenCLBackend)
    with pg.compile(drawn, backend=device) as program:
        program.run()
        return int(device.download_stencil(stencil_storage(device, program))[3, 3])


def stencil_storage(device: Any, program: pg.Program) -> Any:
    storages = [s for s in program._execution.memories if s.stencil is not None]  # type: ignore[union-attr]
    return storages[0]


def test_blending_happens_in_the_order_of_submission(device: Backend) -> None:
    corners = [*quad().positions, *quad().positions]
    colors = [(1, 0, 0, 0.5)] * 4 + [(0, 1, 0, 0.5)] * 4
    both = mesh(corners, [(0, 1, 2), (0, 2, 3), (4, 5, 6), (4, 6, 7)], colors)
    drawn = run(device, pg.draw(both, vertex=flat, fragment=painted, into=colour(), blend="alpha"))
    np.testing.assert_array_equal(drawn, np.broadcast_to([0.25, 0.5, 0, 0.75], drawn.shape))


@pytest.mark.parametrize(
    ("blend", "result"),
    [
        ("add", 0.75), ("multiply", 0.125), ("min", 0.25), ("max", 0.5),
        (pg.Blend("one", "one", "subtract"), -0.25), (pg.Blend("one", "one", "reverse_subtract"), 0.25),
        (pg.Blend("destination_color", "zero"), 0.125),
        (pg.Blend("one_minus_destination_color", "zero"), 0.125),
        (pg.Blend("destination_alpha", "zero"), 0.125),
        (pg.Blend("source_alpha", "one_minus_source_alpha"), 0.4375),
    ],
)  # fmt: skip
def test_blends(device: Backend, blend: Any, result: float) -> None:
    """0.25 (alpha 0.25) drawn over 0.5 (alpha 0.5)."""
    cleared = colour(clear=0.5)
    drawn = run(
        device, pg.draw(quad(color=(0.25,) * 4), vertex=flat, fragment=painted, into=cleared, blend=blend)
    )
    assert drawn[3, 3, 0] == result


def test_blending_quantises_behind_it(device: Backend) -> None:
    """0.3 + 0.3 in 8 bits: the sum of unrounded 0.3 and stored 77/255."""
    first = pg.draw(quad(color=(0.3,) * 4), vertex=flat, fragment=painted, into=colour("rgba8"), blend="add")
    drawn = run(
        device, pg.draw(quad(color=(0.3,) * 4), vertex=flat, fragment=painted, into=first, blend="add")
    )
    stored = np.rint(np.float32(0.3) * 255) / 255
    assert np.rint(drawn[3, 3, 0] * 255) == np.rint((0.3 + stored) * 255)


def test_unorm_targets_clamp_before_blending(device: Backend) -> None:
    low = quad(color=(-5, 0.5, 9, 1))
    drawn = run(
        device, pg.draw(low, vertex=flat, fragment=painted, into=colour("rgba8", clear=0.5), blend="add")
    )
    np.testing.assert_array_equal(np.rint(drawn[3, 3] * 255), [128, 255, 255, 255])


def test_colour_masks_keep_channels(device: Backend) -> None:
    drawn = run(
        device,
        pg.draw(
            quad(),
            vertex=flat,
            fragment=white,
            into=colour(clear=0.25),
            color_mask=(True, False, True, False),
        ),
    )
    assert drawn[3, 3].tolist() == [1, 0.25, 1, 0.25]


def test_several_targets(device: Backend) -> None:
    second = pg.target("second", "rg16f", SIZE)
    made = pg.draw(quad(color=(1, 2, 3, 4)), vertex=flat, fragment=two, into=(colour(), second))
    with pg.compile(list(made), backend=device) as program:
        result = program()
    assert result["color"][3, 3].tolist() == [1, 2, 3, 4]
    assert result["second"][3, 3].tolist() == [0.25, 0.5]


def test_discarded_fragments_change_nothing(device: Backend) -> None:
    made = pg.draw(quad(), vertex=flat, fragment=left_half, into=colour(), depth=depth_target())
    with pg.compile([made, made.depth], backend=device) as program:
        result = program()
    assert result["color"][:, :8].min() == 1
    assert result["color"][:, 8:].max() == 0
    assert result["depth"][:, 8:].min() == 1
    assert result["depth"][:, :8].max() == 0.5


def test_discarded_fragments_leave_the_stencil(device: Backend) -> None:
    rule = pg.Stencil(passed="increment")
    depth = depth_target("depth32f_stencil8")
    drawn = pg.draw(quad(), vertex=flat, fragment=left_half, into=colour(), depth=depth, stencil=rule)
    with pg.compile(drawn, backend=device) as program:
        program.run()
        stencil = device.download_stencil(stencil_storage(device, program))  # type: ignore[attr-defined]
    assert stencil[:, :8].min() == 1
    assert stencil[:, 8:].max() == 0


@pytest.mark.parametrize("format_", ["rgba8", "rgba16", "rgba16f", "rgba32f"])
def test_targets_of_each_kind_hold_what_was_drawn(device: Backend, format_: str) -> None:
    drawn = run(
        device, pg.draw(quad(color=(0.2, 0.4, 0.6, 1)), vertex=flat, fragment=painted, into=colour(format_))
    )
    np.testing.assert_allclose(drawn[3, 3], [0.2, 0.4, 0.6, 1], atol=2e-3)
