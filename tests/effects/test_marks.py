"""Points, lines and copies as draws."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import ArrayLike

import passgraph as pg
from passgraph import mat4, vec4
from passgraph.effects.surfaces.marks import instances, lines, points, spread_line, spread_point
from passgraph.scene import Mesh

BACKENDS = ["reference", "numpy", "gl", "opencl"]
SIZE = (96, 64)


@pg.struct
class Mark:
    position: vec4
    color: vec4


@pg.vertex
def dot_of(vertex: pg.Vertex, diameter: float) -> Mark:
    return Mark(spread_point(vec4(vertex.position, 1.0), vertex.uv, diameter), vertex.color)


@pg.vertex
def strip_of(vertex: pg.Vertex, view: mat4, width: float) -> Mark:
    start, end = view * vec4(vertex.position, 1.0), view * vec4(vertex.normal, 1.0)
    return Mark(spread_line(start, end, vertex.uv, width), vertex.color)


@pg.vertex
def copy_of(vertex: pg.Vertex) -> Mark:
    return Mark(vec4(vertex.position.x + vertex.instance * 0.5, vertex.position.yz, 1.0), vec4(vertex.instance))


@pg.fragment
def plain(mark: Mark) -> vec4:
    return mark.color


def drawn(backend: str, mesh: Any, vertex: Any, blend: str | None = "add", **values: Any) -> np.ndarray[Any, Any]:
    target = pg.draw(mesh, vertex=vertex, fragment=plain, into=pg.target("color", "rgba32f"), blend=blend, **values)
    with pg.compile(target, backend=backend, size=SIZE) as program:
        return program()["color"]


@pytest.mark.parametrize("backend", BACKENDS)
def test_points_add_up_like_a_histogram(backend: str) -> None:
    """Scatter as a draw, held against numpy.histogram2d."""
    rng = np.random.default_rng(5)
    places = np.concatenate([rng.uniform(-1, 1, (500, 2)), np.zeros((500, 1))], axis=1).astype(np.float32)
    # In the middle of their pixels, so that a point of one pixel covers it and no other.
    cells = np.floor((places[:, :2] + 1) / 2 * SIZE)
    places[:, :2] = (cells + 0.5) / SIZE * 2 - 1
    counts, _, _ = np.histogram2d(cells[:, 1], cells[:, 0], bins=SIZE[::-1], range=((0, SIZE[1]), (0, SIZE[0])))
    seen = drawn(backend, points(places), dot_of, diameter=1.0)[:, :, 0]
    assert np.array_equal(seen, counts[::-1])


@pytest.mark.parametrize("backend", BACKENDS)
def test_a_line_is_as_wide_as_asked_for_at_every_slope(backend: str) -> None:
    for angle in np.arange(0.0, np.pi, 0.4):
        end = np.array([[np.cos(angle) * 20 / SIZE[0] * 2, np.sin(angle) * 20 / SIZE[1] * 2, 0]])
        seen = drawn(backend, lines(-end, end), strip_of, blend=None, view=np.eye(4), width=5.0)[:, :, 0]
        assert abs(float(seen.sum()) - 40 * 5) < 14, angle


@pytest.mark.parametrize("backend", BACKENDS)
def test_a_line_that_goes_behind_the_camera_stays_straight(backend: str) -> None:
    view = [[SIZE[1] / SIZE[0], 0, 0, 0], [0, 1, 0, 0], [0, 0, -1.0002, -0.020002], [0, 0, -1, 0]]
    # Along the ground beside the camera: on the screen a straight line down to an edge of the picture.
    seen = drawn(backend, lines([[0.5, -1, -50]], [[0.5, -1, 20]]), strip_of, blend=None, view=view, width=3.0)[:, :, 0]
    rows = np.flatnonzero(seen.any(axis=1))
    assert rows[-1] == SIZE[1] - 1 and rows[0] in range(31, 34)
    middles = np.array([np.flatnonzero(seen[row]).mean() for row in rows[2:-3]])
    assert np.abs(np.diff(middles, 2)).max() <= 1.0
    widths = np.array([seen[row].sum() for row in rows[2:-3]])
    assert widths.min() >= 3 and widths.max() <= 4


@pytest.mark.parametrize("backend", BACKENDS)
def test_copies_know_their_number(backend: str) -> None:
    square = Mesh.make([[-1, -1, 0], [-0.5, -1, 0], [-0.5, 1, 0], [-1, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    seen = drawn(backend, instances(square, 4), copy_of)[:, :, 0]
    assert np.array_equal(seen, np.tile(np.repeat([0.0, 1.0, 2.0, 3.0], 24), (SIZE[1], 1)))


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: points(np.zeros((3, 2))), r"points: positions must be \(n, 3\), got \(3, 2\)"),
        (lambda: points(np.zeros((0, 3))), r"got \(0, 3\)"),
        (lambda: points(0), "points: their number"),
        (lambda: points(1 << 40), "points: their number"),
        (lambda: points(np.zeros((3, 3)), np.zeros((2, 4))), r"colors must be \(3, 4\)"),
        (lambda: lines(np.zeros((3, 3)), np.zeros((2, 3))), r"ends must be \(3, 3\)"),
        (lambda: instances(points(4), 1 << 22), "copies of 16 vertices"),
    ],
)
def test_what_cannot_be_drawn_is_refused(make: Any, said: str) -> None:
    with pytest.raises(pg.InputError, match=said):
        make()


def test_marks_stay_as_they_were_made() -> None:
    places: ArrayLike = np.zeros((2, 3), np.float32)
    made = points(places)
    places[:] = 7.0  # type: ignore[index]
    assert not made.positions.any()
