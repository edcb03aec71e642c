"""Which sides of surfaces are seen: of files that say it, of files that do not, and where it is asked for."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest
import trimesh

import passgraph as pg
from passgraph.commands.entry import run
from passgraph.scene.meshes import Mesh
from passgraph.scene.sides import with_outside

BALL = trimesh.creation.icosphere(2)
#: Without its upper part.
BOWL = BALL.faces[BALL.triangles_center[:, 1] < 0.4]


def saved(path: Path, faces: np.ndarray, vertices: np.ndarray = BALL.vertices) -> Path:
    trimesh.Trimesh(vertices, faces, process=False).export(path)
    return path


def some_turned(faces: np.ndarray) -> np.ndarray:
    turned = np.random.default_rng(0).random(len(faces)) < 0.4
    return np.where(turned[:, None], faces[:, ::-1], faces)


def is_two_sided(path: Path) -> bool:
    (node,) = pg.Scene.load(path, ground=False).nodes
    return node.material.double_sided


def outsides(node: pg.Node) -> np.ndarray:
    """Of each triangle of a ball round the middle, how far its front looks outward."""
    a, b, c = (node.mesh.positions[node.mesh.triangles[:, k]] for k in range(3))
    return (np.cross(b - a, c - a) * (a + b + c)).sum(axis=1)


@pytest.mark.parametrize("suffix", [".obj", ".off", ".ply", ".stl"])
def test_what_is_open_or_wound_both_ways_is_seen_from_both_sides(tmp_path: Path, suffix: str) -> None:
    assert not is_two_sided(saved(tmp_path / f"ball{suffix}", BALL.faces))
    assert is_two_sided(saved(tmp_path / f"bowl{suffix}", BOWL))
    assert is_two_sided(saved(tmp_path / f"mixed{suffix}", some_turned(BALL.faces)))
    inner = BALL.vertices * 0.5
    hollow = np.concatenate([BALL.vertices, inner]), np.concatenate([BALL.faces, BALL.faces[:, ::-1] + len(inner)])
    assert is_two_sided(saved(tmp_path / f"hollow{suffix}", hollow[1], hollow[0]))


@pytest.mark.parametrize("suffix", [".obj", ".stl"])
def test_a_body_that_is_inside_out_is_turned(tmp_path: Path, suffix: str) -> None:
    (node,) = pg.Scene.load(saved(tmp_path / f"ball{suffix}", BALL.faces[:, ::-1]), ground=False).nodes
    assert not node.material.double_sided
    assert (outsides(node) > 0.0).all()
    assert ((node.mesh.normals * node.mesh.positions).sum(axis=1) > 0.9).all()


def test_normals_of_a_file_say_where_the_outside_is(tmp_path: Path) -> None:
    lines = [f"v {x} {y} {z}\nvn {x} {y} {z}" for x, y, z in BALL.vertices]
    for name, faces in (("all", BALL.faces[:, ::-1]), ("some", some_turned(BALL.faces))):
        corners = [" ".join(f"{i + 1}//{i + 1}" for i in face) for face in faces]
        (tmp_path / f"{name}.obj").write_text("\n".join([*lines, *(f"f {corner}" for corner in corners)]))
        (node,) = pg.Scene.load(tmp_path / f"{name}.obj", ground=False).nodes
        assert not node.material.double_sided
        assert (outsides(node) > 0.0).all()


def test_gltf_says_it_itself(tmp_path: Path) -> None:
    assert not is_two_sided(saved(tmp_path / "bowl.glb", BOWL))
    mesh = trimesh.Trimesh(BALL.vertices, BOWL, process=False)
    mesh.visual = trimesh.visual.TextureVisuals(material=trimesh.visual.material.PBRMaterial(doubleSided=True))
    mesh.export(tmp_path / "said.glb")
    assert is_two_sided(tmp_path / "said.glb")


@pytest.mark.parametrize("scale", [1e-20, 1.0, 1e18])
def test_parts_count_one_by_one_at_any_size(scale: float) -> None:
    """Two balls far apart, one inside out: together their volume is above 0, which tells nothing of the smaller one."""
    small = BALL.vertices * 0.1 + [30.0, 0.0, 0.0]
    vertices = np.concatenate([BALL.vertices, small]) * scale
    for turn, expected in ((1, True), (-1, False)):
        faces = np.concatenate([BALL.faces, BALL.faces[:, ::turn] + len(small)])
        assert with_outside(Mesh.make(vertices, faces))[1] == expected


def test_what_has_no_inside_is_seen_from_both_sides() -> None:
    flat = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
    for faces in ([[0, 1, 2]], [[0, 1, 2], [0, 2, 1]], [[0, 0, 0]], [[0, 1, 1]]):
        assert not with_outside(Mesh.make(flat, faces))[1]


def test_scenes_share_what_they_shared_when_both_sides_are_seen() -> None:
    material = pg.Material("one")
    node = pg.Node(Mesh.make(BALL.vertices, BALL.faces), material)
    scene = pg.Scene((node, dataclasses.replace(node, name="other")), pg.Scene.shipped().camera).two_sided()
    assert scene.nodes[0].material is scene.nodes[1].material
    assert scene.nodes[0].material.double_sided
    assert not material.double_sided


def test_a_render_shows_the_inside_of_what_is_open(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Seen from above, the middle of a bowl is its inside, lit from above too; not the sky through it."""
    monkeypatch.chdir(tmp_path)
    saved(Path("bowl.obj"), BOWL)
    saved(Path("bowl.glb"), BOWL)
    look = ["--elevation", "80", "--ground", "none", "--size", "32x32", "-b", "numpy", "--antialias", "none"]
    shown = {}
    for name, *more in (("bowl.obj",), ("bowl.glb",), ("bowl.glb", "--two-sided")):
        assert run(["render", name, *more, *look, "-o", "out.png"]) == 0
        shown[name, *more] = pg.load("out.png")[14:18, 14:18, :3].mean(axis=(0, 1))
    inside, through = shown["bowl.glb", "--two-sided"], shown["bowl.glb",]
    assert np.ptp(inside) < 0.05 < np.ptp(through)  # what is seen through it is the sky, which is blue
    assert np.ptp(shown["bowl.obj",]) < 0.05
