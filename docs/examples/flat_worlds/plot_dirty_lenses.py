"""
Dirt on the lens, lit by lamps
==============================

Three ways to light dirt on the lens of a game's camera: wherever the picture is bright, lamp or not; by spots around
the lamps, drawn for this view; and by one map of spots for the whole level.
"""

import passgraph as pg
from passgraph.effects.light2d import World2D
from passgraph.effects.light2d.picture import light2d

SIZE = (960, 540)
world = World2D.shipped()

for name, lens in {"without": "none", "bright pixels": "bright", "spots": "spots", "map of spots": "map"}.items():
    with pg.compile(light2d(world, SIZE, lens=lens, lens_strength=3.0), size=SIZE) as program:
        program().save(f"{name}.png")
