"""
Tone curves
===========

A tone curve maps scene-linear light to a display. The photograph is two stops too bright. ``agx`` and ``pbr-neutral``
let bright colors turn white; the others compress each channel alone and shift the hue.

The ramps span sixteen stops of gray, pure colors and a skin tone. They show how far blacks and whites reach.
"""

import numpy as np
from skimage import data

import passgraph as pg
from passgraph.effects import tone_map

CURVES = ("linear", "reinhard", "hable", "aces", "agx", "pbr-neutral")

for curve in CURVES:
    with pg.compile(tone_map(pg.Input("photo", "srgb"), exposure_stops=2.0, curve=curve)) as program:
        program(photo=data.coffee()[31:369]).save(f"{curve}.png")

colors = [(1, 1, 1), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 1, 1), (0, 0, 1), (1, 0, 1), (0.9, 0.45, 0.3)]
light = 0.18 * np.geomspace(2.0**-8, 2.0**8, 640)
ramps = np.repeat(colors, 18, axis=0)[:, None, :] * light[None, :, None]

for curve in CURVES:
    with pg.compile(tone_map(pg.Input("ramps"), curve=curve)) as program:
        program(ramps=ramps).save(f"{curve}, ramps.png")

# sphinx_gallery_thumbnail_number = 4
