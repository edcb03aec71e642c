"""
Blur widths in the world and in pixels
======================================

The camera moves away; the middle of each picture is enlarged. A blur of constant width in the world keeps its look. A
blur of constant width in pixels dissolves the shadows.
"""

from dataclasses import replace

import numpy as np

import passgraph as pg
from passgraph.effects import Blur, soft_shadow_passes, supersampled

scene = pg.Scene.shipped()
camera = scene.camera

for width in ("world", "constant"):
    for factor in (1, 2, 4):
        eye = np.array(camera.target) + factor * (np.array(camera.eye) - camera.target)
        moved = scene.with_(camera=replace(camera, eye=tuple(eye), far=factor * camera.far))
        shadows = soft_shadow_passes(moved, softness=0.1, filter=Blur(width, radius_px=12)).shadows_blurred
        with pg.compile(supersampled(shadows), size=(1280, 720)) as program:
            picture = program()["supersampled"]
        x, y = 320 - 320 // factor, 180 - 180 // factor
        middle = picture[y : 360 - y, x : 640 - x].repeat(factor, axis=0).repeat(factor, axis=1)
        pg.save(f"{width}, {factor} x as far.png", middle)

# sphinx_gallery_thumbnail_number = 6
