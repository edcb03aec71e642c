"""Meshes on the device: a buffer for each attribute that some pass reads, sent once."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from passgraph.backends.base import ATTRIBUTES, vertex_attribute
from passgraph.backends.gl import functions as g
from passgraph.backends.gl.objects import Objects
from passgraph.graph.geometry import Geometry


class Mesh:
    """One vertex array object; attributes join it when a pass first reads them."""

    def __init__(self, objects: Objects, mesh: Geometry) -> None:
        self.objects, self.mesh = objects, mesh
        gl = objects.gl
        self.buffers: list[int] = []
        self.attributes: set[str] = set()
        self.array = objects.new("VertexArray")
        triangles = np.ascontiguousarray(mesh.triangles, np.uint32)
        self.count = triangles.size
        gl.BindVertexArray(self.array)
        gl.BindBuffer(g.ELEMENT_ARRAY_BUFFER, self._buffer())
        gl.BufferData(g.ELEMENT_ARRAY_BUFFER, triangles.nbytes, triangles.ctypes.data, g.STATIC_DRAW)
        gl.BindVertexArray(0)
        gl.check(f"sending {self.count // 3} triangles")

    def _buffer(self) -> int:
        self.buffers.append(self.objects.new("Buffer"))
        return self.buffers[-1]

    def send(self, attributes: tuple[str, ...]) -> None:
        """Have at least these attributes in the vertex array, which is bound."""
        for name in attributes:
            if name not in self.attributes:
                self._send(name, vertex_attribute(self.mesh, name))

    def _send(self, name: str, values: NDArray[np.float32]) -> None:
        gl, location = self.objects.gl, list(ATTRIBUTES).index(name)
        gl.BindBuffer(g.ARRAY_BUFFER, self._buffer())
        gl.BufferData(g.ARRAY_BUFFER, values.nbytes, values.ctypes.data, g.STATIC_DRAW)
        gl.EnableVertexAttribArray(location)
        gl.VertexAttribPointer(location, values.shape[1], g.FLOAT, 0, 0, None)
        gl.BindBuffer(g.ARRAY_BUFFER, 0)
        gl.check(f"sending {name} of {len(values)} vertices")
        self.attributes.add(name)

    def release(self) -> None:
        self.objects.delete("VertexArray", self.array)
        for buffer in self.buffers:
            self.objects.delete("Buffer", buffer)
