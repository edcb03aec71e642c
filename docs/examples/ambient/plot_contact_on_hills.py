"""
Contact shadows on a height field
=================================

The floor is rendered to a height map first, so that the threshold follows the hills.
"""

import numpy as np
import trimesh

import passgraph as pg
from passgraph.effects import contact, contact_passes, supersampled

axis = np.linspace(-1.5, 1.5, 97)
x, z = np.meshgrid(axis, axis)
height = 0.18 * np.sin(2.1 * x) * np.cos(2.6 * z) + 0.1 * np.sin(4.0 * z + x)
index = np.arange(97 * 97).reshape(97, 97)
a, b, c, d = index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]
faces = np.concatenate([np.stack([a, d, c], -1), np.stack([a, c, b], -1)]).reshape(-1, 3)
ground = pg.Mesh.make(np.stack([x, height, z], -1).reshape(-1, 3), faces)
nodes = [pg.Node(ground, pg.Material(base_color=(0.45, 0.5, 0.3, 1.0)), name="hills")]

torus = trimesh.creation.torus(0.2, 0.06)
for row, column in ((64, 60), (50, 30), (32, 70), (75, 40)):
    place = np.eye(4)
    place[:3, :3] = [[1, 0, 0], [0, 0, 1], [0, -1, 0]]
    place[:3, 3] = axis[column], height[row - 5 : row + 6, column - 5 : column + 6].max() + 0.05, axis[row]
    ring = pg.Mesh.make(torus.vertices, torus.faces)
    nodes.append(pg.Node(ring, pg.Material(base_color=(0.7, 0.25, 0.1, 1.0)), place))

camera = pg.Camera((0.9, 2.1, 2.7), (0.0, 0.0, 0.1), vertical_fov_rad=0.5, near=0.5, far=30.0)
scene = pg.Scene(nodes, camera, [pg.Light.directional((0.55, -1.0, -0.35), intensity=0.6, radius=0.05)])
passes = contact_passes(scene, floor="hills", threshold=0.25, darkness=0.9)
shown = {"contact": contact(scene, floor="hills", threshold=0.25, darkness=0.9), "remaining light": passes.share}

for name, target in shown.items():
    with pg.compile(supersampled(target), size=(1280, 720)) as program:
        program().save(f"{name}.png")
