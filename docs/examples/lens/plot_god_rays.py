"""
God rays
========

Beams of light between the spokes of a wheel that stands before the sun. Each pixel takes the mean of 216 samples of the
sky on the way to the sun, in the picture, after K. Mitchell (GPU Gems 3, 2007).
"""

import math

import trimesh

import passgraph as pg
from passgraph.effects import god_rays, soft_shadow_passes, supersampled, tone_map
from passgraph.language import Image, dot, exp, length, output_size, smoothstep, uv, vec2, vec3, vec4


@pg.kernel
def before_sun(color: Image, depth: Image, at: vec2) -> vec4:
    """Put a sky with a sun behind a dark scene."""
    way = (uv() - at) * vec2(float(output_size().x) / float(output_size().y), 1.0)
    glow = vec3(0.5, 0.3, 0.1) * exp(-8.0 * dot(way, way))
    sun = vec3(4.0, 3.2, 2.0) * (1.0 - smoothstep(0.10, 0.12, length(way)))
    return vec4(color[0, 0].rgb * 0.1 if depth[0, 0].r > 0.0 else vec3(0.04, 0.07, 0.16) + glow + sun, 1.0)


nodes = []
for spoke in range(9):
    box = trimesh.creation.box(bounds=((-0.11, 0.2, -0.1), (0.11, 1.8, 0.1)))
    box.unmerge_vertices()  # flat sides
    turn = trimesh.transformations.rotation_matrix(math.tau * spoke / 9, (0, 0, 1))
    nodes.append(pg.Node(pg.Mesh.make(box.vertices, box.faces), transform=turn))
rim = trimesh.creation.annulus(1.7, 1.9, 0.2, sections=64)
nodes.append(pg.Node(pg.Mesh.make(rim.vertices, rim.faces)))
camera = pg.Camera((1.2, 0.8, 9.0), (0.0, 0.0, 0.0), vertical_fov_rad=0.62, near=1.0, far=60.0)
wheel = pg.Scene(nodes, camera, [pg.Light.directional((0.3, -1.0, -0.5))])

seen = soft_shadow_passes(wheel, display=False)
light = before_sun(seen.picture, seen.depth, (0.5, 0.5))
rays = god_rays(light, x=0.5, y=0.5, intensity=0.5, threshold=0.5, decay=0.3, occluders=seen.depth)

for name, target in {"without": light, "god rays": rays}.items():
    with pg.compile(supersampled(tone_map(target)), size=(1280, 720)) as program:
        program().save(f"{name}.png")

# sphinx_gallery_thumbnail_number = 2
