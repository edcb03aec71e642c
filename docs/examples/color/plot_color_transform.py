"""
Color spaces and displays
=========================

OpenColorIO defines the transform and passgraph runs it as one pass: here from scene-linear light to an sRGB monitor,
by the views of OpenColorIO's built-in configuration. Install it with ``pip install 'passgraph[color]'``.
"""

from skimage import data

import passgraph as pg
from passgraph.effects import color_transform

photo = pg.Input("photo", "srgb")
VIEWS = {"ACES 2.0": "ACES 2.0 - SDR 100 nits (Rec.709)", "without a tone curve": "Un-tone-mapped"}

for name, view in VIEWS.items():
    shown = color_transform(photo, src="Linear Rec.709 (sRGB)", display="sRGB - Display", view=view, exposure_stops=1.5)
    with pg.compile(shown) as program:
        program(photo=data.coffee()[31:369]).save(f"{name}.png")
