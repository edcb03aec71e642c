"""
A Shadertoy
===========

An export of a Shadertoy with a buffer that reads its last frame: drops fall on water, and the photograph is seen
through the waves.

Download :download:`ripples.json </shaders/ripples.json>` next to the script.
"""

from skimage import data

import passgraph as pg

ripples = pg.load_shader("ripples.json")
photo = data.stereo_motorcycle()[0][60:440, 40:716]

with pg.compile(ripples(pg.Input("photo"))) as program:
    for frame in range(1, 151):
        result = program(photo=photo)
        if frame in (30, 150):
            result.save(f"frame {frame}.png")

# sphinx_gallery_thumbnail_number = 2
