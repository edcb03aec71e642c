"""Find the outer side of a surface, for file formats without double-sided materials."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from passgraph.scene.meshes import Mesh, least_joined, places_of


def with_outside(mesh: Mesh) -> tuple[Mesh, bool]:
    """Return the mesh with consistent winding, and True if only one side of it is visible from outside.

    Triangles whose file normals point to their back are reversed. Without file normals, a closed mesh that is inside
    out is reversed. One side is visible if the mesh is closed and all its parts are wound counter-clockwise seen from
    outside. Vertices at the same position count as one. A cavity in a body is a part with the opposite winding.

    >>> corners = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
    >>> sides = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])
    >>> [with_outside(Mesh.make(corners, triangles))[1] for triangles in (sides, sides[:, ::-1], sides[1:])]
    [True, True, False]
    """
    mesh = _by_normals(mesh)
    volumes = _volumes(mesh)
    if volumes is None:
        return mesh, False
    if volumes.sum() < 0.0 and not mesh.has_normals:
        mesh = replace(mesh, triangles=np.ascontiguousarray(mesh.triangles[:, ::-1]), normals=-mesh.normals)
        volumes = -volumes
    return mesh, bool((volumes > 0.0).all())


def _by_normals(mesh: Mesh) -> Mesh:
    if not mesh.has_normals:
        return mesh
    a, b, c = (mesh.positions[mesh.triangles[:, k]].astype(np.float64) for k in range(3))
    stored_normals = mesh.normals[mesh.triangles].sum(axis=1, dtype=np.float64)
    turned = (np.cross(b - a, c - a) * stored_normals).sum(axis=1) < 0.0
    if not turned.any():
        return mesh
    return replace(mesh, triangles=np.where(turned[:, None], mesh.triangles[:, ::-1], mesh.triangles))


def _volumes(mesh: Mesh) -> NDArray[np.float64] | None:
    """Return six times the volume of each part, relative to the mesh's extent; None if the mesh is not closed.

    Parts that are inside out have negative volumes.
    """
    places = places_of(mesh.positions)[mesh.triangles]
    count = int(places.max()) + 1
    starts, ends = places.reshape(-1).astype(np.int64), np.roll(places, -1, axis=1).reshape(-1).astype(np.int64)
    edges, edge_of = np.unique(np.minimum(starts, ends) * count + np.maximum(starts, ends), return_inverse=True)
    # In a closed mesh each edge has as many triangles in one direction as in the other.
    if np.bincount(edge_of.reshape(-1), np.sign(ends - starts), len(edges)).any():
        return None
    part = least_joined(count, np.stack([starts, ends]))[places[:, 0]]
    points = mesh.positions.astype(np.float64) - mesh.positions.mean(axis=0, dtype=np.float64)
    points /= max(float(np.abs(points).max()), 1e-300)
    a, b, c = (points[mesh.triangles[:, k]] for k in range(3))
    volumes = np.bincount(part, (a * np.cross(b, c)).sum(axis=1), count)
    return np.asarray(volumes[np.unique(part)], np.float64)
