"""Host side of a draw: vertices, triangles to tiles, tiles to pixels, each step on all threads."""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Sequence
from itertools import accumulate
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from passgraph.backends.base import ATTRIBUTES, Block, vertex_attribute
from passgraph.backends.numpy.machine import llvm
from passgraph.backends.numpy.machine.llvm import IRBuilder
from passgraph.backends.numpy.machine.machine_code import function_code, lanes
from passgraph.backends.numpy.machine.workers import Workers
from passgraph.backends.numpy.raster import entries, layout
from passgraph.backends.numpy.raster.fragments import found_in, image_names, image_sizes, is_deferred
from passgraph.backends.numpy.raster.layout import TILE
from passgraph.backends.numpy.raster.paint import Deferred, Ordered, Triangles
from passgraph.backends.numpy.vector.lane_body import LaneBody, for_lanes
from passgraph.backends.numpy.vector.lanes import F32, F64, I64, Lanes, counting
from passgraph.cached import cached_property
from passgraph.formats import Format
from passgraph.plan.data import DrawStep

if TYPE_CHECKING:
    from passgraph.backends.numpy.storage import Storage
    from passgraph.graph.draw_state import Geometry


_CALL = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_int64, ctypes.c_int64)


class VertexStage:
    """A compiled vertex program."""

    def __init__(self, step: DrawStep) -> None:
        program = step.vertex
        parts = ("vertices", program.key, repr([n for n, _ in program.builtins]), str(len(step.varyings)))
        formats = [(format_.number, format_.steps) for format_ in _image_formats(step)]
        self.code = function_code((*parts, repr(formats), str(lanes())), lambda name: _text(step, name))
        self.context = np.zeros(len(_context_names(step)), np.int64)

    @cached_property
    def function(self) -> Any:
        return self.code.function(_CALL)

    def bound(
        self, block: Block, attributes: Sequence[Any], images: Sequence[Storage], clip: Any, varyings: Any
    ) -> Callable[[int, int], None]:
        """Return a function of the first vertex and the end.  It keeps the arrays that it uses alive."""
        arrays = (block.floats, block.ints, clip, varyings, *attributes)
        pictures = [part for image in images for part in image.anywhere]
        self.context[:] = [*(array.ctypes.data for array in arrays), *pictures]
        function, context = self.function, self.context.ctypes.data

        def run(first: int, last: int, kept_alive: tuple[Any, ...] = (*arrays, *images)) -> None:
            function(context, first, last)

        return run


def _context_names(step: DrawStep) -> list[str]:
    """Return the names of the context's entries, in order."""
    return ["floats", "ints", "clip", "varyings", *step.vertex.attributes, *image_names(step.vertex)]


def _image_formats(step: DrawStep) -> tuple[Format, ...]:
    return step.image_formats[: len(step.vertex.images)]


def _text(step: DrawStep, name: str) -> str:
    """Return LLVM text of ``vertices(context, first, last)``."""
    module = llvm.Module(name)
    kind = llvm.FunctionType(llvm.VoidType(), [llvm.PointerType(), I64, I64])
    function = llvm.Function(module, kind, name)
    b = Lanes(IRBuilder(function), lanes())
    context, first, last = function.args
    memory = found_in(b, context, _context_names(step))
    with counting(b, first, last, llvm.Constant(I64, b.lanes)) as at:
        vertex = b.add(at, b.counting(I64))
        mask = b.icmp_signed("<", vertex, last)
        program = for_lanes(step.vertex)
        builtins = image_sizes(program, memory)
        for builtin in (name for name, _ in program.builtins if name not in builtins):
            first = b.mul(vertex, llvm.Constant(I64, ATTRIBUTES[builtin.of][1]))
            index = b.add(first, llvm.Constant(I64, builtin.component or 0))
            builtins[builtin] = b.load_at(memory[builtin.of], index, F32, mask)
        results = LaneBody(program, b, builtins, memory, mask, _image_formats(step)).results()
        for part, value in enumerate(results[:4]):
            index = b.add(b.mul(vertex, llvm.Constant(I64, 4)), llvm.Constant(I64, part))
            b.store_at(memory["clip"], index, b.fpext(value, F64), F64, mask)
        count = len(step.varyings)
        for part, value in enumerate(results[4:]):
            index = b.add(b.mul(vertex, llvm.Constant(I64, count)), llvm.Constant(I64, part))
            b.store_at(memory["varyings"], index, value, F32, mask)
    b.ret_void()
    return str(module)


#: Triangles (and vertices) in one piece of work.
CHUNK = 4096
_CULL = {"none": 0, "back": 1, "front": 2}


class Raster:
    """A compiled draw.  Its scratch arrays are kept and grow as the mesh needs."""

    def __init__(self, step: DrawStep, workers: Workers) -> None:
        self.step, self.workers = step, workers
        self.width, self.height = step.size
        self.attributes = step.vertex.attributes
        self.vertices = VertexStage(step)
        self.paint = (Deferred if is_deferred(step) else Ordered)(step, workers)
        self.tiles_x = -(-self.width // TILE)
        self.tiles_y = -(-self.height // TILE)
        self.project, self.classify, self.assemble, self.count, self.fill = (
            code.call()
            for code in (entries.project, entries.classify, entries.assemble, entries.count_tiles, entries.fill_tiles)
        )
        self._mesh: Geometry | None = None
        self.counts = self.cursors = np.zeros((0, 0), np.int64)
        self.starts, self.lists = np.zeros(1, np.int64), np.empty(1, np.int32)
        self.sorts = np.zeros((0, 2), np.int64)  # per chunk: whole triangles, and clipped ones
        self.corners = np.zeros((0, layout.CORNER_ROOM), np.int64)

    def __call__(
        self, outputs: Sequence[Storage], depth: Storage | None, images: Sequence[Storage], geometry: Geometry,
        vertex: Block, fragment: Block,
    ) -> None:  # fmt: skip
        if depth is not None and depth.stencil is not None and self.step.depth_clear is not None:
            depth.stencil.fill(self.step.state.clear_stencil)
        self._prepare(geometry)
        first = len(self.step.vertex.images)
        self._transform(geometry, vertex, images[:first])
        ends = self._assemble(geometry)
        offsets, lists = self._bin(ends)
        self.paint(outputs, depth, images[first:], fragment, self._triangles(), offsets, lists)

    def _triangles(self) -> Triangles:
        return self.made, self.window_x, self.window_y, self.depth, self.inverse_w, self.varyings

    def _prepare(self, mesh: Geometry) -> None:
        """Prepare attributes and scratch for a mesh, kept from run to run."""
        if self._mesh is mesh:
            return
        self._mesh = mesh
        self.arrays = [vertex_attribute(mesh, name) for name in self.attributes]
        self.triangles: NDArray[np.int32] = np.ascontiguousarray(mesh.triangles, np.int32)
        self.kinds = np.zeros(len(self.triangles), np.uint8)
        self._size_vertices(len(mesh.positions))
        self.made = np.zeros((max(1, len(self.triangles)), 8), np.int32)

    def _size_vertices(self, count: int) -> None:
        varyings = len(self.step.varyings)
        self.clip = np.zeros((count, 4), np.float64)
        self.varyings = np.zeros((count, varyings), np.float32)
        self.window_x, self.window_y = np.zeros(count, np.int32), np.zeros(count, np.int32)
        self.depth, self.inverse_w = np.zeros(count, np.float64), np.zeros(count, np.float64)
        self.codes = np.zeros(count, np.uint8)

    def _chunks(self, count: int) -> list[tuple[int, int]]:
        """Return at least one chunk, so that an empty mesh is no special case."""
        return [(first, min(count, first + CHUNK)) for first in range(0, max(1, count), CHUNK)]

    def _transform(self, mesh: Geometry, block: Block, images: Sequence[Storage]) -> None:
        chunks = self._chunks(len(mesh.positions))
        run = self.vertices.bound(block, self.arrays, images, self.clip, self.varyings)
        project = self.project.bound(
            self.clip, self.width, self.height, self.window_x, self.window_y, self.depth, self.inverse_w, self.codes
        )

        def piece(number: int) -> None:
            run(*chunks[number])
            project(*chunks[number])

        self.workers.each(piece, len(chunks))

    def _assemble(self, mesh: Geometry) -> list[tuple[int, int]]:
        """Collect triangles to draw, chunk by chunk; return the range of each chunk."""
        chunks = self._chunks(len(self.triangles))
        if len(self.sorts) != len(chunks):
            self.sorts = np.zeros((len(chunks), 2), np.int64)
        classify = self.classify.bound(self.triangles, self.codes, self.kinds, self.sorts)
        self.workers.each(lambda number: classify(*chunks[number], number), len(chunks))
        corners = layout.MAX_CORNERS
        capacity = [direct + (corners - 2) * clipped for direct, clipped in self.sorts.tolist()]
        fresh = [layout.NEW_VERTICES * clipped for clipped in self.sorts[:, 1].tolist()]
        self._grow(len(mesh.positions) + sum(fresh), sum(capacity))
        if len(self.corners) < layout.CORNER_LISTS * len(chunks):
            self.corners = np.zeros((layout.CORNER_LISTS * len(chunks), layout.CORNER_ROOM), np.int64)
        starts = [0, *accumulate(capacity)]
        frees = [len(mesh.positions) + before for before in (0, *accumulate(fresh))]
        ends: list[tuple[int, int]] = [(0, 0)] * len(chunks)
        assemble = self.assemble.bound(
            self.triangles, self.kinds, self.codes, self.clip, self.varyings, self.width, self.height,
            _CULL[self.step.state.cull], self.window_x, self.window_y, self.depth, self.inverse_w, self.made,
            self.corners,
        )  # fmt: skip

        def piece(number: int) -> None:
            ends[number] = (starts[number], assemble(*chunks[number], number, frees[number], starts[number]))

        self.workers.each(piece, len(chunks))
        return ends

    def _grow(self, vertices: int, triangles: int) -> None:
        """Grow the arrays, keeping their content."""
        for name in ("clip", "varyings", "window_x", "window_y", "depth", "inverse_w", "codes"):
            array = getattr(self, name)
            if len(array) < vertices:
                grown = np.zeros((vertices, *array.shape[1:]), array.dtype)
                grown[: len(array)] = array
                setattr(self, name, grown)
        if len(self.made) < triangles:
            self.made = np.zeros((triangles, 8), np.int32)

    def _bin(self, ends: list[tuple[int, int]]) -> tuple[NDArray[np.int64], NDArray[np.int32]]:
        """Return each tile's triangles in submission order: offsets of tiles into one list."""
        tiles = self.tiles_x * self.tiles_y
        if self.counts.shape != (len(ends), tiles):
            self.counts, self.cursors = np.zeros((len(ends), tiles), np.int64), np.zeros((len(ends), tiles), np.int64)
            self.starts = np.zeros(len(ends) * tiles + 1, np.int64)
        self.counts.fill(0)
        count = self.count.bound(self.made, self.tiles_x, self.counts)
        self.workers.each(lambda number: count(*ends[number], number), len(ends))
        by_tile = self.starts[1:].reshape(tiles, len(ends))
        by_tile[:] = self.counts.T
        np.cumsum(self.starts[1:], out=self.starts[1:])
        self.cursors[:] = self.starts[:-1].reshape(tiles, len(ends)).T  # filling advances them
        if len(self.lists) < self.starts[-1]:
            self.lists = np.empty(int(self.starts[-1]) * 5 // 4, np.int32)
        fill = self.fill.bound(self.made, self.tiles_x, self.cursors, self.lists)
        self.workers.each(lambda number: fill(*ends[number], number), len(ends))
        return np.ascontiguousarray(self.starts[:: len(ends)]), self.lists
