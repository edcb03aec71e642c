"""
Cathode ray tube
================

The beam draws lines of soft dots, and a mask splits them into phosphors. Input is a picture of 160 by 90 pixels; the
middle of each result is shown.
"""

from skimage import data

import passgraph as pg
from passgraph.effects import crt, tone_map

photo = data.stereo_motorcycle()[0][80:440, 40:680].reshape(90, 4, 160, 4, 3).mean(axis=(1, 3)) / 255.0
light, screen = pg.Input("light"), pg.target("crt", "rgba32f", (1280, 720))
shown = {
    "stretched VGA mask": crt(light, pixel_px=1, into=screen),
    "aperture grille, flat": crt(light, pixel_px=1, scan=16.0, curve=0.0, mask="grille", into=screen),
}

for name, target in shown.items():
    with pg.compile(tone_map(target, curve="linear")) as program:
        picture = program(light=photo**2.2)["tone_map"]
    pg.save(f"{name}.png", picture[180:540, 320:960])
