"""
Edges and shapes
================

The Sobel filter shows where the luminance changes. Erosion and dilation take the least and the largest value of each
channel within two pixels: dark lines grow, then bright areas grow.
"""

from skimage import data

import passgraph as pg
from passgraph.effects import morphology, sobel

photo = pg.Input("photo")
shown = {
    "Sobel": sobel(photo, strength=2.0),
    "erosion": morphology(photo, "erode", radius_px=2),
    "dilation": morphology(photo, "dilate", radius_px=2),
}

for name, target in shown.items():
    with pg.compile(target) as program:
        program(photo=data.stereo_motorcycle()[0][60:285, 300:700]).save(f"{name}.png")
