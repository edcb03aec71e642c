"""Loading model files: formats, orientation, precision, and the text of every refusal."""

from __future__ import annotations

import json
import struct
import subprocess
import sys

import numpy as np
import pytest
import trimesh
from PIL import Image

from passgraph.errors import InputError
from passgraph.scene import Scene
from passgraph.scene import materials as material_module
from passgraph.scene.load_scene import load_scene
from passgraph.scene.matrices import transform_points

QUAD = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n"
LEVEL = "v 0 0 0\nv 1 0 0\nv 1 0 -1\nv 0 0 -1\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n"
FACES = "f 1/1 2/2 3/3\nf 1/1 3/3 4/4\n"


def picture(path, size=(8, 8)):
    """Red top left, green top right, blue bottom left, white bottom right."""
    w, h = size
    array = np.zeros((h, w, 3), np.uint8)
    array[: h // 2, : w // 2] = (255, 0, 0)
    array[: h // 2, w // 2 :] = (0, 255, 0)
    array[h // 2 :, : w // 2] = (0, 0, 255)
    array[h // 2 :, w // 2 :] = (255, 255, 255)
    Image.fromarray(array).save(path)
    return array


def obj(folder, text, mtl=None, name="m.obj"):
    if mtl is not None:
        (folder / "m.mtl").write_text(mtl)
        text = "mtllib m.mtl\n" + text.replace("f ", "usemtl a\nf ", 1)
    (folder / name).write_text(text)
    return folder / name


def gltf(folder, positions, indices, *, attributes=None, node=None, **extra):
    """A minimal glTF with one triangle mesh and a binary file beside it."""
    tables = [("POSITION", np.asarray(positions, np.float32), "VEC3", 5126)]
    tables += [(k, np.asarray(v, np.float32), f"VEC{np.shape(v)[1]}", 5126) for k, v in (attributes or {}).items()]
    tables.append(("indices", np.asarray(indices, np.uint16).reshape(-1), "SCALAR", 5123))
    blob, views, accessors = b"", [], []
    for _, table, kind, component in tables:
        views.append({"buffer": 0, "byteOffset": len(blob), "byteLength": table.nbytes})
        accessors.append({"bufferView": len(accessors), "componentType": component, "count": len(table), "type": kind})
        blob += table.tobytes() + b"\0" * (-table.nbytes % 4)
    (folder / "m.bin").write_bytes(blob)
    primitive = {"attributes": {t[0]: i for i, t in enumerate(tables[:-1])}, "indices": len(tables) - 1}
    if "materials" in extra:
        primitive["material"] = 0
    header = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0, **(node or {})}],
        "meshes": [{"primitives": [primitive]}],
        "buffers": [{"uri": "m.bin", "byteLength": len(blob)}],
        "bufferViews": views,
        "accessors": accessors,
        **extra,
    }
    path = folder / "m.gltf"
    path.write_text(json.dumps(header))
    return path


TRIANGLE = ([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])


@pytest.mark.parametrize("suffix", ["obj", "ply", "stl", "off", "glb", "gltf"])
def test_each_format_gives_the_same_box(tmp_path, suffix):
    cube = trimesh.creation.box(extents=(1, 2, 3))
    if suffix == "gltf":
        for name, data in trimesh.exchange.gltf.export_gltf(trimesh.Scene(cube)).items():
            (tmp_path / name).write_bytes(data)
        path = tmp_path / "model.gltf"
    else:
        path = tmp_path / f"m.{suffix}"
        cube.export(path)
    scene = Scene.load(path, ground=False, up="y")
    assert scene.triangle_count == 12
    assert np.allclose(scene.bounds(), [[-0.5, -1, -1.5], [0.5, 1, 1.5]])
    assert scene.warnings == ()


WITHOUT_SCIPY = """
import sys
sys.modules["scipy"] = None  # as if it were not installed
from passgraph import Scene
for file in sys.argv[1:]:
    print(len(Scene.load(file, ground=False).nodes[0].mesh.triangles))
"""


def test_no_format_needs_scipy(tmp_path):
    """trimesh would use it for what is computed here: normals."""
    files = [tmp_path / f"m.{suffix}" for suffix in ("obj", "ply", "stl", "off", "glb")]
    for file in files:
        trimesh.creation.box((1, 2, 3)).export(file)
    command = [sys.executable, "-c", WITHOUT_SCIPY, *map(str, files)]
    made = subprocess.run(command, capture_output=True, text=True, check=False, timeout=120)
    assert (made.stdout, made.stderr) == ("12\n" * len(files), "")


def test_models_without_a_floor_get_one_unless_told_otherwise(tmp_path):
    path = obj(tmp_path, QUAD + FACES)
    assert [n.name for n in Scene.load(path).nodes][-1] == "floor"
    assert len(Scene.load(path, ground=False).nodes) == 1
    assert len(Scene.load(obj(tmp_path, LEVEL + FACES)).nodes) == 1
    assert len(Scene.load(obj(tmp_path, LEVEL + FACES), ground=True).nodes) == 2


def test_z_is_up_in_stl_unless_told_otherwise(tmp_path):
    """A tower of 4 along z, as CAD writes it."""
    trimesh.creation.box(extents=(1, 2, 4)).export(tmp_path / "tower.stl")
    sizes = {up: np.ptp(Scene.load(tmp_path / "tower.stl", ground=False, up=up).bounds(), axis=0) for up in (None, "y")}
    assert sizes[None].tolist() == [1.0, 4.0, 2.0]
    assert sizes["y"].tolist() == [1.0, 2.0, 4.0]


def test_z_up_files_are_turned(tmp_path):
    path = obj(tmp_path, "v 0 0 0\nv 1 0 0\nv 0 0 5\nf 1 2 3\n")
    assert Scene.load(path, ground=False, up="z").bounds()[1].tolist() == [1.0, 5.0, 0.0]
    with pytest.raises(InputError, match="up: expected 'y' or 'z', got 'x'"):
        Scene.load(path, up="x")


@pytest.mark.parametrize("kind", ["obj", "glb"])
def test_v_zero_is_the_top_row_of_the_texture(tmp_path, kind):
    """The quad's upper left corner shows the picture's upper left texel, in every format."""
    expected = picture(tmp_path / "t.png")
    path = obj(tmp_path, QUAD + FACES, "newmtl a\nKd 1 1 1\nmap_Kd t.png\n")
    if kind == "glb":
        trimesh.load_scene(path, process=False).export(tmp_path / "m.glb")
        path = tmp_path / "m.glb"
    node = Scene.load(path, ground=False).nodes[0]
    assert np.array_equal(node.material.base_color_texture.pixels[..., :3], expected)
    points = transform_points(node.transform, node.mesh.positions)
    for corner, texel in (((0, 1), (255, 0, 0)), ((1, 1), (0, 255, 0)), ((0, 0), (0, 0, 255))):
        u, v = node.mesh.uvs[np.abs(points[:, :2] - corner).sum(axis=1).argmin()]
        x, y = int(np.clip(u * 8, 0, 7)), int(np.clip(v * 8, 0, 7))
        assert tuple(node.material.base_color_texture.pixels[y, x, :3]) == texel


def test_corners_with_other_normals_keep_their_own_uv(tmp_path):
    text = QUAD + "vn 0 0 1\nvn 0 1 0\nf 1/1/1 2/2/1 3/3/1\nf 1/2/2 3/3/2 4/4/2\n"
    mesh = Scene.load(obj(tmp_path, text), ground=False).nodes[0].mesh
    assert {(*map(float, p), *map(float, uv)) for p, uv in zip(mesh.positions, mesh.uvs, strict=True)} >= {
        (0, 0, 0, 0, 1),
        (0, 0, 0, 1, 1),
    }


def test_normals_are_smooth_across_texture_seams(tmp_path):
    text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv -1 0 .5\nvt 0 0\nvt 1 0\nvt 0 1\nvt .5 .5\nf 1/1 2/2 3/3\nf 1/4 3/2 4/3\n"
    mesh = Scene.load(obj(tmp_path, text), ground=False).nodes[0].mesh
    at_origin = mesh.normals[(mesh.positions == 0).all(axis=1)]
    assert len(at_origin) == 2
    assert np.array_equal(at_origin[0], at_origin[1])


def test_obj_material_opacity_and_bump(tmp_path):
    Image.fromarray(np.full((4, 4, 3), (128, 128, 255), np.uint8)).save(tmp_path / "n.png")
    Image.fromarray(np.full((4, 4), 90, np.uint8)).save(tmp_path / "h.png")
    path = obj(tmp_path, QUAD + FACES, "newmtl a\nKd 0.5 0.25 1\nd 0.5\nmap_Bump -bm 0.3 n.png\n")
    node = Scene.load(path, ground=False).nodes[0]
    assert node.material.base_color == pytest.approx((0.5, 0.25, 1.0, 0.5))
    assert node.material.alpha_mode == "blend"
    assert node.material.normal_texture is not None
    assert node.mesh.has_tangents
    path = obj(tmp_path, QUAD + FACES, "newmtl a\nTr 0.25\nbump h.png\n")
    node = Scene.load(path, ground=False).nodes[0]
    assert node.material.height_texture is not None
    assert node.material.base_color[3] == 0.75


def test_gltf_material_and_colors(tmp_path):
    materials = [
        {
            "name": "glass",
            "alphaMode": "MASK",
            "alphaCutoff": 0.25,
            "doubleSided": True,
            "pbrMetallicRoughness": {"baseColorFactor": [0.011, 0.5, 0.25, 0.5]},
        }
    ]
    colors = [[1, 0, 0, 1], [0, 1, 0, 1], [0, 0, 0.5, 1]]
    path = gltf(tmp_path, *TRIANGLE, attributes={"COLOR_0": colors}, materials=materials)
    node = Scene.load(path, ground=False).nodes[0]
    assert node.material.base_color == pytest.approx((0.011, 0.5, 0.25, 0.5))
    assert (node.material.alpha_mode, node.material.alpha_cutoff, node.material.double_sided) == (
        "mask",
        0.25,
        True,
    )
    assert np.allclose(node.mesh.colors, colors)


def test_ply_vertex_colors_are_decoded_from_srgb(tmp_path):
    mesh = trimesh.Trimesh(*TRIANGLE, vertex_colors=[[188, 0, 255, 255]] * 3, process=False)
    mesh.export(tmp_path / "m.ply")
    colors = Scene.load(tmp_path / "m.ply", ground=False).nodes[0].mesh.colors
    assert colors[0] == pytest.approx([0.503, 0, 1, 1], abs=1e-3)


def test_gltf_transforms_compose(tmp_path):
    half = 0.5**0.5
    node = {"translation": [10, 0, 0], "rotation": [0, half, 0, half], "scale": [2, 1, 1]}
    scene = Scene.load(gltf(tmp_path, *TRIANGLE, node=node), ground=False)
    assert np.allclose(scene.bounds(), [[10, 0, -2], [10, 1, 0]], atol=1e-6)


def test_gltf_orthographic_cameras_are_used(tmp_path):
    lens = {"xmag": 3.0, "ymag": 2.0, "znear": 0.0, "zfar": 20.0}
    nodes = [{"mesh": 0}, {"camera": 0, "translation": [0, 0, 7]}]
    cameras = [{"type": "orthographic", "orthographic": lens}]
    file = gltf(tmp_path, *TRIANGLE, nodes=nodes, scenes=[{"nodes": [0, 1]}], cameras=cameras)
    camera = Scene.load(file, ground=False).camera
    assert camera.orthographic_height == 4.0
    # a near plane at the eye: parallel rays see the same from farther back
    ends = camera.eye[2] - camera.near, camera.eye[2] - camera.far
    assert ends == pytest.approx((7.0, -13.0))
    assert camera.near > 0.0


def test_gltf_cameras_come_by_name_in_the_file_s_order_and_turn_with_it(tmp_path):
    nodes = [
        {"mesh": 0},
        {"camera": 0, "translation": [0, 0, 7], "name": "front"},
        {"camera": 0, "translation": [0, -9, 0], "rotation": [2**-0.5, 0, 0, 2**-0.5]},
    ]
    cameras = [{"type": "perspective", "name": "lens", "perspective": {"yfov": 0.7, "znear": 0.5}}]
    file = gltf(tmp_path, *TRIANGLE, nodes=nodes, scenes=[{"nodes": [0, 1, 2]}], cameras=cameras)
    scene = Scene.load(file, ground=False)
    assert [one.name for one in scene.cameras] == ["front", "lens"]
    assert scene.camera == scene.cameras[0].camera
    turned = Scene.load(file, ground=False, up="z").cameras
    np.testing.assert_allclose(turned[1].camera.eye, (0, 0, 9), atol=1e-12)
    np.testing.assert_allclose(turned[1].camera.forward, (0, 0, -1), atol=1e-12)
    np.testing.assert_allclose(turned[0].camera.eye, (0, 7, 0), atol=1e-12)


def test_gltf_camera_and_lights_are_used(tmp_path):
    nodes = [
        {"mesh": 0},
        {"camera": 0, "translation": [0, 0, 7]},
        {"translation": [0, 3, 0], "extensions": {"KHR_lights_punctual": {"light": 0}}},
    ]
    lights = {"KHR_lights_punctual": {"lights": [{"type": "point", "intensity": 800, "color": [1, 0.5, 0]}]}}
    cameras = [{"type": "perspective", "perspective": {"yfov": 0.7, "znear": 0.5}}]
    path = gltf(tmp_path, *TRIANGLE, nodes=nodes, scenes=[{"nodes": [0, 1, 2]}], cameras=cameras, extensions=lights)
    scene = Scene.load(path)
    assert scene.camera.eye == (0.0, 0.0, 7.0)
    assert scene.camera.vertical_fov_rad == 0.7
    (light,) = scene.lights
    assert (light.kind, light.position, light.color) == ("point", (0.0, 3.0, 0.0), (1.0, 0.5, 0.0))
    middle = np.array([0.5, 0.5, 0.0])
    assert light.intensity / ((middle - light.position) ** 2).sum() == pytest.approx(1.0)


def test_far_positions_keep_their_shape(tmp_path):
    text = "v 1000000.001 0 5\nv 1000000.251 0 5\nv 1000000.001 0.125 5\nf 1 2 3\n"
    node = Scene.load(obj(tmp_path, text), ground=False).nodes[0]
    points = transform_points(node.transform, node.mesh.positions)
    assert np.abs(points[1] - points[0] - [0.25, 0, 0]).max() < 1e-8
    assert points[:, 0].min() == pytest.approx(1000000.001, abs=1e-8)


def test_latin_1_and_utf_16_text_is_read(tmp_path):
    (tmp_path / "a.obj").write_bytes("# gr\u00fcn\n".encode("latin-1") + (QUAD + FACES).encode())
    (tmp_path / "b.obj").write_bytes((QUAD + FACES).encode("utf-16"))
    for name in ("a.obj", "b.obj"):
        assert Scene.load(tmp_path / name, ground=False).triangle_count == 2


def test_missing_texture_is_a_warning(tmp_path):
    scene = Scene.load(obj(tmp_path, QUAD + FACES, "newmtl a\nmap_Kd gone.png\n"))
    assert scene.warnings == ("gone.png: not found beside m.obj; left out",)


@pytest.mark.parametrize("name", ["t.png", "../t.png", "..\\inner\\t.png", "inner/t.png"])
def test_textures_lie_beside_their_material_file_too(tmp_path, name):
    """As modellers write them: an MTL file in a folder of its own, with names as seen from there, or from the model."""
    (tmp_path / "inner").mkdir()
    picture(tmp_path / ("t.png" if name == "../t.png" else "inner/t.png"))
    (tmp_path / "inner" / "m.mtl").write_text(f"newmtl a\nmap_Kd {name}\n")
    scene = Scene.load(obj(tmp_path, "mtllib inner/m.mtl\nusemtl a\n" + QUAD + FACES), ground=False)
    assert scene.nodes[0].material.base_color_texture is not None
    assert scene.warnings == ()


@pytest.mark.parametrize(
    "name", ["../secret.png", "/etc/secret.png", "C:\\secret.png", "..\\secret.png", "%2e%2e/secret.png"]
)
def test_textures_outside_the_folder_are_not_read(tmp_path, name):
    picture(tmp_path / "secret.png")
    inner = tmp_path / "inner"
    inner.mkdir()
    scene = Scene.load(obj(inner, QUAD + FACES, f"newmtl a\nmap_Kd {name}\n"), ground=False)
    assert scene.nodes[0].material.base_color_texture is None
    assert "leads out of the folder of the model" in scene.warnings[0]


def test_a_material_file_in_a_folder_leads_no_farther_out(tmp_path):
    picture(tmp_path / "secret.png")
    (tmp_path / "model" / "inner").mkdir(parents=True)
    (tmp_path / "model" / "inner" / "m.mtl").write_text("newmtl a\nmap_Kd ../../secret.png\n")
    model = obj(tmp_path / "model", "mtllib inner/m.mtl\nusemtl a\n" + QUAD + FACES)
    scene = Scene.load(model, ground=False)
    assert scene.nodes[0].material.base_color_texture is None
    assert "leads out of the folder of the model" in scene.warnings[0]


def test_links_out_of_the_folder_are_not_followed(tmp_path):
    picture(tmp_path / "secret.png")
    inner = tmp_path / "inner"
    inner.mkdir()
    (inner / "t.png").symlink_to(tmp_path / "secret.png")
    scene = Scene.load(obj(inner, QUAD + FACES, "newmtl a\nmap_Kd t.png\n"), ground=False)
    assert "leads out of the folder" in scene.warnings[0]


def test_gltf_buffer_outside_the_folder_is_refused(tmp_path):
    path = gltf(tmp_path, *TRIANGLE, buffers=[{"uri": "../m.bin", "byteLength": 44}])
    with pytest.raises(InputError, match=r"m.gltf: '../m.bin' leads out of the folder"):
        Scene.load(path)


def test_broken_texture_is_a_warning(tmp_path):
    data = picture(tmp_path / "t.png", (64, 64)) is not None and (tmp_path / "t.png").read_bytes()
    (tmp_path / "t.png").write_bytes(data[:90])
    scene = Scene.load(obj(tmp_path, QUAD + FACES, "newmtl a\nmap_Kd t.png\n"), ground=False)
    assert scene.nodes[0].material.base_color_texture is None
    assert "not a picture that can be read" in scene.warnings[0]


def test_huge_texture_is_refused(tmp_path, monkeypatch):
    picture(tmp_path / "t.png", (64, 64))
    monkeypatch.setattr(material_module, "MAX_TEXELS", 1000)
    path = obj(tmp_path, QUAD + FACES, "newmtl a\nmap_Kd t.png\n")
    with pytest.raises(InputError, match=r"t.png: 64 x 64 texels are more than the limit of 1000"):
        Scene.load(path)


@pytest.mark.parametrize(
    ("scale", "told"),
    [
        (0.0, "all its vertices are at one place; nothing could be seen"),
        (1e-20, "its extent, 1e-20, is below what float32 can draw; scale it up"),
        (1e20, "is beyond what float32 can draw; scale it down"),
    ],
)
def test_models_of_no_size_that_can_be_drawn_are_refused(tmp_path, scale, told):
    text = f"v 0 0 0\nv {scale:g} 0 0\nv 0 {scale:g} 0\nf 1 2 3\n"
    with pytest.raises(InputError, match=told):
        Scene.load(obj(tmp_path, text))


def test_triangles_without_area_are_a_warning(tmp_path):
    scene = Scene.load(obj(tmp_path, "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n"), ground=False)
    assert [line for line in scene.warnings if "none of its 1 triangles has an area" in line]
    scene = Scene.load(obj(tmp_path, "v 0 0 0\nv 1e-9 0 0\nv 0 1e-9 0\nf 1 2 3\n"), ground=False)
    assert not [line for line in scene.warnings if "area" in line]


def test_bad_normals_are_computed_with_a_warning(tmp_path):
    normals = [[0, 0, 1], [0, 0, 0], [np.nan, 0, 0]]
    scene = Scene.load(gltf(tmp_path, *TRIANGLE, attributes={"NORMAL": normals}), ground=False)
    assert "2 normals are zero or not finite; computed instead" in scene.warnings[0]
    assert np.array_equal(scene.nodes[0].mesh.normals, [[0, 0, 1]] * 3)


def test_zero_scale_node_is_skipped_with_a_warning(tmp_path):
    nodes = [{"mesh": 0}, {"mesh": 0, "scale": [0, 1, 1], "name": "flat"}]
    scene = Scene.load(gltf(tmp_path, *TRIANGLE, nodes=nodes, scenes=[{"nodes": [0, 1]}]), ground=False)
    assert len(scene.nodes) == 1
    assert "node 'flat': its transform has a scale of zero" in scene.warnings[0]


def test_folder_missing_empty_and_unknown_files_are_named(tmp_path):
    (tmp_path / "e.obj").write_bytes(b"")
    (tmp_path / "m.blend").write_bytes(b"x")
    for name, text in [
        ("", "is a directory; expected a model file"),
        ("no.obj", "no.obj: no such file"),
        ("e.obj", r"the file is empty \(0 bytes\)"),
        ("m.blend", r"unknown kind of model \(.blend\); expected one of .glb"),
    ]:
        with pytest.raises(InputError, match=text):
            Scene.load(tmp_path / name)


def test_file_size_is_bounded(tmp_path):
    with pytest.raises(InputError, match="bytes are more than the limit of 10"):
        load_scene(obj(tmp_path, QUAD + FACES), max_bytes=10)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("v 0 0 0\nv nan 0 0\nv 0 1 0\nf 1 2 3\n", r"1 of 3 rows are not finite, the first is row 1"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n", "cannot be read as OBJ, it is corrupt or truncated"),
        ("v 0 0 0\nv 1 0 0\n", "holds only points or lines; expected at least one triangle"),
        ("hello\n", "holds no mesh; expected at least one triangle"),
    ],
)
def test_bad_obj_is_refused(tmp_path, text, message):
    with pytest.raises(InputError, match=message):
        Scene.load(obj(tmp_path, text))


def test_absurd_counts_are_refused_before_allocation(tmp_path):
    ply = "ply\nformat ascii 1.0\nelement vertex 4000000000\nproperty float x\nend_header\n0\n"
    (tmp_path / "m.ply").write_text(ply)
    (tmp_path / "m.off").write_text("OFF\n4000000000 1 0\n0 0 0\n")
    for name in ("m.ply", "m.off"):
        with pytest.raises(InputError, match="the header announces 4000000000 elements"):
            Scene.load(tmp_path / name)


@pytest.mark.parametrize("suffix", ["ply", "stl", "glb", "off"])
def test_truncated_files_are_refused(tmp_path, suffix):
    path = tmp_path / f"m.{suffix}"
    trimesh.creation.icosphere(subdivisions=2).export(path)
    whole = path.read_bytes()
    path.write_bytes(whole[: len(whole) // 2])
    with pytest.raises(InputError, match="truncated") as caught:
        Scene.load(path)
    if suffix == "stl":
        assert f"truncated, 320 triangles take {len(whole)} bytes and {len(whole) // 2} are there" in str(caught.value)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"asset": {"version": "1.0"}}, "glTF version 1.0; expected 2.0"),
        ({"asset": None}, "no 'asset' entry"),
        ({"accessors": True}, "a value in it has the wrong type or range"),
        ({"extensions": 3}, "m.gltf: .* broken"),
        ({"extensionsRequired": ["KHR_draco_mesh_compression"]}, "compressed with KHR_draco"),
        ({"nodes": [{"mesh": 0, "children": [0]}]}, "node 0 is reached twice"),
        ({"scenes": [{"nodes": [7]}]}, "its tree of nodes is broken"),
        ({"buffers": [{"uri": "gone.bin", "byteLength": 4}]}, "its file gone.bin is missing beside it"),
        ({"scenes": [{"nodes": []}]}, "expected at least one triangle in its scene"),
        (
            {"accessors": [{"componentType": 5126, "type": "VEC3", "count": 1 << 40}]},
            "accessor 0 has the absurd count",
        ),
    ],
)
def test_bad_gltf_is_refused(tmp_path, change, message):
    with pytest.raises(InputError, match=message):
        Scene.load(gltf(tmp_path, *TRIANGLE, **change))


def test_gltf_index_out_of_range_is_refused(tmp_path):
    with pytest.raises(InputError, match=r"1 of 1 name a vertex outside 0..2, the first is triangle 0 \[0, 1, 900\]"):
        Scene.load(gltf(tmp_path, TRIANGLE[0], [[0, 1, 900]]))


def test_gltf_infinite_position_is_refused(tmp_path):
    with pytest.raises(InputError, match="1 of 3 rows are not finite, the first is row 2"):
        Scene.load(gltf(tmp_path, [[0, 0, 0], [1, 0, 0], [np.inf, 1, 0]], [[0, 1, 2]]))


def test_broken_json_and_glb_are_refused(tmp_path):
    (tmp_path / "m.gltf").write_text("{" * 5)
    with pytest.raises(InputError, match="its JSON cannot be read"):
        Scene.load(tmp_path / "m.gltf")
    (tmp_path / "m.glb").write_bytes(b"nope" * 10)
    with pytest.raises(InputError, match="not a GLB file"):
        Scene.load(tmp_path / "m.glb")
    (tmp_path / "m.glb").write_bytes(struct.pack("<4sIIII", b"glTF", 2, 4000, 3000, 0x4E4F534A))
    with pytest.raises(InputError, match="truncated, 20 of 4000 bytes"):
        Scene.load(tmp_path / "m.glb")
