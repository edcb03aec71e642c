"""
Bloom
=====

Light brighter than a threshold spreads to the pixels around it, as in a camera that looks at lamps. The glow is a sum
of five Gaussian blurs, each of half the size of the one before. It reaches 64 pixels at little cost.

The camera clipped the highlights of the photograph at white. A kernel first stretches them to 35 times white.
"""

from skimage import data

import passgraph as pg
from passgraph.effects import bloom, tone_map
from passgraph.language import Image, vec4


@pg.kernel
def stretched(color: Image) -> vec4:
    c = color[0, 0]
    return vec4(0.7 * c.rgb / (1.02 - c.rgb), c.a)


light = stretched(pg.Input("photo", "srgb"))
shown = {"without": light, "bloom": bloom(light, threshold=2.0, intensity=0.6, levels=5)}

for name, target in shown.items():
    with pg.compile(tone_map(target, curve="pbr-neutral")) as program:
        program(photo=data.rocket()[67:]).save(f"{name}.png")

# sphinx_gallery_thumbnail_number = 2
