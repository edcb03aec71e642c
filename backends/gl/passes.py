"""Compiled passes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from passgraph.backends.base import ATTRIBUTES, Block, vertex_attribute
from passgraph.backends.driver import stored_clear
from passgraph.backends.gl import gl_functions as g
from passgraph.backends.gl import state as fixed
from passgraph.backends.gl.programs import LinkedProgram
from passgraph.backends.gl.state import Bound
from passgraph.backends.gl.textures import ALL_PLAIN, Objects, Texture, placements_of
from passgraph.graph.draw_state import Geometry
from passgraph.language.scalar import filtered_images
from passgraph.plan.data import DrawStep, PixelStep

if TYPE_CHECKING:
    from passgraph.backends.gl.backend import GLBackend


class Mesh:
    """A vertex array object; attributes are uploaded when a pass first reads them."""

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
        """Upload these attributes if needed; the vertex array is bound."""
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


def run_pixels(
    backend: GLBackend,
    program: LinkedProgram,
    outputs: Sequence[Texture],
    images: Sequence[Texture],
    block: Block,
    size: tuple[int, int],
) -> None:
    """Draw one triangle over whole targets; inside a run, or followed by ``backend.unbind()``."""
    gl, bound = backend.context.gl, backend.context.bound
    fixed.set_pixel_pass(gl, bound, backend.objects.framebuffer(outputs, None), size, outputs[0].origin)
    fixed.bind_images(gl, bound, images)
    fixed.use(gl, bound, program.name, backend.no_vertices)
    program.send(gl, "pixel", block)
    program.send_size(gl, size)
    program.send_parts(gl, outputs, images)
    gl.DrawArrays(g.TRIANGLES, 0, 3)


def with_filters(backend: GLBackend, images: Sequence[Texture], filtered: dict[int, str]) -> Sequence[Texture]:
    """Return the same textures, with filtering set on some."""
    if not filtered:
        return images
    samplers = {number: backend.objects.linear_sampler(border) for number, border in filtered.items()}
    return [replace(image, sampler=samplers.get(k, image.sampler)) for k, image in enumerate(images)]


class PixelRun:
    """A pixel pass: one triangle over the whole target."""

    def __init__(self, backend: GLBackend, step: PixelStep) -> None:
        self.backend, self.step = backend, step
        self.program = backend.programs.pixel(step.program)
        self.filtered = filtered_images(step.program)

    def __call__(self, outputs: Sequence[Texture], images: Sequence[Texture], block: Block) -> None:
        backend = self.backend
        if not backend.in_run:
            with backend.running():
                return self(outputs, images, block)
        placements = placements_of(outputs, images)
        program = self.program
        if placements is not ALL_PLAIN:
            program = backend.programs.pixel(self.step.program, placements)
        run_pixels(backend, program, outputs, with_filters(backend, images, self.filtered), block, self.step.size)
        backend.context.gl.check("running pass", self.step.name)


class DrawRun:
    """A draw: clears, then the triangles of a mesh."""

    def __init__(self, backend: GLBackend, step: DrawStep) -> None:
        self.backend, self.step = backend, step
        fixed.check_targets(backend.context.gl, step.state, step.output_formats, f"draw {step.name!r}")
        self.program = backend.programs.draw(step.vertex, step.fragment, step.varyings)
        self.guard = fixed.guard_band(backend.context.gl, step.size, backend.max_viewport)
        self.attributes = step.vertex.attributes
        factor, units = step.state.polygon_offset
        self.state = step.state
        if units:
            self.state = replace(step.state, polygon_offset=(factor, units / backend.offset_unit()))

    def __call__(
        self,
        outputs: Sequence[Texture],
        depth: Texture | None,
        images: Sequence[Texture],
        geometry: Mesh,
        vertex: Block,
        fragment: Block,
    ) -> None:
        backend = self.backend
        if not backend.in_run:
            with backend.running():
                return self(outputs, depth, images, geometry, vertex, fragment)
        gl, bound, step, program = backend.context.gl, backend.context.bound, self.step, self.program
        placements = placements_of((), images)
        if placements is not ALL_PLAIN:
            program = backend.programs.draw(step.vertex, step.fragment, step.varyings, placements)
        fixed.set_common(gl, bound, backend.objects.framebuffer(outputs, depth))
        self.clear(gl, bound, outputs, depth)
        fixed.set_guard_band(gl, bound, step.size, self.guard)
        fixed.set_draw(gl, bound, self.state, outputs, depth)
        fixed.bind_images(gl, bound, images)
        fixed.use(gl, bound, program.name, geometry.array)
        geometry.send(self.attributes)
        program.send_guard(gl, self.guard)
        program.send(gl, "vertex", vertex)
        if step.fragment is not None:
            program.send(gl, "fragment", fragment)
        program.send_size(gl, step.size)
        program.send_parts(gl, (), images)
        gl.DrawElements(g.TRIANGLES, geometry.count, g.UNSIGNED_INT, None)
        gl.check("running draw", step.name)

    def clear(self, gl: Any, bound: Bound, outputs: Sequence[Texture], depth: Texture | None) -> None:
        step = self.step
        colours = [
            (k, stored_clear(value, texture.format))
            for k, (value, texture) in enumerate(zip(step.clears, outputs, strict=True))
            if value is not None
        ]
        stencil = step.state.clear_stencil if depth is not None and depth.format.stencil else None
        fixed.clear_targets(gl, bound, colours, step.depth_clear if depth is not None else None, stencil)
