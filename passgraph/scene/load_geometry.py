"""The arrays of one trimesh geometry as a `Mesh`, recentred where it is far from the origin."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
from numpy.typing import NDArray

from passgraph.errors import InputError
from passgraph.scene.material import srgb_to_linear
from passgraph.scene.matrices import Float64, translation
from passgraph.scene.mesh import Mesh
from passgraph.scene.normals import smooth_normals

# Beyond this ratio of distance to extent float32 loses more than 6 of its 24 bits. Nearer meshes keep their
# coordinates, so that borders which two meshes share stay equal to the bit.
FAR_OFFSET = 64.0


def mesh_of(geometry: Any, name: str, suffix: str, warnings: list[str]) -> tuple[Mesh, Float64]:
    """A checked mesh and the (4, 4) float64 matrix that puts it back where the file had it.

    Missing normals are smooth, and continuous across seams of the texture; in STL and glTF they are flat,
    because STL has nothing else and the glTF specification asks for it (section 3.7.2.1).
    """
    positions = np.asarray(geometry.vertices, dtype=np.float64)
    triangles = np.asarray(geometry.faces)
    uvs, colors, face_colors = _uvs(geometry), _vertex_colors(geometry, suffix), _face_colors(geometry)
    # trimesh keeps the normals of a file in its cache, and computes smooth ones for who asks for the property
    normals = geometry._cache.cache.get("vertex_normals")
    _check(positions, triangles, name)
    if normals is not None and np.shape(normals) != positions.shape:
        normals = None
    if face_colors is not None or (normals is None and suffix in (".stl", ".glb", ".gltf")):
        flat = normals is None and face_colors is None
        order = triangles.reshape(-1)
        positions, normals = positions[order], None if normals is None else np.asarray(normals)[order]
        uvs = None if uvs is None else uvs[order]
        colors = colors[order] if colors is not None else None
        if face_colors is not None:
            colors = np.repeat(face_colors, 3, axis=0)
        triangles = np.arange(len(order)).reshape(-1, 3)
        weld = not flat
    else:
        weld = True
    low, high = positions.min(axis=0), positions.max(axis=0)
    centre = np.zeros(3)
    if np.abs(np.stack([low, high])).max() > FAR_OFFSET * max(float((high - low).max()), 1e-30):
        centre = 0.5 * (low + high)
    local = positions - centre
    smooth = smooth_normals(local, triangles, weld=weld)
    if normals is None:
        normals = smooth
        given = False
    else:
        normals, given = _mended(np.asarray(normals, dtype=np.float64), smooth, name, warnings), True
    mesh = Mesh.make(local, triangles, normals, uvs, colors, name)
    return dataclasses.replace(mesh, has_normals=given), translation(centre)


def _check(positions: Float64, triangles: NDArray[Any], name: str) -> None:
    """Refuse what the arithmetic below cannot take, with the texts of `Mesh.make`."""
    count = len(positions)
    bad = (triangles < 0) | (triangles >= count)
    if not np.isfinite(positions).all() or bad.any():
        Mesh.make(positions, triangles, np.ones((count, 3)), name=name)
        raise InputError(f"mesh {name!r}: positions or triangles are broken")


def _mended(given: Float64, smooth: NDArray[np.float32], name: str, warnings: list[str]) -> Float64:
    lengths = np.linalg.norm(given, axis=1)
    bad = ~np.isfinite(lengths) | (lengths < 1e-12)
    if bad.any():
        warnings.append(f"mesh {name!r}: {int(bad.sum())} normals are zero or not finite; computed instead")
        given = np.where(bad[:, None], smooth, given)
    return given


def _uvs(geometry: Any) -> Float64 | None:
    """Texture coordinates with v = 0 at the top row; trimesh has v = 0 at the bottom for every format."""
    uvs = getattr(geometry.visual, "uv", None)
    if uvs is None or len(uvs) != len(geometry.vertices) or np.ndim(uvs) != 2:
        return None
    result = np.array(uvs, dtype=np.float64)[:, :2]
    result[:, 1] = 1.0 - result[:, 1]
    return np.nan_to_num(result, nan=0.0, posinf=0.0, neginf=0.0)


def _linear(colors: Any, is_linear: bool) -> Float64:
    table = np.asarray(colors)
    scale = float(np.iinfo(table.dtype).max) if np.issubdtype(table.dtype, np.integer) else 1.0
    values = np.clip(np.nan_to_num(table.astype(np.float64) / scale), 0.0, 1.0)
    if not is_linear:
        values[:, :3] = srgb_to_linear(values[:, :3])
    return values


def _vertex_colors(geometry: Any, suffix: str) -> Float64 | None:
    visual = geometry.visual
    is_linear = suffix in (".glb", ".gltf")
    if visual.kind == "vertex":
        return _linear(visual.vertex_colors, is_linear)
    table = getattr(visual, "vertex_attributes", {}).get("color")
    if table is not None and np.ndim(table) == 2 and len(table) == len(geometry.vertices):
        return _linear(table, is_linear)
    return None


def _face_colors(geometry: Any) -> Float64 | None:
    return _linear(geometry.visual.face_colors, False) if geometry.visual.kind == "face" else None
