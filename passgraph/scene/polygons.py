"""Split the polygons of model files into triangles."""

from __future__ import annotations

import re
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from passgraph.scene.matrices import Float64

#: Most corners of a concave polygon: ear clipping takes quadratic time for some of them.
MAX_CONCAVE_CORNERS = 1 << 14
_LARGE_FACE = re.compile(rb"^[ \t]*f(?:(?:[ \t]|\\\r?\n)+[-\d/]+){4}", re.MULTILINE)


@dataclass(frozen=True)
class Polygons:
    """The surface of a file with polygons.

    Attributes
    ----------
    positions : (n, 3)
    corners : (c,) vertices of the polygons, one polygon after the other
    lengths : (p,) corners of each polygon
    normals : (n, 3), or None
    vertex_colors, polygon_colors : (n, 3 | 4) and (p, 3 | 4) as stored, or None
    uvs : (n, 2) of the vertices, v = 0 at the bottom, or None
    corner_uvs : (c, 2) of the corners, or None
    picture : the name of the picture of its texture, or None
    """

    positions: Float64
    corners: NDArray[np.int64]
    lengths: NDArray[np.int64]
    normals: Float64 | None = None
    vertex_colors: NDArray[Any] | None = None
    polygon_colors: NDArray[Any] | None = None
    uvs: Float64 | None = None
    corner_uvs: Float64 | None = None
    picture: str | None = None

    def triangles(self) -> NDArray[np.int64]:
        """Return the triangles, (m, 3), as numbers of corners; raise ValueError for a corner that is no vertex."""
        if len(self.corners) and not 0 <= int(self.corners.min()) <= int(self.corners.max()) < len(self.positions):
            raise ValueError(f"a polygon names a vertex outside 0..{len(self.positions) - 1}")
        return triangles_of_polygons(self.positions[self.corners], self.lengths)


def triangles_of_polygons(points: Float64, lengths: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the triangles of polygons, as numbers of corners.

    A polygon becomes a fan around its first corner if all triangles of the fan face its side, as those of a convex
    polygon do. Other polygons are cut by ear clipping in the plane of their mean normal.

    Parameters
    ----------
    points : (c, 3) positions of all polygons' corners, one polygon after the other
    lengths : (n,) corners of each polygon; polygons of less than three have no triangles

    Returns
    -------
    (m, 3): the triangles in the order of the polygons, ``max(length - 2, 0)`` each

    Raises
    ------
    ValueError
        A concave polygon has more than `MAX_CONCAVE_CORNERS`.

    >>> corner = [[0, 0, 0], [4, 0, 0], [4, 4, 0], [2, 1, 0], [0, 4, 0]]
    >>> triangles_of_polygons(np.array(corner, float), np.array([5])).tolist()
    [[3, 4, 0], [3, 0, 1], [3, 1, 2]]
    """
    starts = np.cumsum(lengths) - lengths
    counts = np.maximum(lengths - 2, 0)
    polygon = np.repeat(np.arange(len(lengths)), counts)
    first = starts[polygon]
    step = np.arange(len(polygon)) - (np.cumsum(counts) - counts)[polygon]
    fans = np.stack([first, first + step + 1, first + step + 2], axis=1)
    a, b, c = (points[fans[:, k]] for k in range(3))
    with np.errstate(all="ignore"):  # infinite positions are reported by the caller
        areas = np.cross(b - a, c - a)
        # the sum of a fan's triangles is the polygon's own area, for concave polygons too
        normals = np.stack([np.bincount(polygon, areas[:, k], len(lengths)) for k in range(3)], axis=1)
        turned = np.einsum("ij,ij->i", areas, normals[polygon]) < 0.0
    ends = np.cumsum(counts)
    for number in np.unique(polygon[turned]):
        where = slice(ends[number] - counts[number], ends[number])
        cut = _clipped(points[starts[number] : starts[number] + lengths[number]], normals[number])
        # a polygon that crosses itself has no such triangles; the fan stays
        if len(cut) == counts[number]:
            fans[where] = starts[number] + cut
    return fans


def _clipped(corners: Float64, normal: Float64) -> NDArray[np.int64]:
    """Return the triangles, (m, 3), of one polygon, which keep its winding."""
    import mapbox_earcut

    if len(corners) > MAX_CONCAVE_CORNERS:
        raise ValueError(
            f"a concave polygon has {len(corners)} corners; expected at most {MAX_CONCAVE_CORNERS}, split it"
        )
    across = np.cross(normal, np.eye(3)[np.argmin(np.abs(normal))])
    across /= max(float(np.linalg.norm(across)), 1e-300)
    up = np.cross(normal, across)
    up /= max(float(np.linalg.norm(up)), 1e-300)
    flat = np.stack([corners @ across, corners @ up], axis=1)
    triangles = mapbox_earcut.triangulate_float64(flat, np.array([len(flat)], np.uint32))
    cut: NDArray[np.int64] = triangles.astype(np.int64).reshape(-1, 3)
    x, y = flat[cut, 0], flat[cut, 1]
    area = (x[:, 1] - x[:, 0]) * (y[:, 2] - y[:, 0]) - (x[:, 2] - x[:, 0]) * (y[:, 1] - y[:, 0])
    cut[area < 0.0] = cut[area < 0.0][:, ::-1]
    return cut


def split_obj_polygons(text: bytes) -> bytes:
    """Return OBJ text in which the faces that are no fans of their first corner are triangles.

    trimesh (5.2) makes a fan of every polygon, also where a concave one leaves it.

    >>> split_obj_polygons(b"v 4 4 0\\nv 1 1.5 0\\nv 0 4 0\\nv 0 0 0\\nf 1 2 3 4\\n").splitlines()[-2:]
    [b'f 4 1 2', b'f 4 2 3']
    """
    if _LARGE_FACE.search(text) is None:
        return text
    lines = text.replace(b"\\\r\n", b" ").replace(b"\\\n", b" ").splitlines()
    points, faces, corners, lengths = list[bytes](), list[tuple[int, list[bytes]]](), list[int](), list[int]()
    for number, line in enumerate(lines):
        words = line.split()
        if not words:
            continue
        if words[0] == b"v":
            points.append(b" ".join(words[1:4]))
        elif words[0] == b"f" and len(words) > 4:
            words = words[1 : next((k for k, word in enumerate(words) if word[:1] == b"#"), len(words))]
            named = [int(word.split(b"/")[0]) for word in words]
            corners += [index - 1 if index > 0 else len(points) + index for index in named]
            lengths.append(len(named))
            faces.append((number, words))
    places = np.array(b" ".join(points).split(), np.float64).reshape(-1, 3)
    order = np.array(corners)
    if order.min() < 0 or order.max() >= len(places):
        return text  # the loader refuses it
    sizes = np.array(lengths, np.int64)
    triangles = triangles_of_polygons(places[order], sizes)
    bounds = np.concatenate([[0], np.cumsum(np.maximum(sizes - 2, 0))])
    firsts = np.cumsum(sizes) - sizes
    for (number, words), (low, high), first in zip(faces, pairwise(bounds), firsts, strict=True):
        own = triangles[low:high] - first
        if len(own) and (own[:, 0] != 0).any():
            lines[number] = b"\n".join(b"f " + b" ".join(words[corner] for corner in row) for row in own)
    return b"\n".join(lines) + b"\n"
