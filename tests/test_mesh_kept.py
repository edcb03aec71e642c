"""A mesh is drawn as it was when ``pg.draw`` was called, whatever becomes of it afterwards."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import passgraph as pg
from passgraph.backends.registry import open_backend
from tests.conftest import require

SIZE = (24, 16)
STAGES = """
class Corner:
    position: vec4
    level: float

def place(vertex: Vertex, z: float) -> Corner:
    return Corner(vec4(vertex.position.xy, z, 1.0), vertex.normal.x)

def paint(corner: Corner) -> vec4:
    return vec4(corner.level)
"""
PLACE, PAINT = pg.vertex(source=STAGES, name="place"), pg.fragment(source=STAGES, name="paint")
COVERING = [[-1, -1, 0], [3, -1, 0], [-1, 3, 0]]


@dataclasses.dataclass
class OwnMesh:
    """A caller's mesh, which can change; float64 and int64, as callers have them."""

    positions: Any
    triangles: Any
    normals: Any


def own_mesh() -> OwnMesh:
    return OwnMesh(np.array(COVERING, np.float64), np.array([[0, 1, 2]]), np.full((3, 3), 0.5))


def drawn(mesh: Any) -> pg.Target:
    made: pg.Target = pg.draw(mesh, vertex=PLACE, fragment=PAINT, z=pg.Value("z", float), into=pg.target(
        "drawn", "rgba32f", SIZE, clear=0.0))  # fmt: skip
    return made


def grow(mesh: OwnMesh) -> None:
    mesh.positions = np.zeros((100_000, 3))
    mesh.triangles = np.arange(99_999).reshape(-1, 3)
    mesh.normals = np.ones((100_000, 3))


def shrink(mesh: OwnMesh) -> None:
    mesh.positions, mesh.normals = mesh.positions[:1], mesh.normals[:1]


def point_beyond(mesh: OwnMesh) -> None:
    mesh.triangles[:] = 2**30


def move(mesh: OwnMesh) -> None:
    mesh.positions[:] = 9.0
    mesh.normals[:] = 9.0


def take_away(mesh: OwnMesh) -> None:
    mesh.normals = None


@pytest.mark.parametrize("change", [grow, shrink, point_beyond, move, take_away])
@pytest.mark.parametrize("name", ["numpy", "gl", "opencl", "webgpu", "reference"])
def test_what_becomes_of_a_mesh_changes_no_picture(name: str, change: Callable[[OwnMesh], None]) -> None:
    """Changed before compiling, before the first run and between runs: half everywhere, always."""
    if name != "reference":
        require(name)
    with open_backend(name) as backend:
        meshes = [own_mesh() for _ in range(3)]
        targets = [drawn(mesh) for mesh in meshes]
        change(meshes[0])
        programs = [pg.compile(target, backend=backend) for target in targets]
        change(meshes[1])
        for z in (0.0, 0.5):
            for program in programs:
                np.testing.assert_array_equal(program(z=z)["drawn"], np.full((SIZE[1], SIZE[0], 4), np.float32(0.5)))
            change(meshes[2]) if z == 0.0 else None


def test_a_mesh_of_our_own_is_not_copied_and_refuses_changes() -> None:
    mesh = pg.Mesh.make(COVERING, [[0, 1, 2]])
    assert drawn(mesh).made_by.geometry is mesh  # type: ignore[union-attr]
    with pytest.raises(dataclasses.FrozenInstanceError, match="cannot assign to field 'positions'"):
        mesh.positions = np.zeros((9, 3), np.float32)  # type: ignore[misc]
    for name in ("positions", "triangles", "normals", "uvs", "colors", "tangents"):
        with pytest.raises(ValueError, match="read-only"):
            getattr(mesh, name)[0] = 0


@pytest.mark.parametrize("writable", [True, False], ids=["its own array", "a view of a writable array"])
def test_a_frozen_mesh_over_memory_that_can_change_is_copied(writable: bool) -> None:
    positions = np.array(COVERING, np.float32)
    given = positions if writable else positions[:]
    given.setflags(write=writable)
    mesh = dataclasses.replace(pg.Mesh.make(COVERING, [[0, 1, 2]]), positions=given)
    kept = drawn(mesh).made_by.geometry  # type: ignore[union-attr]
    positions[:] = 7.0
    assert kept.positions.tolist() == COVERING


def test_one_array_for_two_draws_stays_apart() -> None:
    """Each draw keeps what the mesh was at that moment."""
    mesh = SimpleNamespace(positions=np.array(COVERING, np.float32), triangles=np.array([[0, 1, 2]], np.int32))
    first = drawn(mesh)
    mesh.positions[:, 2] = 4.0
    second = drawn(mesh)
    assert [t.made_by.geometry.positions[0, 2] for t in (first, second)] == [0.0, 4.0]  # type: ignore[union-attr]
