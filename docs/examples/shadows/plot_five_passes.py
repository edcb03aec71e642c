"""
Shadow mask in five passes
==========================

A published method: depth from the light, a mask of 3 x 3 comparisons, a Gaussian blur of 15 taps in two passes, and
the product of light, mask and a spotlight texture. The kernel as printed has weights that add up to 1.137, and it
shifts the mask. The normalized kernel has neither fault.
"""

import passgraph as pg
from passgraph.effects import five_pass, five_pass_targets

lamp = pg.Light.spot((-6.0, 8.0, 2.5), (6.0, -7.2, -2.5), intensity=90.0, cone_outer_rad=0.42)
scene = pg.Scene.shipped().with_(lights=[lamp])
shown = {
    "normalized kernel": five_pass(scene, kernel="normalised", ambient=0.06),
    "kernel as printed": five_pass(scene, kernel="faithful", ambient=0.06),
    "normalized kernel, mask": five_pass_targets(scene, kernel="normalised").mask_blurred,
    "kernel as printed, mask": five_pass_targets(scene, kernel="faithful").mask_blurred,
}

for name, target in shown.items():
    with pg.compile(target, size=(640, 360)) as program:
        program().save(f"{name}.png")
