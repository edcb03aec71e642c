"""
Contact shadows on a floor
==========================

Objects darken the floor below them. Projected straight down, everything over the floor casts the same dark shadow with
hard edges. ``contact`` renders the objects from below the floor, up to a threshold: shadows are darkest where an object
touches the floor and fade out with its height. The table top is above the threshold; the ball hovers.
"""

import trimesh

import passgraph as pg
from passgraph.effects import contact, contact_passes, planar, supersampled


def node(shape, at, color, receives=True):
    shape.unmerge_vertices()  # flat sides
    return pg.Node(
        pg.Mesh.make(shape.vertices + at, shape.faces), pg.Material(base_color=(*color, 1.0)), receives=receives
    )


wood, red, white = (0.5, 0.3, 0.15), (0.6, 0.12, 0.1), (0.8, 0.8, 0.8)
legs = [(x, 0.5, z) for x in (-0.9, 0.9) for z in (-0.5, 0.5)]
nodes = [
    node(trimesh.creation.box((10.0, 0.1, 10.0)), (0.0, -0.05, 0.0), white, receives=False),
    node(trimesh.creation.box((2.0, 0.1, 1.2)), (0.0, 1.05, 0.0), wood),
    *(node(trimesh.creation.box((0.16, 1.0, 0.16)), at, wood) for at in legs),
    node(trimesh.creation.icosphere(4, 0.35), (1.5, 0.4, 0.6), red),
]
camera = pg.Camera((1.6, 2.2, 4.6), (0.2, 0.45, 0.0), vertical_fov_rad=0.5, near=0.5, far=30.0)
scene = pg.Scene(nodes, camera, [pg.Light.directional((0.0, -1.0, -0.3), intensity=0.7)])
above = scene.with_(lights=[pg.Light.directional((0.0, -1.0, 0.0), intensity=0.7)])
shown = {
    "projected straight down": planar(above, height=0.001, top_opacity=1.0, darkness=0.8, fog="none"),
    "contact": contact(scene, threshold=0.5, darkness=0.9),
    "remaining light": contact_passes(scene, threshold=0.5, darkness=0.9).share,
}

for name, target in shown.items():
    with pg.compile(supersampled(target), size=(1280, 720)) as program:
        program().save(f"{name}.png")

# sphinx_gallery_thumbnail_number = 2
