"""
Auto exposure
=============

The exposure is measured on the picture: a histogram of its luminance, of which the darkest and the brightest tenth
do not count. The photographs are four stops too dark and three stops too bright.
"""

from skimage import data

import passgraph as pg
from passgraph import Image, exp2, vec4
from passgraph.effects import auto_exposure, tone_map


@pg.kernel
def exposed(color: Image, stops: float) -> vec4:
    """Change the exposure by this many stops."""
    return vec4(color[0, 0].rgb * exp2(stops), color[0, 0].a)


for name, stops in {"too dark": -4.0, "too bright": 3.0}.items():
    light = exposed(pg.Input("photo", "srgb"), stops)
    for part, target in {"": light, ", corrected": auto_exposure(light)}.items():
        with pg.compile(tone_map(target)) as program:
            program(photo=data.coffee()).save(f"{name}{part}.png")
