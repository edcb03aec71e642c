"""Light and shadow of flat worlds: a light map computed once, and what changes in each frame.

Reading order: world, shapes, buffers, penumbra, smoothing, light_map, grid, sprites.
"""

from passgraph.effects.light2d.grid import distance_grid, occlusion
from passgraph.effects.light2d.light_map import light_map, lit
from passgraph.effects.light2d.smoothing import smoothed
from passgraph.effects.light2d.sprites import Mover, moving_shadows
from passgraph.effects.light2d.world import Light2D, Wall, Window

__all__ = [
    "Light2D",
    "Mover",
    "Wall",
    "Window",
    "distance_grid",
    "light_map",
    "lit",
    "moving_shadows",
    "occlusion",
    "smoothed",
]
