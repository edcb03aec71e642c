"""What is done with light maps in each frame: dark rims along walls, dirt on the lens."""

from __future__ import annotations

import numpy as np
import pytest

import passgraph as pg
from passgraph.effects.lens.lens import dirty_lens_bright
from passgraph.effects.light2d import Light2D, Wall, Window, distance_grid, occlusion
from passgraph.effects.light2d.distance_grid import reach
from passgraph.effects.light2d.lens_spots import dirty_lens_map, dirty_lens_spots, light_spots
from tests.effects.scenes import Picture

LEVEL = Window(0, 0, 32, 16)
VIEW = Window(4, 4, 12, 12)
LAMPS = (Light2D((8, 8), (1.0, 0.8, 0.4), 6), Light2D((20, 9), (0.3, 0.4, 1.0), 8))
SCENE, DIRT = pg.Input("scene"), pg.Input("dirt")


def run(target: pg.Target, backend: str, **given: object) -> Picture:
    with pg.compile(target, backend=backend, size=(48, 48)) as program:
        return program(**given)[target.name]


def picture(seed: int, size: int = 48) -> Picture:
    return np.random.default_rng(seed).random((size, size, 4), np.float32)


def test_the_grid_holds_the_distance_to_the_nearest_wall() -> None:
    window = Window(0, 0, 12, 9)
    grid = distance_grid(window, [Wall.box(3, 3, 6, 6), Wall(((9, 0), (9, 9)))], 1.5)
    assert grid.shape == (6, 8)
    assert grid[3, 2] == 0.0  # inside the box
    assert grid[0, 0] == pytest.approx(np.hypot(3 - 0.75, 8.25 - 6))
    assert grid[0, 7] == pytest.approx(11.25 - 9)
    assert reach(grid, window, (11.2, 8.0), 1.5, 0.5) == pytest.approx(2.75)
    assert np.isinf(distance_grid(window, [], 1.5)).all()


def test_rims_are_dark_at_walls_smooth_between_cells_and_nowhere_else(backend_name: str) -> None:
    grid = distance_grid(Window(0, 0, 12, 12), [Wall.box(0, 0, 3, 12)], 1.5)
    white = np.ones((48, 48, 4), np.float32)
    shown = run(occlusion(SCENE, grid, 1.0, 0.6), backend_name, scene=white)
    row = shown[20, :, 0]
    np.testing.assert_allclose(row[:15], 0.4, atol=3e-3)
    assert (row[22:] == 1.0).all()
    assert (np.diff(row) >= 0).all()
    assert np.diff(row).max() < 0.6 / 5
    assert (shown[:, :, 3] == 1.0).all()


def test_dirt_over_bright_pixels_is_dirt_times_them(backend_name: str) -> None:
    scene, dirt = picture(1), picture(2)
    shown = run(dirty_lens_bright(SCENE, DIRT, 0.5), backend_name, scene=scene, dirt=dirt)
    np.testing.assert_allclose(shown[:, :, :3], (scene * (1 + 0.5 * dirt))[:, :, :3], atol=3e-3)
    np.testing.assert_allclose(shown[:, :, 3], scene[:, :, 3], atol=1e-3)


def test_a_scene_bright_all_over_shows_dirt_without_any_lamp() -> None:
    """What is wrong with the first lens, and right with the second."""
    scene, dirt = np.full((48, 48, 4), 0.9, np.float32), picture(2)
    first = run(dirty_lens_bright(SCENE, DIRT), "reference", scene=scene, dirt=dirt)
    spots = light_spots(VIEW, [], (48, 48))
    second = run(dirty_lens_spots(SCENE, DIRT, spots), "reference", scene=scene, dirt=dirt)
    assert (first - scene)[:, :, :3].mean() > 0.4
    np.testing.assert_array_equal(second, scene)


def test_spots_drawn_anew_and_a_map_of_spots_look_the_same(backend_name: str) -> None:
    scene, dirt = picture(3), picture(4)
    anew = dirty_lens_spots(SCENE, DIRT, light_spots(VIEW, LAMPS, (48, 48)))
    once = dirty_lens_map(SCENE, DIRT, light_spots(LEVEL, LAMPS, (192, 96)), LEVEL, pg.Value("view"))
    second = run(anew, backend_name, scene=scene, dirt=dirt)
    third = run(once, backend_name, scene=scene, dirt=dirt, view=VIEW)
    assert (second - scene)[24, 24, :3].max() > 0.1
    np.testing.assert_allclose(third, second, atol=0.01)
    expected = run(once, "reference", scene=scene, dirt=dirt, view=VIEW)
    np.testing.assert_allclose(third, expected, atol=2e-3)


def test_the_map_of_spots_is_drawn_once_while_the_view_moves() -> None:
    made = dirty_lens_map(SCENE, DIRT, light_spots(LEVEL, LAMPS, (64, 32)), LEVEL, pg.Value("view"))
    steps: list[str] = []
    with pg.compile(made, backend="reference") as program:
        for shift in (0, 3):
            steps.clear()
            view = Window(4 + shift, 4, 12 + shift, 12)
            program.run(lambda step, _: steps.append(step.name), scene=picture(5), dirt=picture(6), view=view)
    assert steps == ["lens"]
