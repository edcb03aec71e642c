"""The Utah teapot as a closed triangle mesh.

Source: Martin Newell's 32 bicubic Bezier patches of 1975 (public domain), of which ten are stored; the others are
mirror images. Deviations: the lid is widened by 1.4/1.3 so that its edge meets the rim and the pot is closed, and the
open ends of the spout and of the handle are capped.
"""

from __future__ import annotations

import json
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from passgraph.errors import InputError
from passgraph.kept_arrays import kept
from passgraph.scene.matrices import Float64
from passgraph.scene.meshes import Mesh, smooth_normals

# Parts whose surfaces join smoothly share normals; the lid meets the rim in a crease.
_SMOOTH_GROUP = {"rim": 0, "body": 0, "bottom": 0, "lid": 1, "handle": 2, "spout": 3}
_CAP_GROUP = 4
# Solids, each of which is closed.
_SOLIDS = (("rim", "body", "bottom", "lid"), ("handle",), ("spout",))
_LID_SCALE = 1.4 / 1.3
# Decimals for welding points; control points have 5.
_WELD_DECIMALS = 7


@lru_cache(maxsize=4)
def teapot_mesh(segments: int = 16) -> Mesh:
    """Tessellate the teapot.

    Parameters
    ----------
    segments : segments along each side of a patch, 2 to 128; there are about 64 * segments**2 triangles

    Returns
    -------
    A mesh with y up: it stands on y = 0, is 3.15 high, its spout points along +x to 3.4 and its handle to -3.
    Wound counter-clockwise from outside; vertices at one position are equal in every bit; no texture coordinates.

    >>> mesh = teapot_mesh(4)
    >>> mesh.bounds[:, 1].tolist()
    [0.0, 3.1500000953674316]
    """
    if not 2 <= segments <= 128:
        raise InputError(f"teapot: segments: expected 2 to 128, got {segments}")
    places, triangles, normals = _teapot(segments)
    return Mesh.make(places, triangles, normals, name="teapot")


@kept
def _teapot(segments: int) -> tuple[NDArray[Any], ...]:
    """Return the points, triangles and normals of the mesh."""
    grids = _patch_grids(segments)
    places, faces, groups, directions = [], [], [], []
    first = 0
    for solid in _SOLIDS:
        points, triangles, kind, normals = _solid([g for g in grids if g[0] in solid], segments)
        places.append(points)
        faces.append(triangles + first)
        groups.append(kind)
        directions.append(normals)
        first += len(points)
    points = np.concatenate(places)
    triangles, group, normals = np.concatenate(faces), np.concatenate(groups), np.concatenate(directions)
    return _with_creases(points, triangles, group, normals)


def _patch_grids(segments: int) -> list[tuple[str, Float64, Float64, bool]]:
    """Return part, points (k, k, 3), unit normals (zero if degenerate), and True if mirrored, for each grid."""
    data = json.loads((Path(__file__).parents[1] / "assets" / "teapot.json").read_text(encoding="utf-8"))
    control = np.array(data["points"])
    grids = []
    for patch in data["patches"]:
        net = control[patch["points"]].reshape(4, 4, 3)
        if patch["part"] == "lid":
            net = net * np.array([_LID_SCALE, _LID_SCALE, 1.0])
        points, normals = _evaluate(net, segments)
        for flip_x in (1.0, -1.0) if "x" in patch["mirror"] else (1.0,):
            for flip_y in (1.0, -1.0):
                flip = np.array([flip_x, flip_y, 1.0])
                grids.append((patch["part"], points * flip, normals * flip, flip_x * flip_y < 0.0))
    return grids


def _evaluate(net: Float64, segments: int) -> tuple[Float64, Float64]:
    """Return points and unit normals of a bicubic Bezier patch on a regular grid."""
    t = np.linspace(0.0, 1.0, segments + 1)
    s = 1.0 - t
    basis = np.stack([s**3, 3 * s * s * t, 3 * s * t * t, t**3], axis=1)
    slope = np.stack([-3 * s * s, 3 * s * s - 6 * s * t, 6 * s * t - 3 * t * t, 3 * t * t], axis=1)
    points = np.einsum("vi,uj,ijk->vuk", basis, basis, net)
    along_u = np.einsum("vi,uj,ijk->vuk", basis, slope, net)
    along_v = np.einsum("vi,uj,ijk->vuk", slope, basis, net)
    normal = np.cross(along_u, along_v)
    length = np.linalg.norm(normal, axis=2, keepdims=True)
    # at the knob's tip and the middle of the bottom a whole side of the patch is one point
    return points, np.where(length > 1e-6, normal / np.maximum(length, 1e-6), 0.0)


def _solid(
    grids: list[tuple[str, Float64, Float64, bool]], segments: int
) -> tuple[Float64, NDArray[np.int64], NDArray[np.int64], Float64]:
    """Return a solid: welded points (n, 3), outward triangles, smoothing groups (m,), corner normals (m, 3, 3)."""
    side = segments + 1
    corner = np.arange(side * side).reshape(side, side)[:-1, :-1].reshape(-1, 1)
    quad = np.concatenate([corner, corner + 1, corner + side + 1, corner, corner + side + 1, corner + side], axis=1)
    quad = quad.reshape(-1, 3)
    faces, groups = [], []
    for index, (part, _, _, mirrored) in enumerate(grids):
        faces.append((quad[:, ::-1] if mirrored else quad) + index * side * side)
        groups.append(np.full(len(quad), _SMOOTH_GROUP[part]))
    raw = np.concatenate([points.reshape(-1, 3) for _, points, _, _ in grids])
    analytic = np.concatenate([normals.reshape(-1, 3) for _, _, normals, _ in grids])
    raw = np.round(raw, _WELD_DECIMALS) + 0.0
    points, weld = np.unique(raw, axis=0, return_inverse=True)
    corners = np.concatenate(faces)
    triangles, group = weld.reshape(-1)[corners], np.concatenate(groups)
    normals = analytic[corners]
    keep = (triangles != np.roll(triangles, 1, axis=1)).all(axis=1)
    triangles, group, normals = triangles[keep], group[keep], normals[keep]
    points, caps = _caps(points, triangles)
    triangles = np.concatenate([triangles, caps])
    group = np.concatenate([group, np.full(len(caps), _CAP_GROUP)])
    normals = np.concatenate([normals, np.zeros((len(caps), 3, 3))])
    a, b, c = points[triangles].transpose(1, 0, 2)
    if float((a * np.cross(b, c)).sum()) < 0.0:  # six times the volume: negative when wound inward
        triangles, normals = triangles[:, ::-1], -normals[:, ::-1]
    return points, triangles, group, normals


def _caps(points: Float64, triangles: NDArray[np.int64]) -> tuple[Float64, NDArray[np.int64]]:
    """Return the points with a center added for every hole, and the triangle fans that close the holes."""
    edges = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    known = {(a, b) for a, b in edges.tolist()}
    following = {b: a for a, b in known if (b, a) not in known}
    caps: list[list[int]] = []
    added: list[Float64] = []
    while following:
        start = next(iter(following))
        loop = [start]
        while (after := following.pop(loop[-1])) != start:
            loop.append(after)
        middle = len(points) + len(added)
        added.append(points[loop].mean(axis=0))
        caps += [[a, b, middle] for a, b in zip(loop, loop[1:] + loop[:1], strict=True)]
    if not added:
        return points, np.zeros((0, 3), np.int64)
    return np.concatenate([points, np.stack(added)]), np.array(caps, dtype=np.int64)


def _with_creases(
    points: Float64, triangles: NDArray[np.int64], group: NDArray[np.int64], normals: Float64
) -> tuple[NDArray[Any], ...]:
    """Return points, triangles and normals, with a vertex for each pair of point and smoothing group.

    Normals are averaged in each.
    """
    pair = triangles * (_CAP_GROUP + 1) + group[:, None]
    used, index = np.unique(pair, return_inverse=True)
    index = index.reshape(-1, 3)
    places = points[used // (_CAP_GROUP + 1)]
    total = np.zeros((len(used), 3))
    np.add.at(total, index, normals)
    length = np.linalg.norm(total, axis=1, keepdims=True)
    smooth = smooth_normals(places, index)
    total = np.where(length > 1e-6, total / np.maximum(length, 1e-6), smooth)
    to_y_up = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
    return places @ to_y_up.T + 0.0, index, total @ to_y_up.T + 0.0
