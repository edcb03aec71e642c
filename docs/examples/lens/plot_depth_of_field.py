"""
Depth of field
==============

A thin lens, described by its f-number, focal length and focus distance. A blurred foreground covers what is sharp
behind it, and sharp objects do not bleed into a blurred background.
"""

from math import tan

import passgraph as pg
from passgraph.effects import depth_of_field, fxaa, soft_shadow_passes, tone_map

scene = pg.Scene.shipped()
camera = pg.Camera((4.4, 2.6, 8.4), (0.5, 1.15, 0.0), vertical_fov_rad=0.57, near=1.0, far=60.0)
seen = soft_shadow_passes(scene.with_(camera=camera), display=False)
lens = {"focal_length_mm": 12.0 / tan(0.5 * camera.vertical_fov_rad), "unit_m": 0.07}
shown = {
    "all in focus": seen.picture,
    "the ball in focus, f 1.4": depth_of_field(seen.picture, seen.depth, 6.3, f_number=1.4, **lens),
    "the box in focus, f 1.4": depth_of_field(seen.picture, seen.depth, 10.6, f_number=1.4, **lens),
    "the ball in focus, f 5.6": depth_of_field(seen.picture, seen.depth, 6.3, f_number=5.6, **lens),
}

for name, target in shown.items():
    with pg.compile(fxaa(tone_map(target, curve="linear")), size=(640, 360)) as program:
        program().save(f"{name}.png")

# sphinx_gallery_thumbnail_number = 2
