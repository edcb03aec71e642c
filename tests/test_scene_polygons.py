"""Polygons, strips and colors of OBJ, PLY and OFF files, which trimesh changes or drops without a word."""

from __future__ import annotations

import struct

import numpy as np
import pytest

from passgraph.errors import InputError
from passgraph.scene import Scene
from passgraph.scene import polygons as polygons_module
from passgraph.scene.polygons import triangles_of_polygons

# A notched square, wound both ways and from each of its corners: the fan of some corners leaves it.
NOTCHED = [(4, 4, 0), (2, 1, 0), (0, 4, 0), (0, 0, 0), (4, 0, 0)]
NOTCHED_AREA = 10.0
# the same polygon leaning in space: an isometry times 2
LEANING = 2.0 * np.linalg.qr(np.array([[1.0, 2, 3], [0, 1, 4], [5, 6, 0]]))[0]


def obj_of(points, polygons):
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in np.asarray(points, float).tolist()]
    return "\n".join(lines + ["f " + " ".join(str(i + 1) for i in face) for face in polygons]) + "\n"


def off_of(points, polygons):
    lines = [f"{x!r} {y!r} {z!r}" for x, y, z in np.asarray(points, float).tolist()]
    lines += [f"{len(face)} " + " ".join(map(str, face)) for face in polygons]
    return f"OFF\n{len(points)} {len(polygons)} 0\n" + "\n".join(lines) + "\n"


def ply_header(form, vertices, faces, more="", element="face", length="uchar"):
    return (
        f"ply\nformat {form} 1.0\ncomment made by hand\nelement vertex {vertices}\nproperty double x\n"
        f"property double y\nproperty double z\n{more}element {element} {faces}\n"
        f"property list {length} int vertex_indices\nend_header\n"
    )


def ply_of(points, polygons, form="ascii"):
    points = np.asarray(points, float).tolist()
    head = ply_header(form, len(points), len(polygons))
    if form == "ascii":
        rows = [" ".join(map(repr, row)) for row in points] + [f"{len(f)} " + " ".join(map(str, f)) for f in polygons]
        return (head + "\n".join(rows) + "\n").encode()
    order = "<" if "little" in form else ">"
    body = b"".join(struct.pack(order + "3d", *row) for row in points)
    return head.encode() + body + b"".join(struct.pack(f"{order}B{len(f)}i", len(f), *f) for f in polygons)


WRITERS = {
    "m.obj": obj_of,
    "m.off": off_of,
    "text.ply": ply_of,
    "little.ply": lambda points, polygons: ply_of(points, polygons, "binary_little_endian"),
    "big.ply": lambda points, polygons: ply_of(points, polygons, "binary_big_endian"),
}


def written(folder, name, points, polygons):
    text = WRITERS[name](points, polygons)
    (folder / name).write_bytes(text if isinstance(text, bytes) else text.encode())
    return folder / name


def one_mesh(path):
    (node,) = Scene.load(path, ground=False).nodes
    return node.mesh


def area_of(mesh):
    a, b, c = (mesh.positions[mesh.triangles[:, k]].astype(np.float64) for k in range(3))
    return float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2.0)


@pytest.mark.parametrize("name", WRITERS)
@pytest.mark.parametrize("first", range(5))
def test_concave_polygons_are_not_filled_beyond_their_edges(tmp_path, name, first):
    order = [(first + k) % 5 for k in range(5)]
    points = np.array(NOTCHED, float) @ LEANING.T + 7.0
    for face in (order, order[::-1]):
        mesh = one_mesh(written(tmp_path, name, points, [face]))
        assert len(mesh.triangles) == 3
        assert area_of(mesh) == pytest.approx(4.0 * NOTCHED_AREA, rel=1e-6)


@pytest.mark.parametrize("name", WRITERS)
def test_polygons_of_mixed_size_are_read(tmp_path, name):
    """A triangle, a square, a notched square and a hexagon side by side."""
    angles = np.arange(6) * np.pi / 3.0
    hexagon = np.stack([np.cos(angles) + 20.0, np.sin(angles), np.zeros(6)], axis=1)
    square = [(10, 0, 0), (11, 0, 0), (11, 1, 0), (10, 1, 0)]
    points = np.concatenate([NOTCHED, square, hexagon, [(30, 0, 0), (31, 0, 0), (30, 1, 0)]])
    faces = [[15, 16, 17], [5, 6, 7, 8], [0, 1, 2, 3, 4], [9, 10, 11, 12, 13, 14]]
    mesh = one_mesh(written(tmp_path, name, points, faces))
    assert len(mesh.triangles) == 1 + 2 + 3 + 4
    assert area_of(mesh) == pytest.approx(0.5 + 1.0 + NOTCHED_AREA + 1.5 * np.sqrt(3.0), rel=1e-6)


def test_random_star_shaped_polygons_keep_their_area():
    """The area of a polygon by its corners' coordinates (the shoelace formula) is that of its triangles."""
    random = np.random.default_rng(5)
    for corners in (4, 5, 7, 12, 40):
        angles = np.sort(random.uniform(0.0, 2.0 * np.pi, corners))
        radii = random.uniform(0.2, 1.0, corners)
        flat = np.stack([radii * np.cos(angles), radii * np.sin(angles)], axis=1)
        if np.diff(angles, append=angles[0] + 2.0 * np.pi).max() >= np.pi:
            continue  # the center lies outside
        x, y = flat.T
        due = 0.5 * float((x * np.roll(y, -1) - np.roll(x, -1) * y).sum())
        rows = triangles_of_polygons(np.column_stack([flat, np.zeros(corners)]), np.array([corners]))
        a, b, c = (flat[rows[:, k]] for k in range(3))
        parts = 0.5 * ((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0])
        assert (parts > -1e-12).all()
        assert parts.sum() == pytest.approx(due, rel=1e-12)


def test_a_polygon_that_crosses_itself_stays_a_fan():
    bow_tie = np.array([(0, 0, 0), (1, 1, 0), (1, 0, 0), (0, 1, 0)], float)
    assert len(triangles_of_polygons(bow_tie, np.array([4]))) == 2


def test_concave_polygons_of_too_many_corners_are_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(polygons_module, "MAX_CONCAVE_CORNERS", 4)
    with pytest.raises(InputError, match="a concave polygon has 5 corners; expected at most 4, split it"):
        Scene.load(written(tmp_path, "m.off", NOTCHED, [[0, 1, 2, 3, 4]]))


def test_obj_corners_keep_their_texture_coordinates_and_relative_numbers(tmp_path):
    text = "".join(f"v {x} {y} 0\nvt {x / 4} {y / 4}\n" for x, y, _ in NOTCHED)
    (tmp_path / "m.obj").write_text(text + "f -5/-5 -4/-4 \\\n-3/-3 -2/-2 -1/-1 # a comment\n")
    mesh = one_mesh(tmp_path / "m.obj")
    assert area_of(mesh) == pytest.approx(NOTCHED_AREA)
    expected = np.stack([mesh.positions[:, 0] / 4.0, 1.0 - mesh.positions[:, 1] / 4.0], axis=1)
    assert np.allclose(mesh.uvs, expected)


@pytest.mark.parametrize("form", ["ascii", "binary_little_endian", "binary_big_endian"])
def test_ply_strips_are_triangles(tmp_path, form):
    """Two strips in one list: a square of two triangles, and one triangle; every second triangle is reversed."""
    points = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (1, 1, 0), (5, 0, 0), (6, 0, 0), (5, 1, 0)], float)
    strip = [0, 1, 2, 3, -1, 4, 5, 6]
    head = ply_header(form, len(points), 1, element="tristrips", length="int")
    if form == "ascii":
        rows = [" ".join(map(repr, row)) for row in points.tolist()]
        data = (head + "\n".join(rows) + f"\n{len(strip)} " + " ".join(map(str, strip)) + "\n").encode()
    else:
        order = "<" if "little" in form else ">"
        data = head.encode() + points.astype(order + "f8").tobytes() + np.array([8, *strip], order + "i4").tobytes()
    (tmp_path / "m.ply").write_bytes(data)
    mesh = one_mesh(tmp_path / "m.ply")
    a, b, c = (mesh.positions[mesh.triangles[:, k]] for k in range(3))
    assert np.cross(b - a, c - a)[:, 2].tolist() == [1.0, 1.0, 1.0]


def test_ply_lines_may_end_with_cr(tmp_path):
    for end in ("\r", "\r\n"):
        (tmp_path / "m.ply").write_bytes(ply_of(NOTCHED, [[0, 1, 2, 3, 4]]).replace(b"\n", end.encode()))
        assert area_of(one_mesh(tmp_path / "m.ply")) == pytest.approx(NOTCHED_AREA)
    header, body = ply_of(NOTCHED, [[0, 1, 2, 3, 4]], "binary_little_endian").split(b"end_header\n")
    (tmp_path / "m.ply").write_bytes(header.replace(b"\n", b"\r") + b"end_header\r" + body)
    assert area_of(one_mesh(tmp_path / "m.ply")) == pytest.approx(NOTCHED_AREA)


@pytest.mark.parametrize("prefix", ["", "diffuse_"])
def test_ply_colors_of_both_names_are_shown(tmp_path, prefix):
    more = "".join(f"property uchar {prefix}{name}\n" for name in ("red", "green", "blue"))
    text = ply_header("ascii", 3, 1, more) + "0 0 0 188 0 255\n1 0 0 188 0 255\n0 1 0 188 0 255\n3 0 1 2\n"
    (tmp_path / "m.ply").write_text(text)
    assert one_mesh(tmp_path / "m.ply").colors[0] == pytest.approx([0.503, 0.0, 1.0, 1.0], abs=1e-3)


def test_ply_corners_may_have_their_own_texture_coordinates(tmp_path):
    head = ply_header("ascii", 5, 1).replace("end_header", "property list uchar float texcoord\nend_header")
    corners = [(x / 4 + 1, y / 4) for x, y, _ in NOTCHED]
    rows = [f"{x} {y} {z}" for x, y, z in NOTCHED]
    rows.append("5 0 1 2 3 4 10 " + " ".join(f"{u} {v}" for u, v in corners))
    (tmp_path / "m.ply").write_text(head + "\n".join(rows) + "\n")
    mesh = one_mesh(tmp_path / "m.ply")
    expected = np.stack([mesh.positions[:, 0] / 4.0 + 1.0, 1.0 - mesh.positions[:, 1] / 4.0], axis=1)
    assert np.allclose(mesh.uvs, expected)


def test_off_colors_and_normals_are_read(tmp_path):
    (tmp_path / "a.off").write_text("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2 188 0 255\n")
    (tmp_path / "b.off").write_text(
        "COFF 3 1 0\n0 0 0 188 0 255 255\n1 0 0 188 0 255 255\n0 1 0 188 0 255 255\n3 0 1 2\n"
    )
    for name in ("a.off", "b.off"):
        assert one_mesh(tmp_path / name).colors[0] == pytest.approx([0.503, 0.0, 1.0, 1.0], abs=1e-3)
    (tmp_path / "n.off").write_text("NOFF\n3 1 0\n0 0 0 .6 0 .8\n1 0 0 .6 0 .8\n0 1 0 .6 0 .8\n3 0 1 2\n")
    assert one_mesh(tmp_path / "n.off").normals[0] == pytest.approx([0.6, 0.0, 0.8])


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("m.ply", "ply\nformat ascii 1.0\nelement vertex 1\n", "no header from 'ply' to 'end_header'"),
        ("m.ply", "ply\nformat utf8 1.0\nend_header\n", "its format is 'utf8'; expected ascii, binary_little"),
        ("m.ply", "ply\nformat ascii 1.0\nelement vertex 1\nproperty half x\nend_header\n0\n", "of the type 'half'"),
        ("m.ply", ply_header("ascii", 1, 0) + "0 0", "it ends early"),
        ("m.ply", ply_header("ascii", 1, 1) + "0 0 0 3 0 0 1", "a polygon names a vertex outside 0..0"),
        ("m.ply", ply_header("ascii", 1, 1, length="char") + "0 0 0 -3 0 0 0", "a list has -3 values"),
        ("m.ply", ply_header("ascii", 1, 2) + "0 0 0 3 0 0 0 4 0 0", "it ends early"),
        ("m.off", "OOF\n", "it begins with 'OOF'; expected OFF"),
        ("m.off", "OFF\n3 1 0\n0 0 0\n", "it is truncated: 3 vertices and 1 polygons"),
        ("m.off", "OFF\n1 1 0\n0 0 0\n3 0 0\n", "a polygon's line has fewer corners than its first number says"),
        ("m.off", "OFF\n1 1 0\n0 0 0\n3 0 0 1\n", "a polygon names a vertex outside 0..0"),
    ],
)
def test_damaged_polygons_are_refused(tmp_path, name, text, message):
    (tmp_path / name).write_text(text)
    with pytest.raises(InputError, match="corrupt or truncated") as caught:
        Scene.load(tmp_path / name)
    assert message in str(caught.value)
