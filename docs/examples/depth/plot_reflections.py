"""
Screen-space reflections
========================

Smooth surfaces mirror what the picture shows along reflected rays, most at grazing angles. What the picture does not
show is missing in the reflection. On a rough floor, reflections are more blurred the farther the reflected object is.
"""

import numpy as np

import passgraph as pg
from passgraph.effects import fxaa, soft_shadow_passes, ssr, tone_map

SIZE = (640, 360)
scene = pg.Scene.shipped()
floor = scene.with_(nodes=[node for node in scene.nodes if node.name == "floor"])
distance = []
for part in (scene, floor):
    with pg.compile(soft_shadow_passes(part).depth, size=SIZE) as program:
        distance.append(np.asarray(program()))
is_floor = np.isclose(*distance, rtol=1e-3).astype(np.float32)

seen = soft_shadow_passes(scene, display=False)
mask = pg.Input("is_floor", "r32f", SIZE, static=True, default=is_floor)
options = {"reflectance": 0.4, "mask": mask, "reach": 8.0, "steps": 128, "camera": scene.camera}
shown = {"without": seen.picture}
for roughness in (0.0, 0.1, 0.25):
    shown[f"roughness {roughness}"] = ssr(seen.picture, seen.depth, roughness=roughness, **options)

for name, target in shown.items():
    with pg.compile(fxaa(tone_map(target, curve="linear")), size=SIZE) as program:
        program().save(f"{name}.png")

# sphinx_gallery_thumbnail_number = 2
