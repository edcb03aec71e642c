"""Merge nodes that look alike into one mesh, to save draws."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

import passgraph as pg
from passgraph.records import dataclass

Float64 = NDArray[np.float64]
#: A part smaller than this fraction of the scene keeps a mesh of its own: float32 positions relative to a common origin
#: would round it by more than a thousandth of its size.
SMALLEST_PART = 1e-4


@dataclass(frozen=True, eq=False)
class Batch:
    """Triangles of one draw: their material, and the world position of the mesh's origin."""

    mesh: pg.Mesh
    material: pg.Material
    origin: Float64
    receives: bool = True


def is_textured(material: pg.Material) -> bool:
    """Return True if drawing it needs texture coordinates."""
    maps = (material.base_color_texture, material.normal_texture, material.height_texture)
    return any(texture is not None for texture in maps)


def batches(scene: pg.Scene) -> list[Batch]:
    """Return the scene in as few meshes as its materials allow; base colors become vertex colors.

    Positions are world positions relative to the batch's origin, subtracted in float64, so that a scene far from the
    world's origin keeps its shape.
    """
    box = scene.bounds()
    extent = float(np.linalg.norm(box[1] - box[0]))
    groups: dict[tuple[object, ...], list[pg.Node]] = {}
    for number, node in enumerate(scene.nodes):
        low, high = node.bounds
        alone = float(np.linalg.norm(high - low)) < SMALLEST_PART * extent
        look: object = id(node.material) if is_textured(node.material) else _plain(node.material)
        key = (look, node.material.double_sided, node.receives, number if alone else None)
        groups.setdefault(key, []).append(node)
    merged = [_batch(nodes) for nodes in groups.values()]
    # blended surfaces are drawn after all opaque ones
    return sorted(merged, key=lambda batch: batch.material.alpha_mode == "blend")


def bounds_of(nodes: Sequence[pg.Node]) -> Float64:
    """Return the world bounding box of nodes, (2, 3): minimum, maximum."""
    boxes = np.stack([node.bounds for node in nodes])
    return np.stack([boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)])


def _plain(material: pg.Material) -> tuple[object, ...]:
    cutoff = material.alpha_cutoff if material.alpha_mode == "mask" else None
    return (material.alpha_mode, cutoff, material.unlit)


def _batch(nodes: list[pg.Node]) -> Batch:
    material = nodes[0].material
    origin = bounds_of(nodes).mean(axis=0)
    mesh = merged(nodes, origin)
    leans = material.normal_texture is not None or material.height_texture is not None
    return Batch(mesh.with_tangents() if leans else mesh, material, origin, nodes[0].receives)


def merged(nodes: Iterable[pg.Node], origin: Float64) -> pg.Mesh:
    """Return one mesh of transformed nodes, relative to ``origin``, with base colors in the vertex colors."""
    columns: list[list[NDArray[np.floating]]] = [[], [], [], []]
    triangles, first = [], 0
    for node in nodes:
        linear, mesh = node.transform[:3, :3], node.mesh
        positions = mesh.positions.astype(np.float64) @ linear.T + (node.transform[:3, 3] - origin)
        normals = mesh.normals.astype(np.float64) @ np.linalg.inv(linear)
        parts: tuple[NDArray[np.floating], ...] = (
            positions,
            normals,
            mesh.uvs,
            mesh.colors * np.array(node.material.base_color, np.float32),
        )
        for column, part in zip(columns, parts, strict=True):
            column.append(part)
        faces = mesh.triangles + first
        triangles.append(faces[:, ::-1] if node.flips_winding else faces)
        first += mesh.vertex_count
    positions, normals, uvs, colors = (np.concatenate(column) for column in columns)
    return pg.Mesh.make(positions, np.concatenate(triangles), normals, uvs, colors, name="merged")
