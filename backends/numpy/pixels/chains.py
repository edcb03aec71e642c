"""Chains of pixel passes: intermediate results are stored in rings of rows that stay in a core's cache.

A piece of work is a rectangle of the last pass's target.  Its rows are computed one by one, each after the rows of
earlier passes that it needs; a ring keeps only the last few of those.  The halo of a piece is recomputed, so pieces are
independent and results are bit-identical to running pass by pass.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

from passgraph.formats import Format
from passgraph.language import scalar as s
from passgraph.language.borders import BORDERS
from passgraph.plan.data import PixelStep
from passgraph.plan.window import Halo
from passgraph.records import dataclass

#: Most texels of a pass's windows, rows times columns: 256 x 256, or a row of 65,536.
MAX_WINDOW = 1 << 16
#: Most rows of windows: each row's address is computed again for each row of pixels.
MAX_WINDOW_ROWS = 1024


def reach(uses: Sequence[s.ImageUse]) -> Halo:
    """Return the halo of relative reads."""
    halo = Halo()
    for use in uses:
        if use.relative:
            halo = halo.over(Halo(-use.x[0], use.x[1], -use.y[0], use.y[1]))
    return halo


def near_images(program: s.ScalarProgram) -> tuple[s.ImageUse, ...]:
    """Return the images whose relative reads use windows."""
    apart = program.varying_images if any(use.relative for use in program.images) else frozenset()
    around, halo = Halo(), []
    for use in program.images:
        wider = around.over(reach([use]))
        rows = wider.up + wider.down + 1
        small = rows <= MAX_WINDOW_ROWS and rows * (wider.left + wider.right + 1) <= MAX_WINDOW
        if use.relative and small and use.name not in apart:
            around = wider
            halo.append(use)
    return tuple(halo)


#: Most bytes of one thread's rings, half of the level-2 cache of common cores; rows that the last stage computes
#: together come on top.
RING_BYTES = 512 * 1024
#: Least columns of a piece: for narrower ones, row starts and ends cost more than a ring saves.
MIN_COLUMNS = 64
#: Least size of a piece compared with its recomputed halo, in each direction.
MIN_SHARE = 6
#: Most recomputed instructions per pixel for each number that stays out of main memory.
MAX_AGAIN = 12


class Work(Protocol):
    """The properties of a step that a stage needs, see :class:`passgraph.plan.data.PixelStep`."""

    @property
    def program(self) -> s.ScalarProgram: ...
    @property
    def size(self) -> tuple[int, int]: ...
    @property
    def image_formats(self) -> tuple[Format, ...]: ...
    @property
    def output_formats(self) -> tuple[Format, ...]: ...


@dataclass(frozen=True)
class Stage:
    """A pass of a chain."""

    step: Work
    margin: Halo  # the halo that later stages need around a piece
    rings: tuple[tuple[int, int, int], ...]  # image number, the stage that makes it, index among its outputs

    @property
    def rows(self) -> int:
        """Return the rows of its results that are needed at the same time."""
        return self.margin.up + self.margin.down + 1

    @property
    def channels(self) -> tuple[int, ...]:
        return tuple(len(output.values) for output in self.step.program.outputs)


def single_stage(step: PixelStep) -> tuple[Stage, ...]:
    """Return a chain of one pass."""
    return (Stage(step, Halo(), ()),)


def stages(steps: Sequence[PixelStep]) -> tuple[Stage, ...] | None:
    """Return the chain of these passes; None if one reads another outside of a fixed neighborhood."""
    if any(step.program.arrays for step in steps):
        return None  # the arrays of all would be on the stack together
    producers = {resource: (k, slot) for k, step in enumerate(steps) for slot, resource in enumerate(step.outputs)}
    margins = [Halo()] * len(steps)
    rings: list[list[tuple[int, int, int]]] = [[] for _ in steps]
    for k in range(len(steps) - 1, -1, -1):
        program, resources = steps[k].program, dict(steps[k].images)
        for number, use in enumerate(program.images):
            if resources[use.name] not in producers:
                continue
            producer, slot = producers[resources[use.name]]
            if producer >= k or not _near(program, use):
                return None
            margins[producer] = margins[producer].over(reach([use]).beyond(margins[k]))
            rings[k].append((number, producer, slot))
    return tuple(Stage(step, margins[k], tuple(rings[k])) for k, step in enumerate(steps))


def _near(program: s.ScalarProgram, use: s.ImageUse) -> bool:
    if use.absolute or (use.relative and use not in near_images(program)):
        return False
    # Other rules read outside of the stored rows and columns.
    return all(BORDERS[load.border].is_nearest for load in s.texel_loads(program.body, use.name))


def pitch(stage: Stage, tile: int) -> int:
    """Return the row stride of a ring for a piece width: an odd multiple of 16, so that rows are aligned to cache lines
    and successive rows do not map to the same cache set."""
    return (tile + stage.margin.left + stage.margin.right + 15) // 16 // 2 * 32 + 16


@dataclass(frozen=True)
class Tiling:
    """The pieces of a target: ``columns`` side by side, each ``width`` wide, ``rows`` high."""

    columns: int
    width: int
    rows: int
    pieces: int


def tiling(chain: Sequence[Stage], threads: int, least_pixels: int, at_once: int = 1) -> Tiling | None:
    """Return pieces that occupy all threads and whose rings fit the cache; None if too much would be recomputed.

    ``at_once``: number of rows that the last stage computes together.
    """
    width, height = chain[-1].step.size
    if len(chain) == 1:
        rows = min(height, -(-max(1, least_pixels // width) // at_once) * at_once)
        return Tiling(1, width, rows, -(-height // rows))
    around = Halo()
    for stage in chain:
        around = around.over(stage.margin)
    across, down = around.left + around.right, around.up + around.down
    fitting = RING_BYTES // sum(4 * stage.rows * sum(stage.channels) for stage in chain[:-1]) - across
    tile = min(width, fitting // 16 * 16)
    if tile < width and tile < max(MIN_SHARE * across, MIN_COLUMNS):
        return None
    columns = -(-width // tile)
    tile_rows = min(4 * threads, -(-width * height // least_pixels))
    rows = max(-(-height * columns // tile_rows), MIN_SHARE * down)
    rows = min(height, -(-rows // at_once) * at_once)
    tiles = Tiling(columns, tile, rows, columns * -(-height // rows))
    if tiles.pieces < min(threads, tile_rows) or any(_costs_too_much(stage, tiles) for stage in chain[:-1]):
        return None
    return tiles


def _costs_too_much(stage: Stage, tiles: Tiling) -> bool:
    """Return True if recomputing a stage around every piece costs more than a chain saves."""
    width, height = stage.step.size
    left, right, up, down = stage.margin
    again = (1 + (left + right) / tiles.width * (tiles.width < width)) * (
        1 + (up + down) / tiles.rows * (tiles.rows < height)
    ) - 1
    return again * s.work(stage.step.program.body) > MAX_AGAIN * sum(stage.channels)
