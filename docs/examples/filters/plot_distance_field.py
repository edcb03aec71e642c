"""
Distance field
==============

The distance of each pixel to a shape, in pixels, by jump flooding. A second kernel draws a line every ten pixels of
the signed distance: blue outside, orange inside.
"""

import numpy as np
from skimage import data

import passgraph as pg
from passgraph.effects import distance_field
from passgraph.language import Image, mix, sin, smoothstep, vec3, vec4


@pg.kernel
def contour_lines(distance: Image) -> vec4:
    d = distance[0, 0].r
    side = mix(vec3(0.95, 0.5, 0.1), vec3(0.1, 0.35, 0.6), smoothstep(-1.0, 1.0, d))
    return vec4(side * (0.6 + 0.4 * smoothstep(-0.6, 0.6, sin(0.6 * d) / 0.6)), 1.0)


horse = np.float32(~np.pad(data.horse(), ((20, 20), (127, 127)), constant_values=True))[..., None].repeat(3, axis=2)
shape = pg.Input("shape")
shown = {
    "distance": distance_field(shape, unit_px=100.0),
    "lines of equal distance": contour_lines(distance_field(shape, signed=True)),
}

pg.save("the shape.png", horse)
for name, target in shown.items():
    with pg.compile(target) as program:
        program(shape=horse).save(f"{name}.png")

# sphinx_gallery_thumbnail_number = 3
