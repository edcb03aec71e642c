"""Sources of tiles: TIFF and OpenEXR files, Zarr stores, and arrays indexed as ``array[rows, columns]``."""

from __future__ import annotations

from collections.abc import Iterator
from os import PathLike
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from passgraph import arguments
from passgraph.errors import InputError
from passgraph.pictures import split_layer
from passgraph.run.caller_arrays import GREY_CHANNELS
from passgraph.tiles.grid import Numbers, Part, block_of, checked_dtype, checked_shape, imported


class Source(Protocol):
    """A picture that is read part by part.

    ``shape`` is (height, width, channels). ``block`` is the (height, width) of the blocks that are decoded as a whole,
    (1, 1) if there are none. ``cost`` is the memory for reading besides the part itself.
    """

    @property
    def name(self) -> str: ...
    @property
    def shape(self) -> tuple[int, int, int]: ...
    @property
    def dtype(self) -> np.dtype[Any]: ...
    @property
    def block(self) -> tuple[int, int]: ...
    @property
    def cost(self) -> int: ...
    @property
    def is_grey(self) -> bool:
        """True for a gray picture, which has no channel axis; False for one channel of data."""

    def read(self, part: Part) -> Numbers:
        """Return a copy of the part as (rows, columns, channels)."""

    def close(self) -> None: ...


def open_source(given: Any, what: str, room: int) -> Source:
    """Open a path or an array as a source.

    Parameters
    ----------
    given : the path of a TIFF or OpenEXR file or of a Zarr array, or an array of any library that has ``shape``,
        ``dtype`` and ``[rows, columns]``, (h, w) or (h, w, 1 to 4)
    what : its name in messages
    room : bytes of decoded blocks to keep for the next tiles

    Raises
    ------
    InputError : it does not exist, or is no picture that can be read in parts
    """
    if not isinstance(given, (str, PathLike)):
        return array_source(given, what, room)
    path = Path(given)
    file, _ = split_layer(path)
    if not file.exists():
        raise InputError(
            f"{what}: there is no {file}; give the path of a TIFF or OpenEXR file or Zarr array, or an array"
        )
    if path.is_dir() or path.suffix.lower() == ".zarr":
        return Blocks(ArraySource(open_zarr(path, what), f"{what} ({path})", of_file=True), room)
    if file.suffix.lower() == ".exr":
        from passgraph.tiles.exr import ExrSource

        return Blocks(ExrSource(path, what), room)
    if path.suffix.lower() not in (".tif", ".tiff"):
        raise InputError(
            f"{what}: {path} is read whole or not at all; tiles come from TIFF (.tif, .tiff), OpenEXR (.exr), Zarr "
            "(.zarr), or an array"
        )
    from passgraph.tiles.tiff import TiffSource

    return Blocks(TiffSource(path, what), room)


def open_zarr(path: Path, what: str) -> Any:
    """Open the array of a Zarr store."""
    zarr = imported("zarr", what)
    try:
        array = zarr.open(str(path), mode="r")
    except Exception as error:  # stores raise errors of any type
        reason = " ".join(str(error).split()) or type(error).__name__
        raise InputError(f"{what}: {path} cannot be read as Zarr ({reason}); give the path of an array") from error
    if not isinstance(array, zarr.Array):
        arrays = ", ".join(sorted(array.array_keys())) or "none"
        raise InputError(f"{what}: {path} is a Zarr group; give the path of one of its arrays: {arrays}")
    return array


def array_source(given: Any, what: str, room: int) -> Source:
    """Return a source that reads an array, with a cache of blocks if it is chunked."""
    if not (hasattr(given, "shape") and hasattr(given, "dtype") and hasattr(given, "__getitem__")):
        raise InputError(
            f"{what} must be a path or an array (h, w) or (h, w, 1 to 4) that gives its parts, got "
            f"{arguments.shown(given)}"
        )
    source = ArraySource(given, what, of_file=False)
    return source if source.block == (1, 1) else Blocks(source, room)


class ArraySource:
    """A source that indexes an array as ``array[rows, columns]``: NumPy, memory maps, Zarr, HDF5, dask."""

    cost = 0

    def __init__(self, array: Any, name: str, *, of_file: bool) -> None:
        self.name, self.array, self._of_file = name, array, of_file
        self.shape = checked_shape(array.shape, name)
        self.dtype = checked_dtype(array.dtype, name)
        self.block = block_of(array)
        self.is_grey = len(array.shape) == 2

    def read(self, part: Part) -> Numbers:
        top, bottom, left, right = part
        try:
            pixels = self.array[top:bottom, left:right]
        except Exception as error:  # stores raise errors of any type; errors of the caller's arrays are not converted
            if not self._of_file:
                raise
            raise InputError(
                f"{self.name}: truncated or corrupt at rows {top} to {bottom} ({error}); make or copy it again"
            ) from error
        copied = np.array(arguments.numbers(pixels, self.name))
        shape = bottom - top, right - left, self.shape[2]
        if copied.shape not in (shape, shape[:2] if shape[2] == 1 else shape):
            raise InputError(
                f"{self.name}: rows {top} to {bottom} and columns {left} to {right} have shape {copied.shape}; "
                f"expected {shape}"
            )
        return copied.reshape(shape)

    def close(self) -> None:
        """Do nothing; the array belongs to the caller."""


class Grey:
    """A gray source as RGB: its value is red, green and blue."""

    is_grey = False

    def __init__(self, source: Source) -> None:
        self.source, self.name = source, source.name
        self.shape = (*source.shape[:2], GREY_CHANNELS)
        self.dtype, self.block, self.cost = source.dtype, source.block, source.cost

    def read(self, part: Part) -> Numbers:
        return np.repeat(self.source.read(part), GREY_CHANNELS, axis=2)

    def close(self) -> None:
        self.source.close()


class Blocks:
    """A source with a cache of decoded blocks, since neighboring tiles share the blocks at their edges."""

    def __init__(self, source: Any, room: int) -> None:
        self.source, self.name = source, source.name
        self.shape, self.dtype, self.block = source.shape, source.dtype, source.block
        self.is_grey = source.is_grey
        height, width, channels = self.shape
        self.block_bytes = min(self.block[0], height) * min(self.block[1], width) * channels * self.dtype.itemsize
        across = -(-width // self.block[1])
        # Two rows of blocks: the row that a row of tiles shares with the next one, and the row after it.
        self.kept = max(1, min(2 * across + 2, room // max(1, self.block_bytes))) if self.block != (1, 1) else 0
        self._blocks: dict[tuple[int, int], Numbers] = {}

    @property
    def cost(self) -> int:
        # Two more: the block being decoded, and its encoded bytes.
        return int((self.kept + 2) * self.block_bytes + self.source.cost)

    def read(self, part: Part) -> Numbers:
        if self.block == (1, 1):
            return np.asarray(self.source.read(part))
        top, bottom, left, right = part
        joined = np.empty((bottom - top, right - left, self.shape[2]), self.dtype)
        for row, column in self._touched(part):
            block, y, x = self._block(row, column), row * self.block[0], column * self.block[1]
            y0, y1, x0, x1 = max(top, y), min(bottom, y + len(block)), max(left, x), min(right, x + block.shape[1])
            joined[y0 - top : y1 - top, x0 - left : x1 - left] = block[y0 - y : y1 - y, x0 - x : x1 - x]
        return joined

    def _touched(self, part: Part) -> Iterator[tuple[int, int]]:
        top, bottom, left, right = part
        for row in range(top // self.block[0], -(-bottom // self.block[0])):
            for column in range(left // self.block[1], -(-right // self.block[1])):
                yield row, column

    def _block(self, row: int, column: int) -> Numbers:
        block = self._blocks.get((row, column))
        if block is None:
            (height, width), (rows, columns) = self.shape[:2], self.block
            top, left = row * rows, column * columns
            while len(self._blocks) >= self.kept:
                # Tiles proceed to the right and down, so the first block is the one that is needed no more.
                del self._blocks[min(self._blocks)]
            block = self.source.read((top, min(top + rows, height), left, min(left + columns, width)))
            self._blocks[row, column] = block
        return block

    def close(self) -> None:
        self._blocks.clear()
        self.source.close()
