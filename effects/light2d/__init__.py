"""Light and shadow of flat worlds: a light map computed once, and per-frame updates.

Reading order: world, shapes, penumbra, tiles, smoothing, light_map, grid, sprites,
world_file, lens_spots, picture, bake.
"""

from passgraph.effects.light2d.distance_grid import distance_grid, occlusion
from passgraph.effects.light2d.light_map import light_map, lit
from passgraph.effects.light2d.light_tiles import LiveLight, live_light_map
from passgraph.effects.light2d.smoothing import smoothed
from passgraph.effects.light2d.sprites import LampCache, Mover, moving_shadows
from passgraph.effects.light2d.world import Light2D, Wall, Window
from passgraph.effects.light2d.world_file import World2D

__all__ = [
    "LampCache",
    "Light2D",
    "LiveLight",
    "Mover",
    "Wall",
    "Window",
    "World2D",
    "distance_grid",
    "light_map",
    "lit",
    "live_light_map",
    "moving_shadows",
    "occlusion",
    "smoothed",
]
