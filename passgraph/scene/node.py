"""A mesh placed in the world with a material."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from passgraph import arguments
from passgraph.cached import cached_property
from passgraph.errors import InputError
from passgraph.scene.material import Material
from passgraph.scene.matrices import Float64, matrix4, transform_points
from passgraph.scene.mesh import Mesh


@dataclass(frozen=True, eq=False)
class Node:
    """One drawn thing.

    Attributes
    ----------
    mesh : shared freely between nodes; tangents are added here when the material needs them
    material : how its surface looks
    transform : (4, 4) float64, mesh frame to world
    name : used in messages
    casts, receives : whether it throws and whether it shows shadows

    >>> triangle = Mesh.make([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    >>> Node(triangle).bounds.tolist()
    [[0.0, 0.0, 0.0], [1.0, 1.0, 0.0]]
    """

    mesh: Mesh
    material: Material = field(default_factory=Material)
    transform: Float64 = field(default_factory=lambda: np.eye(4))
    name: str = "node"
    casts: bool = True
    receives: bool = True

    def __post_init__(self) -> None:
        where = f"node {arguments.string(self.name, 'the name of a node')!r}"
        arguments.instance(self.mesh, Mesh, f"{where}: mesh", "a pg.Mesh, made by pg.Mesh.make(...)", InputError)
        arguments.instance(self.material, Material, f"{where}: material", "a pg.Material", InputError)
        for switch in ("casts", "receives"):
            arguments.flag(getattr(self, switch), f"{where}: {switch}", InputError)
        transform = matrix4(self.transform, f"{where}: transform")
        transform.setflags(write=False)
        object.__setattr__(self, "transform", transform)
        if self.material.needs_tangents and self.mesh.has_uvs:
            object.__setattr__(self, "mesh", self.mesh.with_tangents())

    @cached_property
    def bounds(self) -> Float64:
        """The box round all vertices in the world, (2, 3) float64."""
        points = transform_points(self.transform, self.mesh.positions)
        return np.stack([points.min(axis=0), points.max(axis=0)])

    @property
    def flips_winding(self) -> bool:
        """Whether the transform mirrors, so that front faces become clockwise."""
        return bool(np.linalg.det(self.transform[:3, :3]) < 0.0)

    def normal_matrix(self) -> Float64:
        """Inverse transpose of the linear part, (3, 3) float64; normals need normalising after it."""
        return np.asarray(np.linalg.inv(self.transform[:3, :3]).T, dtype=np.float64)
