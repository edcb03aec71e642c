"""A glTF file: header, tree of nodes, buffers, accessors and images, with limits checked before allocation."""

from __future__ import annotations

import binascii
import struct
from base64 import b64decode
from dataclasses import dataclass, field
from math import pi
from pathlib import Path
from typing import Any
from urllib.parse import unquote_to_bytes

import numpy as np
from numpy.typing import NDArray

from passgraph.errors import InputError
from passgraph.reading import parsed_json
from passgraph.scene.camera import DEFAULT_FOV_RAD, Camera, NamedCamera
from passgraph.scene.lights import Light, exposed
from passgraph.scene.matrices import Float64
from passgraph.scene.model_files import FolderReader, Notes
from passgraph.scene.projection import STEP_BACK

# Most values in accessors without a buffer: these are zeros that take no bytes in the file, so its size does not limit
# them.
MAX_UNBACKED_VALUES = 1 << 24
UNREADABLE = ("KHR_draco_mesh_compression", "EXT_meshopt_compression")
# Extensions that a file may require; they are read at least as far as the picture needs.
READABLE = (
    "EXT_mesh_gpu_instancing",
    "EXT_texture_webp",
    "KHR_lights_punctual",
    "KHR_materials_pbrSpecularGlossiness",
    "KHR_materials_unlit",
    "KHR_mesh_quantization",
    "KHR_texture_transform",
)


def read_header(file: Path, raw: bytes) -> tuple[dict[str, Any], bytes]:
    """Return the JSON of a .gltf or .glb file's bytes, and its binary chunk.

    Raises
    ------
    InputError
        Not JSON, not a GLB container, or truncated.
    """
    binary = b""
    if file.suffix.lower() == ".glb":
        if raw[:4] != b"glTF" or len(raw) < 20:
            raise InputError(f"{file}: not a GLB file (it does not start with 'glTF' and a header)")
        version, total, length = struct.unpack("<III", raw[4:16])
        if version != 2:
            raise InputError(f"{file}: glTF version {version}; expected 2, convert the file")
        if total > len(raw) or 20 + length > len(raw):
            raise InputError(f"{file}: truncated, {len(raw)} of {total} bytes are there")
        binary = _binary(raw[20 + length : total])
        raw = raw[20 : 20 + length]
    try:
        header = parsed_json(raw)
    except ValueError as error:
        raise InputError(f"{file}: its JSON cannot be read ({str(error)[:80]})") from None
    if not isinstance(header, dict) or not isinstance(header.get("asset"), dict):
        raise InputError(f"{file}: not a glTF file (no 'asset' entry)")
    version_text = str(header["asset"].get("version", "2.0"))
    if not version_text.startswith("2"):
        raise InputError(f"{file}: glTF version {version_text}; expected 2.0, convert the file")
    return header, binary


def _binary(rest: bytes) -> bytes:
    """Return the BIN chunk, the first after the JSON, without the padding beyond its buffer."""
    if len(rest) < 8 or rest[4:8] != b"BIN\0":
        return b""
    return rest[8 : 8 + struct.unpack("<I", rest[:4])[0]]


def check_header(header: dict[str, Any], file: Path) -> None:
    """Raise InputError for compressed geometry, excessive counts and node cycles."""
    for extension in UNREADABLE:
        if extension in header.get("extensionsRequired", []):
            raise InputError(
                f"{file}: compressed with {extension}, which is not read; save it uncompressed, with glTF-Transform or "
                "Blender"
            )
    for extension in header.get("extensionsRequired", []):
        if extension not in READABLE:
            raise InputError(
                f"{file}: requires {extension}, which is not read; expected no other than {', '.join(READABLE)}; "
                "save it without"
            )
    for index, accessor in enumerate(header.get("accessors", [])):
        accessor = accessor if isinstance(accessor, dict) else {"count": accessor}
        count = accessor.get("count", 0)
        limit = MAX_UNBACKED_VALUES if "bufferView" not in accessor else 1 << 31
        if not isinstance(count, int) or not 0 <= count <= limit:
            raise InputError(f"{file}: accessor {index} has the absurd count {count!r}")
    walk_nodes(header, file)


def local_matrix(node: dict[str, Any]) -> Float64:
    """Return the matrix of a node: its own, or translation * rotation * scale."""
    if "matrix" in node:
        return np.array(node["matrix"], dtype=np.float64).reshape(4, 4).T
    x, y, z, w = np.array(node.get("rotation", (0, 0, 0, 1)), dtype=np.float64)
    result = np.eye(4)
    result[:3, :3] = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    result[:3, :3] *= np.array(node.get("scale", (1, 1, 1)), dtype=np.float64)
    result[:3, 3] = node.get("translation", (0, 0, 0))
    return result


def world_of(header: dict[str, Any], index: int, file: Path) -> Float64:
    """Return the world matrix of a node, also outside the default scene, where joints may be."""
    nodes = header.get("nodes", [])
    parents = {child: number for number, node in enumerate(nodes) for child in node.get("children", [])}
    world = np.eye(4)
    for _ in range(len(nodes)):
        world = local_matrix(nodes[index]) @ world
        if index not in parents:
            return world
        index = parents[index]
    raise InputError(f"{file}: node {index} is below itself; glTF nodes form a tree")


def _orphans(nodes: list[dict[str, Any]]) -> list[int]:
    children = {child for node in nodes for child in node.get("children", [])}
    return [number for number in range(len(nodes)) if number not in children]


def walk_nodes(header: dict[str, Any], file: Path) -> list[tuple[dict[str, Any], Float64]]:
    """Return the nodes of the default scene with world matrices, in the file's order, parents before children.

    A node has one parent, so a repeat is an error. In a file without scenes, all nodes are returned.
    """
    nodes = header.get("nodes", [])
    scenes = header.get("scenes", [])
    placed: list[tuple[dict[str, Any], Float64]] = []
    visited: set[int] = set()
    try:
        roots = scenes[header.get("scene", 0)].get("nodes", []) if scenes else _orphans(nodes)
        stack = [(index, np.eye(4)) for index in reversed(roots)]
        while stack:
            index, parent = stack.pop()
            if index in visited:
                raise InputError(f"{file}: node {index} is reached twice; glTF nodes form a tree")
            visited.add(index)
            world = parent @ local_matrix(nodes[index])
            placed.append((nodes[index], world))
            stack += [(child, world) for child in reversed(nodes[index].get("children", []))]
    except (IndexError, KeyError, TypeError, ValueError, AttributeError) as error:
        raise InputError(f"{file}: its tree of nodes is broken ({error})") from None
    return placed


def cameras_of(data: GltfData, bounds: Float64, turn: Float64) -> list[NamedCamera]:
    """Return the cameras of the file, in the order of its nodes; ``turn`` is (4, 4), the file's axes to the scene's.

    Targets are at the depth of the middle of ``bounds``, (2, 3), which also give a missing far plane.
    """
    result = list[NamedCamera]()
    for node, world in walk_nodes(data.header, data.file):
        if "camera" not in node:
            continue
        entry = data.entry("cameras", node["camera"])
        kind = str(entry.get("type"))
        lens = entry.get(kind)
        if kind not in ("perspective", "orthographic") or not isinstance(lens, dict):
            continue
        world = turn @ world
        eye = world[:3, 3]
        forward, up = -world[:3, 2], world[:3, 1]
        forward = forward / np.linalg.norm(forward)
        depth = float((bounds.mean(axis=0) - eye) @ forward)
        reach = float(np.linalg.norm(np.maximum(np.abs(bounds[0] - eye), np.abs(bounds[1] - eye))))
        near = float(lens.get("znear", reach * 1e-3))
        far = float(lens.get("zfar", max(reach * 1.05, near * 10.0)))
        height = 2.0 * abs(float(lens["ymag"])) if kind == "orthographic" else None
        if height is not None and near <= 0.0:  # parallel rays see the same from farther back
            back = STEP_BACK * (far - near) - near
            eye, depth, near, far = eye - back * forward, depth + back, near + back, far + back
        target = eye + forward * (depth if depth > 0.0 else max(reach, 1.0))
        fov = DEFAULT_FOV_RAD if height is not None else lens["yfov"]
        camera = Camera(tuple(eye.tolist()), tuple(target.tolist()), tuple(up.tolist()), fov, near, far, height)
        lens = str(entry.get("name", ""))
        name = str(node.get("name", lens or f"camera {len(result) + 1}"))
        result.append(NamedCamera(name, camera, "" if lens == name else lens))
    return result


def lights_of(data: GltfData, bounds: Float64, turn: Float64) -> list[Light]:
    """Return the lights of KHR_lights_punctual.

    The format has no size of lights: a directional light gets the tangent 0.02, others 1/50 of the scene's diagonal.
    It has no exposure for its photometric units either: intensities are scaled by one factor, so that all lights
    together show a white surface in the middle of the scene as 1.
    """
    table = data.header.get("extensions", {}).get("KHR_lights_punctual", {}).get("lights", [])
    radius = float(np.linalg.norm(bounds[1] - bounds[0])) / 50.0
    lights: list[Light] = []
    for node, world in walk_nodes(data.header, data.file):
        reference = node.get("extensions", {}).get("KHR_lights_punctual", {}).get("light")
        if reference is None:
            continue
        entry = data.entry("lights", reference, table)
        color, strength = entry.get("color", (1.0, 1.0, 1.0)), float(entry.get("intensity", 1.0))
        world = turn @ world
        name, place = str(entry.get("name", node.get("name", "light"))), world[:3, 3]
        if entry.get("type") == "directional":
            lights.append(Light.directional(-world[:3, 2], color, strength, name=name))
        elif entry.get("type") == "spot":
            cone = entry.get("spot", {})
            outer = float(cone.get("outerConeAngle", pi / 4))
            inner = float(cone.get("innerConeAngle", 0.0))
            lights.append(Light.spot(place, -world[:3, 2], color, strength, radius, inner, outer, name))
        else:
            lights.append(Light.point(place, color, strength, radius, name))
    return exposed(lights, bounds)


TYPES = {5120: "i1", 5121: "u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}


@dataclass(frozen=True)
class GltfData:
    """A glTF file and the files that it names.

    Attributes
    ----------
    file : the path, for messages
    header : its JSON
    binary : the BIN chunk of a .glb file, else empty
    folder : reader of the files that it names
    notes : missing and unsupported parts
    """

    file: Path
    header: dict[str, Any]
    binary: bytes
    folder: FolderReader
    notes: Notes
    _buffers: dict[int, bytes] = field(default_factory=dict)

    def entry(self, key: str, index: Any, table: list[Any] | None = None) -> dict[str, Any]:
        """Return an object of a list in the header, or of another ``table``; raise InputError if it is missing."""
        table = self.header.get(key, []) if table is None else table
        if not isinstance(index, int) or isinstance(index, bool) or not 0 <= index < len(table):
            raise InputError(f"{self.file}: names entry {index!r} of {key}, which is not there")
        entry = table[index]
        if not isinstance(entry, dict):
            raise InputError(f"{self.file}: entry {index} of {key} is not an object")
        return entry

    def array(self, index: Any) -> NDArray[Any]:
        """Return an accessor as (count, components); normalized integers as float64 in [-1, 1] or [0, 1]."""
        accessor = self.entry("accessors", index)
        dtype, width, count = _layout(accessor, f"{self.file}: accessor {index}")
        if "bufferView" in accessor:  # its length is checked before anything is allocated
            values = self._rows(accessor["bufferView"], accessor.get("byteOffset", 0), dtype, count, width, index)
        else:
            values = np.zeros((count, width), dtype)
        if "sparse" in accessor:
            values = self._sparse(values.copy(), accessor["sparse"], index)
        if accessor.get("normalized") and dtype.kind in "iu":
            return np.maximum(values.astype(np.float64) / np.iinfo(dtype).max, -1.0)
        return values

    def _sparse(self, values: NDArray[Any], sparse: dict[str, Any], index: Any) -> NDArray[Any]:
        """Replace some rows of an accessor (section 3.6.2.3)."""
        count, where, stored_values = sparse["count"], sparse["indices"], sparse["values"]
        places = self._rows(
            where["bufferView"], where.get("byteOffset", 0), np.dtype(TYPES[where["componentType"]]), count, 1, index
        )[:, 0]
        if count and int(places.max()) >= len(values):
            raise InputError(
                f"{self.file}: accessor {index}: a sparse row is {places.max()}, and there are {len(values)}"
            )
        width = values.shape[1]
        rows = self._rows(
            stored_values["bufferView"], stored_values.get("byteOffset", 0), values.dtype, count, width, index
        )
        values[places.astype(np.int64)] = rows
        return values

    def _rows(self, view: Any, offset: int, dtype: np.dtype[Any], count: int, width: int, index: Any) -> NDArray[Any]:
        data, stride = self._view(view)
        row = dtype.itemsize * width
        stride = stride or row
        needed = offset + stride * (count - 1) + row if count else 0
        if offset < 0 or count < 0 or stride < row or needed > len(data):
            raise InputError(
                f"{self.file}: accessor {index} needs {needed} bytes of buffer view {view}, which has {len(data)}; "
                "the file is corrupt or truncated"
            )
        return np.ndarray((count, width), dtype, data, offset, (stride, dtype.itemsize))

    def _view(self, index: Any) -> tuple[memoryview, int]:
        view = self.entry("bufferViews", index)
        data = self._buffer(view.get("buffer"))
        start, length = view.get("byteOffset", 0), view.get("byteLength", 0)
        if not 0 <= start <= start + length <= len(data):
            raise InputError(
                f"{self.file}: buffer view {index} ends at byte {start + length} of a buffer of {len(data)}; "
                "the file is corrupt or truncated"
            )
        return memoryview(data)[start : start + length], view.get("byteStride", 0)

    def _buffer(self, index: Any) -> bytes:
        if index not in self._buffers:
            uri = self.entry("buffers", index).get("uri")
            if uri is None:
                self._buffers[index] = self.binary
            else:
                self._buffers[index] = self._fetched(str(uri))
        return self._buffers[index]

    def _fetched(self, uri: str) -> bytes:
        if uri.startswith("data:"):
            try:
                return bytes_of(uri)
            except ValueError as error:
                raise InputError(f"{self.file}: a buffer's data: address cannot be read ({error})") from None
        data = self.folder.read(uri)
        if data is None:
            if self.folder.refused:
                raise InputError(f"{self.file}: {self.folder.refused[0]}")
            raise InputError(f"{self.file}: its file {self.folder.missing[0]} is missing beside it")
        return data

    def picture(self, index: Any, what: str) -> bytes | None:
        """Return the bytes of an image; None with a note if it is missing, since surfaces can be drawn without it."""
        image = self.entry("images", index)
        uri = image.get("uri")
        if uri is None:
            return bytes(self._view(image.get("bufferView"))[0])
        if not str(uri).startswith("data:"):
            return self.folder.read(str(uri))
        try:
            return bytes_of(str(uri))
        except ValueError as error:
            self.notes.add(f"its data: address cannot be read ({error}); left out", what)
            return None


def _layout(accessor: dict[str, Any], where: str) -> tuple[np.dtype[Any], int, int]:
    kind, component = accessor.get("type"), accessor.get("componentType")
    if kind not in WIDTHS or component not in TYPES:
        raise InputError(f"{where} has the unknown type {kind!r} of components {component!r}")
    return np.dtype(TYPES[component]), WIDTHS[kind], accessor.get("count", 0)


def bytes_of(uri: str) -> bytes:
    """Decode a ``data:`` address (RFC 2397).

    >>> bytes_of("data:image/png;base64,aGk="), bytes_of("data:,hi%21")
    (b'hi', b'hi!')
    """
    head, comma, body = uri[5:].partition(",")
    if not comma:
        raise ValueError("it has no comma")
    if not head.endswith(";base64"):
        return unquote_to_bytes(body)
    try:
        return b64decode(unquote_to_bytes(body), validate=True)
    except binascii.Error as error:
        raise ValueError(f"{error}") from None
