"""Small meshes for draws: triangles with a colour at each corner, in clip coordinates divided by w."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class Soup:
    """Triangles; ``positions`` (n, 3), ``triangles`` (m, 3), ``colors`` (n, 4)."""

    positions: NDArray[np.float32]
    triangles: NDArray[np.int32]
    colors: NDArray[np.float32]


def soup(count: int, seed: int, size: float = 0.8, depth: tuple[float, float] = (-0.9, 0.9)) -> Soup:
    """Random overlapping triangles, of both windings."""
    random = np.random.default_rng(seed)
    centres = random.uniform(-1, 1, (count, 1, 2))
    corners = centres + random.uniform(-size, size, (count, 3, 2))
    z = random.uniform(*depth, (count, 3, 1))
    positions = np.concatenate([corners, z], -1).reshape(-1, 3).astype(np.float32)
    colors = random.uniform(0, 1, (count * 3, 4)).astype(np.float32)
    return Soup(positions, np.arange(count * 3, dtype=np.int32).reshape(-1, 3), colors)


def quad(z: float = 0.0, color: tuple[float, ...] = (1, 1, 1, 1), half: float = 1.0) -> Soup:
    """Two triangles over the square from -half to half, counter-clockwise with y up."""
    positions = np.array([[-half, -half, z], [half, -half, z], [half, half, z], [-half, half, z]], np.float32)
    return Soup(positions, np.array([[0, 1, 2], [0, 2, 3]], np.int32), np.tile(np.array(color, np.float32), (4, 1)))


def made(positions: object, triangles: object, colors: object = (1.0, 1.0, 1.0, 1.0)) -> Soup:
    """From nested numbers; one colour for all corners, or one for each."""
    points = np.asarray(positions, np.float32).reshape(-1, 3)
    corner = np.broadcast_to(np.asarray(colors, np.float32), (len(points), 4)).copy()
    return Soup(points, np.asarray(triangles, np.int32).reshape(-1, 3), corner)
