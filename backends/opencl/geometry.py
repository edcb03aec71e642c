"""Meshes on an OpenCL device."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from passgraph.backends.base import vertex_attribute
from passgraph.graph.geometry import Geometry

if TYPE_CHECKING:
    from passgraph.backends.opencl.backend import OpenCLBackend


class DeviceMesh:
    """Triangles, and the attributes that some vertex kernel has asked for; each is uploaded once."""

    def __init__(self, backend: OpenCLBackend, mesh: Geometry) -> None:
        self.backend = backend
        self.mesh = mesh
        self.vertex_count = len(mesh.positions)
        self.triangle_count = len(mesh.triangles)
        self.triangles = self._upload(np.ascontiguousarray(mesh.triangles, np.int32), "triangles")
        self.attributes: dict[str, Any] = {}

    def attribute(self, name: str) -> Any:
        """The buffer of an attribute such as ``normal``."""
        if name not in self.attributes:
            self.attributes[name] = self._upload(vertex_attribute(self.mesh, name), name)
        return self.attributes[name]

    def _upload(self, array: Any, what: str) -> Any:
        buffer = self.backend.allocate(array.nbytes, f"the {what} of a mesh of {self.vertex_count:,} vertices")
        self.backend.free_with(self, buffer)
        with self.backend.reported(f"uploading {what}"):
            self.backend.cl.enqueue_copy(self.backend.queue, buffer, array, is_blocking=True)
        return buffer
