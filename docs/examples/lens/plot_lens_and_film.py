"""
Vignette, chromatic aberration and film grain
=============================================

Light falls off toward the corners with the fourth power of the cosine. A simple lens magnifies each wavelength
differently. Film grain is strongest between black and white.
"""

from skimage import data

import passgraph as pg
from passgraph.effects import chromatic_aberration, film_grain, tone_map, vignette

photo = pg.Input("photo", "srgb")
shown = {
    "without": tone_map(photo, curve="linear"),
    "vignette": tone_map(vignette(photo, vertical_fov_rad=1.2), curve="linear"),
    "chromatic aberration": tone_map(chromatic_aberration(photo, spread=0.015), curve="linear"),
    "film grain": film_grain(tone_map(photo, curve="linear"), strength=0.07, size_px=1.5),
}

for name, target in shown.items():
    with pg.compile(target) as program:
        program(photo=data.stereo_motorcycle()[0][60:440, 40:716]).save(f"{name}.png")

# sphinx_gallery_thumbnail_number = 2
