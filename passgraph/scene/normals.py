"""Smooth normals and tangents of an indexed triangle mesh."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Float = NDArray[np.floating]
Int = NDArray[np.integer]

#: Where two triangles turn by more, their edge is to be seen: what has eight sides (45 degrees) looks round, what has
#: six (60 degrees) does not.
CREASE_RAD = np.radians(50.0)


def _scaled_edges(positions: Float, triangles: Int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Corners (m, 3, 3) and edges (m, 3, 3), scaled to unit size so that products cannot overflow."""
    points = positions.astype(np.float64)
    points = points - points.mean(axis=0)
    points /= max(float(np.abs(points).max()), 1e-300)
    corners = points[triangles]
    return corners, np.roll(corners, -1, axis=1) - corners


def _unit_rows(vectors: NDArray[np.float64], fallback: NDArray[np.float64]) -> NDArray[np.float64]:
    lengths = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.where(lengths > 1e-30, vectors / np.maximum(lengths, 1e-30), fallback)


def smooth_normals(positions: Float, triangles: Int, *, weld: bool = False) -> NDArray[np.float32]:
    """Vertex normals: the triangle normals weighted by the angle at the vertex.

    Parameters
    ----------
    positions : (n, 3) float
    triangles : (m, 3) int, counter-clockwise from outside
    weld : treat vertices at the same position as one, so that a seam of the texture does not become an edge

    Returns
    -------
    (n, 3) float32 unit vectors; a vertex that only degenerate triangles touch gets +y.

    Source: G. Thuermer, C. Wuethrich, "Computing Vertex Normals from Polygonal Facets", 1998.

    >>> smooth_normals(np.eye(3), np.array([[0, 1, 2]])).round(3)[0].tolist() == [np.float32(0.577)] * 3
    True
    """
    face, angle = _corners(positions, triangles)
    group = _places(positions) if weld else np.arange(len(positions))
    return _summed(group[triangles], face, angle, int(group.max()) + 1)[group].astype(np.float32)


def creased_normals(positions: Float, triangles: Int) -> tuple[Int, Int, NDArray[np.float32]]:
    """Normals that are smooth but for sharp edges, where vertices are split so that each side has its own.

    An edge is sharp where its triangles turn by more than `CREASE_RAD`, or where it has one triangle alone. Vertices at
    the same position count as one, so that a seam of the texture does not become an edge.

    Parameters
    ----------
    positions : (n, 3) float
    triangles : (m, 3) int, counter-clockwise from outside

    Returns
    -------
    which vertex each new one is, (k,) int; the triangles of the new ones, (m, 3) int; their unit normals, (k, 3)
    float32. Vertices that no triangle has are left out.

    >>> cube = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
    >>> sides = np.array([[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]])
    >>> of, triangles, normals = creased_normals(cube, sides[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3))
    >>> len(of), bool((abs(normals).max(axis=1) == 1).all())
    (24, True)
    """
    face, angle = _corners(positions, triangles)
    fans = _fans(_places(positions)[triangles], face)
    count = fans.size
    keys, corners = np.unique(triangles.astype(np.int64) * count + fans, return_inverse=True)
    normals = _summed(fans, face, angle, count)[keys % count]
    return keys // count, corners.reshape(-1, 3), normals.astype(np.float32)


def _corners(positions: Float, triangles: Int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Unit normals of the triangles, (m, 3), zero of degenerate ones; and their angles, (m, 3) radians."""
    _, edges = _scaled_edges(positions, triangles)
    face = _unit_rows(np.cross(edges[:, 0], -edges[:, 2]), np.zeros(3))
    towards = edges / np.maximum(np.linalg.norm(edges, axis=2, keepdims=True), 1e-30)
    cosine = -(towards * np.roll(towards, 1, axis=1)).sum(axis=2)
    return face, np.arccos(np.clip(cosine, -1.0, 1.0))


def _places(positions: Float) -> Int:
    """A number for each vertex, the same for those at one position."""
    return np.unique(positions, axis=0, return_inverse=True)[1].reshape(-1)


def _summed(groups: Int, face: NDArray[np.float64], angle: NDArray[np.float64], count: int) -> NDArray[np.float64]:
    """Unit sums of the normals of triangles at the corners, (m, 3), of each group, weighted by the angle there."""
    total = np.zeros((count, 3))
    for corner in range(3):
        # bincount adds repeated indices and is many times faster than np.add.at
        for axis in range(3):
            total[:, axis] += np.bincount(groups[:, corner], angle[:, corner] * face[:, axis], count)
    return _unit_rows(total, np.array([0.0, 1.0, 0.0]))


def _fans(places: Int, face: NDArray[np.float64]) -> Int:
    """A number for each corner, (m, 3), the same where smooth edges join corners at one place."""
    corner = np.arange(places.size).reshape(-1, 3)
    ends = np.stack([places, np.roll(places, -1, axis=1)], axis=-1).reshape(-1, 2)
    corners = np.stack([corner, np.roll(corner, -1, axis=1)], axis=-1).reshape(-1, 2)
    turned = ends[:, 0] > ends[:, 1]
    ends[turned], corners[turned] = ends[turned, ::-1], corners[turned, ::-1]
    key = ends[:, 0].astype(np.int64) * (int(places.max()) + 1) + ends[:, 1]
    order = np.argsort(key, kind="stable")
    order = order[np.flatnonzero(ends[order, 0] != ends[order, 1])]
    same = np.flatnonzero(key[order[1:]] == key[order[:-1]])
    one, other = order[same], order[same + 1]
    smooth = (face[one // 3] * face[other // 3]).sum(axis=1) >= np.cos(CREASE_RAD)
    joins = np.concatenate([np.stack([corners[one[smooth], k], corners[other[smooth], k]]) for k in (0, 1)], axis=1)
    return least_joined(places.size, joins).reshape(-1, 3)


def least_joined(count: int, joins: Int) -> Int:
    """For each of so many numbers the least that ``joins``, (2, n), lead to: the roots of joined ones are joined, and
    every path to a root made short, which ends after about log2(count) rounds."""
    label = np.arange(count)
    while joins.size:
        roots = label[joins]
        joins = joins[:, roots[0] != roots[1]]
        roots = label[joins]
        np.minimum.at(label, roots.max(axis=0), roots.min(axis=0))
        while not np.array_equal(shorter := label[label], label):
            label = shorter
    return label


def tangents_of(positions: Float, triangles: Int, normals: Float, uvs: Float) -> NDArray[np.float32]:
    """Tangents along which u grows, for normal maps and parallax.

    Parameters
    ----------
    positions, triangles, normals : as in `smooth_normals`
    uvs : (n, 2) float, v = 0 at the top row of the texture

    Returns
    -------
    (n, 4) float32: xyz the unit tangent, orthogonal to the normal, and w = +1 or -1 such that
    ``bitangent = w * cross(normal, tangent)`` points along *decreasing* v: the green axis of an OpenGL or
    glTF normal map, up in the picture. Where the coordinates have no area any orthogonal vector stands in.

    Source: E. Lengyel, "Computing Tangent Space Basis Vectors for an Arbitrary Mesh", 2001.
    """
    corners, _ = _scaled_edges(positions, triangles)
    coordinates = uvs.astype(np.float64)[triangles] * np.array([1.0, -1.0])
    e1, e2 = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    d1, d2 = coordinates[:, 1] - coordinates[:, 0], coordinates[:, 2] - coordinates[:, 0]
    area = d1[:, 0] * d2[:, 1] - d2[:, 0] * d1[:, 1]
    inverse = np.where(np.abs(area) > 1e-30, 1.0 / np.where(np.abs(area) > 1e-30, area, 1.0), 0.0)[:, None]
    along_u = (e1 * d2[:, 1:] - e2 * d1[:, 1:]) * inverse
    along_v = (e2 * d1[:, :1] - e1 * d2[:, :1]) * inverse
    # weight by the area in space, not by stretch: large triangles decide
    weight = np.linalg.norm(np.cross(e1, e2), axis=1)[:, None]
    u_sum, v_sum = np.zeros((len(positions), 3)), np.zeros((len(positions), 3))
    for total, part in ((u_sum, along_u), (v_sum, along_v)):
        part = _unit_rows(part, np.zeros(3)) * weight
        for corner in range(3):
            for axis in range(3):
                total[:, axis] += np.bincount(triangles[:, corner], part[:, axis], len(positions))
    n = normals.astype(np.float64)
    stand_in = np.where(np.abs(n[:, :1]) < 0.9, np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0]))
    stand_in = _unit_rows(stand_in - n * (stand_in * n).sum(axis=1, keepdims=True), stand_in)
    tangent = _unit_rows(u_sum - n * (u_sum * n).sum(axis=1, keepdims=True), stand_in)
    sign = np.where((np.cross(n, tangent) * v_sum).sum(axis=1) < 0.0, -1.0, 1.0)
    return np.concatenate([tangent, sign[:, None]], axis=1).astype(np.float32)
