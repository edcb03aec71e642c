"""Primitives of a glTF file as arrays of triangles, in the pose that the file says: default weights, default joints.

Source: Khronos, glTF 2.0 specification, sections 3.7.2 (meshes), 3.7.3 (skins).
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from passgraph.errors import InputError
from passgraph.scene.gltf import world_of
from passgraph.scene.gltf_data import GltfData
from passgraph.scene.load_geometry import Arrays
from passgraph.scene.matrices import Float64

TRIANGLES, STRIP, FAN = 4, 5, 6


def arrays_of(data: GltfData, primitive: dict[str, Any], weights: list[float], where: str) -> Arrays | None:
    """One primitive with its morph targets mixed by ``weights``; None for points and lines."""
    attributes = primitive.get("attributes", {})
    mode = primitive.get("mode", TRIANGLES)
    if mode not in (TRIANGLES, STRIP, FAN) or "POSITION" not in attributes:
        return None
    positions = _floats(data, attributes["POSITION"], 3, f"{where}: POSITION")
    if "indices" in primitive:
        indices = data.array(primitive["indices"])[:, 0].astype(np.int64)
    else:
        indices = np.arange(len(positions))
    triangles = triangles_of(indices, mode)
    if not len(triangles):
        return None
    normals = _optional(data, attributes, "NORMAL", len(positions), where)
    colors = _optional(data, attributes, "COLOR_0", len(positions), where, (3, 4))
    targets = primitive.get("targets", [])
    for weight, target in zip(weights, targets, strict=False):
        if weight and "POSITION" in target:
            positions = positions + weight * _floats(data, target["POSITION"], 3, f"{where}: a target's POSITION")
        if weight and normals is not None and "NORMAL" in target:
            normals = normals + weight * _floats(data, target["NORMAL"], 3, f"{where}: a target's NORMAL")
    return Arrays(positions, triangles, normals, None, None if colors is None else np.clip(colors, 0.0, 1.0))


def triangles_of(indices: NDArray[np.int64], mode: int) -> NDArray[np.int64]:
    """(m, 3) of a list, a strip or a fan; every second triangle of a strip is turned round.

    >>> triangles_of(np.arange(5), STRIP).tolist(), triangles_of(np.arange(5), FAN).tolist()
    ([[0, 1, 2], [1, 3, 2], [2, 3, 4]], [[1, 2, 0], [2, 3, 0], [3, 4, 0]])
    """
    if mode == TRIANGLES:
        return indices[: len(indices) // 3 * 3].reshape(-1, 3)
    a, b, c = indices[:-2], indices[1:-1], indices[2:]
    if mode == FAN:
        return np.stack([b, c, np.full_like(b, indices[0] if len(indices) else 0)], axis=1)
    odd = np.arange(len(a)) % 2 == 1
    return np.stack([a, np.where(odd, c, b), np.where(odd, b, c)], axis=1)


def uvs_of(data: GltfData, primitive: dict[str, Any], number: int, where: str) -> Float64 | None:
    """A set of texture coordinates, v = 0 at the top row."""
    attributes = primitive.get("attributes", {})
    count = data.entry("accessors", attributes.get("POSITION")).get("count", 0)
    uvs = _optional(data, attributes, f"TEXCOORD_{number}", count, where, (2,))
    return None if uvs is None else np.nan_to_num(uvs, nan=0.0, posinf=0.0, neginf=0.0)


def skinned(data: GltfData, arrays: Arrays, primitive: dict[str, Any], skin: Any, where: str) -> Arrays:
    """The vertices where the joints of the default pose carry them, in the world.

    The place of the node that draws them does not count.
    """
    attributes = primitive.get("attributes", {})
    count = len(arrays.positions)
    matrices = _joint_matrices(data, data.entry("skins", skin))
    blended = np.zeros((count, 4, 4))
    total = np.zeros(count)
    for number in range(4):
        if f"JOINTS_{number}" not in attributes or f"WEIGHTS_{number}" not in attributes:
            break
        joints = data.array(attributes[f"JOINTS_{number}"]).astype(np.int64)
        weights = _floats(data, attributes[f"WEIGHTS_{number}"], 4, f"{where}: WEIGHTS_{number}")
        if joints.shape != (count, 4) or len(weights) != count or joints.max(initial=0) >= len(matrices):
            raise InputError(f"{where}: JOINTS_{number} or WEIGHTS_{number} do not fit its vertices and joints")
        for k in range(4):
            blended += weights[:, k, None, None] * matrices[joints[:, k]]
            total += weights[:, k]
    free = total < 1e-6
    blended[free] = np.eye(4)
    blended /= np.where(free, 1.0, total)[:, None, None]
    positions = np.einsum("nij,nj->ni", blended[:, :3, :3], arrays.positions) + blended[:, :3, 3]
    normals = arrays.normals
    if normals is not None:
        # cofactors turn normals, as an inverse transpose does, and need no division
        a, b, c = blended[:, 0, :3], blended[:, 1, :3], blended[:, 2, :3]
        cofactors = np.stack([np.cross(b, c), np.cross(c, a), np.cross(a, b)], axis=1)
        normals = np.einsum("nij,nj->ni", cofactors, normals)
    return Arrays(positions, arrays.triangles, normals, arrays.uvs, arrays.colors)


def _joint_matrices(data: GltfData, skin: dict[str, Any]) -> Float64:
    """From the mesh's frame at rest to the world, (joints, 4, 4)."""
    joints = skin.get("joints", [])
    worlds = np.stack([world_of(data.header, joint, data.file) for joint in joints])
    if "inverseBindMatrices" not in skin:
        return worlds
    table = _floats(data, skin["inverseBindMatrices"], 16, f"{data.file}: inverseBindMatrices")
    if len(table) < len(joints):
        raise InputError(f"{data.file}: a skin has {len(joints)} joints and {len(table)} inverse bind matrices")
    return worlds @ table[: len(joints)].reshape(-1, 4, 4).transpose(0, 2, 1)


def _floats(data: GltfData, index: Any, width: int, where: str) -> Float64:
    values = data.array(index)
    if values.shape[1] != width:
        raise InputError(f"{where} has {values.shape[1]} numbers a row; expected {width}")
    return values.astype(np.float64)


def _optional(
    data: GltfData, attributes: dict[str, Any], name: str, count: int, where: str, widths: tuple[int, ...] = (3,)
) -> Float64 | None:
    """An attribute of the right shape, or None: what is there and does not fit is noted."""
    if name not in attributes:
        return None
    values = data.array(attributes[name])
    if len(values) != count or values.shape[1] not in widths:
        data.notes.add(f"{name} has the shape {values.shape} and does not fit its {count} positions; left out", where)
        return None
    return values.astype(np.float64)
