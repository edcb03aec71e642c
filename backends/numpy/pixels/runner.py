"""Run compiled pixel passes: bind addresses, distribute pieces, keep rings from frame to frame."""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from functools import partial
from operator import is_not
from typing import TYPE_CHECKING, Any

import numpy as np

from passgraph.backends.base import Block, FloatBlock
from passgraph.backends.numpy.machine.machine_code import Code, function_code, lanes
from passgraph.backends.numpy.machine.workers import Workers, aligned_zeros
from passgraph.backends.numpy.pixels.buffer_layout import Layout, StageLayout
from passgraph.backends.numpy.pixels.chains import Stage, Tiling, pitch, tiling
from passgraph.cached import cached_property
from passgraph.language.scalar import work

if TYPE_CHECKING:
    from passgraph.backends.numpy.storage import Storage

#: Pixels in one piece of work: small enough for balance, large enough that waking another thread pays.
MIN_PIXELS_A_PIECE = 16_384
#: Instructions from which on a piece is large enough too, even with few pixels.
MIN_WORK_A_PIECE = 128 * MIN_PIXELS_A_PIECE
_CALL = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p)


class PixelRun:
    """A compiled chain of passes; a single pass is a chain of one."""

    def __init__(self, chain: Sequence[Stage], tiles: Tiling, layout: Layout, workers: Workers) -> None:
        self.workers = workers
        self.code = function_code(layout.parts, lambda name: _text(layout, name))
        self.bodies = [_body(stage) for stage in layout.stages]
        self.zeros = aligned_zeros(layout.zeros)
        fixed = [0, tiles.pieces, tiles.columns, tiles.width, tiles.rows, *chain[-1].step.size, self.zeros.ctypes.data]
        fixed += [pitch(stage, tiles.width) for stage in chain[:-1]]
        fixed += [0] * len(chain)
        self.context = np.zeros(len(fixed) + len(layout.bound), np.int64)
        self.context[: len(fixed)] = fixed
        self.begin = len(fixed)
        self.entries: list[int] = []
        self.address = self.context.ctypes.data
        self.order = [_places(stage) for stage in layout.stages]
        self.blocks: tuple[Block, ...] = ()
        self.block_addresses: list[tuple[int, int]] = []
        threads = min(workers.count, tiles.pieces)
        self.own = [_Own(chain, tiles, layout) for _ in range(threads)]

    @classmethod
    def compile(cls, chain: Sequence[Stage], workers: Workers) -> PixelRun | None:
        """Return the compiled chain; None if it has no advantage."""
        layout = Layout.for_chain(chain, lanes())
        least = MIN_PIXELS_A_PIECE
        if len(chain) == 1:
            least = min(least, max(1, MIN_WORK_A_PIECE // max(1, work(chain[0].step.program.body))))
        tiles = tiling(chain, workers.count, least, layout.stages[-1].rows)
        return None if tiles is None else cls(chain, tiles, layout, workers)

    @cached_property
    def function(self) -> Any:
        """Return the compiled function that computes pieces; it finds the bodies in the context."""
        self.context[self.begin - len(self.bodies) : self.begin] = [body.address for body in self.bodies]
        return self.code.function(_CALL, self.bodies)

    def __call__(
        self, outputs: Sequence[Storage], images: Sequence[Sequence[Storage]], blocks: Sequence[Block]
    ) -> None:
        """Run the chain.  The context holds bare addresses: the arguments keep their memory alive."""
        if not self.blocks or any(map(is_not, blocks, self.blocks)):
            self.blocks = tuple(blocks)
            self.block_addresses = [(block.floats.ctypes.data, block.ints.ctypes.data) for block in blocks]
        entries: list[int] = []
        for places, storages, addresses in zip(self.order, images, self.block_addresses, strict=True):
            for place, anywhere in places:
                storage = storages[place]
                entries += storage.anywhere if anywhere else storage.by_rows
                entries += storage.last_row
            entries += addresses
        for output in outputs:
            entries += (output.address, output.pitch)
        if entries != self.entries:
            self.entries = entries
            self.context[self.begin :] = entries
        self.context[0] = 0
        function, context, own = self.function, self.address, self.own
        self.workers.together(lambda thread: function(context, own[thread].address), len(own))


class _Own:
    """Memory of one thread: intermediate results, and the ends of rows."""

    def __init__(self, chain: Sequence[Stage], tiles: Tiling, layout: Layout) -> None:
        self.arrays: list[FloatBlock] = [
            aligned_zeros(layout.ring_rows(number) * pitch(stage, tiles.width) * channels)
            for number, stage in enumerate(chain[:-1])
            for channels in stage.channels
        ]
        self.arrays.append(aligned_zeros(layout.scratch))
        self.entries = np.array([array.ctypes.data for array in self.arrays], np.int64)
        self.address = self.entries.ctypes.data


def _body(stage: StageLayout) -> Code:
    return function_code(stage.parts, partial(_body_text, stage))


def _text(layout: Layout, name: str) -> str:
    """Generate the code; imported only when there is something to compile."""
    from passgraph.backends.numpy.pixels.code import pixel_text

    return pixel_text(layout, name)


def _body_text(stage: StageLayout, name: str) -> str:
    from passgraph.backends.numpy.pixels.body import body_text

    return body_text(stage, name)


def _places(stage: StageLayout) -> list[tuple[int, bool]]:
    """Return the images that no stage makes, and True for those read by texel instead of by row."""
    images = list(enumerate(stage.program.images))
    return [(n, use.absolute or use not in stage.near) for n, use in images if n not in stage.rings]
