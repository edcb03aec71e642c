"""
Lens flare and light streaks
============================

Ghosts of the sun lie on the line through the middle of the picture, inside a halo. Streaks come from an anamorphic
lens, or from a star filter before the lens.
"""

import passgraph as pg
from passgraph.effects import lens_flare, light_streaks, soft_shadow_passes, supersampled, tone_map
from passgraph.language import Image, dot, exp, length, mix, output_size, smoothstep, uv, vec2, vec3, vec4


@pg.kernel
def before_sun(color: Image, depth: Image, at: vec2) -> vec4:
    """Put an evening sky with a sun behind a dark scene."""
    way = (uv() - at) * vec2(float(output_size().x) / float(output_size().y), 1.0)
    sky = mix(vec3(0.04, 0.07, 0.16), vec3(0.25, 0.16, 0.12), uv().y) + vec3(1.2, 0.7, 0.3) * exp(-40.0 * dot(way, way))
    sun = vec3(30.0) * (1.0 - smoothstep(0.02, 0.03, length(way)))
    return vec4(color[0, 0].rgb * 0.2 if depth[0, 0].r > 0.0 else sky + sun, 1.0)


camera = pg.Camera((1.0, 0.9, 9.5), (0.2, 1.75, 0.0), vertical_fov_rad=0.5, near=1.0, far=60.0)
scene = soft_shadow_passes(pg.Scene.shipped().with_(camera=camera), display=False)
light = before_sun(scene.picture, scene.depth, (0.72, 0.2))
shown = {
    "without": light,
    "lens flare": lens_flare(light, threshold=2.0, intensity=0.06, ghosts=6, spacing=0.35, halo=0.5),
    "light streaks": light_streaks(light, threshold=2.0, intensity=0.25, length=0.9, tint=(0.3, 0.5, 1.0)),
    "star filter": light_streaks(light, threshold=2.0, intensity=0.25, length=0.4, streaks=6, angle_rad=0.3),
}

for name, target in shown.items():
    with pg.compile(supersampled(tone_map(target)), size=(1280, 720)) as program:
        program().save(f"{name}.png")

# sphinx_gallery_thumbnail_number = 2
