"""Draw binned triangles: triangle by triangle in order, or a tile at once if order does not matter."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from passgraph.backends.base import Block, clear_colour, quantised
from passgraph.backends.numpy.machine.machine_code import Code
from passgraph.backends.numpy.machine.shipped import NumbaCode
from passgraph.backends.numpy.machine.workers import Workers
from passgraph.backends.numpy.raster import entries, layout
from passgraph.backends.numpy.raster.fragments import context_names, merge_code, shade_code
from passgraph.backends.numpy.raster.layout import TILE
from passgraph.backends.numpy.raster.planes import plane_numbers, plane_rows
from passgraph.cached import cached_property
from passgraph.plan.data import DrawStep

if TYPE_CHECKING:
    from passgraph.backends.numpy.storage import Storage

#: Triangles from setup.py, and their vertices: window x and y, depth, 1/w, varyings.
Triangles: TypeAlias = "tuple[NDArray[Any], ...]"
#: Pixels of a tile.
PIXELS = TILE * TILE


def clear_values(storage: Storage, clear: tuple[float, ...] | None) -> NDArray[np.float32]:
    """Return the stored clear value of each channel; zeros if the draw does not clear."""
    channels = storage.format.channels
    if clear is None:
        return np.zeros(channels, np.float32)
    return quantised(np.array(clear_colour(clear, channels, storage.format.srgb)), storage.format)


class Painter:
    """Common part of both painters: a queue of tiles for the threads, and the context of the kernel's code."""

    def __init__(self, step: DrawStep, workers: Workers, code: NumbaCode, kernel: Code | None) -> None:
        self.step, self.workers, self.kernel = step, workers, kernel
        self.calls = [code.call() for _ in range(workers.count)]
        self.width, self.height = step.size
        self.tiles_x = -(-self.width // TILE)
        self.context = np.zeros(len(context_names(step)), np.int64)
        self.counter = np.zeros(1, np.int64)
        self.nothing = np.zeros(1, np.float32)
        self.offset = tuple(float(part) for part in step.state.polygon_offset)
        self.depth_clear = float("nan") if step.depth is None or step.depth_clear is None else float(step.depth_clear)
        self.clears = any(clear is not None for clear in step.clears)
        self.clears_any = step.depth_clear is not None or self.clears
        self.every = np.arange(self.tiles_x * -(-self.height // TILE), dtype=np.int64)
        self.scratch = [self.thread_scratch() for _ in range(workers.count)]

    @cached_property
    def shade(self) -> int:
        """Return the address of the kernel's code."""
        return 0 if self.kernel is None else self.kernel.address

    def thread_scratch(self) -> list[Any]:
        """Return the scratch arrays of one thread."""
        raise NotImplementedError

    def __call__(
        self, outputs: Sequence[Storage], depth: Storage | None, images: Sequence[Storage], block: Block,
        triangles: Triangles, offsets: NDArray[np.int64], lists: NDArray[np.int32],
    ) -> None:  # fmt: skip
        counts = np.diff(offsets)
        busy = self.every if self.clears_any else np.flatnonzero(counts)
        self.make_room(int(counts.max(initial=0)))
        colours = self.nothing
        if self.clears:
            colours = np.concatenate(
                [clear_values(o, clear) for o, clear in zip(outputs, self.step.clears, strict=True)]
            )
        depths = self.nothing if depth is None else depth.numbers.reshape(-1)
        stencil = self.nothing if depth is None or depth.stencil is None else depth.stencil
        # The context holds bare addresses: their memory must live until the threads are done.
        arrays = [block.floats, block.ints, colours, depths, stencil]
        self._fill(arrays, images, outputs)
        self.counter[0] = 0
        arguments = (
            self.counter, len(busy), busy, self.tiles_x, offsets, lists, *triangles, *self.offset,
            self.width, self.height,
        )  # fmt: skip
        self.workers.together(
            lambda thread: self.tiles(thread, arguments, None if depth is None else depths),
            min(self.workers.count, len(busy)),
        )
        del arrays

    def make_room(self, longest: int) -> None:
        """Allocate scratch memory for a number of triangles in one tile."""

    def _fill(self, arrays: Sequence[NDArray[Any]], images: Sequence[Storage], outputs: Sequence[Storage]) -> None:
        addresses = [array.ctypes.data for array in arrays]
        pictures = [part for image in images for part in image.anywhere]
        targets = [part for output in outputs for part in (output.address, output.pitch)]
        self.context[:] = [*addresses, self.width, self.height, *pictures, *targets]

    def tiles(self, thread: int, arguments: tuple[Any, ...], depths: NDArray[np.float32] | None) -> None:
        raise NotImplementedError


class Deferred(Painter):
    """Finds the visible triangle of each pixel in a tile, then runs the kernel once for each pixel."""

    def __init__(self, step: DrawStep, workers: Workers) -> None:
        # Without a depth buffer every fragment passes.
        has_depth = step.depth is not None
        test = layout.TESTS[step.state.depth_compare if has_depth else "always"]
        self.test = (int(has_depth), test, int(has_depth and step.state.depth_write))
        self.no_depth = [np.zeros(PIXELS, np.float32) for _ in range(workers.count)]
        super().__init__(step, workers, entries.tiles, None if step.fragment is None else shade_code(step))

    def thread_scratch(self) -> list[Any]:
        """Return scratch: each pixel's triangle, indices of visible triangles, their number rows, their planes."""
        table = np.empty(PIXELS * plane_numbers(self.step) if self.kernel is not None else 1, np.float64)
        return [np.empty(PIXELS, np.int32), np.empty(0, np.int32), plane_rows(self.step), table]

    def make_room(self, longest: int) -> None:
        for scratch in self.scratch:
            if len(scratch[1]) < longest:
                scratch[1] = np.empty(longest, np.int32)

    def tiles(self, thread: int, arguments: tuple[Any, ...], depths: NDArray[np.float32] | None) -> None:
        self.calls[thread].bound(
            *arguments, self.no_depth[thread] if depths is None else depths, *self.test, self.depth_clear,
            *self.scratch[thread], self.shade, self.context,
        )()  # fmt: skip


class Ordered(Painter):
    """Draws triangle by triangle: tests, kernel and blending of each before the next."""

    def __init__(self, step: DrawStep, workers: Workers) -> None:
        super().__init__(step, workers, entries.in_order, merge_code(step))

    def thread_scratch(self) -> list[Any]:
        """Return scratch: spans of one triangle, and its planes."""
        return [
            np.empty(2 * layout.SPAN_ROWS, np.int32),
            plane_rows(self.step),
            np.empty(plane_numbers(self.step), np.float64),
        ]

    def tiles(self, thread: int, arguments: tuple[Any, ...], depths: NDArray[np.float32] | None) -> None:
        self.calls[thread].bound(
            *arguments, self.nothing if depths is None else depths, self.depth_clear, int(self.clears),
            *self.scratch[thread], self.shade, self.context,
        )()  # fmt: skip
