"""
Glitch
======

A bad signal: bands and blocks lose their place, and the colors come apart. ``index`` is the number of the frame.
"""

from skimage import data

import passgraph as pg
from passgraph.effects import glitch

photo = pg.Input("photo")
shown = {
    "amount 0.2": glitch(photo, amount=0.2, shift_px=16, split_px=6),
    "amount 0.6": glitch(photo, amount=0.6, shift_px=60, split_px=12, index=3),
}

for name, target in shown.items():
    with pg.compile(target) as program:
        program(photo=data.stereo_motorcycle()[0][60:440, 40:716]).save(f"{name}.png")

# sphinx_gallery_thumbnail_number = 2
