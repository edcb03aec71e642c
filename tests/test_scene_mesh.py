"""Meshes, materials, the floor and the teapot."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest
import trimesh

from passgraph.errors import InputError
from passgraph.scene import Material, Mesh, Node, Scene, Texture, merge
from passgraph.scene.ground import floor_material, floor_node
from passgraph.scene.matrices import translation
from passgraph.scene.shipped_scene import ball, box, cylinder
from passgraph.scene.teapot import teapot_mesh
from tests.effects.scenes import scaling

POINTS = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]]


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (([[0, 0]], [[0, 0, 0]]), r"mesh 'm': positions: expected shape \(n, 3\), got \(1, 2\)"),
        (([], [[0, 1, 2]]), "positions: expected shape"),
        ((np.zeros((0, 3)), [[0, 1, 2]]), "positions: empty"),
        ((POINTS, np.zeros((0, 3), int)), "triangles: empty"),
        ((POINTS, [[0, 1]]), r"triangles: expected shape \(m, 3\)"),
        ((POINTS, [[0, 1, 2.5]]), "triangles: expected integers"),
        (
            (POINTS, [[0, 1, 2], [0, 1, 9]]),
            r"1 of 2 name a vertex outside 0..3, the first is triangle 1 \[0, 1, 9\]",
        ),
        (
            ([[0, 0, 0], [np.nan, 0, 0], [0, 1, 0]], [[0, 1, 2]]),
            "1 of 3 rows are not finite, the first is row 1",
        ),
        (([[0, 0, 0], [1e300, 0, 0], [0, 1, 0]], [[0, 1, 2]]), "1 of 3 rows are not finite"),
        ((POINTS, [[0, 1, 2]], [[0, 0, 1]]), "normals: expected one row per vertex"),
        ((POINTS, [[0, 1, 2]], None, [[0, 0, 1]] * 4), r"uvs: expected shape \(n, 2\)"),
        (("no", [[0, 1, 2]]), "positions: expected an array"),
    ],
)
def test_bad_arrays_are_named(arguments, text):
    with pytest.raises(InputError, match=text):
        Mesh.make(*arguments, name="m")


def test_missing_attributes_have_defaults():
    mesh = Mesh.make(POINTS, [[0, 1, 2], [1, 3, 2]])
    assert not (mesh.has_normals or mesh.has_uvs or mesh.has_colors or mesh.has_tangents)
    assert np.array_equal(mesh.normals, [[0, 0, 1]] * 4)
    assert mesh.colors.min() == 1.0


def test_degenerate_triangles_leave_finite_normals():
    mesh = Mesh.make([[0, 0, 0], [1, 0, 0], [2, 0, 0], [5, 5, 5]], [[0, 1, 2], [3, 3, 3]])
    assert np.allclose(np.linalg.norm(mesh.normals, axis=1), 1.0)


def test_zero_normals_are_computed():
    mesh = Mesh.make(POINTS, [[0, 1, 2]], np.zeros((4, 3)))
    assert np.array_equal(mesh.normals[0], [0, 0, 1])


def test_smooth_normals_of_a_sphere_are_radial():
    sphere = trimesh.creation.icosphere(subdivisions=3)
    mesh = Mesh.make(sphere.vertices, sphere.faces)
    assert (mesh.normals * sphere.vertices).sum(axis=1).min() > 0.999


def test_tangents_follow_u_and_the_bitangent_points_up_the_picture():
    uvs = [[0, 1], [1, 1], [0, 0], [1, 0]]
    mesh = Mesh.make(POINTS, [[0, 1, 2], [1, 3, 2]], uvs=uvs).with_tangents()
    assert np.allclose(mesh.tangents[0], [1, 0, 0, 1], atol=1e-6)
    mirrored = Mesh.make(POINTS, [[0, 1, 2], [1, 3, 2]], uvs=[[1 - u, v] for u, v in uvs]).with_tangents()
    assert np.allclose(mirrored.tangents[0], [-1, 0, 0, -1], atol=1e-6)


def test_merge_places_parts_relative_to_the_origin_and_keeps_outside_outside():
    cube = box(1.0)
    merged = merge(
        [(cube, translation((1e6, 0, 0))), (cube, translation((1e6, 0, 5)) @ scaling((-1, 1, 1)))],
        (1e6, 0, 0),
    )
    assert np.allclose(merged.bounds, [[-0.5, 0, -0.5], [0.5, 1, 5.5]])
    assert trimesh.Trimesh(merged.positions, merged.triangles).volume == pytest.approx(2.0)


def test_merge_of_nothing_is_refused():
    with pytest.raises(InputError, match="nothing to merge"):
        merge([])


@pytest.mark.parametrize(("mesh", "volume"), [(box(1.0), 1.0), (ball(1.0), 4.18879), (cylinder(1.0, 2.0), 6.28318)])
def test_simple_solids_are_closed_and_wound_outward(mesh, volume):
    solid = trimesh.Trimesh(mesh.positions, mesh.triangles, process=False)
    face, vertex = solid.face_normals, mesh.normals[mesh.triangles].mean(axis=1)
    assert (face * vertex).sum(axis=1).min() > 0.9
    solid.merge_vertices(merge_norm=True, merge_tex=True)
    assert solid.is_watertight
    assert solid.volume == pytest.approx(volume, rel=0.01)


def test_teapot_is_closed_consistent_and_has_newells_measures():
    mesh = teapot_mesh(12)
    solid = trimesh.Trimesh(mesh.positions.astype(float), mesh.triangles, process=False)
    agreement = (solid.face_normals * mesh.normals[mesh.triangles].mean(axis=1)).sum(axis=1)
    assert agreement.min() > 0.7  # lowest where 12 pieces round the knob's tip
    assert np.allclose(np.linalg.norm(mesh.normals, axis=1), 1.0, atol=1e-5)
    solid.merge_vertices(merge_norm=True, merge_tex=True, digits_vertex=6)
    assert solid.is_watertight
    assert solid.is_winding_consistent
    parts = solid.split()
    assert len(parts) == 3
    assert all(part.volume > 0 for part in parts)
    assert mesh.bounds[0] == pytest.approx([-3.0, 0.0, -2.0], abs=1e-6)
    assert mesh.bounds[1, 1:] == pytest.approx([3.15, 2.0], abs=1e-6)
    assert solid.area == pytest.approx(54.7, rel=0.01)


def test_teapot_poles_point_up_and_down():
    mesh = teapot_mesh(8)
    top, bottom = mesh.positions[:, 1].argmax(), np.abs(mesh.positions).sum(axis=1).argmin()
    assert mesh.normals[top, 1] > 0.999
    assert mesh.normals[bottom, 1] < -0.999


def test_teapot_segments_are_bounded():
    with pytest.raises(InputError, match="segments: expected 2 to 128, got 1000"):
        teapot_mesh(1000)


def test_floor_has_maps_and_touches_the_box_from_below():
    node = floor_node([[1e6, 3.0, 0], [1e6 + 2, 5.0, 1]])
    assert node.bounds[:, 1].tolist() == [3.0, 3.0]
    assert node.mesh.has_tangents
    decoded = floor_material(64).normal_texture.decode()[..., :3] * 2 - 1
    assert np.allclose(np.linalg.norm(decoded, axis=2), 1.0, atol=0.02)


def test_texture_decodes_srgb_and_keeps_alpha_linear():
    texture = Texture.make(np.full((1, 1, 4), 188, np.uint8))
    assert texture.decode()[0, 0] == pytest.approx([0.503, 0.503, 0.503, 188 / 255], abs=1e-3)
    assert Texture.make(np.full((1, 1), 51, np.uint8), "linear").decode()[0, 0, 0] == pytest.approx(0.2)


@pytest.mark.parametrize(
    ("pixels", "space", "text"),
    [
        (np.zeros((2, 2, 5), np.uint8), "srgb", r"texture 't': expected shape"),
        (np.zeros((2, 2)), "srgb", "expected uint8, got float64"),
        (np.zeros((2, 2), np.uint8), "rec709", "color_space: expected 'srgb' or 'linear'"),
        (np.broadcast_to(np.uint8(0), (1 << 14, 1 << 13)), "srgb", "more than the limit"),
    ],
)
def test_bad_textures_are_named(pixels, space, text):
    with pytest.raises(InputError, match=text):
        Texture.make(pixels, space, "t")


@pytest.mark.parametrize(
    ("fields", "text"),
    [
        ({"base_color": (1, 1, 2, 1)}, r"material 'm': base_color: expected four numbers in \[0, 1\]"),
        ({"alpha_mode": "glass"}, "alpha_mode: expected 'opaque'"),
        ({"height_scale": -1}, "height_scale: expected a finite number"),
    ],
)
def test_bad_materials_are_named(fields, text):
    with pytest.raises(InputError, match=text):
        Material("m", **fields)


@pytest.mark.parametrize(
    ("matrix", "text"),
    [
        (np.eye(3), r"node 'n': transform: expected a \(4, 4\) matrix"),
        (np.full((4, 4), np.nan), "NaN"),
        (scaling((1, 0, 1)), "singular"),
        (np.eye(4) * 2, "last row 0 0 0 1"),
    ],
)
def test_bad_transforms_are_named(matrix, text):
    with pytest.raises(InputError, match=text):
        Node(box(1.0), transform=matrix, name="n")


def test_a_scene_needs_a_node():
    with pytest.raises(InputError, match="no nodes"):
        Scene((), Scene.shipped().camera)


def test_shipped_scene_is_bounded_and_sees_the_teapot():
    scene = Scene.shipped()
    teapot = next(node for node in scene.nodes if node.name == "teapot")
    corners = np.c_[teapot.bounds[[0, 1, 0, 1]] * [1, 1, 1], np.ones(4)]
    v = corners @ (scene.camera.projection_matrix(16 / 9) @ scene.camera.view_matrix()).T
    assert np.abs(v[:, :3] / v[:, 3:]).max() < 1.0
    assert scene.lights[0].radius > 0.0


def test_import_is_light():
    code = "import sys, passgraph.scene; sys.exit(any(m in sys.modules for m in ('trimesh', 'PIL', 'scipy')))"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
