"""
Planar shadows, reflection and fog
==================================

A classic of fixed-function graphics with a stencil buffer: the plane, the mirrored scene in it, shadows projected onto
it that darken each pixel once, and fog.
"""

import passgraph as pg
from passgraph.effects import planar, supersampled

scene = planar(pg.Scene.shipped(), top_opacity=0.75, fog="linear", fog_start=9.0, fog_end=26.0)

with pg.compile(supersampled(scene), size=(1280, 720)) as program:
    program().save("planar.png")
