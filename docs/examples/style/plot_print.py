"""
Squares, dithering and halftone
===============================

Even squares; few levels for each channel, by an ordered matrix (Bayer 1973) or blue noise; and dots of four inks whose
mean is the color of the picture.
"""

import numpy as np
from skimage import data

import passgraph as pg
from passgraph.effects import dither, halftone, pixelate, tone_map

photo, light = pg.Input("photo"), pg.Input("photo", "srgb")
shown = {
    "pixelate": pixelate(photo, size_px=6),
    "dither, 2 levels": dither(photo, levels=2),
    "dither, 2 levels, blue noise": dither(photo, levels=2, pattern="blue-noise"),
    "dither, 4 levels": dither(photo, levels=4),
    "halftone": tone_map(halftone(light, cell_px=5.0), curve="linear"),
    "halftone, black": tone_map(halftone(light, cell_px=5.0, colored=False), curve="linear"),
}

for name, target in shown.items():
    with pg.compile(target) as program:
        picture = np.asarray(program(photo=data.astronaut()[10:190, 90:410]))
    pg.save(f"{name}.png", picture.repeat(2, axis=0).repeat(2, axis=1))

# sphinx_gallery_thumbnail_number = 5
