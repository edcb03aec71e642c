"""Sources of tiles: TIFF and OpenEXR files, Zarr stores, and arrays indexed as ``array[rows, columns]``."""

from __future__ import annotations

from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from passgraph import arguments
from passgraph.errors import InputError, reason
from passgraph.image_files import paste
from passgraph.pictures import split_layer
from passgraph.run.caller_arrays import GREY_CHANNELS
from passgraph.tiles.grid import Numbers, Part, Source, block_of, checked_dtype, checked_shape, imported, touched


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
        if not (hasattr(given, "shape") and hasattr(given, "dtype") and hasattr(given, "__getitem__")):
            raise InputError(
                f"{what} must be a path or an array (h, w) or (h, w, 1 to 4) that gives its parts, got "
                f"{arguments.shown(given)}"
            )
        source = ArraySource(given, what, of_file=False)
        return source if source.block == (1, 1) else Blocks(source, room)
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
        raise InputError(
            f"{what}: {path} cannot be read as Zarr ({reason(error)}); give the path of an array"
        ) from error
    if not isinstance(array, zarr.Array):
        arrays = ", ".join(sorted(array.array_keys())) or "none"
        raise InputError(f"{what}: {path} is a Zarr group; give the path of one of its arrays: {arrays}")
    return array


class ArraySource(Source):
    """A source that indexes an array as ``array[rows, columns]``: NumPy, memory maps, Zarr, HDF5, dask."""

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


class Grey(Source):
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


class Blocks(Source):
    """A source with a cache of decoded blocks, since neighboring tiles share the blocks at their edges."""

    def __init__(self, source: Source, room: int) -> None:
        self.source, self.name = source, source.name
        self.shape, self.dtype, self.block = source.shape, source.dtype, source.block
        self.is_grey = source.is_grey
        height, width, channels = self.shape
        self.block_bytes = min(self.block[0], height) * min(self.block[1], width) * channels * self.dtype.itemsize
        across = -(-width // self.block[1])
        # Two rows of blocks: the row that a row of tiles shares with the next one, and the row after it.
        self.kept = max(1, min(2 * across + 2, room // max(1, self.block_bytes))) if self.block != (1, 1) else 0
        self._blocks: dict[tuple[int, int], Numbers] = {}
        # Two more: the block being decoded, and its encoded bytes.
        self.cost = (self.kept + 2) * self.block_bytes + source.cost

    def read(self, part: Part) -> Numbers:
        if self.block == (1, 1):
            return np.asarray(self.source.read(part))
        top, bottom, left, right = part
        joined = np.empty((bottom - top, right - left, self.shape[2]), self.dtype)
        for row, column in touched(part, self.block):
            paste(joined, (top, left), self._block(row, column), (row * self.block[0], column * self.block[1]))
        return joined

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
