"""Materials, meshes and drawn nodes of a glTF file."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass, field
from math import cos, sin
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from passgraph.errors import InputError
from passgraph.scene.gltf import GltfData, local_matrix, walk_nodes, world_of
from passgraph.scene.materials import AlphaMode, ColorSpace, Magnify, Material, Minify, Node, Texture, Wrap
from passgraph.scene.matrices import Float64
from passgraph.scene.model_data import Arrays, PlacedMeshes, rgba, texture_of

GLOSSY = "KHR_materials_pbrSpecularGlossiness"
UNLIT = "KHR_materials_unlit"
TRANSFORM = "KHR_texture_transform"
WEBP = "EXT_texture_webp"
# glTF 2.0, section 5.26: filters of a sampler that read one texel. Others are linear, with mipmaps for minification.
MAGNIFY: dict[Any, Magnify] = {9728: "nearest"}
MINIFY: dict[Any, Minify] = {9728: "nearest", 9984: "nearest mipmap nearest", 9986: "nearest mipmap linear"}
# wrap modes of a sampler (OpenGL's numbers); other numbers repeat
WRAPS: dict[Any, Wrap] = {33071: "clamp", 33648: "mirror", 10497: "repeat"}


@dataclass(frozen=True)
class Coordinates:
    """The mapping of a material's textures onto a mesh: a set of coordinates and the (2, 3) matrix applied to it."""

    number: int = 0
    matrix: tuple[tuple[float, float, float], tuple[float, float, float]] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0))

    def applied(self, uvs: Float64) -> Float64:
        transformed: Float64 = uvs @ np.array(self.matrix)[:, :2].T + np.array(self.matrix)[:, 2]
        return transformed


@dataclass
class GltfMaterials:
    """Read materials and pictures, each once."""

    data: GltfData
    _made: dict[int | None, tuple[Material, Coordinates]] = field(default_factory=dict)
    _textures: dict[tuple[Any, ColorSpace], Texture | None] = field(default_factory=dict)

    def read(self, index: int | None) -> tuple[Material, Coordinates]:
        """Return a material, and the coordinates of its pictures; without an index the specification's white one."""
        if index not in self._made:
            self._made[index] = self._read({} if index is None else self.data.entry("materials", index), index)
        return self._made[index]

    def _read(self, source: dict[str, Any], index: int | None) -> tuple[Material, Coordinates]:
        name = str(source.get("name") or ("default" if index is None else f"material {index}"))
        where = f"material {name!r}"
        self._note_unshown(source, where)
        color, picture = self._base(source)
        bump = source.get("normalTexture")
        own = self._coordinates(picture if picture is not None else bump, where)
        if picture is not None and bump is not None and self._coordinates(bump, where) != own:
            self.data.notes.add("its normal map has other coordinates than its base colour; left out", where)
            bump = None
        mode = str(source.get("alphaMode", "OPAQUE")).lower()
        if mode not in ("opaque", "mask", "blend"):
            self.data.notes.add(f"unknown alpha mode {mode!r}, opaque is used", where)
            mode = "opaque"
        material = Material(
            name,
            rgba(color),
            self._texture(picture, "srgb", f"{name} base colour"),
            self._texture(bump, "linear", f"{name} normal map"),
            alpha_mode=cast(AlphaMode, mode),
            alpha_cutoff=max(float(source.get("alphaCutoff", 0.5)), 0.0),
            double_sided=bool(source.get("doubleSided", False)),
            unlit=UNLIT in source.get("extensions", {}),
        )
        return material, own

    def _base(self, source: dict[str, Any]) -> tuple[Any, dict[str, Any] | None]:
        """Return the color and the picture of diffuse reflection."""
        glossy = source.get("extensions", {}).get(GLOSSY)
        if glossy is not None:
            return glossy.get("diffuseFactor", (1, 1, 1, 1)), glossy.get("diffuseTexture")
        matt = source.get("pbrMetallicRoughness", {})
        return matt.get("baseColorFactor", (1, 1, 1, 1)), matt.get("baseColorTexture")

    def _note_unshown(self, source: dict[str, Any], where: str) -> None:
        add = self.data.notes.add
        if any(source.get("emissiveFactor", ())):
            add("its emissive light is not shown", where)
        matt = source.get("pbrMetallicRoughness", {})
        # The factor's default is 1, which most files without it do not mean.
        if matt.get("metallicFactor", 0.0) or "metallicRoughnessTexture" in matt:
            add("its metal is not shown; it looks diffuse", where)
        if "occlusionTexture" in source:
            add("its occlusion map is not used", where)
        if source.get("normalTexture", {}).get("scale", 1.0) != 1.0:
            add("the scale of its normal map is not applied", where)
        for extension in source.get("extensions", {}):
            if extension not in (GLOSSY, UNLIT):
                add(f"{extension} is not shown", where)

    def _coordinates(self, picture: dict[str, Any] | None, where: str) -> Coordinates:
        if picture is None:
            return Coordinates()
        change = picture.get("extensions", {}).get(TRANSFORM, {})
        for extension in picture.get("extensions", {}):
            if extension != TRANSFORM:
                self.data.notes.add(f"{extension} of a texture is not applied", where)
        (x, y), (sx, sy) = change.get("offset", (0.0, 0.0)), change.get("scale", (1.0, 1.0))
        c, s = cos(change.get("rotation", 0.0)), sin(change.get("rotation", 0.0))
        return Coordinates(
            change.get("texCoord", picture.get("texCoord", 0)), ((c * sx, s * sy, x), (-s * sx, c * sy, y))
        )

    def _texture(self, picture: dict[str, Any] | None, space: ColorSpace, what: str) -> Texture | None:
        if picture is None:
            return None
        key = (picture.get("index"), space)
        if key not in self._textures:
            self._textures[key] = self._decoded(self.data.entry("textures", picture.get("index")), space, what)
        return self._textures[key]

    def _decoded(self, texture: dict[str, Any], space: ColorSpace, what: str) -> Texture | None:
        extensions = texture.get("extensions", {})
        source = extensions.get(WEBP, {}).get("source", texture.get("source"))
        if source is None:
            named = ", ".join(extensions) or "no source"
            self.data.notes.add(f"its picture is not read ({named}); left out", what)
            return None
        data = self.data.picture(source, what)
        if data is None:
            return None
        sampler = self.data.entry("samplers", texture["sampler"]) if "sampler" in texture else {}
        decoded = texture_of(data, space, what, self.data.notes, str(self.data.file), _wrap(sampler))
        magnify = MAGNIFY.get(sampler.get("magFilter"), "linear")
        minify = MINIFY.get(sampler.get("minFilter"), "linear mipmap linear")
        return decoded and dataclasses.replace(decoded, magnify=magnify, minify=minify)


def _wrap(sampler: dict[str, Any]) -> Wrap | tuple[Wrap, Wrap]:
    across, down = (WRAPS.get(sampler.get(key, 10497), "repeat") for key in ("wrapS", "wrapT"))
    return across if across == down else (across, down)


TRIANGLES, STRIP, FAN = 4, 5, 6


def arrays_of(data: GltfData, primitive: dict[str, Any], weights: list[float], where: str) -> Arrays | None:
    """Return a primitive with its morph targets blended by ``weights``; None for points and lines."""
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
    """Return the triangles, (m, 3), of a list, a strip or a fan; every second triangle of a strip is reversed.

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
    """Return a set of texture coordinates, v = 0 at the top row."""
    attributes = primitive.get("attributes", {})
    count = data.entry("accessors", attributes.get("POSITION")).get("count", 0)
    uvs = _optional(data, attributes, f"TEXCOORD_{number}", count, where, (2,))
    return None if uvs is None else np.nan_to_num(uvs, nan=0.0, posinf=0.0, neginf=0.0)


def skinned(data: GltfData, arrays: Arrays, primitive: dict[str, Any], skin: Any, where: str) -> Arrays:
    """Return the vertices transformed by the joints of the default pose, in the world.

    The transform of the node that draws them is ignored, as in the specification. Joints that mirror reverse the
    triangles, so that their outer sides stay outside.
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
    mirrored = np.linalg.det(blended[:, :3, :3]) < 0.0
    triangles = np.where(mirrored[arrays.triangles[:, :1]], arrays.triangles[:, ::-1], arrays.triangles)
    normals = arrays.normals
    if normals is not None:
        # the cofactor matrix transforms normals as the inverse transpose does, up to a factor: the determinant
        a, b, c = blended[:, 0, :3], blended[:, 1, :3], blended[:, 2, :3]
        cofactors = np.stack([np.cross(b, c), np.cross(c, a), np.cross(a, b)], axis=1)
        normals = np.einsum("nij,nj->ni", cofactors, normals) * np.where(mirrored, -1.0, 1.0)[:, None]
    return Arrays(positions, triangles, normals, arrays.uvs, arrays.colors)


def _joint_matrices(data: GltfData, skin: dict[str, Any]) -> Float64:
    """Return the matrices from the mesh's rest frame to the world, (joints, 4, 4)."""
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
    """Return an attribute of the right shape, or None, with a note if it has another shape."""
    if name not in attributes:
        return None
    values = data.array(attributes[name])
    if len(values) != count or values.shape[1] not in widths:
        data.notes.add(f"{name} has the shape {values.shape} and does not fit its {count} positions; left out", where)
        return None
    return values.astype(np.float64)


# The extension for instances of a node's mesh, and their transform attributes; names with "_" are the application's.
_COPIES, _PLACES = "EXT_mesh_gpu_instancing", ("TRANSLATION", "ROTATION", "SCALE")
# Extensions of nodes and primitives that are read; others are noted.
_READ = ("KHR_lights_punctual", _COPIES)


def nodes_of(data: GltfData, turn: Float64) -> tuple[list[Node], list[str]]:
    """Return the primitives of all nodes of the default scene, and warnings about meshes; see also ``data.notes``."""
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
    return placed.done()


def _copies(data: GltfData, node: dict[str, Any], placed: PlacedMeshes) -> list[Float64]:
    """Return the placements of a node's mesh, relative to the node: one, or one for each row of an instancing table."""
    attributes = node.get("extensions", {}).get(_COPIES, {}).get("attributes", {})
    rows = {
        counts_text.lower(): data.array(attributes[counts_text]) for counts_text in _PLACES if counts_text in attributes
    }
    if not rows:
        return [np.eye(4)]
    counts = {len(table) for table in rows.values()}
    if len(counts) > 1:
        counts_text = ", ".join(map(str, sorted(counts)))
        raise InputError(
            f"{data.file}: node {node.get('name', '')!r}: {_COPIES} has tables of {counts_text} rows; expected one row "
            "in each for every copy"
        )
    placed.check_count(max(counts))
    return [local_matrix({attribute: table[i] for attribute, table in rows.items()}) for i in range(max(counts))]


def _place(
    data: GltfData, placed: PlacedMeshes, materials: GltfMaterials, node: dict[str, Any], world: Float64,
    primitive: dict[str, Any], place: tuple[int, int],
) -> None:  # fmt: skip
    """Place a primitive of a node in the world, and read it at its first use."""
    mesh = data.entry("meshes", node["mesh"])
    label = str(mesh.get("name", f"mesh {node['mesh']}")) + (f".{place[1]}" if len(mesh["primitives"]) > 1 else "")
    name = str(node.get("name", label))
    weights = node.get("weights", mesh.get("weights", []))
    skin = node.get("skin")
    # the mesh depends on the node's skin and weights
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
    """Return the arrays with the texture coordinates for the material's pictures."""
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
