"""Clipping of triangles in clip space (rule 1 of docs/rasterisation.md), all triangles of a plane at once."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Float64 = NDArray[np.float64]
Ints = NDArray[np.int64]

#: |x| and |y| may reach this many times w before a triangle is clipped at the sides.
GUARD_BAND = 8.0
#: Near, far, and the four sides of the guard band.
PLANES = 6
#: Polygons clipped at once; each has up to 9 corners.
BATCH = 1 << 14


@dataclass(frozen=True)
class Vertices:
    """What the vertex kernel gave: rows of clip position (4) and varyings side by side."""

    rows: Float64

    @property
    def clip(self) -> Float64:
        return self.rows[:, :4]


def distances(clip: Float64) -> Float64:
    """Signed distance of each position (…, 4) to each of the six planes (…, 6)."""
    x, y, z, w = (clip[..., i] for i in range(4))
    wide = GUARD_BAND * w
    return np.stack([z + w, w - z, wide + x, wide - x, wide + y, wide - y], axis=-1)


def clip_triangles(vertices: Vertices, triangles: Ints) -> tuple[Vertices, Ints, Ints]:
    """Triangles (m, 3) cut down to what lies inside all planes, in the order of submission, and which each is of.

    Corners that cutting makes are added behind the vertices.  A triangle with a position that is not finite
    is dropped.
    """
    finite = np.asarray(np.isfinite(vertices.clip).all(axis=1))
    inside = (distances(vertices.clip) >= 0) & finite[:, None]
    corners: NDArray[np.bool_] = inside[triangles]
    whole = corners.all(axis=(1, 2))
    reachable = np.asarray(corners.any(axis=1)).all(axis=1) & np.asarray(finite[triangles]).all(axis=1)
    cut = np.flatnonzero(reachable & ~whole)
    kept = np.flatnonzero(whole)
    rows, parts, sources = [vertices.rows], [triangles[kept]], [kept]
    count = len(vertices.rows)
    for first in range(0, len(cut), BATCH):
        batch = cut[first : first + BATCH]
        polygons, sizes = _clip_polygons(vertices.rows[triangles[batch]])
        fans, owners = _fans(sizes, polygons.shape[1])
        rows.append(polygons.reshape(-1, polygons.shape[2]))
        parts.append(fans + count)
        sources.append(batch[owners])
        count += len(rows[-1])
    owner = np.concatenate(sources)
    order = np.argsort(owner, kind="stable")
    return Vertices(np.concatenate(rows)), np.concatenate(parts)[order], owner[order]


def _clip_polygons(polygons: Float64) -> tuple[Float64, Ints]:
    """(k, 3, row) triangles to (k, 9, row) polygons and their numbers of corners."""
    sizes = np.full(len(polygons), 3)
    for plane in range(PLANES):
        polygons, sizes = _clip_at(polygons, sizes, distances(polygons[..., :4])[..., plane])
    return polygons, sizes


def _clip_at(polygons: Float64, sizes: Ints, distance: Float64) -> tuple[Float64, Ints]:
    """Sutherland and Hodgman (1974): each corner inside stays, each edge that crosses gives one more.

    What lies inside is one run of corners, so at most two edges cross and a polygon grows by one corner.
    """
    count, width, row = polygons.shape
    place = np.arange(width)
    following = (place + 1) % np.maximum(sizes, 1)[:, None]
    inside = _inside(distance, sizes)
    crossing = (place < sizes[:, None]) & (inside != np.take_along_axis(inside, following, axis=1))
    emitted = inside.astype(np.int64) + crossing
    target = np.cumsum(emitted, axis=1) - emitted
    clipped = np.zeros((count, width + 1, row))
    k, i = np.nonzero(inside)
    clipped[k, target[k, i]] = polygons[k, i]
    k, i = np.nonzero(crossing)
    j = following[k, i]
    leaving = inside[k, i]
    a, b = np.where(leaving, i, j), np.where(leaving, j, i)  # from the inside corner to the outside one
    apart = distance[k, a] - distance[k, b]
    share, rest = -distance[k, b] / apart, distance[k, a] / apart
    made = polygons[k, a] * share[:, None] + polygons[k, b] * rest[:, None]
    clipped[k, target[k, i] + inside[k, i]] = made
    return clipped, emitted.sum(axis=1)


def _inside(distance: Float64, sizes: Ints) -> NDArray[np.bool_]:
    """Corners inside that lie next to one another round the one that lies deepest.

    Of a convex polygon these are all.  Rounding may put others inside; they lie on the plane but for that rounding.
    """
    place, number = np.arange(distance.shape[1]), np.maximum(sizes, 1)[:, None]
    real = place < sizes[:, None]
    deepest = np.argmax(np.where(real, distance, -np.inf), axis=1)[:, None]
    inside = real & (distance >= 0)
    runs = []
    for step in (1, -1):
        onward = np.take_along_axis(inside, (deepest + step * place) % number, axis=1)
        reached = np.logical_and.accumulate(onward, axis=1)
        runs.append(np.take_along_axis(reached, step * (place - deepest) % number, axis=1))
    return np.asarray(real & (runs[0] | runs[1]))


def _fans(sizes: Ints, width: int) -> tuple[Ints, Ints]:
    """Triangles (0, i, i + 1) of each polygon as rows of its corner table, and which polygon each is of."""
    owners, i = np.nonzero(np.arange(1, width - 1) < (sizes - 1)[:, None])
    base = owners * width
    return np.stack([base, base + i + 1, base + i + 2], axis=1), owners
