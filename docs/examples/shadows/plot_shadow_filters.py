"""
Shadow filters
==============

A light with a radius casts penumbrae. ``Hard`` compares one texel of the shadow map. ``Pcf`` and ``Disc`` average
comparisons. ``Pcss`` and ``Penumbra`` widen the average with the distance to the caster. ``Vsm``, ``Evsm4`` and ``Msm``
blur moments of the map. ``Blur`` blurs the shadows on the screen.
"""

import passgraph as pg
from passgraph.effects import Blur, Disc, Evsm4, Hard, Msm, Pcf, Pcss, Penumbra, Vsm, soft_shadow, supersampled

scene = pg.Scene.shipped()
near = pg.Camera((0.6, 3.4, 8.2), (-1.2, 0.35, 1.6), vertical_fov_rad=0.42, near=1.0, far=60.0)

for filter in (Hard(), Pcf(), Disc(), Pcss(), Penumbra(), Vsm(), Evsm4(), Msm(), Blur()):
    target = soft_shadow(scene.with_(camera=near), filter=filter, softness=0.08)
    with pg.compile(supersampled(target), size=(1280, 720)) as program:
        program().save(f"{type(filter).__name__}.png")

# sphinx_gallery_thumbnail_number = 5
