"""Rays toward an area light, and a ray tracer."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from passgraph.errors import InputError
from passgraph.scene.lights import Light
from passgraph.scene.matrices import look_rotation

Float64 = NDArray[np.float64]
Int32 = NDArray[np.int32]
#: Length of a ray without an end; finite in float32 too.
ENDLESS = 1e30


class Tracer:
    """Trace many rays at once through a set of triangles with Intel's Embree: float32, one thread.

    Source: I. Wald et al., "Embree: A Kernel Framework for Efficient CPU Ray Tracing", 2014.

    Parameters
    ----------
    corners : (n, 3, 3) triangle, corner, coordinate; every triangle has an area

    Attributes
    ----------
    rounding : largest distance of a hit from its triangle, as a share of the largest coordinate

    Raises
    ------
    InputError
        If the package embreex is missing.

    >>> tracer = Tracer(np.array([[[0, 0, 0], [1, 0, 0], [0, 1, 0.0]]]))
    >>> tracer.closest(np.array([[0.2, 0.2, 1], [2, 2, 1.0]]), np.array([[0, 0, -1], [0, 0, -1.0]])).tolist()
    [0, -1]
    """

    # a few units in the last place of float32, 6e-8 each
    rounding = 2e-6

    def __init__(self, corners: Float64) -> None:
        try:
            from embreex.mesh_construction import TriangleMesh
            from embreex.rtcore_scene import EmbreeScene
        except ImportError as error:
            raise InputError(
                f"tracing rays needs the package embreex ({error}): pip install 'passgraph[truth]'"
            ) from None
        # robust: a ray through an edge or a vertex hits one of the triangles there
        self._scene = EmbreeScene(robust=True)
        indices = np.arange(3 * len(corners), dtype=np.int32).reshape(-1, 3)
        TriangleMesh(scene=self._scene, vertices=corners.reshape(-1, 3).astype(np.float32), indices=indices)

    def closest(self, origins: Float64, directions: Float64) -> Int32:
        """Return the number of the first triangle along each ray, (n,), or -1; directions are unit vectors."""
        hits = self._scene.run(origins.astype(np.float32), directions.astype(np.float32))
        return np.asarray(hits, np.int32)

    def blocked(self, origins: Float64, directions: Float64, lengths: Float64) -> NDArray[np.bool_]:
        """Return True where a triangle lies within a ray's length, (n,)."""
        hits = self._scene.run(
            origins.astype(np.float32), directions.astype(np.float32), lengths.astype(np.float32), query="OCCLUDED"
        )
        return np.asarray(hits >= 0)


def strata(rng: np.random.Generator, count: int, side: int) -> Float64:
    """Return one random point in each cell of a side × side grid over the unit square, (count, side², 2)."""
    cells = np.stack(np.meshgrid(np.arange(side), np.arange(side)), axis=-1).reshape(-1, 2)
    return (cells + rng.random((count, side * side, 2))) / side


def disc(square: Float64) -> Float64:
    """Map the unit square to the unit disc, preserving areas and neighbors.

    Source: P. Shirley and K. Chiu, "A Low Distortion Map Between Disk and Square", 1997.

    >>> disc(np.array([[0.5, 0.5], [1.0, 0.5]])).tolist()
    [[0.0, 0.0], [1.0, 0.0]]
    """
    a, b = 2.0 * square[..., 0] - 1.0, 2.0 * square[..., 1] - 1.0
    wide = np.abs(a) > np.abs(b)
    radius = np.where(wide, a, b)
    ratio = np.divide(np.where(wide, b, a), radius, out=np.zeros_like(a), where=radius != 0.0)
    angle = np.where(wide, 0.25 * np.pi * ratio, 0.5 * np.pi - 0.25 * np.pi * ratio)
    return np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=-1)


def toward(light: Light, origin: Float64, positions: Float64, square: Float64) -> tuple[Float64, Float64]:
    """Return unit directions and lengths of rays from positions to points of the light.

    Parameters
    ----------
    light : directional lights are a disc of ``radius`` at distance 1, perpendicular to the direction; point lights a
        sphere, sampled evenly over its solid angle; spot lights a disc perpendicular to their axis
    origin : (3,) world point that positions are relative to
    positions : (n, 3)
    square : (n, m, 2) points of the unit square

    Returns
    -------
    directions : (n, m, 3)
    lengths : (n, m) to the light's surface
    """
    if light.kind == "point":
        return _toward_ball(np.subtract(light.position, origin), light.radius, positions, square)
    across = look_rotation(light.direction)[:2, :3]
    spread = light.radius * disc(square) @ across
    if light.kind == "directional":
        # rounding must not change the direction of a light without extent
        directions = spread - np.array(light.direction)
        lengths = np.full(square.shape[:2], ENDLESS)
        return directions / np.linalg.norm(directions, axis=-1, keepdims=True), lengths
    directions = np.subtract(light.position, origin) + spread - positions[:, None]
    far = np.linalg.norm(directions, axis=-1)
    return directions / np.maximum(far, 1e-300)[..., None], far


def _toward_ball(place: Float64, radius: float, positions: Float64, square: Float64) -> tuple[Float64, Float64]:
    """Return directions within the cone around a sphere; a position inside the sphere sees half of it."""
    axis = place - positions
    far = np.maximum(np.linalg.norm(axis, axis=-1), 1e-300)
    axis = axis / far[:, None]
    sine2 = np.minimum((radius / far) ** 2, 1.0)
    # 1 - cos without cancellation; equal areas of the disc are equal solid angles
    widest = sine2 / (1.0 + np.sqrt(1.0 - sine2))
    flat = disc(square)
    share = np.einsum("nmk,nmk->nm", flat, flat)
    drop = widest[:, None] * share
    # a frame about each axis: T. Duff et al., "Building an Orthonormal Basis, Revisited", 2017
    x, y, z = axis.T
    sign = np.where(z >= 0.0, 1.0, -1.0)
    a = -1.0 / (sign + z)
    u = np.stack([1.0 + sign * x * x * a, sign * x * y * a, -sign * x], axis=-1)
    v = np.stack([x * y * a, sign + y * y * a, -y], axis=-1)
    out = np.sqrt(np.maximum(widest[:, None] * (2.0 - drop), 0.0))[..., None] * flat
    directions = (1.0 - drop)[..., None] * axis[:, None] + out[..., :1] * u[:, None] + out[..., 1:] * v[:, None]
    cosine = 1.0 - drop
    inside = np.maximum(radius**2 - far[:, None] ** 2 * (1.0 - cosine**2), 0.0)
    return directions, np.maximum(far[:, None] * cosine - np.sqrt(inside), 0.0)
