"""
Highlights out of focus
=======================

Points of light out of focus become discs, or polygons of the aperture's blades. The front rim of a lens narrows the
discs in the corners ("cat's eyes").
"""

import numpy as np

import passgraph as pg
from passgraph.effects import depth_of_field, tone_map

random = np.random.default_rng(2)
y, x = np.mgrid[0:360, 0:640]
lamps = np.full((360, 640, 3), 0.02) + 0.03 * (y / 360.0)[..., None]
for left, top in random.uniform((20, 20), (620, 340), (40, 2)):
    lamps[np.hypot(x - left, y - top) < 3.0] = random.uniform(5.0, 30.0, 3)
depth = np.full((360, 640, 1), 30.0)

shapes = {
    "round": {},
    "six blades": {"blades": 6},
    "six blades, turned": {"blades": 6, "rotation_rad": 0.26},
    "cat's eyes": {"cats_eye": 0.8},
}
for name, shape in shapes.items():
    blurred = depth_of_field(pg.Input("light"), pg.Input("depth"), 2.0, 1.0, 85.0, taps=256, **shape)
    with pg.compile(tone_map(blurred, curve="reinhard")) as program:
        program(light=lamps, depth=depth).save(f"{name}.png")
