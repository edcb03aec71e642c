"""Triangle meshes: checked arrays, ready to draw."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from passgraph.arguments import numbers, shown, string
from passgraph.cached import cached_property
from passgraph.errors import InputError
from passgraph.graph.draw_state import Fixed, fixed
from passgraph.records import dataclass
from passgraph.scene.matrices import Float64, floats, transform_points, vec3

Float = NDArray[np.floating]
Int = NDArray[np.integer]

#: Least angle between triangles for a sharp edge: prisms of eight sides (45 degrees) look round, of six (60 degrees)
#: not.
CREASE_RAD = np.radians(50.0)


def _scaled_edges(positions: Float, triangles: Int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return corners (m, 3, 3) and edges (m, 3, 3), scaled to unit size so that products cannot overflow."""
    points = positions.astype(np.float64)
    points = points - points.mean(axis=0)
    points /= max(float(np.abs(points).max()), 1e-300)
    corners = points[triangles]
    return corners, np.roll(corners, -1, axis=1) - corners


def _unit_rows(vectors: NDArray[np.float64], fallback: NDArray[np.float64]) -> NDArray[np.float64]:
    lengths = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.where(lengths > 1e-30, vectors / np.maximum(lengths, 1e-30), fallback)


def smooth_normals(positions: Float, triangles: Int, *, weld: bool = False) -> NDArray[np.float32]:
    """Return vertex normals: the triangle normals weighted by the angle at the vertex.

    Parameters
    ----------
    positions : (n, 3) float
    triangles : (m, 3) int, counter-clockwise from outside
    weld : treat vertices at the same position as one, so that a texture seam does not become an edge

    Returns
    -------
    (n, 3) float32 unit vectors; +y for vertices of degenerate triangles only.

    Source: G. Thuermer, C. Wuethrich, "Computing Vertex Normals from Polygonal Facets", 1998.

    >>> smooth_normals(np.eye(3), np.array([[0, 1, 2]])).round(3)[0].tolist() == [np.float32(0.577)] * 3
    True
    """
    face, angle = _corners(positions, triangles)
    group = places_of(positions) if weld else np.arange(len(positions))
    return _summed(group[triangles], face, angle, int(group.max()) + 1)[group].astype(np.float32)


def creased_normals(positions: Float, triangles: Int) -> tuple[Int, Int, NDArray[np.float32]]:
    """Return normals that are smooth except at sharp edges, where vertices are split.

    An edge is sharp if the angle of its triangles exceeds `CREASE_RAD`, or if it has only one triangle. Vertices at the
    same position count as one, so that a texture seam does not become an edge.

    Parameters
    ----------
    positions : (n, 3) float
    triangles : (m, 3) int, counter-clockwise from outside

    Returns
    -------
    The original index of each new vertex, (k,) int; the triangles of the new vertices, (m, 3) int; their unit normals,
    (k, 3) float32. Unused vertices are left out.

    >>> cube = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
    >>> sides = np.array([[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]])
    >>> of, triangles, normals = creased_normals(cube, sides[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3))
    >>> len(of), bool((abs(normals).max(axis=1) == 1).all())
    (24, True)
    """
    face, angle = _corners(positions, triangles)
    fans = _fans(places_of(positions)[triangles], face)
    count = fans.size
    keys, corners = np.unique(triangles.astype(np.int64) * count + fans, return_inverse=True)
    normals = _summed(fans, face, angle, count)[keys % count]
    return keys // count, corners.reshape(-1, 3), normals.astype(np.float32)


def _corners(positions: Float, triangles: Int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return unit normals of the triangles, (m, 3), zero for degenerate ones; and their angles, (m, 3) radians."""
    _, edges = _scaled_edges(positions, triangles)
    face = _unit_rows(np.cross(edges[:, 0], -edges[:, 2]), np.zeros(3))
    towards = edges / np.maximum(np.linalg.norm(edges, axis=2, keepdims=True), 1e-30)
    cosine = -(towards * np.roll(towards, 1, axis=1)).sum(axis=2)
    return face, np.arccos(np.clip(cosine, -1.0, 1.0))


def places_of(positions: Float) -> Int:
    """Return a number for each vertex, the same for vertices at one position.

    Coordinates are sorted one after the other, many times faster than rows.
    """
    places = np.zeros(len(positions), np.int64)
    for column in positions.T:
        numbers = np.unique(column, return_inverse=True)[1].reshape(-1)
        places = np.unique(places * len(positions) + numbers, return_inverse=True)[1].reshape(-1)
    return places


def _summed(groups: Int, face: NDArray[np.float64], angle: NDArray[np.float64], count: int) -> NDArray[np.float64]:
    """Return for each group of corners, (m, 3), the normalized sum of the triangle normals, weighted by angle."""
    total = np.zeros((count, 3))
    for corner in range(3):
        # bincount adds repeated indices and is many times faster than np.add.at
        for axis in range(3):
            total[:, axis] += np.bincount(groups[:, corner], angle[:, corner] * face[:, axis], count)
    return _unit_rows(total, np.array([0.0, 1.0, 0.0]))


def _fans(places: Int, face: NDArray[np.float64]) -> Int:
    """Return a number for each corner, (m, 3), the same for corners at one position joined by smooth edges."""
    corner = np.arange(places.size).reshape(-1, 3)
    ends = np.stack([places, np.roll(places, -1, axis=1)], axis=-1).reshape(-1, 2)
    corners = np.stack([corner, np.roll(corner, -1, axis=1)], axis=-1).reshape(-1, 2)
    turned = ends[:, 0] > ends[:, 1]
    ends[turned], corners[turned] = ends[turned, ::-1], corners[turned, ::-1]
    key = ends[:, 0].astype(np.int64) * (int(places.max()) + 1) + ends[:, 1]
    order = np.argsort(key, kind="stable")
    order = order[np.flatnonzero(ends[order, 0] != ends[order, 1])]
    equal_next = np.flatnonzero(key[order[1:]] == key[order[:-1]])
    one, other = order[equal_next], order[equal_next + 1]
    smooth = (face[one // 3] * face[other // 3]).sum(axis=1) >= np.cos(CREASE_RAD)
    joins = np.concatenate([np.stack([corners[one[smooth], k], corners[other[smooth], k]]) for k in (0, 1)], axis=1)
    return least_joined(places.size, joins).reshape(-1, 3)


def least_joined(count: int, joins: Int) -> Int:
    """Return, for each of ``count`` numbers, the least number that ``joins``, (2, n), connect it to (union-find, about
    log2(count) rounds)."""
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
    """Return tangents along growing u, for normal maps and parallax.

    Parameters
    ----------
    positions, triangles, normals : as in `smooth_normals`
    uvs : (n, 2) float, v = 0 at the top row of the texture

    Returns
    -------
    (n, 4) float32: xyz the unit tangent, orthogonal to the normal, and w = +1 or -1 such that
    ``bitangent = w * cross(normal, tangent)`` points along *decreasing* v: the green axis of an OpenGL or
    glTF normal map, up in the picture. If the coordinates have no area, it is any orthogonal vector.

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
    # weighted by the area in space, not by stretch, so that large triangles dominate
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


Float32 = NDArray[np.float32]
Int32 = NDArray[np.int32]
#: Arrays of a mesh, with their numbers of columns.
COLUMNS = {"positions": 3, "triangles": 3, "normals": 3, "uvs": 2, "colors": 4, "tangents": 4}


@dataclass(frozen=True, eq=False)
class Mesh(Fixed):
    """A triangle mesh in its own frame; build it with `Mesh.make`, which checks and completes it.

    Attributes
    ----------
    positions : (n, 3) float32, scene units, local to the node's transform
    triangles : (m, 3) int32 vertex numbers, counter-clockwise seen from outside
    normals : (n, 3) float32 unit vectors; computed if the source has none (``has_normals`` is False)
    uvs : (n, 2) float32, v = 0 at the top row of the texture; zeros where ``has_uvs`` is False
    colors : (n, 4) float32 linear RGBA; white where ``has_colors`` is False
    tangents : (n, 4) float32, see `passgraph.scene.meshes.tangents_of`; (1, 0, 0, 1) where ``has_tangents``
        is False
    name : used in messages
    """

    positions: Float32
    triangles: Int32
    normals: Float32
    uvs: Float32
    colors: Float32
    tangents: Float32
    name: str = "mesh"
    has_normals: bool = False
    has_uvs: bool = False
    has_colors: bool = False
    has_tangents: bool = False

    def __post_init__(self) -> None:
        where = f"mesh {string(self.name, 'the name of a mesh')!r}"
        for field, columns in COLUMNS.items():
            array, dtype = getattr(self, field), np.int32 if field == "triangles" else np.float32
            if (
                not isinstance(array, np.ndarray)
                or array.ndim != 2
                or array.shape[1] != columns
                or array.dtype != dtype
            ):
                expected = f"an array of shape (n, {columns}), {np.dtype(dtype)} (pg.Mesh.make checks and converts)"
                raise InputError(f"{where}: {field}: expected {expected}, got {shown(array)}")

    @classmethod
    def make(
        cls,
        positions: ArrayLike,
        triangles: ArrayLike,
        normals: ArrayLike | None = None,
        uvs: ArrayLike | None = None,
        colors: ArrayLike | None = None,
        name: str = "mesh",
    ) -> Mesh:
        """Check the arrays, compute missing ones, and freeze them.

        Parameters
        ----------
        positions : (n, 3) numbers, scene units
        triangles : (m, 3) integers in [0, n)
        normals : (n, 3) numbers, of any length except zero; None computes smooth ones
        uvs : (n, 2) numbers, v = 0 at the top row of the texture
        colors : (n, 3) or (n, 4) numbers, linear
        name : used in messages

        Raises
        ------
        InputError
            An array has the wrong shape, is empty, holds NaN or infinity, or an index is out of range.

        >>> Mesh.make([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]).normals[0].tolist()
        [0.0, 0.0, 1.0]
        """
        string(name, "the name of a mesh")
        points = _numbers(positions, 3, f"mesh {name!r}: positions")
        count = len(points)
        faces = _indices(triangles, count, name)
        normal_rows = None if normals is None else _rows(normals, count, (3,), f"mesh {name!r}: normals")
        coordinates = np.zeros((count, 2), np.float32)
        if uvs is not None:
            coordinates = _rows(uvs, count, (2,), f"mesh {name!r}: uvs")
        tint = np.ones((count, 4), np.float32)
        if colors is not None:
            table = _rows(colors, count, (3, 4), f"mesh {name!r}: colors")
            tint[:, : table.shape[1]] = table
        directions = smooth_normals(points, faces) if normal_rows is None else _unit_normals(normal_rows, points, faces)
        flat = np.tile(np.array([1, 0, 0, 1], np.float32), (count, 1))
        return cls(
            fixed(points),
            fixed(faces),
            fixed(directions),
            fixed(coordinates),
            fixed(tint),
            fixed(flat),
            name,
            has_normals=normal_rows is not None,
            has_uvs=uvs is not None,
            has_colors=colors is not None,
        )

    @property
    def vertex_count(self) -> int:
        """Number of vertices."""
        return len(self.positions)

    @property
    def triangle_count(self) -> int:
        """Number of triangles."""
        return len(self.triangles)

    @cached_property
    def bounds(self) -> Float64:
        """The box around all vertices in the mesh's own frame, (2, 3) float64: minimum, maximum."""
        points = self.positions.astype(np.float64)
        return np.stack([points.min(axis=0), points.max(axis=0)])

    def with_tangents(self) -> Mesh:
        """Return the mesh with tangents computed from its texture coordinates; itself if it has tangents."""
        if self.has_tangents:
            return self
        tangents = fixed(tangents_of(self.positions, self.triangles, self.normals, self.uvs))
        return dataclasses.replace(self, tangents=tangents, has_tangents=True)


def merge(parts: Sequence[tuple[Mesh, Float64]], origin: ArrayLike = (0.0, 0.0, 0.0), name: str = "merged") -> Mesh:
    """Merge positions and normals of placed meshes into one mesh, for drawing shadow casters in one call.

    Parameters
    ----------
    parts : pairs of a mesh and its (4, 4) float64 transform to the world
    origin : (3,) world position that becomes the merged mesh's origin, subtracted in float64
    name : used in messages

    Returns
    -------
    A mesh relative to ``origin``; triangles of mirrored parts are reversed, which keeps their outer side.

    Raises
    ------
    InputError
        ``parts`` is empty.

    >>> triangle = Mesh.make([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    >>> merge([(triangle, np.eye(4)), (triangle, np.eye(4))]).triangle_count
    2
    """
    if not parts:
        raise InputError(f"mesh {name!r}: nothing to merge; pass at least one (mesh, transform) pair")
    centre = np.array(vec3(origin, f"mesh {name!r}: origin"))
    positions, normals, triangles, first = [], [], [], 0
    for mesh, transform in parts:
        positions.append(transform_points(transform, mesh.positions) - centre)
        linear = transform[:3, :3]
        normals.append(mesh.normals.astype(np.float64) @ np.linalg.inv(linear))
        faces = mesh.triangles + first
        triangles.append(faces[:, ::-1] if np.linalg.det(linear) < 0.0 else faces)
        first += mesh.vertex_count
    return Mesh.make(np.concatenate(positions), np.concatenate(triangles), np.concatenate(normals), name=name)


def _numbers(value: ArrayLike, columns: int, what: str) -> Float32:
    array = floats(value, what, f"an array of shape (n, {columns}) of numbers")
    if array.ndim != 2 or array.shape[1] != columns:
        raise InputError(f"{what}: expected shape (n, {columns}), got {array.shape}")
    if len(array) == 0:
        raise InputError(f"{what}: empty; a mesh needs at least one triangle")
    with np.errstate(over="ignore"):
        result = array.astype(np.float32)
    bad = ~np.isfinite(result).all(axis=1)
    if bad.any():
        first = int(np.argmax(bad))
        raise InputError(
            f"{what}: {int(bad.sum())} of {len(array)} rows are not finite, the first is row {first} "
            f"{array[first].tolist()}; export the mesh again or remove these rows"
        )
    return result


def _rows(value: ArrayLike, count: int, columns: tuple[int, ...], what: str) -> Float32:
    table = floats(value, what, f"an array of shape (n, {columns[-1]}) of numbers")
    width = table.shape[1] if table.ndim == 2 else columns[-1]
    array: Float32 = _numbers(table, width if width in columns else columns[-1], what)
    if len(array) != count:
        raise InputError(f"{what}: expected one row per vertex ({count}), got {len(array)}")
    return array


def _indices(value: ArrayLike, count: int, name: str) -> Int32:
    try:
        array = numbers(value, "triangles")
    except InputError:
        raise InputError(f"mesh {name!r}: triangles: expected an array of shape (m, 3) of integers") from None
    if array.ndim != 2 or array.shape[1] != 3:
        raise InputError(f"mesh {name!r}: triangles: expected shape (m, 3), got {array.shape}")
    if len(array) == 0:
        raise InputError(f"mesh {name!r}: triangles: empty; a mesh needs at least one triangle")
    if not np.issubdtype(array.dtype, np.integer):
        raise InputError(f"mesh {name!r}: triangles: expected integers, got {array.dtype}")
    bad = ((array < 0) | (array >= count)).any(axis=1)
    if bad.any():
        first = int(np.argmax(bad))
        raise InputError(
            f"mesh {name!r}: triangles: {int(bad.sum())} of {len(array)} name a vertex "
            f"outside 0..{count - 1}, the first is triangle {first} {array[first].tolist()}"
        )
    return array.astype(np.int32)


def _unit_normals(normals: Float32, points: Float32, faces: Int32) -> Float32:
    """Return normals of length 1; those of length zero are computed from the triangles."""
    wide = normals.astype(np.float64)
    lengths = np.linalg.norm(wide, axis=1, keepdims=True)
    result = (wide / np.maximum(lengths, 1e-30)).astype(np.float32)
    zero = lengths[:, 0] < 1e-20
    if zero.any():
        result[zero] = smooth_normals(points, faces)[zero]
    return np.asarray(result, dtype=np.float32)
