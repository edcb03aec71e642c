"""
Brightness, contrast, hue, saturation and sepia
===============================================

Simple adjustments of encoded values, as the CSS filters of these names define them; and contrast stretched between two
percentiles.
"""

from math import tau

from skimage import data

import passgraph as pg
from passgraph.effects import brightness_contrast, hue_saturation, normalize, sepia

photo = pg.Input("photo")
shown = {
    "brightness 1.2, contrast 1.5": brightness_contrast(photo, brightness=1.2, contrast=1.5),
    "normalized": normalize(photo, low=2.0, high=98.0),
    "hue, a third of a turn": hue_saturation(photo, hue_rad=tau / 3),
    "saturation 2": hue_saturation(photo, saturation=2.0),
    "sepia": sepia(photo),
}

for name, target in shown.items():
    with pg.compile(target) as program:
        program(photo=data.chelsea()[20:274]).save(f"{name}.png")
