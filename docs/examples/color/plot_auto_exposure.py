"""
Auto exposure
=============

The exposure is measured on the picture: a histogram of its luminance, of which the darkest and the brightest tenth
do not count. A photograph that is too dark and one that is too bright become the same.
"""

from skimage import data

import passgraph as pg
from passgraph.effects import auto_exposure, tone_map
from passgraph.language import Image, exp2, vec4


@pg.kernel
def exposed(color: Image, stops: float) -> vec4:
    """Change the exposure by this many stops."""
    return vec4(color[0, 0].rgb * exp2(stops), color[0, 0].a)


photo = pg.Input("photo", "srgb")
shown = {
    "four stops too dark": exposed(photo, -4.0),
    "three stops too bright": exposed(photo, 3.0),
    "either, corrected": auto_exposure(exposed(photo, -4.0)),
}

for name, target in shown.items():
    with pg.compile(tone_map(target)) as program:
        program(photo=data.coffee()[31:369]).save(f"{name}.png")

# sphinx_gallery_thumbnail_number = 2
