"""
Shadows of moving things
========================

The world that comes with passgraph, with two more things beside lamps. Exact shadows treat moving things as walls, and
compute the whole light map anew in each frame. Sprites are drawn over a static map: near a lamp they fade out, or
become a fan of several sprites.
"""

from dataclasses import replace

import passgraph as pg
from passgraph.effects.light2d import Mover, Wall, World2D
from passgraph.effects.light2d.picture import light2d

SIZE = (960, 540)
shipped = World2D.shipped()
beside_lamps = Mover((6.4, 8.6), (0.5, 0.35), 0.4), Mover((23.2, 14.4), (0.5, 0.3))
world = replace(shipped, movers=(*shipped.movers, *beside_lamps))
solid = replace(world, walls=(*world.walls, *(Wall(mover.corners) for mover in world.movers)), movers=())
shown = {
    "exact, computed anew in each frame": light2d(solid, SIZE, rims=0.0),
    "sprites that fade near lamps": light2d(world, SIZE, rims=0.0, near="fade"),
    "sprites that fan out near lamps": light2d(world, SIZE, rims=0.0, near="fan"),
    "sprites, and rims along walls": light2d(world, SIZE, near="fan"),
}

for name, target in shown.items():
    with pg.compile(target, size=SIZE) as program:
        program().save(f"{name}.png")

# sphinx_gallery_thumbnail_number = 3
