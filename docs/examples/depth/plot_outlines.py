"""
Outlines
========

Silhouettes and creases, found in the depth alone. Floors have no lines at any angle of view. FXAA smooths the lines.
"""

import passgraph as pg
from passgraph.effects import fxaa, outlines, soft_shadow_passes

scene = pg.Scene.shipped()
seen = soft_shadow_passes(scene)

for name, width_px in {"1 pixel": 1, "2 pixels": 2}.items():
    lines = outlines(seen.picture, seen.depth, width_px=width_px, crease_rad=1.0, camera=scene.camera)
    with pg.compile(fxaa(lines), size=(640, 360)) as program:
        program().save(f"{name}.png")

# sphinx_gallery_thumbnail_number = 2
