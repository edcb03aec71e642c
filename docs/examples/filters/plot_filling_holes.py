"""
Filling holes
=============

Transparent pixels are filled from the known pixels around them, by halving the picture until every hole is closed and
doubling it again. Known pixels stay as they are.
"""

import numpy as np
from skimage import data

import passgraph as pg
from passgraph.effects import fill

photo = np.dstack([data.chelsea()[20:274] / 255.0, np.ones((254, 451))])
random = np.random.default_rng(5)

y, x = np.mgrid[:254, :451]
scratched = photo.copy()
for left, top, angle, width in random.random((40, 4)) * (451.0, 254.0, 3.2, 2.5):
    scratched[np.abs((x - left) * np.sin(angle) - (y - top) * np.cos(angle)) < width] = 0.0
sparse = np.where(random.random((254, 451, 1)) < 0.15, photo, 0.0)

for name, picture in {"scratches": scratched, "15 % of the pixels": sparse}.items():
    pg.save(f"{name}.png", picture[..., :3])
    with pg.compile(fill(pg.Input("holes"))) as program:
        program(holes=picture).save(f"{name}, filled.png")
