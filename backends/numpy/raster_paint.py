"""Binned triangles into pixels: fragment by fragment in order, or a tile at once where order does not matter."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from passgraph.backends.base import Block, clear_colour, quantised
from passgraph.backends.numpy import raster_entries as entries
from passgraph.backends.numpy.llvm_names import TILE
from passgraph.backends.numpy.raster_code import thread_scratch, tile_code
from passgraph.backends.numpy.raster_shade import context_names, plane_numbers, plane_rows, shade_address
from passgraph.backends.numpy.workers import Workers
from passgraph.plan.data import DrawStep

if TYPE_CHECKING:
    from passgraph.backends.numpy.backend import Storage

#: Triangles as raster_setup.py makes them, and their vertices: window x and y, depth, 1/w, varyings.
Triangles: TypeAlias = "tuple[NDArray[Any], ...]"


def clear_values(storage: Storage, clear: tuple[float, ...] | None) -> NDArray[np.float32]:
    """What a draw clears each channel to, as the target stores it; zeros where it does not clear."""
    channels = storage.format.channels
    if clear is None:
        return np.zeros(channels, np.float32)
    return quantised(np.array(clear_colour(clear, channels, storage.format.srgb)), storage.format)


class Forward:
    """Every fragment of a tile in submission order."""

    def __init__(self, step: DrawStep, workers: Workers) -> None:
        self.step, self.workers = step, workers
        self.width, self.height = step.size
        self.tiles_x = -(-self.width // TILE)
        code = tile_code(step)
        self.calls = [code.call() for _ in range(workers.count)]
        self.scratch = [thread_scratch(step) for _ in range(workers.count)]

    def __call__(
        self, outputs: Sequence[Storage], depth: Storage | None, images: Sequence[Storage], block: Block,
        triangles: Triangles, offsets: NDArray[np.int64], lists: NDArray[np.int32],
    ) -> None:  # fmt: skip
        self._clear(outputs, depth)
        arguments = [part for image in images for part in (image.values, *image.size)]
        stores = [output.values for output in outputs]
        depths = depth.values if depth is not None else np.zeros(1, np.float32)
        stencil = depth.stencil if depth is not None and depth.stencil is not None else np.zeros(1, np.uint8)
        busy = np.flatnonzero(np.diff(offsets)).tolist()
        numbers = itertools.count()

        def tiles(thread: int) -> None:
            draw = self.calls[thread].bound(
                lists, *triangles, self.width, self.height, *arguments, *stores, depths, stencil, block.floats,
                block.ints, *self.scratch[thread],
            )  # fmt: skip
            while (number := next(numbers)) < len(busy):
                tile = busy[number]
                draw(tile % self.tiles_x, tile // self.tiles_x, int(offsets[tile]), int(offsets[tile + 1]))

        self.workers.together(tiles, min(self.workers.count, len(busy)))

    def _clear(self, outputs: Sequence[Storage], depth: Storage | None) -> None:
        for storage, clear in zip(outputs, self.step.clears, strict=True):
            if clear is not None:
                rows = storage.values.reshape(self.height, -1)
                rows[0] = np.tile(clear_values(storage, clear), self.width)
                rows[1:] = rows[0]  # whole rows at once: five times as fast as pixel by pixel
        if depth is not None and self.step.depth_clear is not None:
            depth.values.fill(self.step.depth_clear)


class Deferred:
    """The triangle that each pixel of a tile shows, then the kernel once for each pixel."""

    def __init__(self, step: DrawStep, workers: Workers) -> None:
        self.step, self.workers = step, workers
        self.calls = [entries.tiles.call() for _ in range(workers.count)]
        self.width, self.height = step.size
        self.tiles_x = -(-self.width // TILE)
        # Without a depth buffer every fragment passes.
        has_depth = step.depth is not None
        test = entries.TESTS[step.state.depth_compare if has_depth else "always"]
        self.test = (int(has_depth), test, int(has_depth and step.state.depth_write))
        shaded = step.fragment is not None
        self.shade = shade_address(step) if shaded else 0
        self.context = np.zeros(len(context_names(step)) if shaded else 1, np.int64)
        self.counter = np.zeros(1, np.int64)
        self.no_depth = [np.zeros(TILE * TILE, np.float32) for _ in range(workers.count)]
        self.offset = tuple(float(part) for part in step.state.polygon_offset)
        self.depth_clear = float("nan") if step.depth is None or step.depth_clear is None else float(step.depth_clear)
        self.clears_any = step.depth_clear is not None or any(clear is not None for clear in step.clears)
        self.every = np.arange(self.tiles_x * -(-self.height // TILE), dtype=np.int64)
        self.clear_colours = np.zeros(1, np.float32)
        self.scratch = [self._scratch() for _ in range(workers.count)]

    def _scratch(self) -> list[Any]:
        """One thread's: each pixel's triangle, numbers of visible triangles, planes of one, planes of the visible."""
        pixels = TILE * TILE
        rows = plane_rows(self.step)
        table = np.empty(pixels * plane_numbers(self.step) if self.step.fragment is not None else 1, np.float64)
        return [np.empty(pixels, np.int32), np.empty(0, np.int32), np.empty((rows, 3)), table]

    def __call__(
        self, outputs: Sequence[Storage], depth: Storage | None, images: Sequence[Storage], block: Block,
        triangles: Triangles, offsets: NDArray[np.int64], lists: NDArray[np.int32],
    ) -> None:  # fmt: skip
        counts = np.diff(offsets)
        busy = self.every if self.clears_any else np.flatnonzero(counts)
        longest = int(counts.max(initial=0))
        for scratch in self.scratch:
            if len(scratch[1]) < longest:
                scratch[1] = np.empty(longest, np.int32)
        # The context holds bare addresses: what they lead to must live until the threads are done.
        if self.clears_any and len(outputs):
            self.clear_colours = np.concatenate(
                [clear_values(o, clear) for o, clear in zip(outputs, self.step.clears, strict=True)]
            )
        arrays = [block.floats, block.ints, self.clear_colours, *(image.values for image in images)]
        arrays += [output.values for output in outputs]
        if self.step.fragment is not None:
            self._fill(arrays, [image.size for image in images])
        depths = depth.values if depth is not None else None
        self.counter[0] = 0
        self.workers.together(
            lambda thread: self._tiles(thread, len(busy), busy, offsets, lists, triangles, depths),
            min(self.workers.count, len(busy)),
        )
        del arrays

    def _fill(self, arrays: list[Any], sizes: list[tuple[int, int]]) -> None:
        addresses = [array.ctypes.data for array in arrays]
        entries = [*addresses[:3], self.width, self.height]
        for address, size in zip(addresses[3:], sizes, strict=False):
            entries += [address, *size]
        self.context[:] = [*entries, *addresses[3 + len(sizes) :]]

    def _tiles(
        self, thread: int, count: int, busy: NDArray[np.int64], offsets: NDArray[np.int64], lists: NDArray[np.int32],
        triangles: Triangles, depths: NDArray[np.float32] | None,
    ) -> None:  # fmt: skip
        self.calls[thread].bound(
            self.counter, count, busy, self.tiles_x, offsets, lists, *triangles, *self.offset, self.width, self.height,
            self.no_depth[thread] if depths is None else depths, *self.test, self.depth_clear,
            *self.scratch[thread], self.shade, self.context,
        )()  # fmt: skip
