"""
Color grading
=============

Each control of the grade by itself, in linear light: the white balance of a lamp, contrast around middle gray, split
toning, lift, gamma and gain (as in the ASC CDL), and saturation.
"""

from skimage import data

import passgraph as pg
from passgraph.effects import color_grade, tone_map

photo = pg.Input("photo", "srgb")
grades = {
    "as it is": {},
    "white of 4500 K": {"temperature_k": 4500.0},
    "contrast 1.4": {"contrast": 1.4},
    "teal shadows, orange highlights": {"pivot": 0.4, "shadows": (0.4, 1.0, 1.5), "highlights": (1.3, 1.0, 0.7)},
    "lift, gamma, gain": {"lift": (0.02, 0.02, 0.06), "gamma": (1.2, 1.2, 1.2), "gain": (1.1, 1.0, 0.9)},
    "saturation 0.4": {"saturation": 0.4},
}

for name, controls in grades.items():
    with pg.compile(tone_map(color_grade(photo, **controls), curve="linear")) as program:
        program(photo=data.coffee()[31:369]).save(f"{name}.png")

# sphinx_gallery_thumbnail_number = 4
