"""
Tilt-shift
==========

A tilted lens is sharp along a band and blurs what is far from the band. Large things then look like models.
"""

from skimage import data

import passgraph as pg
from passgraph.effects import tilt_shift, tone_map

photo = pg.Input("photo", "srgb")
shown = {"without": photo, "tilt-shift": tilt_shift(photo, y=0.85, band=0.1, sigma_px=7.0)}

for name, target in shown.items():
    with pg.compile(tone_map(target, exposure_stops=1.0, curve="linear")) as program:
        program(photo=data.rocket()[67:]).save(f"{name}.png")

# sphinx_gallery_thumbnail_number = 2
