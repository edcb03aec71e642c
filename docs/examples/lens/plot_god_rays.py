"""
God rays
========

Beams of light around what stands before the sun. Each pixel takes the mean of 216 samples of the sky on the way to the
sun, in the picture, after K. Mitchell (GPU Gems 3, 2007).
"""

import passgraph as pg
from passgraph import Image, dot, exp, length, output_size, smoothstep, uv, vec2, vec3, vec4
from passgraph.effects import god_rays, soft_shadow_passes, supersampled, tone_map


@pg.kernel
def before_sun(color: Image, depth: Image, at: vec2) -> vec4:
    """Put a sky with a sun behind a dark scene."""
    way = (uv() - at) * vec2(float(output_size().x) / float(output_size().y), 1.0)
    glow = vec3(1.5, 0.9, 0.4) * exp(-40.0 * dot(way, way))
    sun = vec3(30.0) * (1.0 - smoothstep(0.02, 0.03, length(way)))
    return vec4(color[0, 0].rgb * 0.2 if depth[0, 0].r > 0.0 else vec3(0.04, 0.07, 0.16) + glow + sun, 1.0)


camera = pg.Camera((1.0, 0.9, 9.5), (0.2, 1.75, 0.0), vertical_fov_rad=0.5, near=1.0, far=60.0)
scene = soft_shadow_passes(pg.Scene.shipped().with_(camera=camera), display=False)
light = before_sun(scene.picture, scene.depth, (0.195, 0.46))
rays = god_rays(light, x=0.195, y=0.46, intensity=0.5, threshold=0.3, decay=0.3, occluders=scene.depth)

for name, target in {"without": light, "god rays": rays}.items():
    with pg.compile(supersampled(tone_map(target)), size=(1280, 720)) as program:
        program().save(f"{name}.png")

# sphinx_gallery_thumbnail_number = 2
