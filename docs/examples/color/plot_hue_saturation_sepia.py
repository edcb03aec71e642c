"""
Hue, saturation and sepia
=========================

Color matrices on encoded values, as the CSS filters ``hue-rotate``, ``saturate`` and ``sepia`` define them.
"""

from math import tau

from skimage import data

import passgraph as pg
from passgraph.effects import hue_saturation, sepia

photo = pg.Input("photo")
shown = {
    "hue, a third of a turn": hue_saturation(photo, hue_rad=tau / 3),
    "saturation 2": hue_saturation(photo, saturation=2.0),
    "sepia": sepia(photo),
}

for name, target in shown.items():
    with pg.compile(target) as program:
        program(photo=data.chelsea()[20:274]).save(f"{name}.png")
