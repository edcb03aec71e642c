"""
A finished picture
==================

Fog, depth of field, bloom, vignette, tone curve, FXAA and grain as one graph, in the order in which light meets them:
air, lens, sensor, screen. One program runs all passes.
"""

from math import tan

import passgraph as pg
from passgraph.effects import bloom, depth_of_field, film_grain, fog, fxaa, soft_shadow_passes, tone_map, vignette

camera = pg.Camera((4.4, 2.6, 8.4), (0.5, 1.15, 0.0), vertical_fov_rad=0.57, near=1.0, far=60.0)
seen = soft_shadow_passes(pg.Scene.shipped().with_(camera=camera), display=False)

light = fog(seen.picture, seen.depth, density=0.02, camera=camera, fog_color=(0.6, 0.5, 0.35), sky=True)
focal_length_mm = 12.0 / tan(0.5 * camera.vertical_fov_rad)
light = depth_of_field(light, seen.depth, 6.3, f_number=2.0, focal_length_mm=focal_length_mm, unit_m=0.1)
light = vignette(bloom(light, threshold=0.6, intensity=0.4), camera.vertical_fov_rad, strength=3.0)
finished = film_grain(fxaa(tone_map(light, exposure_stops=0.2)), strength=0.02)

for name, target in {"as drawn": fxaa(tone_map(seen.picture, curve="linear")), "finished": finished}.items():
    with pg.compile(target, size=(640, 360)) as program:
        program().save(f"{name}.png")

# sphinx_gallery_thumbnail_number = 2
