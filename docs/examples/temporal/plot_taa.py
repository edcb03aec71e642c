"""
Temporal antialiasing
=====================

The camera moves by a part of a pixel in each frame. Temporal antialiasing (TAA) keeps the samples of the frames before.
The upper part of a teapot's handle, eight times enlarged.
"""

import passgraph as pg
from passgraph.effects import jittered, soft_shadow_passes, taa, tone_map

SIZE = (640, 360)
scene = pg.Scene.shipped()
seen = soft_shadow_passes(scene, display=False)
smooth = tone_map(taa(seen.picture, seen.depth, camera=scene.camera), curve="linear")

with pg.compile(smooth, size=SIZE) as program:
    for number in range(16):
        picture = program(camera=jittered(scene.camera, number, SIZE))["tone_map"]
        if number in (0, 3, 15):
            enlarged = picture[95:140, 160:240].repeat(8, axis=0).repeat(8, axis=1)
            pg.save(f"frame {number + 1}.png", enlarged)

# sphinx_gallery_thumbnail_number = 3
