"""
Sharpening
==========

The photograph is blurred with a standard deviation of one pixel, then sharpened. An unsharp mask overshoots at edges.
Contrast adaptive sharpening (CAS, AMD 2019) is weaker where the contrast is already high.
"""

from skimage import data

import passgraph as pg
from passgraph.effects import cas, gaussian_blur, tone_map, unsharp

soft = gaussian_blur(pg.Input("photo", "srgb"), sigma_px=1.0)
shown = {"softened": soft, "unsharp mask": unsharp(soft, amount=1.5, sigma_px=1.5), "CAS": cas(soft, sharpness=1.0)}

for name, target in shown.items():
    with pg.compile(tone_map(target, curve="linear")) as program:
        program(photo=data.astronaut()[:225, 60:460]).save(f"{name}.png")

# sphinx_gallery_thumbnail_number = 2
