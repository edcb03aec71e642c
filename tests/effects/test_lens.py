"""Dirt on the lens: the texture, what each way costs, and how alike the results are."""

from __future__ import annotations

import numpy as np
import pytest

import passgraph as pg
from passgraph.effects.lens.lens import dirt_texture, dirty_lens, dirty_lens_bright
from passgraph.effects.light2d import Light2D, Wall, Window, light_map, lit, moving_shadows, occlusion
from passgraph.effects.light2d.distance_grid import distance_grid
from passgraph.effects.light2d.lens_spots import dirty_lens_map, dirty_lens_spots, light_spots
from tests.effects.scenes import Picture

SIZE = (96, 54)
LEVEL, VIEW = Window(0, 0, 64, 36), Window(4, 6, 20, 15)
LAMPS = (Light2D((9, 10), (1.0, 0.8, 0.4), 8), Light2D((17, 12), (0.3, 0.4, 1.0), 6))
LAMPS_AT = [(lamp.position, lamp.radius) for lamp in LAMPS]
SCENE = pg.Input("scene", "rgba32f", SIZE)
DIRT = pg.Input("dirt", "rgba32f", SIZE, static=True, default=dirt_texture(SIZE))


def shown(target: pg.Target, scene: Picture, **given: object) -> Picture:
    with pg.compile(target, backend="reference", size=SIZE) as program:
        return program(scene=scene, **given)[target.name]


def grey(value: float) -> Picture:
    return np.full((SIZE[1], SIZE[0], 4), value, np.float32)


def test_dirt_is_sparse_and_the_same_each_time() -> None:
    dirt = dirt_texture((320, 180))
    np.testing.assert_array_equal(dirt, dirt_texture((320, 180)))
    assert not np.array_equal(dirt, dirt_texture((320, 180), seed=2))
    assert 0.0 <= dirt.min() <= dirt.max() <= 1.0
    assert 0.01 < dirt[:, :, 0].mean() < 0.12
    assert np.median(dirt[:, :, 0]) < 0.05


def test_the_first_way_shows_dirt_by_brightness_and_the_others_by_lamps() -> None:
    """In a scene that is bright all over the first adds as much far from lamps as near them."""
    spots = light_spots(VIEW, LAMPS, SIZE)
    x, y = np.meshgrid(np.arange(SIZE[0]) + 0.5, np.arange(SIZE[1]) + 0.5)
    places = VIEW.world((x, y), SIZE)  # type: ignore[arg-type]
    # how far away each lamp's spot ends, as a share of it
    far = np.min([np.hypot(places[0] - at[0], places[1] - at[1]) / (0.4 * r) for at, r in LAMPS_AT], axis=0)
    dirt = dirt_texture(SIZE)[:, :, 0]
    added = {
        "bright": shown(dirty_lens_bright(SCENE, DIRT), grey(0.8)) - grey(0.8),
        "spots": shown(dirty_lens_spots(SCENE, DIRT, spots), grey(0.8)) - grey(0.8),
    }
    away = (far > 1.0) & (dirt > 0.05)
    assert away.sum() > 20
    assert added["bright"][away][:, 0].mean() == pytest.approx(0.8 * dirt[away].mean(), rel=0.01)
    assert np.abs(added["spots"][away][:, :3]).max() == 0.0


def test_one_map_of_spots_looks_like_spots_drawn_for_the_view() -> None:
    """RMSE below half a step of 8 bits with a map texel as large as a pixel of the view."""
    anew = dirty_lens_spots(SCENE, DIRT, light_spots(VIEW, LAMPS, SIZE))
    once = dirty_lens_map(SCENE, DIRT, light_spots(LEVEL, LAMPS, (384, 216)), LEVEL, VIEW)
    first, second = shown(anew, grey(0.2)), shown(once, grey(0.2))
    assert (first - grey(0.2)).max() > 0.1
    assert np.sqrt(np.mean((first - second)[:, :, :3] ** 2)) < 0.5 / 255


def test_work_at_load_and_work_in_each_frame() -> None:
    """Light map, rims' texture and spots are made once; each frame takes seven passes."""
    view = pg.Value("view", default=VIEW)
    walls = [Wall.box(12, 8, 13, 11)]
    floor = lit(SCENE, light_map(VIEW, LAMPS, walls, SIZE))
    rims = occlusion(floor, distance_grid(VIEW, walls, 1.0), 1.0)
    moving = moving_shadows(rims, VIEW, LAMPS, pg.Value("movers", default=()), 4)
    made = dirty_lens_map(moving, DIRT, light_spots(LEVEL, LAMPS, SIZE), LEVEL, view)
    frames: list[list[str]] = []
    with pg.compile(made, backend="reference", size=SIZE) as program:
        for _ in range(3):
            steps: list[str] = []
            program.run(lambda step, _, steps=steps: steps.append(step.name), scene=grey(0.5), view=VIEW)
            frames.append(steps)
    load = [step for step in frames[0] if step not in frames[1]]
    assert any(step.startswith("light_map") for step in load)
    assert any(step.startswith("spots") for step in load)
    assert frames[1] == frames[2]
    assert {step.split("_")[0] for step in frames[1]} == {"lit", "occlusion", "moving", "lens"}
    assert len(frames[1]) == 7


def test_what_cannot_be_is_refused() -> None:
    with pytest.raises(pg.GraphError, match="strength must be 0 or more"):
        dirty_lens(SCENE, strength=-1.0)
    with pytest.raises(pg.GraphError, match="share must be above 0"):
        light_spots(VIEW, LAMPS, SIZE, share=0.0)
