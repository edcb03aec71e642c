"""
Radial blur
===========

A camera zooms, or rolls, while its shutter is open. The blur is computed in linear light, so that bright points leave
bright traces.
"""

from skimage import data

import passgraph as pg
from passgraph.effects import radial_blur, tone_map

photo = pg.Input("photo", "srgb")
shown = {
    "zoom": radial_blur(photo, zoom=0.3, x=0.55, y=0.5),
    "spin": radial_blur(photo, zoom=0.0, spin_rad=0.3, x=0.55, y=0.5),
}

for name, target in shown.items():
    with pg.compile(tone_map(target, curve="linear")) as program:
        program(photo=data.stereo_motorcycle()[0][60:440, 40:716]).save(f"{name}.png")
