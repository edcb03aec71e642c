"""
A libretro preset
=================

A television tube, as emulators of game consoles show it: a preset of two shaders. The beam softens lines; mask and
curved glass show them larger. Input is a picture of 160 by 90 pixels.

Download :download:`crt.glslp </shaders/crt.glslp>`, :download:`crt-beam.glsl </shaders/crt-beam.glsl>` and
:download:`crt-glass.glsl </shaders/crt-glass.glsl>` next to the script.
"""

from skimage import data

import passgraph as pg

tube, photo = pg.load_shader("crt.glslp"), pg.Input("photo")
small = data.stereo_motorcycle()[0][80:440, 40:680].reshape(90, 4, 160, 4, 3).mean(axis=(1, 3)) / 255.0
shown = {"the preset": tube(photo), "flat, without a mask": tube(photo, BULGE=0.0, MASK=0.0, LINES=0.8)}

for name, target in shown.items():
    with pg.compile(target) as program:
        program(photo=small).save(f"{name}.png")
