"""Chains of pixel passes: what lies between them goes through rings of rows that stay in a core's cache.

A piece of work is a rectangle of the last pass's target.  Its rows are made one by one, and before each the rows that
it needs of the passes before it; of those only the last few are kept, in a ring.  What a piece needs beyond its own
rectangle is computed again, so every piece stands alone and the values are the same bits as pass by pass.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

from passgraph.formats import Format
from passgraph.language import scalar as s
from passgraph.language.borders import BORDERS
from passgraph.plan.data import PixelStep
from passgraph.plan.window import Halo

#: Texels of the windows of a pass, their rows times their columns: 256 x 256, or a row of 65,536.
MAX_WINDOW = 1 << 16
#: Rows of them: each is an address that is found anew for each row of pixels.
MAX_WINDOW_ROWS = 1024


def reach(uses: Sequence[s.ImageUse]) -> Halo:
    """Return the halo of relative reads."""
    halo = Halo()
    for use in uses:
        if use.relative:
            halo = halo.over(Halo(-use.x[0], use.x[1], -use.y[0], use.y[1]))
    return halo


def near_images(program: s.ScalarProgram) -> tuple[s.ImageUse, ...]:
    """The images whose relative reads go through windows."""
    apart = _apart(program)
    around, halo = Halo(), []
    for use in program.images:
        wider = around.over(reach([use]))
        rows = wider.up + wider.down + 1
        small = rows <= MAX_WINDOW_ROWS and rows * (wider.left + wider.right + 1) <= MAX_WINDOW
        if use.relative and small and use.name not in apart:
            around = wider
            halo.append(use)
    return tuple(halo)


def _apart(program: s.ScalarProgram) -> set[str]:
    """Images read at offsets that differ between pixels: choices by what a pixel holds."""
    alike: set[int] = set()
    apart: set[str] = set()
    for i in s.walk(program.body):
        is_alike = all(isinstance(operand, s.Lit) or operand.id in alike for operand in s.operands_of(i))
        if isinstance(i, s.For):
            alike.add(i.index.id)
        elif isinstance(i, s.LoadTexel):
            if i.relative and not is_alike:
                apart.add(i.image)
        elif is_alike and isinstance(i, (s.Op, s.Choose, s.LoadUniform, s.LoadTable)):
            alike.update(value.id for value in s.results_of(i))
    return apart


#: Rings of one thread take at most this, half of the level-2 cache of common cores; rows that the last stage makes at
#: once come on top.
RING_BYTES = 512 * 1024
#: Narrower columns of pieces spend more on beginning and ending rows than a ring saves.
MIN_COLUMNS = 64
#: A piece is at least so many times as large as what must be computed again around it, in each direction.
MIN_SHARE = 6
#: Instructions a pixel that may be computed again for each number that then need not go to memory and back.
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
    """One pass of a chain."""

    step: Work
    margin: Halo  # what later stages need around a piece
    rings: tuple[tuple[int, int, int], ...]  # image number, the stage that makes it, which of its outputs

    @property
    def rows(self) -> int:
        """Rows of its results that are needed at once."""
        return self.margin.up + self.margin.down + 1

    @property
    def channels(self) -> tuple[int, ...]:
        return tuple(len(output.values) for output in self.step.program.outputs)


def single_stage(step: PixelStep) -> tuple[Stage, ...]:
    """A pass by itself: a chain of one."""
    return (Stage(step, Halo(), ()),)


def stages(steps: Sequence[PixelStep]) -> tuple[Stage, ...] | None:
    """The chain of these passes, or None where one reads another anywhere but in a fixed neighborhood."""
    if any(step.program.arrays for step in steps):
        return None  # the arrays of each would lie on the stack at once
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
    loads = (i for i in s.walk(program.body) if isinstance(i, s.LoadTexel) and i.image == use.name)
    # Other rules lead out of the rows and columns kept.
    return all(BORDERS[load.border].is_nearest for load in loads)


def pitch(stage: Stage, tile: int) -> int:
    """Columns of a ring for pieces so wide: an odd multiple of 16, so that rows begin with a cache line, and lines
    above one another do not fall into the same set of the cache."""
    return (tile + stage.margin.left + stage.margin.right + 15) // 16 // 2 * 32 + 16


@dataclass(frozen=True)
class Tiling:
    """The pieces of a target: ``columns`` side by side, each ``width`` wide, ``rows`` high."""

    columns: int
    width: int
    rows: int
    pieces: int


def tiling(chain: Sequence[Stage], threads: int, least_pixels: int, at_once: int = 1) -> Tiling | None:
    """Pieces that fill the threads and whose rings fit the cache; None where too much would be computed again.

    ``at_once``: how many rows the last stage makes at once.
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
    if tiles.pieces < min(threads, tile_rows) or any(_dear(stage, tiles) for stage in chain[:-1]):
        return None
    return tiles


def _dear(stage: Stage, tiles: Tiling) -> bool:
    """Whether computing a stage again around every piece costs more than what a chain saves."""
    width, height = stage.step.size
    left, right, up, down = stage.margin
    again = (1 + (left + right) / tiles.width * (tiles.width < width)) * (
        1 + (up + down) / tiles.rows * (tiles.rows < height)
    ) - 1
    return again * s.work(stage.step.program.body) > MAX_AGAIN * sum(stage.channels)
