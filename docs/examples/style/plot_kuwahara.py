"""
Painting with a brush
=====================

The generalized Kuwahara filter (Papari, Petkov and Campisi 2007) takes, around each pixel, the mean of the most even
sectors. Edges stay sharp, and areas become strokes.
"""

from skimage import data

import passgraph as pg
from passgraph.effects import kuwahara

for radius in (4, 8):
    with pg.compile(kuwahara(pg.Input("photo"), radius_px=radius)) as program:
        program(photo=data.chelsea()[20:274]).save(f"radius of {radius} pixels.png")
