"""
Antialiasing
============

The upper part of a teapot's handle, eight times enlarged. FXAA and SMAA smooth edges of the finished picture. Four
samples a pixel draw the scene at twice the size and average, at four times the cost. For antialiasing over several
frames see :ref:`sphx_glr_gallery_temporal_plot_taa.py`.
"""

import passgraph as pg
from passgraph.effects import fxaa, smaa, soft_shadow, supersampled

scene = soft_shadow(pg.Scene.shipped())
shown = {
    "no antialiasing": (scene, (640, 360)),
    "FXAA": (fxaa(scene), (640, 360)),
    "FXAA, quality 39": (fxaa(scene, quality="39"), (640, 360)),
    "SMAA": (smaa(scene), (640, 360)),
    "four samples a pixel": (supersampled(scene), (1280, 720)),
}

for name, (target, size) in shown.items():
    with pg.compile(target, size=size) as program:
        picture = program()[target.name]
    enlarged = picture[95:140, 160:240].repeat(8, axis=0).repeat(8, axis=1)
    pg.save(f"{name}.png", enlarged)

# sphinx_gallery_thumbnail_number = 5
