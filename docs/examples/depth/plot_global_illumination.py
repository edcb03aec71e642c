"""
Screen-space global illumination
================================

One bounce of diffuse light between the surfaces of the picture. The red and the green wall color what is near them;
constant ambient light is gray. The result of one frame is noisy; a mean over sixteen frames is not.
"""

import trimesh

import passgraph as pg
from passgraph.effects import fxaa, soft_shadow_passes, ssgi, tone_map

WHITE, RED, GREEN = (0.75, 0.75, 0.75), (0.63, 0.06, 0.05), (0.14, 0.45, 0.09)


def block(size, at, color, turn=0.0):
    box = trimesh.creation.box(size, trimesh.transformations.rotation_matrix(turn, (0, 1, 0)))
    box.unmerge_vertices()  # flat sides
    return pg.Node(pg.Mesh.make(box.vertices + at, box.faces), pg.Material(base_color=(*color, 1.0)))


nodes = [
    block((2.2, 0.1, 2.2), (0.0, -0.05, 0.0), WHITE),
    block((2.2, 2.0, 0.1), (0.0, 1.0, -1.05), WHITE),
    block((0.1, 2.0, 2.2), (-1.05, 1.0, 0.0), RED),
    block((0.1, 2.0, 2.2), (1.05, 1.0, 0.0), GREEN),
    block((0.55, 1.2, 0.55), (-0.35, 0.6, -0.35), WHITE, 0.3),
    block((0.55, 0.6, 0.55), (0.4, 0.3, 0.3), WHITE, -0.3),
]
camera = pg.Camera((0.0, 1.25, 3.9), (0.0, 0.78, 0.0), vertical_fov_rad=0.55, near=0.5, far=10.0)
lamp = pg.Light.spot((0.3, 3.6, 1.4), (-0.1, -1.0, -0.4), (1.0, 0.95, 0.85), 10.0, radius=0.25, cone_outer_rad=0.8)
scene = pg.Scene(nodes, camera, [lamp])

direct = soft_shadow_passes(scene, ambient=0.0, display=False)
options = {"albedo": direct.base_color, "reach": 3.0, "steps": 64, "thickness": 0.3, "camera": camera}
shown = {
    "direct light": direct.picture,
    "with constant ambient light": soft_shadow_passes(scene, ambient=0.2, display=False).picture,
    "ssgi, one frame": ssgi(direct.picture, direct.depth, **options),
    "ssgi, 16 frames": ssgi(direct.picture, direct.depth, most_frames=16, **options),
}

for name, target in shown.items():
    with pg.compile(fxaa(tone_map(target)), size=(640, 360)) as program:
        for _ in range(16 if "16" in name else 1):
            picture = program()
    picture.save(f"{name}.png")

# sphinx_gallery_thumbnail_number = 4
