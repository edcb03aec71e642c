"""
Dirt on the lens, lit by lamps
==============================

Two ways to light dirt on the lens of a game's camera: wherever the picture is bright, lamp or not; and by spots around
the lamps. ``lens="spots"`` draws the spots for each view. ``lens="map"`` draws one map of them for the whole level,
and looks the same.
"""

import passgraph as pg
from passgraph.effects.light2d import World2D
from passgraph.effects.light2d.picture import light2d

SIZE = (960, 540)
world = World2D.shipped()

for name, lens in {"without": "none", "bright pixels": "bright", "spots around lamps": "map"}.items():
    with pg.compile(light2d(world, SIZE, lens=lens, lens_strength=3.0), size=SIZE) as program:
        program().save(f"{name}.png")

# sphinx_gallery_thumbnail_number = 3
