"""The drawn nodes of a glTF file."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from passgraph.errors import InputError
from passgraph.scene.gltf import local_matrix, walk_nodes
from passgraph.scene.gltf_data import GltfData
from passgraph.scene.gltf_materials import Coordinates, GltfMaterials
from passgraph.scene.gltf_mesh import arrays_of, skinned, uvs_of
from passgraph.scene.load_geometry import Arrays, PlacedMeshes
from passgraph.scene.material import Material
from passgraph.scene.matrices import Float64
from passgraph.scene.node import Node

# Copies of a node's mesh, and what places them; attributes that begin with "_" are an application's own.
_COPIES, _PLACES = "EXT_mesh_gpu_instancing", ("TRANSLATION", "ROTATION", "SCALE")
# Of nodes and primitives; everything else that a file names there is noted.
_READ = ("KHR_lights_punctual", _COPIES)


def nodes_of(data: GltfData, turn: Float64) -> tuple[list[Node], list[str]]:
    """Each primitive of each node of the default scene, and warnings about meshes; the rest is in ``data.notes``."""
    placed, materials = PlacedMeshes(data.file, turn, flat=True), GltfMaterials(data)
    walked = [
        (node, world @ copy)
        for node, world in walk_nodes(data.header, data.file)
        if "mesh" in node
        for copy in _copies(data, node, placed)
    ]
    primitives = [data.entry("meshes", node["mesh"]).get("primitives", []) for node, _ in walked]
    placed.check_count(sum(map(len, primitives)))
    for number, (node, world) in enumerate(walked):
        _note_extensions(data, node, f"node {node.get('name', number)!r}")
        for index, primitive in enumerate(primitives[number]):
            _place(data, placed, materials, node, world, primitive, (number, index))
    return placed.done(False)


def _copies(data: GltfData, node: dict[str, Any], placed: PlacedMeshes) -> list[Float64]:
    """Where a node's mesh stands, as seen from the node: once at its place, or a copy for each row of a table."""
    attributes = node.get("extensions", {}).get(_COPIES, {}).get("attributes", {})
    rows = {said.lower(): data.array(attributes[said]) for said in _PLACES if said in attributes}
    if not rows:
        return [np.eye(4)]
    counts = {len(table) for table in rows.values()}
    if len(counts) > 1:
        said = ", ".join(map(str, sorted(counts)))
        raise InputError(
            f"{data.file}: node {node.get('name', '')!r}: {_COPIES} has tables of {said} rows; expected one row in "
            "each for every copy"
        )
    placed.check_count(max(counts))
    return [local_matrix({said: table[i] for said, table in rows.items()}) for i in range(max(counts))]


def _place(
    data: GltfData, placed: PlacedMeshes, materials: GltfMaterials, node: dict[str, Any], world: Float64,
    primitive: dict[str, Any], place: tuple[int, int],
) -> None:  # fmt: skip
    """One primitive of one node: made if it is new, and put into the world."""
    mesh = data.entry("meshes", node["mesh"])
    label = str(mesh.get("name", f"mesh {node['mesh']}")) + (f".{place[1]}" if len(mesh["primitives"]) > 1 else "")
    name = str(node.get("name", label))
    weights = node.get("weights", mesh.get("weights", []))
    skin = node.get("skin")
    # a skin and weights of a node make another mesh of it
    key = (node["mesh"], place[1], tuple(weights), skin)
    material, coordinates = materials.read(primitive.get("material"))
    if key not in placed.meshes:
        where = f"mesh {label!r}"
        _note_extensions(data, primitive, where)
        arrays = arrays_of(data, primitive, weights, where)
        if arrays is None:
            placed.others += 1
            return
        arrays = _with_uvs(data, arrays, primitive, material, coordinates, where)
        if skin is not None:
            arrays = skinned(data, arrays, primitive, skin, where)
        placed.make(key, arrays, f"{data.file.name}:{label}")
    placed.put(key, world if skin is None else np.eye(4), material, name)


def _with_uvs(
    data: GltfData, arrays: Arrays, primitive: dict[str, Any], material: Material, coordinates: Coordinates, where: str
) -> Arrays:
    """The coordinates that its material's pictures are laid by."""
    uvs = uvs_of(data, primitive, coordinates.number, where)
    if uvs is None:
        if material.base_color_texture is not None or material.normal_texture is not None:
            data.notes.add(f"it has no TEXCOORD_{coordinates.number}, which its material asks for", where)
        return arrays
    return dataclasses.replace(arrays, uvs=coordinates.applied(uvs))


def _note_extensions(data: GltfData, entry: dict[str, Any], where: str) -> None:
    for extension in entry.get("extensions", {}):
        if extension not in _READ:
            data.notes.add(f"{extension} is not read", where)
