"""Triangles of a flat world, made on the host: squares, and shadows stretched from edges away from a light."""

from __future__ import annotations

import numpy as np

from passgraph.effects.light2d.world import Float64, Point
from passgraph.effects.pictures.stretched import Shape, quads, shape_of

#: Far ends of shadows lie this many times farther from the light than the edge.
FAR = 2.0**20


def shadow_of(edges: Float64, light: Point) -> Shape:
    """What lies behind edges (n, 4) as seen from a light: one quad an edge, without end.

    Neighbouring edges share their corners to the last bit, so no light passes between their quads.  Every
    vertex carries its edge (ax, ay, bx, by) as its color.
    """
    ends = edges.reshape(-1, 2, 2)
    away = ends - np.array(light)
    near = np.concatenate([ends, np.ones((len(ends), 2, 1))], axis=2)
    # light + FAR · (corner - light), divided through by FAR
    far = np.concatenate([away + np.array(light) / FAR, np.full((len(ends), 2, 1), 1.0 / FAR)], axis=2)
    positions = np.stack([near[:, 0], near[:, 1], far[:, 1], far[:, 0]], axis=1).reshape(-1, 3)
    return shape_of(positions, np.zeros((len(positions), 2)), np.repeat(edges, 4, axis=0))


def around(center: Point, half: float) -> Shape:
    """An upright square."""
    x, y = center
    return quads([[(x - half, y - half), (x + half, y - half), (x + half, y + half), (x - half, y + half)]])
