"""
Enlarging
=========

A picture of 120 by 68 pixels, four times as large. ``resize`` computes in linear light with a filter of your choice.
AMD's FidelityFX Super Resolution 1 (``fsr1``) follows edges and sharpens the result.
"""

import numpy as np
from skimage import data

import passgraph as pg
from passgraph.effects import fsr1, resize, tone_map

photo = np.ascontiguousarray(data.astronaut()[68:136, 160:280])
FILTERS = ("box", "bilinear", "catmull-rom", "mitchell", "lanczos3")

for filter in FILTERS:
    with pg.compile(tone_map(resize(pg.Input("photo", "srgb"), scale=4.0, filter=filter), curve="linear")) as program:
        program(photo=photo).save(f"{filter}.png")

with pg.compile(fsr1(pg.Input("photo"), scale=4.0)) as program:
    program(photo=photo).save("FSR 1.png")

# sphinx_gallery_thumbnail_number = 6
