"""
Plain GLSL
==========

Any fragment shader that reads a picture. ``halftone.glsl`` prints four inks as dots on screens that are turned against
each other. ``hex-tiles.glsl`` lays six-sided tiles of one color each, with a bevel.

Download :download:`halftone.glsl </shaders/halftone.glsl>` and :download:`hex-tiles.glsl </shaders/hex-tiles.glsl>`
next to the script.
"""

from skimage import data

import passgraph as pg

halftone, hexes, photo = pg.load_shader("halftone.glsl"), pg.load_shader("hex-tiles.glsl"), pg.Input("photo")
shown = {
    "halftone.glsl, dots of 6 pixels": halftone(photo, spacing=6.0),
    "halftone.glsl, dots of 12 pixels": halftone(photo, spacing=12.0),
    "hex-tiles.glsl, sides of 6 pixels": hexes(photo, side=6.0),
    "hex-tiles.glsl, sides of 12 pixels": hexes(photo, side=12.0),
}

for name, target in shown.items():
    with pg.compile(target) as program:
        program(photo=data.coffee()[31:369]).save(f"{name}.png")

# sphinx_gallery_thumbnail_number = 2
