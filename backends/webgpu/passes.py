"""Compiled passes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from passgraph.backends.base import ATTRIBUTES, Block, vertex_attribute
from passgraph.backends.driver import stored_clear
from passgraph.backends.webgpu.programs import packed, packed_tables
from passgraph.backends.webgpu.states import color_target, depth_stencil, guard_band, primitive
from passgraph.backends.webgpu.textures import Texture
from passgraph.backends.webgpu.wgsl import FIRST_IMAGE, LINEAR, NEAREST, PARAMETERS
from passgraph.formats import FORMATS
from passgraph.graph.draw_state import Geometry
from passgraph.language.scalar import ScalarProgram, filtered_images
from passgraph.plan.data import DrawStep, PixelStep

if TYPE_CHECKING:
    from passgraph.backends.webgpu.backend import WebGPUBackend

#: Most bind groups kept by a stage: targets with history alternate.
MOST_GROUPS = 16


class Stage:
    """Parameters and bind groups of one program of a pass."""

    def __init__(self, backend: WebGPUBackend, program: ScalarProgram, size: tuple[int, int], guard: float = 1) -> None:
        self.backend, self.program, self.size, self.guard = backend, program, size, guard
        self.layout = backend.programs.stage_layout(program)
        self.filtered = filtered_images(program)
        self.tables = packed_tables(program)
        self.buffer: Any = None
        self.sent = b""
        self.groups: dict[tuple[int, ...], Any] = {}

    def send(self, block: Block) -> None:
        """Write the parameters if they changed."""
        data = packed(self.program, self.size, self.guard, block, self.tables)
        if data == self.sent:
            return
        if self.buffer is None:
            self.buffer = self.backend.buffer(len(data), "UNIFORM", f"the parameters of {self.program.name}")
            self.backend.free_with(self, self.buffer)
        else:
            self.backend.flush()  # passes already encoded read its present content
        self.backend.write(self.buffer, data)
        self.sent = data

    def group(self, images: Sequence[Texture]) -> Any:
        """Return the bind group with these images."""
        read = [image.readable for image in images]
        key = tuple([image.serial for image in read])
        group = self.groups.get(key)
        if group is None:
            if len(self.groups) >= MOST_GROUPS:
                del self.groups[next(iter(self.groups))]
            group = self.groups[key] = self._group(read)
        return group

    def _group(self, read: Sequence[Texture]) -> Any:
        programs = self.backend.programs
        entries: list[dict[str, Any]] = [
            {"binding": PARAMETERS, "resource": {"buffer": self.buffer, "offset": 0, "size": self.buffer.size}},
            {"binding": NEAREST, "resource": programs.nearest},
        ]
        entries += [{"binding": LINEAR + k, "resource": sampler} for k, sampler in enumerate(programs.linear)]
        entries += [{"binding": FIRST_IMAGE + k, "resource": image.read_view} for k, image in enumerate(read)]
        return self.backend.device.create_bind_group(layout=self.layout, entries=entries)


class PixelRun:
    """A pixel pass: one triangle over the whole target."""

    def __init__(self, backend: WebGPUBackend, step: PixelStep) -> None:
        self.backend, self.step = backend, step
        self.stage = Stage(backend, step.program, step.size)
        self.formats = tuple([backend.stored(format_).name for format_ in step.output_formats])
        self.pipeline = self._pipeline(self.formats)

    def _pipeline(self, formats: tuple[str, ...]) -> Any:
        return self.backend.programs.pixel(self.step.program, self.backend.steps(self.step), formats)

    def __call__(self, outputs: Sequence[Texture], images: Sequence[Texture], block: Block) -> None:
        backend = self.backend
        with backend.reported(f"running pass {self.step.name!r}"):
            self.stage.send(block)
            formats = tuple([output.stored.name for output in outputs])  # textures of a host have formats of their own
            if formats != self.formats:
                self.formats, self.pipeline = formats, self._pipeline(formats)
            backend.draw_triangle(self.pipeline, self.stage.group(images), outputs)
            backend.encoded()


class Mesh:
    """Triangles of a mesh, and the attributes that passes read."""

    def __init__(self, backend: WebGPUBackend, mesh: Geometry) -> None:
        self.backend, self.mesh = backend, mesh
        triangles = np.ascontiguousarray(mesh.triangles, np.uint32)
        self.count = triangles.size
        self.indices = self._buffer(triangles, "INDEX") if self.count else None
        self.attributes: dict[str, Any] = {}

    def _buffer(self, values: np.ndarray[Any, Any], usage: str) -> Any:
        buffer = self.backend.buffer(values.nbytes, usage, f"a mesh of {self.count // 3} triangles")
        self.backend.device.queue.write_buffer(buffer, 0, values)
        return buffer

    def bind(self, encoded: Any, attributes: tuple[str, ...]) -> None:
        used = [name for name in ATTRIBUTES if name in attributes]
        for slot, name in enumerate(used):
            if name not in self.attributes:
                self.attributes[name] = self._buffer(vertex_attribute(self.mesh, name), "VERTEX")
            encoded.set_vertex_buffer(slot, self.attributes[name])
        encoded.set_index_buffer(self.indices, "uint32")

    def release(self) -> None:
        for buffer in (self.indices, *self.attributes.values()):
            self.backend.free(buffer)


class DrawRun:
    """A draw: clears, then the triangles of a mesh."""

    def __init__(self, backend: WebGPUBackend, step: DrawStep) -> None:
        self.backend, self.step = backend, step
        state = step.state
        backend.check_draw(step)
        self.guard = guard_band(step.size, backend.limits.side)
        self.vertex = Stage(backend, step.vertex, step.size, 1 / self.guard)
        self.fragment = None if step.fragment is None else Stage(backend, step.fragment, step.size)
        blends = state.blend or (None,) * len(step.outputs)
        masks = state.color_mask or ((True,) * 4,) * len(step.outputs)
        targets = [
            color_target(backend.stored(format_), format_, blend, mask)
            for format_, blend, mask in zip(step.output_formats, blends, masks, strict=True)
        ]
        #: WebGPU offsets depths only where there is a depth target, and kernels may read them without one.
        self.lacks_depth = step.depth is None and any(state.polygon_offset) and _reads_depth(step)
        # It is written although nothing reads it: devices that neither test nor write depths may leave out the offset.
        untested = replace(state, depth_compare="always", depth_write=True, stencil=None)
        self.state = untested if self.lacks_depth else state
        self.unread_depth: Texture | None = None
        self.fixed: dict[str, Any] = {"primitive": primitive(state)}
        self.targets = targets
        self.pipelines: dict[str, Any] = {}
        self.clears = [
            None if value is None else tuple(stored_clear(value, format_).tolist())
            for value, format_ in zip(step.clears, step.output_formats, strict=True)
        ]

    def pipeline(self, depth: Texture | None) -> Any:
        """Return the pipeline for a depth target of this format."""
        name = "" if depth is None else depth.stored.name
        if name not in self.pipelines:
            step, fixed = self.step, dict(self.fixed)
            if depth is not None:
                fixed["depth_stencil"] = depth_stencil(self.state, depth.format, name)
            programs = self.backend.programs
            self.pipelines[name] = programs.draw(step, self.backend.steps(step), fixed, self.targets)
        return self.pipelines[name]

    def __call__(
        self,
        outputs: Sequence[Texture],
        depth: Texture | None,
        images: Sequence[Texture],
        geometry: Mesh,
        vertex: Block,
        fragment: Block,
    ) -> None:
        backend, step = self.backend, self.step
        with backend.reported(f"running draw {step.name!r}"):
            if self.lacks_depth:
                depth = self.unread_depth = self.unread_depth or backend.make(FORMATS["depth32f"], step.size)
            pipeline = self.pipeline(depth)
            count = len(step.vertex.images)
            self.vertex.send(vertex)
            groups = [self.vertex.group(images[:count])]
            if self.fragment is not None:
                self.fragment.send(fragment)
                groups.append(self.fragment.group(images[count:]))
            described: dict[str, Any] = {"color_attachments": self._colors(outputs)}
            if depth is not None:
                if step.depth_clear is None and not self.lacks_depth:
                    backend.as_depth(depth)
                described["depth_stencil_attachment"] = self._depth(depth)
            encoded = backend.encoder().begin_render_pass(**described)
            if geometry.count:
                encoded.set_pipeline(pipeline)
                for number, group in enumerate(groups):
                    encoded.set_bind_group(number, group)
                width, height = step.size
                left, top = (-(self.guard - 1) * side / 2 for side in step.size)
                encoded.set_viewport(left, top, self.guard * width, self.guard * height, 0, 1)
                if step.state.stencil is not None:
                    encoded.set_stencil_reference(step.state.stencil.reference)
                geometry.bind(encoded, step.vertex.attributes)
                encoded.draw_indexed(geometry.count)
            encoded.end()
            if depth is not None:
                depth.is_uploaded = False
            backend.encoded()

    def _colors(self, outputs: Sequence[Texture]) -> list[dict[str, Any]]:
        return [
            {"view": output.view, "load_op": "load", "store_op": "store"}
            if clear is None
            else {"view": output.view, "load_op": "clear", "store_op": "store", "clear_value": clear}
            for output, clear in zip(outputs, self.clears, strict=True)
        ]

    def _depth(self, depth: Texture) -> dict[str, Any]:
        step = self.step
        operation = "load" if step.depth_clear is None and not self.lacks_depth else "clear"
        found = {"view": depth.view, "depth_load_op": operation, "depth_store_op": "store"}
        if operation == "clear":
            found["depth_clear_value"] = 0.0 if step.depth_clear is None else step.depth_clear
        if depth.format.stencil:
            found |= {"stencil_load_op": operation, "stencil_store_op": "store"}
            found["stencil_clear_value"] = step.state.clear_stencil
        return found


def _reads_depth(step: DrawStep) -> bool:
    return step.fragment is not None and any(n.kind == "fragment_depth" for n, _ in step.fragment.builtins)
