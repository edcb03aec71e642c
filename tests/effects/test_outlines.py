"""Outlines of scenes whose rays are cast by hand: where lines are, and where none may be."""

from __future__ import annotations

from math import pi, tan

import numpy as np
import pytest

import passgraph as pg
from passgraph.effects import outlines
from tests.agreement import assert_within_bounds
from tests.conftest import DEVICES
from tests.effects.scenes import Float64, Picture

COLOR, DEPTH = pg.Input("color"), pg.Input("depth")
FOV = 0.8


def run(depth: Float64 | Picture, backend: str = "numpy", **options: object) -> Float64:
    """Where lines are: 1."""
    depth = np.asarray(depth, np.float32)
    made = outlines(COLOR, DEPTH, vertical_fov_rad=FOV, **options)  # type: ignore[arg-type]
    with pg.compile(made, backend=backend, size=(depth.shape[1], depth.shape[0])) as program:
        white = np.ones((*depth.shape[:2], 4), np.float32)
        return 1.0 - program(color=white, depth=depth)["outlines"][:, :, 0].astype(np.float64)


def rays(width: int, height: int) -> tuple[Float64, Float64]:
    """x and y of pixels' rays at distance 1."""
    half = tan(0.5 * FOV)
    y, x = np.mgrid[0:height, 0:width] + 0.5
    return (2 * x / width - 1) * half * width / height, (1 - 2 * y / height) * half


def floor(x: Float64, y: Float64, down: float = 1.0) -> Float64:
    """Distance of a floor so far below the eye; 0 above the horizon."""
    return np.where(y < 0, -down / np.minimum(y, -1e-12), 0.0)


def ball(x: Float64, y: Float64, away: float, radius: float) -> Float64:
    """Distance along the view axis of a ball on that axis; 0 beside it."""
    square = x * x + y * y + 1
    root = away**2 - square * (away**2 - radius**2)
    return np.where(root > 0, (away - np.sqrt(np.maximum(root, 0))) / square, 0.0)


def rim(inside: np.ndarray[tuple[int, int], np.dtype[np.bool_]]) -> np.ndarray[tuple[int, int], np.dtype[np.bool_]]:
    """Pixels inside with one outside beside, above or below them."""
    grown = np.pad(inside, 1, mode="edge")
    around = grown[:-2, 1:-1] & grown[2:, 1:-1] & grown[1:-1, :-2] & grown[1:-1, 2:]
    return np.asarray(inside & ~around)


@pytest.mark.parametrize("backend_name", DEVICES, indirect=True)
@pytest.mark.parametrize("behind", ["sky", "wall"])
def test_a_silhouette_is_the_rim_of_what_is_nearer(behind: str, backend_name: str) -> None:
    x, y = rays(61, 45)
    front = ball(x, y, 4.0, 1.0)
    depth = np.where(front > 0, front, 0.0 if behind == "sky" else 9.0)
    # the ball itself falls off by a third of its radius from pixel to pixel at its rim
    np.testing.assert_array_equal(run(depth, backend_name, crease_rad=pi, jump=0.3) > 0.5, rim(front > 0))


@pytest.mark.parametrize("down", [0.02, 1.0, 50.0])
def test_a_floor_has_no_lines_up_to_its_horizon(down: float) -> None:
    """At every angle, in float32, at the picture's border too, and where it reaches the sky endlessly far away."""
    assert run(floor(*rays(64, 512), down)).sum() == 0.0


@pytest.mark.parametrize(("angle", "seen"), [(0.5, False), (0.7, True)])
def test_a_crease_has_one_line_from_its_angle_on(angle: float, seen: bool) -> None:
    """Two walls that meet in the middle, each turned away by half the angle."""
    x, _ = rays(80, 40)
    for side in (-1, 1):  # toward the eye, and away from it
        depth = 3.0 / (1.0 + side * tan(0.5 * angle) * np.abs(x))
        lines = run(depth, crease_rad=0.6, jump=0.5) > 0
        assert lines[:, 39:41].any(axis=1).all() == seen
        assert lines.sum() == (40 if seen else 0)


def test_lines_are_as_wide_as_they_are_asked_for() -> None:
    depth = np.where(np.hypot(*(np.mgrid[0:60, 0:60] - 29.5)) < 20, 2.0, 6.0)
    for width in (1, 3):
        row = run(depth, width_px=width)[30]
        assert row[:30].sum() == width
        assert row[10] == 1.0
        assert row[9] == 0.0


def test_orthographic_views_have_the_same_lines() -> None:
    depth = np.where(np.mgrid[0:40, 0:40][1] < 20, 3.0 + 0.1 * np.mgrid[0:40, 0:40][0], 8.0)
    depth[:4] = 0.0
    camera = pg.Camera((0, 0, 0), (0, 0, -1), orthographic_height=4.0)
    lines = run(depth, camera=camera) > 0
    assert lines[4:, 19].all()
    assert lines[4].all()
    assert lines.sum() == 36 + 39


@pytest.mark.parametrize("size", [(1, 1), (2, 1), (1, 5)], ids=str)
def test_a_picture_of_hardly_a_pixel_has_none(size: tuple[int, int]) -> None:
    for distance in (0.0, 2.0):
        assert run(np.full(size, distance)).sum() == 0.0


def test_lines_take_their_colour_and_opacity_and_alpha_stays() -> None:
    depth = np.where(np.mgrid[0:9, 0:9][1] < 4, 2.0, 6.0)[:, :, None]
    made = outlines(COLOR, DEPTH, line_color=(1.0, 0.5, 0.0), opacity=0.5)
    with pg.compile(made, size=(9, 9)) as program:
        shown = program(color=np.full((9, 9, 4), 0.25, np.float32), depth=depth.astype(np.float32))["outlines"]
    assert shown[4, 3].tolist() == [0.625, 0.375, 0.125, 0.25]
    assert shown[4, 4].tolist() == [0.25] * 4


def test_every_device_is_within_bounds() -> None:
    x, y = rays(24, 18)
    depth = np.maximum(ball(x, y, 4.0, 1.0), floor(x, y)).astype(np.float32)[:, :, None]
    color = np.random.default_rng(2).random((18, 24, 4), np.float32)
    assert_within_bounds(outlines(COLOR, DEPTH), size=(24, 18), color=color, depth=depth)
