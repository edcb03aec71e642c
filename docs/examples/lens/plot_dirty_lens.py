"""
Dirty lens
==========

Smears and specks on the lens scatter light wherever the picture is bright, after the games of the 2010s. The dirt
comes with the effect; ``dirt=`` takes another picture of it. :ref:`sphx_glr_gallery_flat_worlds_plot_dirty_lenses.py`
shows dirt that only lamps light up.
"""

from skimage import data

import passgraph as pg
from passgraph.effects import bloom, dirty_lens, tone_map

light = bloom(pg.Input("photo", "srgb"), threshold=0.5, intensity=0.8, levels=5)

for name, target in {"without": light, "dirty lens": dirty_lens(light, strength=4.0)}.items():
    with pg.compile(tone_map(target, exposure_stops=0.5)) as program:
        program(photo=data.rocket()[67:]).save(f"{name}.png")

# sphinx_gallery_thumbnail_number = 2
