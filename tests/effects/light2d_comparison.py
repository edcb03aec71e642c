"""Exact shadows of moving things, computed anew in each frame, beside a static map with sprites over it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

import passgraph as pg
from passgraph.effects.light2d.picture import light2d
from passgraph.effects.light2d.sprites import Near
from passgraph.effects.light2d.world import Wall
from passgraph.effects.light2d.world_file import World2D


@dataclass(frozen=True, eq=False)
class Comparison:
    """Two pictures of one world, and how far they are from each other.

    Attributes
    ----------
    exact : moving things are walls of the light map
    sprites : the light map knows walls alone, and moving things have sprites
    rmse : of red, green and blue, linear
    """

    exact: NDArray[np.float32]
    sprites: NDArray[np.float32]
    rmse: float

    @property
    def side_by_side(self) -> NDArray[np.float32]:
        """Both, the exact one on the left."""
        return np.concatenate([self.exact, self.sprites], axis=1)


def static_against_dynamic(
    world: World2D, size: tuple[int, int], backend: str | None = None, near: Near = "fade", display: bool = False
) -> Comparison:
    """Both pictures of a world, without rims.

    Parameters
    ----------
    world : with movers
    size : (width, height) of each picture, px
    backend : as in `passgraph.compile`
    near : as in `moving_shadows`
    display : sRGB pictures; off: linear ones
    """
    walls = (*world.walls, *(Wall(mover.corners) for mover in world.movers))
    pictures = []
    for shown in (replace(world, walls=walls, movers=()), world):
        made = light2d(shown, size, rims=0.0, near=near, display=display)
        with pg.compile(made, backend=backend, size=size) as program:
            pictures.append(program()["light2d"])
    exact, sprites = pictures
    return Comparison(exact, sprites, float(np.sqrt(np.mean((exact - sprites)[:, :, :3] ** 2))))
