"""Normals of models whose files have none: sharp edges stay sharp, held against shapes whose normals are known."""

from __future__ import annotations

from collections import defaultdict
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
import trimesh

from passgraph.scene import Scene
from passgraph.scene.meshes import CREASE_RAD, creased_normals


def shown(shape: trimesh.Trimesh, folder: Path, suffix: str) -> tuple[np.ndarray, np.ndarray]:
    """The corners of a shape that was loaded from a file without normals, and their normals: (m, 3, 3) each."""
    file = folder / f"shape{suffix}"
    shape.export(file)
    mesh = Scene.load(file, ground=False).nodes[0].mesh
    assert not mesh.has_normals
    return mesh.positions[mesh.triangles], mesh.normals[mesh.triangles]


@pytest.mark.parametrize("suffix", [".obj", ".ply", ".off"])
def test_a_box_has_flat_sides(tmp_path: Path, suffix: str) -> None:
    corners, normals = shown(trimesh.creation.box((1, 2, 3)), tmp_path, suffix)
    flat = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    flat /= np.linalg.norm(flat, axis=1, keepdims=True)
    assert np.abs(normals - flat[:, None]).max() < 1e-6


def test_a_cylinder_is_round_and_its_ends_are_flat(tmp_path: Path) -> None:
    corners, normals = shown(trimesh.creation.cylinder(1.0, 2.0, sections=16), tmp_path, ".ply")
    at_end = np.ptp(corners[:, :, 2], axis=1) < 1e-6
    assert 0 < at_end.sum() < len(at_end)
    assert np.abs(np.abs(normals[at_end][..., 2]) - 1.0).max() < 1e-6
    side, radial = normals[~at_end], corners[~at_end] * (1.0, 1.0, 0.0)
    assert np.abs(side - radial).max() < 1e-3  # the sum of three triangles, two of one side, is a little off


def test_a_sphere_stays_smooth(tmp_path: Path) -> None:
    corners, normals = shown(trimesh.creation.icosphere(subdivisions=2), tmp_path, ".off")
    assert np.abs(normals - corners).max() < 0.02


@pytest.mark.parametrize(("sides", "sharp"), [(6, True), (8, False)])
def test_eight_sides_look_round_and_six_do_not(sides: int, sharp: bool, tmp_path: Path) -> None:
    corners, normals = shown(trimesh.creation.cylinder(1.0, 2.0, sections=sides), tmp_path, ".ply")
    side = np.ptp(corners[:, :, 2], axis=1) > 1.0
    assert (np.ptp(normals[side], axis=1).max() < 1e-6) == sharp


def walked(positions: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """The same by walking from corner to corner over smooth edges, in Python: (m, 3, 3) normals."""
    points = positions[triangles]
    face = np.cross(points[:, 1] - points[:, 0], points[:, 2] - points[:, 0])
    lengths = np.linalg.norm(face, axis=1, keepdims=True)
    face = np.where(lengths > 0, face / np.where(lengths > 0, lengths, 1), 0)
    keys = {tuple(p): i for i, p in enumerate(positions.tolist())}
    at = [[keys[tuple(p)] for p in row] for row in points.tolist()]
    edges: dict[tuple[int, int], list[tuple[int, dict[int, int]]]] = defaultdict(list)
    for f, row in enumerate(at):
        for side in range(3):
            a, b = row[side], row[(side + 1) % 3]
            if a != b:
                edges[min(a, b), max(a, b)].append((f, {a: 3 * f + side, b: 3 * f + (side + 1) % 3}))
    beside = defaultdict(set)
    for sharing in edges.values():
        for (f, here), (g, there) in pairwise(sharing):
            if face[f] @ face[g] >= np.cos(CREASE_RAD):
                for place in here:
                    beside[here[place]].add(there[place])
                    beside[there[place]].add(here[place])
    made = np.zeros((3 * len(at), 3))
    for corner in range(len(made)):
        fan, left = {corner}, [corner]
        while left:
            new = beside[left.pop()] - fan
            fan |= new
            left += new
        for one in fan:
            p = points[one // 3]
            to = [p[(one % 3 + k) % 3] - p[one % 3] for k in (1, 2)]
            norms = np.linalg.norm(to, axis=1)
            angle = np.arccos(np.clip(to[0] @ to[1] / max(norms.prod(), 1e-30), -1, 1))
            made[corner] += angle * face[one // 3]
    lengths = np.linalg.norm(made, axis=1, keepdims=True)
    return np.where(lengths > 1e-9, made / np.maximum(lengths, 1e-30), np.array([0, 1, 0])).reshape(-1, 3, 3)


@pytest.mark.parametrize("seed", range(6))
def test_random_soups_are_as_walked(seed: int) -> None:
    """Edges of any number of triangles, turned either way, vertices at one place, triangles without area."""
    rng = np.random.default_rng(seed)
    positions = rng.integers(0, 4, (30, 3)) * (1.0, 1.0, 0.3)
    triangles = rng.integers(0, 30, (80, 3))
    of, made, normals = creased_normals(positions, triangles)
    assert np.array_equal(of[made], triangles)
    held = normals[made] - walked(positions, triangles)
    area = np.linalg.norm(np.cross(*(positions[triangles[:, k]] - positions[triangles[:, 0]] for k in (1, 2))), axis=1)
    assert np.abs(held[area > 0]).max() < 1e-5


def test_one_vertex_of_many_triangles_takes_no_longer_than_many_vertices() -> None:
    count = 60_000
    angle = np.linspace(0.0, 2 * np.pi, count, endpoint=False)
    rim = np.stack([np.cos(angle), np.sin(angle), np.zeros(count)], axis=1)
    turns = np.random.default_rng(0).permutation(count)
    triangles = np.stack([np.full(count, count), turns, (turns + 1) % count], axis=1)
    of, _, normals = creased_normals(np.vstack([rim, [[0.0, 0.0, 0.1]]]), triangles)
    assert (of == count).sum() == 1
    assert normals[of == count][0] == pytest.approx([0, 0, 1], abs=1e-5)
