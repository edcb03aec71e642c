"""Matrices of `passgraph.effects.planar_shadows.planar`: mirror, projections onto a plane, lights as columns."""

from __future__ import annotations

from dataclasses import dataclass
from math import cos

import numpy as np
from numpy.typing import NDArray

import passgraph as pg
from passgraph.effects.shadows.shadow_light import KINDS

Float64 = NDArray[np.float64]
#: Lights are the columns of one matrix.
LIGHTS_MOST = 4


@dataclass(frozen=True, eq=False)
class Ground:
    """The plane as a node, and everything else."""

    height: float
    node: pg.Node
    objects: pg.Scene | None


def ground_of(scene: pg.Scene, height: float) -> Ground:
    """The largest flat node at this height, or else a square under the scene, twice as wide."""
    low, high = scene.bounds()
    extent = float(np.linalg.norm(high - low))
    flat = [node for node in scene.nodes if float(np.abs(node.bounds[:, 1] - height).max()) <= 1e-6 * extent]
    if flat:
        node = max(flat, key=lambda each: float(np.prod((each.bounds[1] - each.bounds[0])[[0, 2]])))
        others = [each for each in scene.nodes if each is not node]
        return Ground(height, node, scene.with_(nodes=others) if others else None)
    half = float(max(high[0] - low[0], high[2] - low[2], 1e-6))
    corners = np.array([[-1, 0, 1], [1, 0, 1], [1, 0, -1], [-1, 0, -1.0]]) * half
    mesh = pg.Mesh.make(corners, [[0, 1, 2], [0, 2, 3]], np.tile([0.0, 1.0, 0.0], (4, 1)), name="plane")
    place = np.eye(4)
    place[:3, 3] = 0.5 * (low[0] + high[0]), height, 0.5 * (low[2] + high[2])
    return Ground(height, pg.Node(mesh, pg.Material("plane", (1, 1, 1, 1)), place, "plane"), scene)


def mirror(level: float) -> Float64:
    """The reflection in y = ``level``."""
    made = np.diag([1.0, -1.0, 1.0, 1.0])
    made[1, 3] = 2.0 * level
    return made


def projection(light: Float64, level: float) -> Float64:
    """Onto y = ``level``, away from a light: (x, y, z, 1) of a position, (x, y, z, 0) toward a direction.

    Between the plane and the light w is above 0.  For the plane's row p the matrix is (p·l) I - l pᵀ.

    Source: J. Blinn, "Me and My (Fake) Shadow", 1988; OpenGL Programming Guide, chapter 14.

    >>> shadow = projection(np.array([0.0, 2.0, 0.0, 1.0]), 0.0) @ np.array([1.0, 1.0, 0.0, 1.0])
    >>> (shadow[:3] / shadow[3]).tolist()
    [2.0, 0.0, 0.0]
    """
    plane = np.array([0.0, 1.0, 0.0, -level])
    towards = float(plane @ light)
    made: Float64 = towards * np.eye(4) - np.outer(light, plane)
    return -made if towards < 0.0 else made


def homogeneous(light: pg.Light, origin: Float64) -> Float64:
    """Where a light is relative to ``origin``: a position (w = 1), or the direction toward it (w = 0)."""
    if light.kind == "directional":
        return np.append(-np.asarray(light.direction, np.float64), 0.0)
    return np.append(np.subtract(light.position, origin), 1.0)


def side_of(light: pg.Light, origin: Float64, level: float) -> float:
    """1 where a light is on or over y = ``level`` relative to ``origin``, -1 under it."""
    place = homogeneous(light, origin)
    return 1.0 if place[1] - level * place[3] >= 0.0 else -1.0


def sees_top(camera: pg.Camera, height: float) -> bool:
    """Whether the upper face of y = ``height`` is the one that is seen; of parallel rays the way decides."""
    return float(camera.forward[1]) <= 0.0 if camera.orthographic else camera.eye[1] >= height


def cone(light: pg.Light) -> tuple[float, float]:
    """Cosines of the outer and inner half angle; below all cosines where there is no cone."""
    return (cos(light.cone_outer_rad), cos(light.cone_inner_rad)) if light.kind == "spot" else (-3.0, -2.0)


def lights_from(camera: pg.Camera, *lights: pg.Light) -> tuple[Float64, Float64, Float64]:
    """Places, colours and axes as columns, world axes, relative to the eye.

    The last row holds the kind by its number, the cosine of the inner and that of the outer half angle.
    """
    places, colors, axes = np.zeros((4, 4)), np.zeros((4, 4)), np.zeros((4, 4))
    for column, light in enumerate(lights):
        outer, inner = cone(light)
        places[:3, column] = homogeneous(light, np.asarray(camera.eye))[:3]
        places[3, column] = KINDS.index(light.kind)
        colors[:, column] = *(np.asarray(light.color) * light.intensity), inner
        axes[:, column] = *light.direction, outer
    return places, colors, axes
