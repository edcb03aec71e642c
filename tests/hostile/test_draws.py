"""Draws that no camera makes: nothing is read or written beside its memory, and every backend draws what is allowed."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from fractions import Fraction
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from passgraph.backends.base import Backend
from passgraph.backends.reference.rasterizer import Vertices, clip_triangles
from passgraph.backends.registry import open_backend
from passgraph.graph.draw_state import Blend
from passgraph.verify.conformance.case_inputs import Soup
from passgraph.verify.oracle.covered import INTERPOLATION_ULP, ULP
from tests.conftest import oclgrind, require
from tests.hostile.draws import SIMULATED_SECONDS, Drawn, Setup, case_of, run

SIZE = (16, 12)
RATIOS = (1e3, 1e8, 1e16, 1e30)


@pytest.fixture(scope="module", params=["numpy", "opencl", "gl", "reference"])
def opened(request: pytest.FixtureRequest) -> Iterator[Backend]:
    require(request.param)
    with open_backend(request.param) as backend:
        yield backend


@cache
def compiled(setup: Setup, opened: Backend) -> Drawn:
    """Once for all tests of a backend."""
    return Drawn(setup, opened)


def soup(clip: object, values: object = None) -> Soup:
    """Triangles of clip coordinates (n, 4); the corners of each are red, green and blue."""
    corners = np.asarray(clip, np.float32).reshape(-1, 4)
    colours = np.tile(np.eye(3), (len(corners) // 3, 1)) if values is None else values
    triangles = np.arange(len(corners), dtype=np.int32).reshape(-1, 3)
    return Soup(np.asarray(colours, np.float32), triangles, corners)


def exact(corners: NDArray[np.float32], x: Fraction, y: Fraction) -> list[Fraction] | None:
    """The shares of a triangle's corners at a point of the picture (pixels), without clipping; None outside.

    The point that the eye sees there is the combination of the corners whose x/w and y/w are the point's.
    """
    a, b, c = ([Fraction(float(v)) for v in row] for row in corners)
    right, up = 2 * x / SIZE[0] - 1, 1 - 2 * y / SIZE[1]
    rows = [[p[k] - at * p[3] for p in (a, b, c)] for k, at in ((0, right), (1, up))]
    shares = [rows[0][i] * rows[1][j] - rows[0][j] * rows[1][i] for i, j in ((1, 2), (2, 0), (0, 1))]
    z, w = (sum(s * p[k] for s, p in zip(shares, (a, b, c), strict=True)) for k in (2, 3))
    if w < 0:
        shares, z, w = [-s for s in shares], -z, -w
    if w <= 0 or min(shares) < 0 or not -w <= z <= w:
        return None
    return [s / sum(shares) for s in shares]


@cache
def decided(seed: int, ratio: float) -> tuple[Soup, dict[tuple[int, int], bool]]:
    """A triangle, and the pixels (row, column) that stay on one side of every edge wherever corners go within a few
    steps of the grid."""
    random = np.random.default_rng(seed)
    corners = random.uniform(-1, 1, (3, 4))
    corners[np.argmax(random.permutation(3) == 1)] *= ratio
    mesh = soup(corners)
    found = {}
    for row, column in np.ndindex(SIZE[1], SIZE[0]):
        places = [(column + Fraction(dx, 32), row + Fraction(dy, 32)) for dx in (15, 17) for dy in (15, 17)]
        covered = [exact(mesh.colors, x, y) is not None for x, y in places]
        if all(covered) or not any(covered):
            found[row, column] = covered[0]
    return mesh, found


@pytest.mark.sampled
@pytest.mark.parametrize("ratio", RATIOS)
def test_however_far_apart_corners_are_the_picture_is_that_of_exact_arithmetic(opened: Backend, ratio: float) -> None:
    draw, seen = compiled(Setup(SIZE), opened), 0
    for seed in (1, 9, 17):
        mesh, pixels = decided(seed, ratio)
        drawn = draw.picture(mesh)[..., 3] > 0.5  # a constant may lose a digit to clipping
        assert [at for at, covered in pixels.items() if drawn[at] != covered] == [], seed
        seen += sum(pixels.values())
    assert seen > 30


@pytest.mark.parametrize("number", [np.inf, -np.inf, np.nan])
@pytest.mark.parametrize("column", range(4))
def test_a_triangle_with_a_corner_that_is_not_finite_is_not_drawn(opened: Backend, number: float, column: int) -> None:
    good = np.array([[-0.9, -0.9, 0, 1], [0.9, -0.9, 0, 1], [0, 0.9, 0, 1]], np.float32)
    bad = good * [1, -1, 1, 1]
    bad[1, column] = number
    draw = compiled(Setup(SIZE), opened)
    assert np.array_equal(draw.picture(soup([*bad, *good, *bad])), draw.picture(soup(good)))


def test_no_polygon_has_more_corners_than_planes_can_make() -> None:
    """Of corners near one another in float64, rounding put 14 to 22 where 9 are."""
    random = np.random.default_rng(5)
    corners = random.uniform(-1, 1, (60_000, 4)) * np.where(random.random((60_000, 1)) < 0.3, 1e16, 1.0)
    rows = corners.astype(np.float32).astype(np.float64)
    vertices, triangles, _ = clip_triangles(Vertices(rows), np.arange(len(rows)).reshape(-1, 3))
    assert np.isfinite(vertices.rows).all()
    assert len(triangles) > 10_000


def test_slivers_with_w_from_1_to_1024_are_interpolated_as_exact_arithmetic_does(opened: Backend) -> None:
    """Corners on the grid, so that no backend rounds them elsewhere."""
    if opened.corner_px > 0.0:
        pytest.skip("its interpolation is a driver's")
    random, draw, seen = np.random.default_rng(3), compiled(Setup((64, 64)), opened), 0
    for _ in range(12):
        start, along = random.integers(1000, 15000, 2), random.integers(-9000, 9000, 2)
        steps = np.array([start, start + along, start + along // 2 + random.integers(40, 700, 2)])
        w = 2.0 ** random.permutation([0, 10, 10])
        place = (steps - 8192) / 8192 * [1, -1]
        mesh = soup(np.column_stack([place * w[:, None], np.zeros(3), w]))
        picture = draw.picture(mesh)
        for row, column in np.argwhere(picture[..., 3] == 1.0):
            shares = [Fraction(v) for v in _edges(steps, 256 * int(column) + 128, 256 * int(row) + 128)]
            near = [s / Fraction(float(v)) for s, v in zip(shares, w, strict=True)]
            right = np.array([float(n / sum(near)) for n in near])
            seen += 1
            assert np.abs(picture[row, column, :3] - right).max() <= INTERPOLATION_ULP * ULP, (row, column)
    assert seen > 150


@pytest.mark.parametrize("state", [(), (("blend", Blend("one", "zero")),)], ids=["a tile at once", "in order"])
def test_a_corner_on_a_pixel_centre_shows_there_however_far_it_is(
    opened: Backend, state: tuple[tuple[str, object], ...]
) -> None:
    """The first, second or third of its triangles' corners, of which one owns the centre."""
    if opened.corner_px > 0.0:
        pytest.skip("its interpolation is a driver's")
    draw = compiled(Setup((64, 64), state=state), opened)
    for far, column, row in ((2.0**10, 5, 9), (2.0**27, 31, 32), (2.0**53, 50, 61), (2.0**100, 40, 3)):
        middle = [(column + 0.5) / 32 - 1, 1 - (row + 0.5) / 32, 0, 1]
        around = [[x, y, 0, 1] for x, y in ((-0.93, -0.91), (0.97, -0.95), (0.94, 0.99), (-0.98, 0.96))]
        corners = [[np.multiply(middle, far), around[k], around[(k + 1) % 4]] for k in range(4)]
        for turn in range(3):
            colours = np.tile(np.roll([[0.25, 1.0, 0.75], [1e6, 0, 0], [0, 0, 1e6]], turn, axis=0), (4, 1))
            picture = draw.picture(soup(np.roll(corners, turn, axis=1), colours))
            assert np.array_equal(picture[row, column], np.float32([0.25, 1.0, 0.75, 1.0])), turn


def _edges(steps: NDArray[np.int64], x: int, y: int) -> list[int]:
    """Shares of corners, times twice the area."""
    at = [[int(v) for v in row] for row in steps]
    return [
        (at[j][0] - at[i][0]) * (y - at[i][1]) - (at[j][1] - at[i][1]) * (x - at[i][0])
        for i, j in ((1, 2), (2, 0), (0, 1))
    ]


def test_the_oracle_allows_what_slivers_become(opened: Backend) -> None:
    """Drivers evaluate planes in float32 from the corner of the picture on, which slivers make steep."""
    draw = compiled(Setup((200, 200)), opened)
    for seed in range(12):
        random = np.random.default_rng(seed)
        middle, along = random.uniform(-1, 1, 2), random.uniform(-8.5, 8.5, 2)
        across = np.array([-along[1], along[0]]) * 10 ** random.uniform(-4, -2)
        place = np.array([middle - along, middle + along, middle + across])
        w = 10.0 ** random.permutation([0, random.uniform(0, 3), 3])
        z = random.uniform(-0.9, 0.9, 3)
        assert draw(soup(np.column_stack([place * w[:, None], z * w, w]))) == "", seed


def test_nan_blended_into_fractions_counts_as_0(opened: Backend) -> None:
    setup = Setup((4, 4), "paint", "rgba8", None, (("blend", Blend("one", "one")),))
    whole = np.array([[-1, -1, 0, 1], [3, -1, 0, 1], [-1, 3, 0, 1]], np.float32)
    picture = compiled(setup, opened).picture(soup(whole, np.full((3, 3), np.nan)))
    assert np.array_equal(picture[..., :3], np.full((4, 4, 3), np.float32(64 / 255)))


def test_a_mesh_of_nothing_draws_nothing(opened: Backend) -> None:
    empty = Soup(np.zeros((1, 3), np.float32), np.zeros((0, 3), np.int32), np.zeros((1, 4), np.float32))
    assert (compiled(Setup((5, 3)), opened).picture(empty) == 0.25).all()


# Cases by chance


@pytest.mark.parametrize(
    ("backend", "count"),
    [
        ("numpy", 90),
        ("opencl", 36),
        ("gl", 36),
        pytest.param("numpy", 360, marks=pytest.mark.slow),
        pytest.param("opencl", 90, marks=pytest.mark.slow),
        pytest.param("gl", 90, marks=pytest.mark.slow),
    ],
)
def test_hostile_draws(backend: str, count: int) -> None:
    require(backend)
    assert run(backend, 0, count, count // 9) == ""


def test_hostile_draws_stay_inside_their_buffers_on_opencl(tmp_path: Path) -> None:
    log = tmp_path / "oclgrind.log"
    assert run("opencl", 500, 18, 6, before=oclgrind(log), seconds=SIMULATED_SECONDS, judged=False) == ""
    assert log.read_text() == ""


def test_cases_hold_what_they_are_to_hold() -> None:
    meshes = [case_of(seed) for seed in range(300)]
    assert {0, 1} <= {len(mesh.triangles) for mesh in meshes}
    assert max(len(mesh.triangles) for mesh in meshes) > 4096
    numbers = np.concatenate([mesh.colors for mesh in meshes]).ravel()
    assert np.isnan(numbers).any()
    assert np.isinf(numbers).any()
    assert (np.abs(numbers) < 1e-38)[numbers != 0].any()


@pytest.mark.parametrize(
    ("code", "said"), [("import os; os.abort()", "exit -6; seed 7"), ("while True: pass", "did not end in")]
)
def test_a_crash_and_a_loop_are_failures_that_name_the_case(code: str, said: str) -> None:
    before = (sys.executable, "-c", f"print('seed 7', flush=True)\n{code}")
    why = run("numpy", 0, 1, 1, before=before, seconds=1.0, start=1.0)
    assert said in why
    assert "seed 7" in why
