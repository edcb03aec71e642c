"""Compiled pixel passes at work: arguments bound, pieces handed out, rings kept from frame to frame."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from passgraph.backends.base import Block, FloatBlock
from passgraph.backends.numpy.chains import Stage, Tiling, pitch, tiling
from passgraph.backends.numpy.jit import load_module
from passgraph.backends.numpy.memory import aligned_zeros
from passgraph.backends.numpy.pixel_code import pixel_module
from passgraph.backends.numpy.workers import Workers

if TYPE_CHECKING:
    from passgraph.backends.numpy.backend import Storage

#: Pixels in one piece of work: small enough to balance, large enough that one more thread is worth waking.
MIN_PIXELS_A_PIECE = 16_384


class PixelRun:
    """One chain of passes; a single pass is a chain of one."""

    def __init__(self, chain: Sequence[Stage], tiles: Tiling, workers: Workers) -> None:
        self.workers, self.tiles = workers, tiles
        self.function = load_module(*pixel_module(chain), chain[-1].step.name).pieces
        self.counter = np.zeros(1, np.int64)
        #: What is the same in every frame: pieces of the target, its size, columns of the rings.
        self.fixed = (
            tiles.pieces, tiles.columns, tiles.width, tiles.rows, *chain[-1].step.size,
            *(pitch(stage, tiles.width) for stage in chain[:-1]),
        )  # fmt: skip
        self.order = [_places(stage) for stage in chain]
        threads = min(workers.count, tiles.pieces)
        self.rings = [_rings(chain, tiles) for _ in range(threads)]
        self._warm_up(len(chain[-1].channels))

    @classmethod
    def made(cls, chain: Sequence[Stage], workers: Workers) -> PixelRun | None:
        """The compiled chain, or None where it brings nothing."""
        tiles = tiling(chain, workers.count, MIN_PIXELS_A_PIECE)
        return None if tiles is None else cls(chain, tiles, workers)

    def __call__(
        self, outputs: Sequence[Storage], images: Sequence[Sequence[Storage]], blocks: Sequence[Block]
    ) -> None:
        arguments: list[Any] = []
        for places, storages, block in zip(self.order, images, blocks, strict=True):
            for place in places:
                arguments += [storages[place].values, *storages[place].size]
            arguments += [block.floats, block.ints]
        stores = [output.values for output in outputs]
        function, counter, fixed, rings = self.function, self.counter, self.fixed, self.rings
        counter[0] = 0
        self.workers.together(lambda thread: function(counter, *fixed, *arguments, *rings[thread], *stores), len(rings))

    def _warm_up(self, outputs: int) -> None:
        """Run on nothing, so that compiling belongs to making the program and not to its first frame."""
        arguments: list[Any] = []
        for places in self.order:
            arguments += [part for _ in places for part in (np.zeros(4, np.float32), 1, 1)]
            arguments += [np.zeros(1, np.float32), np.zeros(1, np.int32)]
        stores = [np.zeros(4, np.float32) for _ in range(outputs)]
        self.function(self.counter, 0, *self.fixed[1:], *arguments, *self.rings[0], *stores)


def _places(stage: Stage) -> list[int]:
    """For each image of the program that no stage makes, its place among the step's images."""
    names = [name for name, _ in stage.step.images]
    made = {number for number, _, _ in stage.rings}
    uses = enumerate(stage.step.program.images)
    return [names.index(use.name) for number, use in uses if number not in made]


def _rings(chain: Sequence[Stage], tiles: Tiling) -> list[FloatBlock]:
    """Memory of one thread for what lies between the stages."""
    return [
        aligned_zeros(stage.rows * pitch(stage, tiles.width) * channels)
        for stage in chain[:-1]
        for channels in stage.channels
    ]
