"""What draws do on OpenCL, rule by rule (docs/rasterization.md)."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import passgraph as pg
from passgraph import fragment_depth, front_facing, vec2, vec4
from passgraph.backends.base import Backend
from passgraph.backends.opencl.draw_source import DrawLayouts, draw_sources
from passgraph.backends.opencl.storage import ImageLayout
from passgraph.backends.registry import open_backend
from passgraph.plan.data import DrawStep
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


@pytest.fixture
def device() -> Iterator[Backend]:
    require("opencl")
    with open_backend("opencl") as opened:
        yield opened


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
def wide(vertex: pg.Vertex) -> Many:
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


def test_draws_of_every_kind_share_what_makes_triangles() -> None:
    """Compilers take half a second for it."""
    kinds = (
        pg.draw(quad(), vertex=flat, fragment=white, into=colour()),
        pg.draw(quad(), vertex=wide, fragment=tens, into=tuple(pg.target(name, "rgba8", (300, 70)) for name in "abc"))[
            0
        ],
        pg.draw(rows(), vertex=flat, depth=depth_target(), cull="back", polygon_offset=(1.0, 2.0)),
    )
    texts = set()
    for target in kinds:
        with pg.compile(target, backend="null") as program:
            (step,) = (step for step in program.plan.steps if isinstance(step, DrawStep))
        layouts = [ImageLayout(format_, step.size) for format_ in step.output_formats]
        sources = draw_sources(step, DrawLayouts((), (), tuple(layouts), False, False), 32, serial=True, constant=True)
        texts.add(sources["pg_count", "pg_setup", "pg_scan", "pg_fill"].text)
    assert len(texts) == 1
