"""
Ambient occlusion
=================

The fraction of ambient light that arrives at each pixel, searched in the depth on the screen. GTAO (ground-truth
ambient occlusion) integrates horizons. SSAO counts hidden points. Without its range check, SSAO puts a dark halo
around everything that stands before the floor. ``bounces`` adds the light that bright surfaces reflect.
"""

import passgraph as pg
from passgraph.effects import ambient_occlusion, ambient_occlusion_passes, soft_shadow, supersampled
from passgraph.language import Image, vec3, vec4

scene = pg.Scene.shipped()


@pg.kernel
def gray(share: Image) -> vec4:
    return vec4(vec3(share[0, 0].r), 1.0)


def visibility(**options):
    return gray(ambient_occlusion_passes(scene, radius=1.5, **options).occlusion.visibility)


shown = {
    "GTAO": visibility(method="gtao"),
    "SSAO": visibility(method="ssao", taps=32),
    "SSAO without range check": visibility(method="ssao", taps=32, range_check=False),
    "picture with constant ambient light": soft_shadow(scene, ambient=0.7),
    "picture with GTAO": ambient_occlusion(scene, method="gtao", radius=1.5, ambient=0.7),
    "picture with GTAO and bounces": ambient_occlusion(scene, method="gtao", radius=1.5, ambient=0.7, bounces=True),
}

for name, target in shown.items():
    with pg.compile(supersampled(target), size=(1280, 720)) as program:
        program().save(f"{name}.png")
