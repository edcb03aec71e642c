"""Sprites beside exact shadows of moving things."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from passgraph.effects.light2d import Light2D, Mover, Wall, Window, World2D
from tests.effects.light2d_comparison import static_against_dynamic

WORLD = World2D(
    Window(0, 0, 16, 9),
    (Wall.box(12, 3, 13, 6),),
    (Light2D((3, 4.5), radius=14, size=0.3),),
    (Mover((7, 5), (0.5, 0.4), 0.3), Mover((8, 2), (0.4, 0.4))),
)
SIZE = (96, 54)


def test_without_moving_things_both_are_the_same_picture() -> None:
    made = static_against_dynamic(replace(WORLD, movers=()), SIZE, "numpy")
    assert made.rmse == 0.0
    assert made.side_by_side.shape == (54, 192, 4)


def test_sprites_are_nearer_to_exact_shadows_than_none(backend_name: str) -> None:
    made = static_against_dynamic(WORLD, SIZE, backend_name)
    none = static_against_dynamic(replace(WORLD, movers=()), SIZE, backend_name).sprites
    without = np.sqrt(np.mean((made.exact - none)[:, :, :3] ** 2))
    assert 0.0 < made.rmse < without
