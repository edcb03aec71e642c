"""
An mpv user shader
==================

Hooks of the video player mpv. This one paints: of four squares around each pixel it takes the mean of the most even
one, after Kuwahara and others (1976).

Download :download:`kuwahara.glsl </shaders/kuwahara.glsl>` next to the script.
"""

from skimage import data

import passgraph as pg

kuwahara = pg.load_shader("kuwahara.glsl")

for radius in (2, 6):
    with pg.compile(kuwahara(pg.Input("photo"), radius=radius, output_scale=1.0)) as program:
        program(photo=data.stereo_motorcycle()[0][60:440, 40:716]).save(f"radius {radius}.png")

# sphinx_gallery_thumbnail_number = 2
