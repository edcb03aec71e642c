"""
Black and white
===============

The luma of each pixel, by the weights of Rec. 709. The input is a photograph, or a scene that an earlier pass of the
same graph renders.
"""

from skimage import data

import passgraph as pg
from passgraph.effects import black_and_white, soft_shadow

with pg.compile(black_and_white(pg.Input("photo"))) as program:
    program(photo=data.coffee()[31:369]).save("a photograph.png")

with pg.compile(black_and_white(soft_shadow(pg.Scene.shipped())), size=(640, 360)) as program:
    program().save("a rendered scene.png")
