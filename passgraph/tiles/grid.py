"""Tiling of a picture: tiles as large as the memory limit allows, in at most two shapes a side."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from importlib import import_module
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from passgraph.arguments import shown
from passgraph.errors import InputError
from passgraph.plan.limits import format_bytes
from passgraph.plan.window import Footprint, Halo, windows

Numbers: TypeAlias = NDArray[Any]
#: (first row, row behind the last, first column, column behind the last) of a part of a picture.
Part: TypeAlias = tuple[int, int, int, int]
#: Gives a part of a picture in the numbers that its sink holds.
Convert: TypeAlias = Callable[[Part], Numbers]

#: Pixels that are converted and written at once: what lies between them and the file stays small.
PIECE_PIXELS = 1 << 18


def pieces(part: Part, block: tuple[int, int]) -> Iterator[Part]:
    """A part cut into pieces of at most :data:`PIECE_PIXELS`, or one block, along the edges of blocks.

    >>> list(pieces((0, 2, 100, 600), (1, 1)))
    [(0, 2, 100, 600)]
    >>> list(pieces((100, 600, 0, 4), (512, 512)))
    [(100, 512, 0, 4), (512, 600, 0, 4)]
    """
    top, bottom, left, right = part
    first_row, first_column = top // block[0] * block[0], left // block[1] * block[1]
    across = -(-(right - first_column) // block[1])
    columns = block[1] * max(1, min(across, PIECE_PIXELS // (block[0] * block[1])))
    rows = block[0] * max(1, PIECE_PIXELS // (block[0] * columns))
    for y in range(first_row, bottom, rows):
        for x in range(first_column, right, columns):
            yield max(top, y), min(bottom, y + rows), max(left, x), min(right, x + columns)


def imported(package: str, what: str) -> Any:
    """A package of the extra ``tiles``."""
    try:
        return import_module(package)
    except ImportError:
        raise InputError(
            f"{what} needs the package {package}; install it with: pip install 'passgraph[tiles]'"
        ) from None


def checked_shape(shape: Any, what: str) -> tuple[int, int, int]:
    """(height, width, channels) of a picture."""
    try:
        sides = tuple(int(side) for side in shape)
    except (TypeError, ValueError):  # sizes that dask does not know yet are NaN
        sides = ()
    if len(sides) == 2:
        sides = (*sides, 1)
    if len(sides) != 3 or not all(sides) or sides[2] > 4:
        raise InputError(f"{what} must have the shape (h, w) or (h, w, 1 to 4) and at least one pixel, got {shape}")
    return sides


def checked_dtype(dtype: Any, what: str) -> np.dtype[Any]:
    """Check a picture's dtype: bool, uint8, uint16 or float."""
    try:
        checked: np.dtype[Any] = np.dtype(dtype)
    except TypeError:
        raise InputError(f"{what} must be uint8, uint16 or floats, got {shown(dtype)}") from None
    if checked.kind not in "fb" and not (checked.kind == "u" and checked.itemsize <= 2):
        raise InputError(f"{what} has dtype {checked}; give uint8, uint16 or floats (0 to 1 for colours)")
    return checked


def block_of(array: Any, *, written: bool = False) -> tuple[int, int]:
    """(height, width) of an array's chunks, or of the shards in which they are written; (1, 1) where it has none."""
    chunks = (getattr(array, "shards", None) if written else None) or getattr(array, "chunks", None)
    if not chunks or len(chunks) < 2:
        return 1, 1
    # dask lists the chunks along each axis
    sides = [max(side) if isinstance(side, tuple) else int(side) for side in chunks[:2]]
    return sides[0], sides[1]


#: Windows are not larger than this where little is computed twice: their pictures of four floats are then below 32 MiB,
#: up to which allocators hand memory out again (glibc, M_MMAP_THRESHOLD); what is larger comes from the system page by
#: page each time, which took a third of the time.
MOST_PIXELS = 2_000_000
#: A picture is cut into about so many tiles at least, so that reading, computing and writing overlap …
LEAST_TILES = 8
#: … unless they would be smaller than this.
LEAST_PIXELS = 1 << 19
#: Pixels computed for each pixel of a result: wider tiles are taken, which files read faster, up to here.
FAIR_SHARE = 1.1


@dataclass(frozen=True, slots=True)
class Cost:
    """Bytes: ``fixed``, and for each pixel of a window."""

    fixed: int
    pixel: int

    def of(self, pixels: int) -> int:
        return self.fixed + self.pixel * pixels


@dataclass(frozen=True)
class Tile:
    """The window that is read and computed, and the part of it that is exact and is written."""

    window: Part
    core: Part


@dataclass(frozen=True)
class Grid:
    """The tiling of a picture, returned by :func:`passgraph.tiled`.

    Attributes
    ----------
    size : (width, height) of the picture, px
    core : (width, height) that each tile writes; those at the right and bottom edges may write less
    window : (width, height) that each tile reads and computes; all are of this size
    halo : how far results reach to each side, px
    bytes : that pictures, blocks of files and compiled passes take at most
    """

    size: tuple[int, int]
    core: tuple[int, int]
    window: tuple[int, int]
    halo: Halo
    bytes: int

    def __len__(self) -> int:
        (width, height), (across, down) = self.size, self.core
        return -(-width // across) * -(-height // down)

    def __iter__(self) -> Iterator[Tile]:
        """Row by row, from the top left."""
        return self.touching((0, self.size[1], 0, self.size[0]))

    def touching(self, part: Part) -> Iterator[Tile]:
        """The tiles that write something of a part."""
        (width, height), (across, down), halo = self.size, self.core, self.halo
        columns = [each for each in windows(width, across, halo.left, halo.right) if _meet(each, part[2:])]
        for y, top, bottom in (each for each in windows(height, down, halo.up, halo.down) if _meet(each, part[:2])):
            for x, left, right in columns:
                yield Tile((y, y + self.window[1], x, x + self.window[0]), (top, bottom, left, right))


def _meet(window: tuple[int, int, int], span: tuple[int, ...]) -> bool:
    return window[1] < span[1] and window[2] > span[0]


def grid_of(
    size: tuple[int, int],
    footprint: Footprint,
    cost: Cost,
    memory: int,
    block: tuple[int, int],
    tile: tuple[int, int] | None = None,
) -> Grid:
    """The tiles of a picture.

    Parameters
    ----------
    size : (width, height) of the picture
    memory : bytes that may be taken
    block : (height, width) that sinks write at once: tiles end at multiples of it where they can
    tile : (width, height) that each tile shall write, in place of what the memory decides

    Raises
    ------
    InputError : where not even the smallest tile fits, or the tile asked for does not
    """
    pixels_in_memory = (memory - cost.fixed) // max(1, cost.pixel)
    if tile is not None:
        core = min(size[0], tile[0]), min(size[1], tile[1])
        core = (size[0] if footprint.wide else core[0], size[1] if footprint.high else core[1])
        tiles = _grid(size, core, footprint.halo, cost)
        if tiles.bytes > memory:
            raise _too_little(memory, tiles, footprint)
        return tiles
    found: list[Grid] = []
    pixels = min(pixels_in_memory, MOST_PIXELS, max(LEAST_PIXELS, size[0] * size[1] // LEAST_TILES))
    while pixels > 0:
        grids = [_grid(size, core, footprint.halo, cost) for core in _cores(size, footprint, pixels, block)]
        fair = next((grid for grid in grids if _share(grid, block) <= FAIR_SHARE), None)
        if fair is not None:
            return fair
        found += grids
        pixels = min(pixels_in_memory, 4 * pixels) if pixels < pixels_in_memory else 0
    if found:
        return min(found, key=lambda grid: _share(grid, block))
    least = (size[0] if footprint.wide else 1, size[1] if footprint.high else 1)
    raise _too_little(memory, _grid(size, least, footprint.halo, cost), footprint)


def _grid(size: tuple[int, int], core: tuple[int, int], halo: Halo, cost: Cost) -> Grid:
    window = min(size[0], core[0] + halo.left + halo.right), min(size[1], core[1] + halo.up + halo.down)
    return Grid(size, core, window, halo, cost.of(window[0] * window[1]))


def _cores(
    size: tuple[int, int], footprint: Footprint, pixels: int, block: tuple[int, int]
) -> Iterator[tuple[int, int]]:
    """Yield the possible cores of tiles whose windows have at most so many pixels, the widest first."""
    (width, height), halo = size, footprint.halo
    across = width
    while across >= 1:
        window = min(width, across + halo.left + halo.right)
        rows = pixels // window
        down = height if rows >= height else rows - halo.up - halo.down
        if down >= height or (down >= 1 and not footprint.high):
            yield across, down if down == height or down < block[0] else down // block[0] * block[0]
        if footprint.wide or across == 1:
            return
        across = _rounded(-(-across // 2), block[1], across)


def _rounded(length: int, block: int, below: int) -> int:
    """A length in whole blocks where that is still less than it was."""
    rounded = -(-length // block) * block
    return rounded if rounded < below else length


def _share(grid: Grid, block: tuple[int, int]) -> float:
    """Pixels computed for each that is written; tiles that cut blocks in two count half as much again."""
    (across, down), (width, height) = grid.core, grid.window
    cuts = (across < grid.size[0] and across % block[1] != 0) or (down < grid.size[1] and down % block[0] != 0)
    return width * height / (across * down) * (1.5 if cuts else 1.0)


def _too_little(memory: int, grid: Grid, footprint: Footprint) -> InputError:
    reasons = "".join(f"; {reason}" for reason in (footprint.wide, footprint.high) if reason)
    return InputError(
        f"memory of {format_bytes(memory)} is too little: a tile of {grid.core[0]}x{grid.core[1]} pixels, read with "
        f"{grid.window[0]}x{grid.window[1]}, takes {format_bytes(grid.bytes)}{reasons}; give more, or fewer passes"
    )
