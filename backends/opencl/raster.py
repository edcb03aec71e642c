"""Draws: the host side of the rasterizer in raster.cl.

Vertices are transformed, triangles are set up in chunks, counted per tile and listed by tile in submission order; then
each tile is drawn.  There are no atomics: results never depend on timing.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from passgraph.backends.base import Block, vertex_attribute
from passgraph.backends.opencl.draw_source import TRIANGLE_INTS, DrawLayouts, draw_sources, triangle_floats
from passgraph.backends.opencl.pixel import Uniforms
from passgraph.backends.opencl.storage import Storage
from passgraph.errors import BackendError
from passgraph.graph.draw_state import Geometry
from passgraph.plan.data import DrawStep

if TYPE_CHECKING:
    from passgraph.backends.opencl.backend import OpenCLBackend


class DeviceMesh:
    """Triangles, and the attributes that vertex kernels have requested; each is uploaded once."""

    def __init__(self, backend: OpenCLBackend, mesh: Geometry) -> None:
        self.backend = backend
        self.mesh = mesh
        self.vertex_count = len(mesh.positions)
        self.triangle_count = len(mesh.triangles)
        self.triangles = self._upload(np.ascontiguousarray(mesh.triangles, np.int32), "triangles")
        self.attributes: dict[str, Any] = {}

    def attribute(self, name: str) -> Any:
        """Return the buffer of an attribute such as ``normal``."""
        if name not in self.attributes:
            self.attributes[name] = self._upload(vertex_attribute(self.mesh, name), name)
        return self.attributes[name]

    def _upload(self, array: Any, what: str) -> Any:
        buffer = self.backend.allocate(array.nbytes, f"the {what} of a mesh of {self.vertex_count:,} vertices")
        self.backend.free_with(self, buffer)
        if array.nbytes:  # OpenCL has no copy of nothing (PoCL 3.1 accepts one, PoCL 6 does not)
            with self.backend.reported(f"uploading {what}"):
                self.backend.cl.enqueue_copy(self.backend.queue, buffer, array, is_blocking=True)
        return buffer


#: raster.cl's names of the culled sides.
CULL = {"none": 0, "back": 1, "front": 2}
#: Side of a tile in pixels: for CPUs (one work-item per tile) and for others (a work-group of 256).
TILE_SERIAL, TILE_PARALLEL = 32, 16
#: Chunks of triangles (a work-item each), on CPUs and on others.
MAX_CHUNKS, MAX_CHUNKS_PARALLEL = 256, 4096
#: Most entries of the table of chunks by tiles.
MAX_TABLE = 1 << 22
#: Work-items of a group in kernels over vertices, chunks and tiles.
GROUP = 64
#: If slots or lists would be larger than this, the mesh is drawn in parts.
MAX_SCRATCH_BYTES = 1 << 28


class DrawPassRunner:
    """A draw, compiled at first use for each combination of storage formats."""

    def __init__(self, backend: OpenCLBackend, step: DrawStep, *, serial: bool | None = None) -> None:
        self.backend, self.step = backend, step
        self.what = f"draw {step.name!r}"
        # A work-item for each tile pays on CPUs, where a work-group's work-items run one after the other.
        self.serial = backend.is_cpu if serial is None else serial
        self.tile = TILE_SERIAL if self.serial else TILE_PARALLEL
        self.tiles = -(-step.size[0] // self.tile), -(-step.size[1] // self.tile)
        vectors = backend.cl.cltypes
        #: raster.cl's ``screen`` and other parameters of a draw.
        self.screen = vectors.make_int4(*step.size, *self.tiles)
        offset = vectors.make_float2(*step.state.polygon_offset)
        self.differing = self.screen, np.int32(CULL[step.state.cull]), offset, np.int32(len(step.varyings))
        vertex, fragment = step.vertex, step.fragment
        self.vertex_uniforms = Uniforms(backend, vertex.float_count, vertex.int_count, self.what)
        counts = (fragment.float_count, fragment.int_count) if fragment is not None else (0, 0)
        self.fragment_uniforms = Uniforms(backend, *counts, self.what)
        self.attributes = vertex.attributes
        self.kernels: dict[DrawLayouts, dict[str, Any]] = {}
        self.max_scratch = min(MAX_SCRATCH_BYTES, backend.max_bytes)
        self.bound: dict[int, Sequence[Any]] = {}  # by the id of one of our kernels

    def __call__(
        self,
        outputs: Sequence[Storage],
        depth: Storage | None,
        images: Sequence[Storage],
        geometry: DeviceMesh,
        vertex: Block,
        fragment: Block,
    ) -> None:
        self.backend.check_open()
        kernels = self._kernels(outputs, depth, images)
        self.vertex_uniforms.update(vertex)
        self.fragment_uniforms.update(fragment)
        first = len(self.step.vertex.images)
        read = [image.buffer for image in images[:first]]
        resources = [storage.buffer for storage in (*images[first:], *outputs)]
        if depth is not None:
            resources += [depth.buffer] if depth.stencil is None else [depth.buffer, depth.stencil]
        resources += self.fragment_uniforms.buffers
        with self.backend.reported(f"running {self.what}"):
            clip, sent = self._vertices(kernels, geometry, read)
            Triangles(self, kernels, geometry, clip, sent, resources).draw(0, geometry.triangle_count)
        if any(storage.is_borrowed for storage in (*images, *outputs)):
            # Memory of the caller is borrowed for one run: keep no reference.
            for name in ("pg_vertices", "pg_tiles"):
                self.bound.pop(id(kernels[name]), None)

    def _kernels(self, outputs: Sequence[Storage], depth: Storage | None, images: Sequence[Storage]) -> dict[str, Any]:
        first = len(self.step.vertex.images)
        layouts = DrawLayouts(
            tuple(image.layout for image in images[:first]),
            tuple(image.layout for image in images[first:]),
            tuple(output.layout for output in outputs),
            depth is not None,
            depth is not None and depth.stencil is not None,
        )
        if layouts not in self.kernels:
            constant = self.vertex_uniforms.fits_constant() and self.fragment_uniforms.fits_constant()
            kernels: dict[str, Any] = {}
            sources = draw_sources(self.step, layouts, self.tile, serial=self.serial, constant=constant)
            for names, source in sources.items():
                built = self.backend.programs.build(source, self.what)
                with self.backend.reported(f"making the kernels of {self.what}"):
                    kernels |= {name: self.backend.cl.Kernel(built, name) for name in names}
            self.kernels[layouts] = kernels
        return self.kernels[layouts]

    def _vertices(self, kernels: dict[str, Any], geometry: DeviceMesh, read: Sequence[Any]) -> tuple[Any, Any]:
        count = geometry.vertex_count
        clip = self.backend.scratch_buffer("clip positions", 16 * count)
        sent = self.backend.scratch_buffer("varyings", 4 * count * len(self.step.varyings))
        attributes = [geometry.attribute(name) for name in self.attributes]
        arguments = (*attributes, *read, *self.vertex_uniforms.buffers, clip, sent, np.int32(count))
        self.launch(kernels["pg_vertices"], count, arguments)
        return clip, sent

    def launch(self, kernel: Any, items: int, arguments: Sequence[Any], group: int = GROUP) -> None:
        """Launch a kernel over a number of work-items in a row, rounded up to whole groups."""
        self.bind(kernel, arguments)
        self.backend.cl.enqueue_nd_range_kernel(self.backend.queue, kernel, (-(-items // group) * group,), (group,))

    def bind(self, kernel: Any, arguments: Sequence[Any]) -> None:
        """Set a kernel's arguments if they differ from its last launch."""
        bound = self.bound.get(id(kernel), ())
        if len(bound) != len(arguments) or not all(map(_same, bound, arguments)):
            kernel.set_args(*arguments)
            self.bound[id(kernel)] = arguments


def _same(bound: Any, new: Any) -> bool:
    """Compare numbers by value, buffers by identity, since a freed one's handle may be reused."""
    return bound is new or (isinstance(bound, np.int32) and isinstance(new, np.int32) and bool(bound == new))


class Triangles:
    """The triangles of one draw, processed in parts if memory for all of them is lacking."""

    def __init__(
        self,
        runner: DrawPassRunner,
        kernels: dict[str, Any],
        mesh: DeviceMesh,
        clip: Any,
        sent: Any,
        resources: Sequence[Any],
    ) -> None:
        self.runner, self.kernels, self.mesh = runner, kernels, mesh
        self.clip, self.sent, self.resources = clip, sent, resources
        self.backend = runner.backend
        self.tile_count = runner.tiles[0] * runner.tiles[1]
        self.cleared = False
        # Chunks are the unit of work on CPUs; elsewhere they are spread over groups.
        self.group = 1 if runner.serial else GROUP

    def draw(self, first: int, count: int) -> None:
        """Draw triangles ``first`` to ``first + count``; in halves if lists would be too long."""
        most = MAX_CHUNKS if self.runner.serial else MAX_CHUNKS_PARALLEL
        chunks = max(1, min(count, most, MAX_TABLE // self.tile_count))
        chunk = -(-count // chunks)
        span = np.int32(first), np.int32(count), np.int32(chunk), np.int32(chunks)
        starts, slots = self._starts(span, chunks)
        floats = triangle_floats(self.runner.step)
        if slots * 4 * max(TRIANGLE_INTS, floats) > self.runner.max_scratch:
            self._halves(first, count)
            return
        buffers = (
            self.backend.scratch_buffer("triangles", slots * 4 * TRIANGLE_INTS),
            self.backend.scratch_buffer("triangle values", slots * 4 * floats),
        )
        bins = self.backend.scratch_buffer("bins", 4 * chunks * self.tile_count)
        mesh = self.mesh.triangles
        setup = (self.clip, self.sent, mesh, *span, starts, *buffers, bins, *self.runner.differing)
        self.runner.launch(self.kernels["pg_setup"], chunks, setup, self.group)
        tile_starts, length = self._tile_starts(bins, chunks)
        if 4 * length > self.runner.max_scratch:
            self._halves(first, count)
            return
        listed = self.backend.scratch_buffer("tile lists", 4 * length)
        fill = (starts, np.int32(chunks), buffers[0], bins, tile_starts, listed, self.runner.screen)
        self.runner.launch(self.kernels["pg_fill"], chunks, fill, self.group)
        self._tiles(buffers, listed, tile_starts)

    def _halves(self, first: int, count: int) -> None:
        if count < 2:
            raise BackendError(
                f"{self.runner.what}: one triangle needs more than {self.runner.max_scratch:,} bytes of scratch memory"
            )
        half = count // 2
        self.draw(first, half)
        self.draw(first + half, count - half)

    def _starts(self, span: tuple[Any, ...], chunks: int) -> tuple[Any, int]:
        """Return the first slot of each chunk and the number of slots."""
        counted = self.backend.scratch_buffer("chunks", 4 * (chunks + 1))
        arguments = (self.clip, self.mesh.triangles, *span, counted)
        self.runner.launch(self.kernels["pg_count"], chunks, arguments, self.group)
        return self._summed(counted, chunks, "chunk starts")

    def _tile_starts(self, bins: Any, chunks: int) -> tuple[Any, int]:
        """Return the start of each tile's list and the length of all lists."""
        totals = self.backend.scratch_buffer("tile totals", 4 * self.tile_count)
        self.runner.launch(
            self.kernels["pg_scan"], self.tile_count, (bins, np.int32(chunks), totals, np.int32(self.tile_count))
        )
        return self._summed(totals, self.tile_count, "tile starts")

    def _summed(self, counts: Any, count: int, purpose: str) -> tuple[Any, int]:
        """Compute running sums from 0 on, on the device; return them and the last one."""
        read = np.empty(count, np.int32)
        self.backend.read(counts, read)
        sums = np.zeros(count + 1, np.int64)
        np.cumsum(read, out=sums[1:])
        starts = self.backend.scratch_buffer(purpose, 4 * (count + 1))
        self.backend.write(starts, np.minimum(sums, 2**31 - 1).astype(np.int32))
        return starts, int(sums[-1])

    def _tiles(self, buffers: tuple[Any, Any], listed: Any, tile_starts: Any) -> None:
        kernel = self.kernels["pg_tiles"]
        clear = np.int32(0 if self.cleared else 1)
        self.cleared = True
        self.runner.bind(kernel, (*buffers, listed, tile_starts, clear, *self.resources))
        side, (across, down) = self.runner.tile, self.runner.tiles
        items, group = ((across * down,), (1,)) if self.runner.serial else ((across * side, down * side), (side, side))
        self.backend.cl.enqueue_nd_range_kernel(self.backend.queue, kernel, items, group)
