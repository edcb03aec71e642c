"""
Contact shadows on a floor
==========================

Objects darken the floor below them. Projected straight down, everything over the floor casts the same dark shadow with
hard edges. ``contact`` renders the objects from below the floor, up to a threshold: shadows are darkest where an object
touches the floor, and fade out with its height. The ball hovers.
"""

from dataclasses import replace

import numpy as np

import passgraph as pg
from passgraph.effects import contact, contact_passes, planar, supersampled

scene = pg.Scene.shipped()
lift = np.eye(4)
lift[1, 3] = 0.15
nodes = [replace(n, transform=lift @ n.transform) if n.name == "ball" else n for n in scene.nodes]
scene = scene.with_(nodes=nodes, lights=[pg.Light.directional((0.0, -1.0, 0.0), intensity=0.7)])
shown = {
    "projected straight down": planar(scene, top_opacity=1.0, darkness=0.8, fog="none"),
    "contact": contact(scene, threshold=0.6, darkness=0.8),
    "remaining light": contact_passes(scene, threshold=0.6, darkness=0.8).share,
}

for name, target in shown.items():
    with pg.compile(supersampled(target), size=(1280, 720)) as program:
        program().save(f"{name}.png")
