"""
Soft shadows
============

Shadows are a picture of their own: all objects white, lit, with shadows only. That picture is blurred along surfaces,
by a width in the scene, and multiplied onto the scene without shadows. The penumbra is sharp where an object touches
the floor and wide far from it.

``soft_shadow`` is the whole chain; ``soft_shadow_passes`` gives its targets.
"""

import passgraph as pg
from passgraph.effects import Blur, soft_shadow, soft_shadow_passes, supersampled, tone_map

scene = pg.Scene.shipped()
passes = soft_shadow_passes(scene, filter=Blur())
shown = {
    "soft_shadow": soft_shadow(scene),
    "1, the scene without shadows": tone_map(passes.unshadowed, curve="linear"),
    "2, shadows alone": passes.shadows,
    "3, blurred along surfaces": passes.shadows_blurred,
    "4, the product of 1 and 3": passes.picture,
}

for name, target in shown.items():
    with pg.compile(supersampled(target), size=(1280, 720)) as program:
        program().save(f"{name}.png")
