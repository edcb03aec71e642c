"""What glTF files and MTL lines mean, held against the numbers of their specifications worked out by hand."""

from __future__ import annotations

import base64
import io
import json
import logging
import struct
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image, ImageFile

from passgraph.errors import InputError
from passgraph.scene import Scene

FLOAT, SHORT, BYTE = 5126, 5123, 5121
KINDS = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4", 16: "MAT4"}
TRIANGLE = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], np.float32)
PIXELS = np.array([[[255, 0, 0], [0, 255, 0]], [[0, 0, 255], [255, 255, 255]]], np.uint8)


def png(pixels: Any = PIXELS) -> str:
    stream = io.BytesIO()
    Image.fromarray(np.asarray(pixels, np.uint8)).save(stream, "PNG")
    return "data:image/png;base64," + base64.b64encode(stream.getvalue()).decode()


class File:
    """A glTF file in the making."""

    def __init__(self) -> None:
        self.blob = b""
        self.header: dict[str, Any] = {"asset": {"version": "2.0"}, "bufferViews": [], "accessors": []}

    def view(self, table: Any) -> int:
        data = np.ascontiguousarray(table).tobytes()
        self.header["bufferViews"].append({"buffer": 0, "byteOffset": len(self.blob), "byteLength": len(data)})
        self.blob += data + bytes(-len(data) % 4)
        return len(self.header["bufferViews"]) - 1

    def accessor(self, table: Any, component: int = FLOAT, **more: Any) -> int:
        types = {FLOAT: np.float32, SHORT: np.uint16, BYTE: np.uint8}
        array = np.asarray(table, types[component])
        width = array.shape[1] if array.ndim == 2 else 1
        entry = {"bufferView": self.view(array), "componentType": component, "count": len(array), "type": KINDS[width]}
        self.header["accessors"].append({**entry, **more})
        return len(self.header["accessors"]) - 1

    def load(self, folder: Path, primitive: dict[str, Any], node: dict[str, Any] | None = None, **more: Any) -> Scene:
        self.header |= {
            "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0, "name": "thing", **(node or {})}],
            "meshes": [{"name": "body", "primitives": [primitive]}], **more,
        }  # fmt: skip
        uri = "data:application/octet-stream;base64," + base64.b64encode(self.blob).decode()
        self.header["buffers"] = [{"uri": uri, "byteLength": len(self.blob)}]
        path = folder / "m.gltf"
        path.write_text(json.dumps(self.header))
        return Scene.load(path, ground=False)


def plain(folder: Path, material: dict[str, Any] | None = None, uvs: Any = None, **more: Any) -> Scene:
    """One triangle with a material."""
    file = File()
    attributes = {"POSITION": file.accessor(TRIANGLE)}
    for number, table in enumerate(uvs or []):
        attributes[f"TEXCOORD_{number}"] = file.accessor(table)
    primitive: dict[str, Any] = {"attributes": attributes}
    if material is not None:
        primitive["material"] = 0
        more["materials"] = [material]
    return file.load(folder, primitive, **more)


def corners(scene: Scene) -> Any:
    """(m, 3, 3) places of the corners of all triangles in the world."""
    node = scene.nodes[0]
    places = node.mesh.positions @ node.transform[:3, :3].T + node.transform[:3, 3]
    return places[node.mesh.triangles]


# Geometry


@pytest.mark.parametrize(
    ("mode", "expected"),
    [
        (4, [[0, 1, 2]]),
        (5, [[0, 1, 2], [1, 3, 2], [2, 3, 4]]),
        (6, [[1, 2, 0], [2, 3, 0], [3, 4, 0]]),
    ],
)
@pytest.mark.parametrize("indexed", [False, True])
def test_lists_strips_and_fans(tmp_path: Path, mode: int, expected: list[list[int]], indexed: bool) -> None:
    points = np.array([[0, 0, 0], [2, 0, 0], [0, 1, 0], [3, 2, 0], [0, 5, 0]], np.float32)
    file = File()
    order = [4, 3, 2, 1, 0] if indexed else [0, 1, 2, 3, 4]
    primitive: dict[str, Any] = {"attributes": {"POSITION": file.accessor(points)}, "mode": mode}
    if indexed:
        primitive["indices"] = file.accessor(order, SHORT)
    assert corners(file.load(tmp_path, primitive)).tolist() == points[np.array(order)[expected]].tolist()


def test_copies_of_a_node_stand_where_their_tables_say(tmp_path: Path) -> None:
    """Half a turn about z, then a scale and a place of its own; the node's transform comes after."""
    file = File()
    tables = {
        "TRANSLATION": file.accessor([[0, 0, 0], [10, 0, 0], [0, 20, 0]]),
        "ROTATION": file.accessor([[0, 0, 0, 1], [0, 0, 1, 0], [0, 0, 0, 1]]),
        "SCALE": file.accessor([[1, 1, 1], [2, 1, 1], [1, -3, 1]]),
        "_ID": file.accessor([1, 2, 3]),
    }
    copied = {
        "translation": [0, 0, 5],
        "scale": [2, 1, 1],
        "extensions": {"EXT_mesh_gpu_instancing": {"attributes": tables}},
    }
    scene = file.load(
        tmp_path, {"attributes": {"POSITION": file.accessor(TRIANGLE)}}, copied,
        extensionsRequired=["EXT_mesh_gpu_instancing"],
    )  # fmt: skip
    made = [(node.transform @ np.append(corner, 1.0))[:3] for node in scene.nodes for corner in node.mesh.positions]
    assert np.allclose(np.reshape(made, (3, 3, 3)), [
        [[0, 0, 5], [2, 0, 5], [0, 1, 5]], [[20, 0, 5], [16, 0, 5], [20, -1, 5]], [[0, 20, 5], [2, 20, 5], [0, 17, 5]],
    ])  # fmt: skip
    assert scene.warnings == ()
    assert len({id(node.mesh) for node in scene.nodes}) == 1


@pytest.mark.parametrize(
    ("rows", "message"),
    [((3, 2), "has tables of 2, 3 rows; expected one row in each"), ((1 << 18, 1 << 18), "more than the limit")],
)
def test_copies_that_are_refused(tmp_path: Path, rows: tuple[int, int], message: str) -> None:
    file = File()
    tables = {"TRANSLATION": file.accessor(np.zeros((rows[0], 3))), "SCALE": file.accessor(np.ones((rows[1], 3)))}
    copied = {"extensions": {"EXT_mesh_gpu_instancing": {"attributes": tables}}}
    with pytest.raises(InputError, match=message):
        file.load(tmp_path, {"attributes": {"POSITION": file.accessor(TRIANGLE)}}, copied)


@pytest.mark.parametrize("based", [True, False])
def test_sparse_rows_replace_those_of_the_base_or_zeros(tmp_path: Path, based: bool) -> None:
    file = File()
    places, rows = file.view(np.array([1, 2], np.uint16)), file.view(np.array([[7, 0, 0], [0, 8, 0]], np.float32))
    sparse = {
        "count": 2, "indices": {"bufferView": places, "componentType": SHORT}, "values": {"bufferView": rows},
    }  # fmt: skip
    index = file.accessor(TRIANGLE + 1, sparse=sparse)
    if not based:
        del file.header["accessors"][index]["bufferView"]
    first = [1, 1, 1] if based else [0, 0, 0]
    assert corners(file.load(tmp_path, {"attributes": {"POSITION": index}})).tolist() == [[first, [7, 0, 0], [0, 8, 0]]]


def test_a_sparse_row_beyond_the_accessor_is_refused(tmp_path: Path) -> None:
    file = File()
    places, rows = file.view(np.array([3], np.uint16)), file.view(np.zeros((1, 3), np.float32))
    sparse = {
        "count": 1, "indices": {"bufferView": places, "componentType": SHORT}, "values": {"bufferView": rows},
    }  # fmt: skip
    index = file.accessor(TRIANGLE, sparse=sparse)
    with pytest.raises(InputError, match="accessor 0: a sparse row is 3, and there are 3"):
        file.load(tmp_path, {"attributes": {"POSITION": index}})


def test_interleaved_and_normalised_numbers(tmp_path: Path) -> None:
    file = File()
    rows = np.zeros(3, [("position", "<f4", 3), ("uv", "<u2", 2)])
    rows["position"], rows["uv"] = TRIANGLE, [[0, 0], [65535, 0], [0, 13107]]
    view = file.view(rows)
    file.header["bufferViews"][view]["byteStride"] = 16
    file.header["accessors"] = [
        {"bufferView": view, "componentType": FLOAT, "count": 3, "type": "VEC3"},
        {"bufferView": view, "byteOffset": 12, "componentType": SHORT, "count": 3, "type": "VEC2", "normalized": True},
    ]
    scene = file.load(tmp_path, {"attributes": {"POSITION": 0, "TEXCOORD_0": 1}})
    assert corners(scene).tolist() == [TRIANGLE.tolist()]
    assert np.allclose(scene.nodes[0].mesh.uvs, [[0, 0], [1, 0], [0, 0.2]])


@pytest.mark.parametrize("where", ["mesh", "node"])
def test_default_weights_of_morph_targets_are_applied(tmp_path: Path, where: str) -> None:
    file = File()
    targets = [{"POSITION": file.accessor(np.tile([[0, 0, 4]], (3, 1)))}, {"POSITION": file.accessor(TRIANGLE)}]
    primitive = {"attributes": {"POSITION": file.accessor(TRIANGLE)}, "targets": targets}
    mesh = {"primitives": [primitive], "weights": [0.5, 1.0] if where == "mesh" else [0.0, 0.0]}
    node = {"weights": [0.5, 1.0]} if where == "node" else {}
    scene = file.load(tmp_path, primitive, node, meshes=[mesh])
    assert corners(scene).tolist() == [[[0, 0, 2], [2, 0, 2], [0, 2, 2]]]


def test_a_skin_is_shown_in_its_default_pose(tmp_path: Path) -> None:
    """Joint 1 is turned a quarter about z round (1, 0, 0): what hangs on it at (1, 1, 0) goes to (0, 0, 0)."""
    file = File()
    bind = np.stack([np.eye(4), np.eye(4)])
    bind[1, :3, 3] = -1, 0, 0
    points = [[0, 0, 0], [1, 1, 0], [1, 1, 2]]
    attributes = {
        "POSITION": file.accessor(points),
        "NORMAL": file.accessor([[0, 1, 0]] * 3),
        "JOINTS_0": file.accessor([[0, 0, 0, 0], [1, 0, 0, 0], [0, 1, 0, 0]], BYTE),
        "WEIGHTS_0": file.accessor([[1, 0, 0, 0], [1, 0, 0, 0], [0.5, 0.5, 0, 0]]),
    }
    skin = {"joints": [1, 2], "inverseBindMatrices": file.accessor(bind.transpose(0, 2, 1).reshape(2, 16))}
    half = 0.5**0.5
    nodes = [
        {"mesh": 0, "skin": 0, "translation": [50, 0, 0]},
        {"children": [2]},
        {"translation": [1, 0, 0], "rotation": [0, 0, half, half]},
    ]
    scene = file.load(
        tmp_path, {"attributes": attributes}, nodes=nodes, skins=[skin], scenes=[{"nodes": [0, 1]}]
    )  # fmt: skip
    assert np.allclose(corners(scene), [[[0, 0, 0], [0, 0, 0], [0.5, 0.5, 2]]], atol=1e-6)
    assert np.allclose(scene.nodes[0].mesh.normals, [[0, 1, 0], [-1, 0, 0], [-half, half, 0]], atol=1e-6)


def test_an_attribute_that_does_not_fit_is_named(tmp_path: Path) -> None:
    scene = plain(tmp_path, {"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}, [[[0, 0]] * 2], **pictured())
    assert scene.warnings == (
        "mesh 'body': TEXCOORD_0 has the shape (2, 2) and does not fit its 3 positions; left out",
        "mesh 'body': it has no TEXCOORD_0, which its material asks for",
    )


def test_a_view_beyond_its_buffer_is_refused(tmp_path: Path) -> None:
    file = File()
    index = file.accessor(TRIANGLE)
    file.header["bufferViews"][0]["byteLength"] = 40
    with pytest.raises(InputError, match="buffer view 0 ends at byte 40 of a buffer of 36"):
        file.load(tmp_path, {"attributes": {"POSITION": index}})
    file.header["bufferViews"][0]["byteLength"] = 32
    with pytest.raises(InputError, match="accessor 0 needs 36 bytes of buffer view 0, which has 32"):
        file.load(tmp_path, {"attributes": {"POSITION": index}})


def test_a_file_without_scenes_shows_all_its_nodes(tmp_path: Path) -> None:
    file = File()
    primitive = {"attributes": {"POSITION": file.accessor(TRIANGLE)}}
    nodes = [{"children": [1], "translation": [0, 0, 3]}, {"mesh": 0}]
    assert corners(file.load(tmp_path, primitive, nodes=nodes, scenes=[]))[0, 0].tolist() == [0, 0, 3]


# Materials


def pictured(uri: str | None = None, **sampler: Any) -> dict[str, Any]:
    return {
        "textures": [{"source": 0, **({"sampler": 0} if sampler else {})}],
        "images": [{"uri": uri or png()}],
        **({"samplers": [sampler]} if sampler else {}),
    }


UVS = [[[0, 0], [1, 0], [0, 1]], [[0.25, 0.5], [0.5, 0.5], [0.25, 0.75]]]


def test_a_surface_without_a_material_is_white(tmp_path: Path) -> None:
    assert plain(tmp_path).nodes[0].material.base_color == (1.0, 1.0, 1.0, 1.0)
    assert plain(tmp_path, {"doubleSided": True}).nodes[0].material.base_color == (1.0, 1.0, 1.0, 1.0)


def test_a_material_without_a_name_keeps_its_own_colour(tmp_path: Path) -> None:
    file = File()
    positions = file.accessor(TRIANGLE)
    primitives = [{"attributes": {"POSITION": positions}, "material": k} for k in (0, 1, 2)]
    red, green, blue = ([*rgb, 1] for rgb in np.eye(3).tolist())
    materials: list[dict[str, Any]] = [
        {"pbrMetallicRoughness": {"baseColorFactor": red}},
        {"name": "material", "pbrMetallicRoughness": {"baseColorFactor": green}},
        {"name": "material 0", "pbrMetallicRoughness": {"baseColorFactor": blue}},
    ]
    scene = file.load(tmp_path, {}, meshes=[{"primitives": primitives}], materials=materials)
    assert [list(node.material.base_color) for node in scene.nodes] == [red, green, blue]
    assert [node.material.name for node in scene.nodes] == ["material 0", "material", "material 0"]


def test_the_set_of_coordinates_is_the_one_that_the_material_names(tmp_path: Path) -> None:
    material = {"pbrMetallicRoughness": {"baseColorTexture": {"index": 0, "texCoord": 1}}}
    assert plain(tmp_path, material, UVS, **pictured()).nodes[0].mesh.uvs.tolist() == UVS[1]


def test_a_texture_transform_moves_the_coordinates(tmp_path: Path) -> None:
    """The sample viewer's order: scale, then turn, then move; a positive angle turns (0, 1) to (sin, cos)."""
    change = {"offset": [0.5, 0.25], "scale": [2, 4], "rotation": np.pi / 2, "texCoord": 0}
    material = {
        "pbrMetallicRoughness": {
            "baseColorTexture": {"index": 0, "texCoord": 1, "extensions": {"KHR_texture_transform": change}}
        }
    }
    uvs = plain(tmp_path, material, UVS, extensionsRequired=["KHR_texture_transform"], **pictured()).nodes[0].mesh.uvs
    assert np.allclose(uvs, [[0.5, 0.25], [0.5, -1.75], [4.5, 0.25]], atol=1e-6)


def test_a_normal_map_with_other_coordinates_is_named(tmp_path: Path) -> None:
    material = {
        "name": "wood", "normalTexture": {"index": 0, "texCoord": 1},
        "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}},
    }  # fmt: skip
    scene = plain(tmp_path, material, UVS, **pictured())
    assert scene.nodes[0].material.normal_texture is None
    assert scene.warnings == ("material 'wood': its normal map has other coordinates than its base colour; left out",)


def test_specular_glossiness_gives_its_diffuse_colour(tmp_path: Path) -> None:
    glossy = {"diffuseFactor": [0.25, 0.5, 0.75, 0.5], "diffuseTexture": {"index": 0}, "specularFactor": [1, 1, 1]}
    material = {
        "extensions": {"KHR_materials_pbrSpecularGlossiness": glossy},
        "pbrMetallicRoughness": {"baseColorFactor": [1, 0, 0, 1]},
    }
    scene = plain(tmp_path, material, UVS, **pictured())
    assert scene.nodes[0].material.base_color == (0.25, 0.5, 0.75, 0.5)
    texture = scene.nodes[0].material.base_color_texture
    assert texture is not None
    assert np.array_equal(texture.pixels[..., :3], PIXELS)
    assert scene.warnings == ()


def test_specular_glossiness_without_a_colour_is_white(tmp_path: Path) -> None:
    scene = plain(tmp_path, {"extensions": {"KHR_materials_pbrSpecularGlossiness": {}}}, UVS)
    assert scene.nodes[0].material.base_color == (1, 1, 1, 1)


def test_a_texture_of_16_bits_keeps_its_upper_8(tmp_path: Path) -> None:
    deep = np.uint16([[0x12FF, 0xFF00], [0x0000, 0x8001]])
    stream = io.BytesIO()
    Image.fromarray(deep).save(stream, "PNG")
    uri = "data:image/png;base64," + base64.b64encode(stream.getvalue()).decode()
    material = {"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}
    texture = plain(tmp_path, material, UVS, **pictured(uri)).nodes[0].material.base_color_texture
    assert texture is not None
    assert np.array_equal(texture.pixels[..., 0], [[0x12, 0xFF], [0x00, 0x80]])


@pytest.mark.parametrize("excess", ["total", "chunk"])
def test_a_glb_file_that_ends_early_is_refused(tmp_path: Path, excess: str) -> None:
    header = b'{"asset":{"version":"2.0"}} '
    total, length = 20 + len(header), len(header)
    total, length = (total + 1, length) if excess == "total" else (total, length + 1)
    (tmp_path / "m.glb").write_bytes(b"glTF" + struct.pack("<III4s", 2, total, length, b"JSON") + header)
    with pytest.raises(InputError, match="truncated"):
        Scene.load(tmp_path / "m.glb")


@pytest.mark.parametrize(("number", "wrap"), [(33071, "clamp"), (33648, "mirror"), (10497, "repeat")])
def test_wrap_modes_are_read(tmp_path: Path, number: int, wrap: str) -> None:
    material = {"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}
    scene = plain(tmp_path, material, UVS, **pictured(wrapS=number, wrapT=number))
    texture = scene.nodes[0].material.base_color_texture
    assert texture is not None
    assert texture.wrap == wrap
    assert scene.warnings == ()


def test_each_axis_has_its_wrap_mode(tmp_path: Path) -> None:
    material = {"name": "wood", "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}
    scene = plain(tmp_path, material, UVS, **pictured(wrapS=33071, wrapT=10497))
    texture = scene.nodes[0].material.base_color_texture
    assert texture is not None
    assert texture.wraps == ("clamp", "repeat")
    assert scene.warnings == ()


def test_a_gray_texture_may_have_alpha(tmp_path: Path) -> None:
    uri = png(np.dstack([PIXELS[..., 0], PIXELS[..., 1]]))
    material = {"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}
    texture = plain(tmp_path, material, UVS, **pictured(uri)).nodes[0].material.base_color_texture
    assert texture is not None
    assert np.array_equal(texture.pixels, PIXELS[..., [0, 0, 0, 1]])


def test_unlit_and_cutoff_are_read(tmp_path: Path) -> None:
    material = {"extensions": {"KHR_materials_unlit": {}}, "alphaMode": "MASK", "alphaCutoff": 1.5}
    scene = plain(tmp_path, material, extensionsRequired=["KHR_materials_unlit"])
    shown = scene.nodes[0].material
    assert (shown.unlit, shown.alpha_mode, shown.alpha_cutoff) == (True, "mask", 1.5)
    assert scene.warnings == ()


@pytest.mark.parametrize("mirrored", [False, True])
def test_joints_that_mirror_keep_outer_sides_outside(tmp_path: Path, mirrored: bool) -> None:
    """One joint at (±2, 1, 1): the triangle is scaled, and its normals and winding go on facing +z."""
    file = File()
    attributes = {
        "POSITION": file.accessor(TRIANGLE),
        "NORMAL": file.accessor([[0, 0, 1]] * 3),
        "JOINTS_0": file.accessor([[0, 0, 0, 0]] * 3, BYTE),
        "WEIGHTS_0": file.accessor([[1, 0, 0, 0]] * 3),
    }
    nodes = [{"mesh": 0, "skin": 0}, {"scale": [-2 if mirrored else 2, 1, 1]}]
    scene = file.load(
        tmp_path, {"attributes": attributes}, nodes=nodes, skins=[{"joints": [1]}], scenes=[{"nodes": [0, 1]}]
    )
    mesh = scene.nodes[0].mesh
    a, b, c = mesh.positions[mesh.triangles[0]]
    assert np.cross(b - a, c - a).tolist() == [0.0, 0.0, 2.0]
    assert mesh.normals.tolist() == [[0.0, 0.0, 1.0]] * 3
    assert mesh.positions[:, 0].min() == (-2.0 if mirrored else 0.0)


@pytest.mark.parametrize(
    ("filters", "magnify", "minify"),
    [
        ({"wrapS": 10497}, "linear", "linear mipmap linear"),
        ({"magFilter": 9729, "minFilter": 9987}, "linear", "linear mipmap linear"),
        ({"magFilter": 9728}, "nearest", "linear mipmap linear"),
        ({"minFilter": 9728}, "linear", "nearest"),
        ({"magFilter": 9728, "minFilter": 9984}, "nearest", "nearest mipmap nearest"),
        ({"magFilter": 9728, "minFilter": 9986}, "nearest", "nearest mipmap linear"),
    ],
)
def test_filters_are_read(tmp_path: Path, filters: dict[str, int], magnify: str, minify: str) -> None:
    material = {"name": "wood", "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}
    scene = plain(tmp_path, material, UVS, **pictured(**filters))
    texture = scene.nodes[0].material.base_color_texture
    assert texture is not None
    assert (texture.magnify, texture.minify) == (magnify, minify)
    assert scene.warnings == ()


@pytest.mark.parametrize(
    ("material", "warning"),
    [
        ({"emissiveFactor": [0, 0, 1]}, "material 'wood': its emissive light is not shown"),
        (
            {"pbrMetallicRoughness": {"metallicFactor": 0.8}},
            "material 'wood': its metal is not shown; it looks diffuse",
        ),
        ({"occlusionTexture": {"index": 0}}, "material 'wood': its occlusion map is not used"),
        ({"normalTexture": {"index": 0, "scale": 2}}, "material 'wood': the scale of its normal map is not applied"),
        ({"extensions": {"KHR_materials_sheen": {}}}, "material 'wood': KHR_materials_sheen is not shown"),
        ({"alphaMode": "FOG"}, "material 'wood': unknown alpha mode 'fog', opaque is used"),
    ],
)
def test_what_is_not_shown_is_named(tmp_path: Path, material: dict[str, Any], warning: str) -> None:
    assert plain(tmp_path, {"name": "wood", **material}, UVS, **pictured()).warnings == (warning,)


def test_a_picture_in_a_format_that_is_not_read_is_named(tmp_path: Path) -> None:
    material = {"name": "wood", "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}
    textures = [{"extensions": {"KHR_texture_basisu": {"source": 0}}}]
    scene = plain(tmp_path, material, UVS, textures=textures, images=[])
    assert scene.warnings == ("wood base colour: its picture is not read (KHR_texture_basisu); left out",)


@pytest.mark.parametrize(
    ("uri", "why"),
    [
        ("data:image/png;base64,@@@", "its data: address cannot be read"),
        ("data:image/png", r"its data: address cannot be read \(it has no comma\)"),
        ("data:image/png;base64,aGVsbG8=", "it is not a picture that can be read"),
    ],
)
def test_a_data_texture_that_cannot_be_read_is_a_warning(tmp_path: Path, uri: str, why: str) -> None:
    material = {"name": "wood", "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}
    scene = plain(tmp_path, material, UVS, **pictured(uri))
    assert scene.nodes[0].material.base_color_texture is None
    (warning,) = scene.warnings
    assert warning.startswith("wood base colour: ")
    assert why.replace("\\", "") in warning


def test_a_data_buffer_that_cannot_be_read_is_refused(tmp_path: Path) -> None:
    plain(tmp_path)
    header = json.loads((tmp_path / "m.gltf").read_text())
    header["buffers"][0]["uri"] = "data:;base64,@"
    (tmp_path / "m.gltf").write_text(json.dumps(header))
    with pytest.raises(InputError, match="a buffer's data: address cannot be read"):
        Scene.load(tmp_path / "m.gltf")


def test_an_extension_that_is_required_and_unknown_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="requires ACME_curved_triangles, which is not read; expected no other than"):
        plain(tmp_path, extensionsRequired=["KHR_mesh_quantization", "ACME_curved_triangles"])


# Pictures of other formats, and MTL and PLY

EPS = b"%!PS-Adobe-3.0 EPSF-3.0\n%%BoundingBox: 0 0 8 8\nshowpage\n"


@pytest.fixture
def decoders(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Formats that Pillow opens during the test."""
    opened: list[str] = []
    start = ImageFile.ImageFile.__init__

    def noted(self: Any, *arguments: Any, **options: Any) -> None:
        opened.append(type(self).__name__)
        start(self, *arguments, **options)

    monkeypatch.setattr(ImageFile.ImageFile, "__init__", noted)
    return opened


@pytest.mark.parametrize("name", ["wood.png", "wood.eps", "wood"])
@pytest.mark.parametrize("line", ["map_Kd", "map_d", "bump"])
def test_postscript_is_no_picture_of_a_material(tmp_path: Path, decoders: list[str], line: str, name: str) -> None:
    (tmp_path / name).write_bytes(EPS)
    (tmp_path / "m.mtl").write_text(f"newmtl a\n{line} {name}\n")
    (tmp_path / "m.obj").write_text("mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl a\nf 1 2 3\n")
    (warning,) = Scene.load(tmp_path / "m.obj", ground=False).warnings
    assert warning.endswith("it is not a picture that can be read; left out")
    assert "EpsImageFile" not in decoders


@pytest.mark.parametrize("uri", ["wood.png", "data:image/png;base64," + base64.b64encode(EPS).decode()])
def test_postscript_is_no_picture_of_a_gltf_file(tmp_path: Path, decoders: list[str], uri: str) -> None:
    (tmp_path / "wood.png").write_bytes(EPS)
    material = {"name": "wood", "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}
    scene = plain(tmp_path, material, UVS, **pictured(uri))
    assert scene.warnings == ("wood base colour: it is not a picture that can be read; left out",)
    assert "EpsImageFile" not in decoders


PLY = """ply
format ascii 1.0
comment TextureFile {name}
element vertex 3
property float x
property float y
property float z
property float texture_u
property float texture_v
element face 1
property list uchar int vertex_indices
end_header
0 0 0 0 0
1 0 0 1 0
0 1 0 0 1
3 0 1 2
"""


def test_a_missing_ply_texture_is_a_warning_of_ours_alone(
    tmp_path: Path, caplog: pytest.LogCaptureFixture, capfd: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "m.ply").write_text(PLY.format(name="gone.png"))
    with caplog.at_level(logging.DEBUG):
        scene = Scene.load(tmp_path / "m.ply", ground=False)
    assert scene.warnings == ("gone.png: not found beside m.ply; left out",)
    assert "Traceback" not in caplog.text + "".join(capfd.readouterr())


def test_a_ply_texture_is_shown(tmp_path: Path) -> None:
    Image.fromarray(PIXELS).save(tmp_path / "my wood.png")
    (tmp_path / "m.ply").write_text(PLY.format(name="my wood.png"))
    texture = Scene.load(tmp_path / "m.ply", ground=False).nodes[0].material.base_color_texture
    assert texture is not None
    assert np.array_equal(texture.pixels[..., :3], PIXELS)


def test_an_opacity_that_would_hide_all_is_taken_as_opaque(tmp_path: Path) -> None:
    """Tr is 1 - d, and many exporters write Tr 1 for surfaces that are meant to be seen."""
    text = "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl a\nf 1 2 3\n"
    (tmp_path / "m.obj").write_text(text)
    (tmp_path / "m.mtl").write_text("newmtl a\nKd 1 1 1\nTr 1.000\n")
    scene = Scene.load(tmp_path / "m.obj", ground=False)
    assert scene.nodes[0].material.base_color[3] == 1.0
    assert scene.nodes[0].material.alpha_mode == "opaque"
    assert scene.warnings == ("material 'a': Tr 1 would make it invisible; taken as opaque",)
    (tmp_path / "m.mtl").write_text("newmtl a\nKd 1 1 1\nTr 0.25\nKe 1 0 0\n")
    scene = Scene.load(tmp_path / "m.obj", ground=False)
    assert scene.nodes[0].material.base_color[3] == 0.75
    assert scene.warnings == ("material 'a': its emissive light (Ke, map_Ke) is not shown",)


@pytest.mark.parametrize("stride", [0, 12, 252])
def test_a_count_beyond_its_buffer_is_refused_before_memory_is_allocated(tmp_path: Path, stride: int) -> None:
    plain(tmp_path)
    header = json.loads((tmp_path / "m.gltf").read_text())
    header["accessors"][0]["count"] = 1 << 31
    if stride:
        header["bufferViews"][0]["byteStride"] = stride
    (tmp_path / "m.gltf").write_text(json.dumps(header))
    code = (
        "import resource; import passgraph as pg; pg.Scene; resource.setrlimit(resource.RLIMIT_AS, (6 << 30,) * 2);"
        f" pg.Scene.load({str(tmp_path / 'm.gltf')!r})"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert "accessor 0 needs" in done.stderr.splitlines()[-1]
    assert "the file is corrupt or truncated" in done.stderr
