"""Triangle meshes: arrays that have been checked once and can be drawn as they are."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from passgraph.arguments import numbers, shown, string
from passgraph.cached import cached_property
from passgraph.errors import InputError
from passgraph.graph.geometry import Fixed, fixed
from passgraph.scene.matrices import Float64, floats, transform_points, vec3
from passgraph.scene.normals import smooth_normals, tangents_of

Float32 = NDArray[np.float32]
Int32 = NDArray[np.int32]
#: Arrays of a mesh and the numbers in a row of each.
COLUMNS = {"positions": 3, "triangles": 3, "normals": 3, "uvs": 2, "colors": 4, "tangents": 4}


@dataclass(frozen=True, eq=False)
class Mesh(Fixed):
    """A triangle mesh in its own frame; build it with `Mesh.make`, which checks and completes it.

    Attributes
    ----------
    positions : (n, 3) float32, scene units, local to the node's transform
    triangles : (m, 3) int32 vertex numbers, counter-clockwise seen from outside
    normals : (n, 3) float32 unit vectors; computed where the source had none (``has_normals`` is False)
    uvs : (n, 2) float32, v = 0 at the top row of the texture; zeros where ``has_uvs`` is False
    colors : (n, 4) float32 linear RGBA; white where ``has_colors`` is False
    tangents : (n, 4) float32, see `passgraph.scene.normals.tangents_of`; (1, 0, 0, 1) where ``has_tangents``
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
        """Check the arrays, fill in what is missing, and freeze them.

        Parameters
        ----------
        positions : (n, 3) numbers, scene units
        triangles : (m, 3) integers in [0, n)
        normals : (n, 3) numbers, any length but zero; None computes smooth ones
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
        given = None if normals is None else _rows(normals, count, (3,), f"mesh {name!r}: normals")
        coordinates = np.zeros((count, 2), np.float32)
        if uvs is not None:
            coordinates = _rows(uvs, count, (2,), f"mesh {name!r}: uvs")
        tint = np.ones((count, 4), np.float32)
        if colors is not None:
            table = _rows(colors, count, (3, 4), f"mesh {name!r}: colors")
            tint[:, : table.shape[1]] = table
        directions = smooth_normals(points, faces) if given is None else _unit_normals(given, points, faces)
        flat = np.tile(np.array([1, 0, 0, 1], np.float32), (count, 1))
        return cls(
            fixed(points),
            fixed(faces),
            fixed(directions),
            fixed(coordinates),
            fixed(tint),
            fixed(flat),
            name,
            has_normals=given is not None,
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
        """The box round all vertices in the mesh's own frame, (2, 3) float64: minimum, maximum."""
        points = self.positions.astype(np.float64)
        return np.stack([points.min(axis=0), points.max(axis=0)])

    def with_tangents(self) -> Mesh:
        """The same mesh with tangents computed from its texture coordinates (itself if it has them)."""
        if self.has_tangents:
            return self
        tangents = fixed(tangents_of(self.positions, self.triangles, self.normals, self.uvs))
        return dataclasses.replace(self, tangents=tangents, has_tangents=True)


def merge(parts: Sequence[tuple[Mesh, Float64]], origin: ArrayLike = (0.0, 0.0, 0.0), name: str = "merged") -> Mesh:
    """One mesh of positions and normals from many placed ones, for drawing shadow casters in one call.

    Parameters
    ----------
    parts : pairs of a mesh and its (4, 4) float64 transform to the world
    origin : (3,) world position that becomes the merged mesh's origin, subtracted in float64
    name : used in messages

    Returns
    -------
    A mesh relative to ``origin``; triangles of mirrored parts are turned round so that outside stays outside.

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


def _unit_normals(given: Float32, points: Float32, faces: Int32) -> Float32:
    """Normals of length 1; those of length zero are computed from the triangles instead."""
    wide = given.astype(np.float64)
    lengths = np.linalg.norm(wide, axis=1, keepdims=True)
    result = (wide / np.maximum(lengths, 1e-30)).astype(np.float32)
    zero = lengths[:, 0] < 1e-20
    if zero.any():
        result[zero] = smooth_normals(points, faces)[zero]
    return np.asarray(result, dtype=np.float32)
