"""Parts of a picture, their sources, and the tiling within a memory limit."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from importlib import import_module
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from passgraph.arguments import shown
from passgraph.errors import InputError
from passgraph.plan.limits import enough, format_bytes
from passgraph.plan.window import Footprint, Halo, windows

Numbers: TypeAlias = NDArray[Any]
#: (top, bottom, left, right) of a part of a picture; bottom and right are exclusive.
Part: TypeAlias = tuple[int, int, int, int]
#: A function that returns a part of a picture in the dtype of its sink.
Convert: TypeAlias = Callable[[Part], Numbers]

#: Most pixels that are converted and written at once, which bounds the size of temporary arrays.
PIECE_PIXELS = 1 << 18


def pieces(part: Part, block: tuple[int, int]) -> Iterator[Part]:
    """Split a part along the edges of blocks, into pieces of at most :data:`PIECE_PIXELS` or one block.

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


def touched(part: Part, block: tuple[int, int]) -> Iterator[tuple[int, int]]:
    """Yield the row and the column, counted in blocks, of each block that a part overlaps."""
    top, bottom, left, right = part
    for row in range(top // block[0], -(-bottom // block[0])):
        for column in range(left // block[1], -(-right // block[1])):
            yield row, column


class Source:
    """A picture that is read part by part.

    Attributes
    ----------
    shape : (height, width, channels)
    block : (height, width) of the blocks that are decoded as a whole, (1, 1) if there are none
    cost : memory for reading besides the part itself
    is_grey : True for a gray picture, which has no channel axis; False for one channel of data
    """

    name: str
    shape: tuple[int, int, int]
    dtype: np.dtype[Any]
    block: tuple[int, int]
    cost = 0
    is_grey: bool

    def read(self, part: Part) -> Numbers:
        """Return a copy of the part as (rows, columns, channels)."""
        raise NotImplementedError

    def close(self) -> None:
        """Release the file, if there is one."""


def imported(package: str, what: str) -> Any:
    """Import a package of the extra ``tiles``."""
    try:
        return import_module(package)
    except ImportError:
        raise InputError(
            f"{what} needs the package {package}; install it with: pip install 'passgraph[tiles]'"
        ) from None


def checked_shape(shape: Any, what: str) -> tuple[int, int, int]:
    """Return the shape of a picture as (height, width, channels), after checking it."""
    try:
        sides = tuple(int(side) for side in shape)
    except (TypeError, ValueError):  # dask has NaN for unknown sizes
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
    """Return (height, width) of an array's chunks, or if ``written``, of its shards; (1, 1) if it has none."""
    chunks = (getattr(array, "shards", None) if written else None) or getattr(array, "chunks", None)
    if not chunks or len(chunks) < 2:
        return 1, 1
    # dask lists the chunks along each axis
    sides = [max(side) if isinstance(side, tuple) else int(side) for side in chunks[:2]]
    return sides[0], sides[1]


#: Most pixels of a window whose halo is small. Its pictures of four floats are then below 32 MiB, up to which
#: allocators reuse memory (glibc, M_MMAP_THRESHOLD). Larger ones are mapped anew for each tile; the page faults took a
#: third of the time.
MOST_PIXELS = 2_000_000
#: Least tiles of a picture, approximately, so that reading, computing and writing overlap …
LEAST_TILES = 8
#: … unless their windows would have fewer pixels than this.
LEAST_PIXELS = 1 << 19
#: Pixels computed for each pixel of a result that count as cheap: the widest tiles within it are chosen, since files
#: are read faster in wide parts.
FAIR_SHARE = 1.1


@dataclass(frozen=True, slots=True)
class Cost:
    """Memory of a tile in bytes: ``fixed``, plus ``pixel`` for each pixel of its window."""

    fixed: int
    pixel: int

    def bytes_for(self, pixels: int) -> int:
        return self.fixed + self.pixel * pixels


@dataclass(frozen=True)
class Tile:
    """A tile: the window that is read and computed, and its core without the halo, which is written."""

    window: Part
    core: Part


@dataclass(frozen=True)
class Grid:
    """The tiling of a picture, returned by :func:`passgraph.tiled`.

    Attributes
    ----------
    size : (width, height) of the picture, px
    core : (width, height) that each tile writes; less at the right and bottom edges
    window : (width, height) that each tile reads and computes, the same for all
    halo : how far the passes read to each side, px
    bytes : most memory of pictures, blocks of files and compiled passes
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
        """Iterate over the tiles row by row, from the top left."""
        return self.touching((0, self.size[1], 0, self.size[0]))

    def is_along(self, block: int) -> bool:
        """Return True if every tile begins at the corner of a square block of this side."""
        return all(core >= side or core % block == 0 for core, side in zip(self.core, self.size, strict=True))

    def touching(self, part: Part) -> Iterator[Tile]:
        """Yield the tiles whose cores overlap a part."""
        (width, height), (across, down), halo = self.size, self.core, self.halo
        columns = [span for span in windows(width, across, halo.left, halo.right) if _overlaps(span, part[2:])]
        rows = [span for span in windows(height, down, halo.up, halo.down) if _overlaps(span, part[:2])]
        for y, top, bottom in rows:
            for x, left, right in columns:
                yield Tile((y, y + self.window[1], x, x + self.window[0]), (top, bottom, left, right))


def _overlaps(window: tuple[int, int, int], span: tuple[int, ...]) -> bool:
    return window[1] < span[1] and window[2] > span[0]


def grid_of(
    size: tuple[int, int],
    footprint: Footprint,
    cost: Cost,
    memory: int,
    block: tuple[int, int],
    tile: tuple[int, int] | None = None,
) -> Grid:
    """Choose the tiling of a picture.

    Parameters
    ----------
    size : (width, height) of the picture
    memory : memory limit in bytes
    block : (height, width) of the blocks of sinks; tiles are aligned to them where possible
    tile : requested (width, height) of a tile's core, instead of one chosen from the memory limit

    Raises
    ------
    TooLittleMemoryError : the smallest or the requested tile does not fit
    """
    pixels_in_memory = (memory - cost.fixed) // max(1, cost.pixel)
    if tile is not None:
        core = min(size[0], tile[0]), min(size[1], tile[1])
        core = (size[0] if footprint.wide else core[0], size[1] if footprint.high else core[1])
        tiles = _grid(size, core, footprint.halo, cost)
        if tiles.bytes > memory:
            raise TooLittleMemoryError(memory, tiles, footprint)
        return tiles
    candidates: list[Grid] = []
    pixels = min(pixels_in_memory, MOST_PIXELS, max(LEAST_PIXELS, size[0] * size[1] // LEAST_TILES))
    while pixels > 0:
        grids = [_grid(size, core, footprint.halo, cost) for core in _cores(size, footprint, pixels, block)]
        cheap = next((grid for grid in grids if _overhead(grid, block) <= FAIR_SHARE), None)
        if cheap is not None:
            return cheap
        candidates += grids
        pixels = min(pixels_in_memory, 4 * pixels) if pixels < pixels_in_memory else 0
    if candidates:
        return min(candidates, key=lambda grid: _overhead(grid, block))
    smallest = (size[0] if footprint.wide else 1, size[1] if footprint.high else 1)
    raise TooLittleMemoryError(memory, _grid(size, smallest, footprint.halo, cost), footprint)


def _grid(size: tuple[int, int], core: tuple[int, int], halo: Halo, cost: Cost) -> Grid:
    window = min(size[0], core[0] + halo.left + halo.right), min(size[1], core[1] + halo.up + halo.down)
    return Grid(size, core, window, halo, cost.bytes_for(window[0] * window[1]))


def _cores(
    size: tuple[int, int], footprint: Footprint, pixels: int, block: tuple[int, int]
) -> Iterator[tuple[int, int]]:
    """Yield the possible cores of tiles whose windows have at most ``pixels`` pixels, widest first."""
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
    """Round a length up to a multiple of the block size if the result is less than ``below``."""
    rounded = -(-length // block) * block
    return rounded if rounded < below else length


def _overhead(grid: Grid, block: tuple[int, int]) -> float:
    """Return the pixels computed for each pixel written, times 1.5 if tiles are not aligned to blocks."""
    (across, down), (width, height) = grid.core, grid.window
    cuts = (across < grid.size[0] and across % block[1] != 0) or (down < grid.size[1] and down % block[0] != 0)
    return width * height / (across * down) * (1.5 if cuts else 1.0)


class TooLittleMemoryError(InputError):
    """Raised if the smallest tile, or the one asked for, takes more than the memory; it takes ``needed`` bytes."""

    def __init__(self, memory: int, grid: Grid, footprint: Footprint) -> None:
        reasons = "".join(f"; {reason}" for reason in (footprint.wide, footprint.high) if reason)
        super().__init__(
            f"memory of {format_bytes(memory)} is too little: a tile of {grid.core[0]}x{grid.core[1]} pixels, read "
            f"with {grid.window[0]}x{grid.window[1]}, takes {format_bytes(grid.bytes)}{reasons}; give at least "
            f"{enough(grid.bytes)}"
        )
        self.needed = grid.bytes
