"""
Lens distortion
===============

The radial distortion of OpenCV's camera calibration, and its inverse by the same coefficients. The grid is drawn onto
the photograph.
"""

from skimage import data

import passgraph as pg
from passgraph.effects import lens_distortion

photo = data.stereo_motorcycle()[0][60:440, 40:716].copy()
photo[19::38] = photo[:, 19::38] = (255, 204, 0)

frame = pg.Input("photo").border("zero")
barrel = lens_distortion(frame, k1=-0.15, name="barrel")
shown = {
    "k1 = -0.15, a barrel": barrel,
    "k1 = 0.15, a pincushion": lens_distortion(frame, k1=0.15),
    "the barrel, undone": lens_distortion(barrel.border("zero"), k1=-0.15, undo=True),
}

for name, target in shown.items():
    with pg.compile(target) as program:
        program(photo=photo).save(f"{name}.png")
