"""
A 2-D game
==========

The light map of the walls is computed once. In each frame, only the sprites of moving things' shadows are drawn. Rims
along walls come from a grid of distances.
"""

import numpy as np
from skimage import data

import passgraph as pg
import passgraph.effects.light2d as flat
from passgraph.effects import tone_map

SIZE = (960, 540)
view = flat.Window(0.0, 0.0, 32.0, 18.0)
lamps = (
    flat.Light2D((7.0, 11.5), (1.0, 0.78, 0.45), 13.0, 0.9),
    flat.Light2D((23.5, 6.0), (0.45, 0.65, 1.0), 13.0, 0.9),
    flat.Light2D((16.5, 15.5), (0.9, 0.35, 0.25), 7.0, 0.6),
)
boxes = ((0, 0, 1, 18), (31, 0, 32, 18), (11, 9, 12, 18), (11, 0, 12, 4), (19.5, 11, 31, 12), (4, 6, 6.5, 7))
walls = [flat.Wall.box(*box) for box in boxes]
places = ((8.8, 7.2), (3.2, 11.0), (14.5, 6.6), (21.2, 8.3), (26.5, 8.4), (21.0, 3.4))
movers = tuple(flat.Mover(place, (0.6, 0.4), 0.3 * number) for number, place in enumerate(places))

# The level without light: gravel, brick walls, and the moving things.
y, x = np.mgrid[0 : SIZE[1], 0 : SIZE[0]]
drawn = data.gravel()[y % 512, x % 512, None] / 255.0 * (0.62, 0.58, 0.5)
wx, wy = (x + 0.5) / 30.0, 18.0 - (y + 0.5) / 30.0
for left, low, right, high in boxes:
    inside = (wx > left) & (wx < right) & (wy > low) & (wy < high)
    drawn[inside] = (data.brick()[y % 512, x % 512, None] / 255.0 * (0.75, 0.42, 0.32))[inside]
for mover in movers:
    away = (wx - mover.position[0]) + 1j * (wy - mover.position[1])
    turned = away * np.exp(-1j * mover.angle_rad)
    drawn[(abs(turned.real) < mover.half[0]) & (abs(turned.imag) < mover.half[1])] = (0.55, 0.5, 0.12)

scene = pg.Input("scene")
rims = flat.occlusion(scene, flat.distance_grid(view, walls, 1.5), threshold=1.0, darkness=0.6, name="rims")
static = flat.lit(rims, flat.light_map(view, lamps, walls, SIZE, ambient=(0.02, 0.02, 0.03)))
moving = flat.moving_shadows(static, view, lamps, pg.Value("movers"), 8)

for name, target in {"as drawn": scene, "rims along walls": rims, "static light": static, "moving": moving}.items():
    with pg.compile(tone_map(target, curve="linear")) as program:
        program(scene=drawn, **({"movers": movers} if target is moving else {})).save(f"{name}.png")

# sphinx_gallery_thumbnail_number = 4
