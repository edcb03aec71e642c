"""Read windows of scanline and tiled OpenEXR files, and write tiled ones, with OpenImageIO."""

from __future__ import annotations

import errno
import os
from contextlib import ExitStack
from math import ceil
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from passgraph.image_files import ImageFile, associated, error_of, name_of, opened_image, paste, straight
from passgraph.image_formats import WRITABLE, Metadata
from passgraph.image_writing import check_system_error, created_output, image_spec
from passgraph.pictures import split_layer
from passgraph.tiles.grid import Convert, Numbers, Part, Source, checked_shape, pieces, touched

#: Rows that OpenEXR compresses together.
_ROWS_OF_STRIPS = {"zip": 16, "pxr24": 16, "piz": 32, "b44": 32, "b44a": 32, "dwaa": 32, "dwab": 256}
#: Sides of the tiles that are written, in pixels; small, since incomplete tiles are kept in memory.
TILE = 64


class ExrSource(Source):
    """An OpenEXR file, or one layer of it, in its display window; alpha is straight. Read by one thread at a time."""

    def __init__(self, path: Path, what: str) -> None:
        file, layer = split_layer(path)
        self.name = f"{what} ({path})"
        with ExitStack() as opened:
            self._image: ImageFile = opened.enter_context(opened_image(file, layer=layer))
            image = self._image
            self.shape = checked_shape((image.height, image.width, image.channels), self.name)
            # Divided by alpha, half floats become float32.
            self.dtype = np.dtype(np.float32) if image.is_associated else image.dtype
            self.is_grey = image.channels == 1
            spec = image.spec
            compression = str(spec.getattribute("compression") or "").partition(":")[0]
            strip = _ROWS_OF_STRIPS.get(compression, 1), spec.width
            self.block = (spec.tile_height, spec.tile_width) if spec.tile_width else strip
            # A block with all of the file's channels, compressed and decompressed.
            self.cost = 2 * self.block[0] * self.block[1] * spec.pixel_bytes(True)
            self._opened = opened.pop_all()

    def read(self, part: Part) -> Numbers:
        """Return a part of the display window; pixels outside the data window are 0."""
        image, spec = self._image, self._image.spec
        top, bottom, left, right = part
        pixels = np.zeros((bottom - top, right - left, self.shape[2]), image.dtype)
        # In the file's coordinates, cut at the data window.
        y0, y1 = max(top + spec.full_y, spec.y), min(bottom + spec.full_y, spec.y + spec.height)
        x0, x1 = max(left + spec.full_x, spec.x), min(right + spec.full_x, spec.x + spec.width)
        if y0 < y1 and x0 < x1:
            top, left = top + spec.full_y, left + spec.full_x
            pixels[y0 - top : y1 - top, x0 - left : x1 - left] = self._stored((y0, y1, x0, x1))
        return straight(pixels) if image.is_associated else pixels

    def _stored(self, part: Part) -> Numbers:
        """Return a part of the data window, in the file's coordinates."""
        image = self._image
        channels = range(min(image.order), max(image.order) + 1)
        stored = image.read_part(part, channels, "half" if image.dtype.itemsize == 2 else "float")
        return stored[:, :, [channel - channels.start for channel in image.order]]

    def close(self) -> None:
        self._opened.close()


class ExrSink:
    """A tiled OpenEXR file. Tiles are compressed and written in any order, each when all of its pixels are known.

    ``metadata`` is that of the source picture.
    """

    block = (TILE, TILE)

    def __init__(
        self, path: Path, shape: tuple[int, int, int], dtype: np.dtype[Any], metadata: Metadata | None = None
    ) -> None:
        self.shape, self.dtype, self._path = shape, dtype.newbyteorder("="), path
        metadata = metadata or Metadata()
        self._is_additive = metadata.additive
        self._is_multiplied = shape[2] in (2, 4) and not metadata.numbers
        spec = image_spec(shape, self.dtype, metadata, "openexr")
        spec.tile_width = spec.tile_height = TILE
        for name, value in (*WRITABLE[".exr"].attributes, ("openexr:lineOrder", "randomY")):
            spec.attribute(name, value)
        path.touch(exist_ok=False)  # raises OSError if the path cannot be written
        self._output = created_output("openexr")
        with name_of(path) as name:
            self._check(self._output.open(name, spec))
        #: Incomplete tiles and their counts of missing pixels, by row and column.
        self._incomplete: dict[tuple[int, int], tuple[Numbers, int]] = {}

    @staticmethod
    def cost(shape: tuple[int, int, int], dtype: np.dtype[Any]) -> int:
        """Return the bytes of two rows of tiles, which can be incomplete at the same time."""
        return 2 * TILE * shape[1] * shape[2] * dtype.itemsize

    def write(self, part: Part, picture: Convert) -> None:
        """Write a part, piece by piece; no pixel may be written twice."""
        for piece in pieces(part, self.block):
            numbers = picture(piece)
            if self._is_multiplied:
                numbers = associated(numbers, additive=self._is_additive)
            with np.errstate(over="ignore"):  # beyond half floats is infinite
                numbers = numbers.astype(self.dtype, copy=False)
            for row, column in touched(piece, self.block):
                self._add(row, column, (piece[0], piece[2]), numbers)

    def _add(self, row: int, column: int, corner: tuple[int, int], numbers: Numbers) -> None:
        """Add the pixels of a piece, with its corner at a row and a column of the picture, to a tile."""
        y, x = row * TILE, column * TILE
        inside = min(TILE, self.shape[0] - y) * min(TILE, self.shape[1] - x)
        empty = np.zeros((TILE, TILE, self.shape[2]), self.dtype)
        tile, missing = self._incomplete.pop((row, column), (empty, inside))
        missing -= paste(tile, (y, x), numbers, corner)
        if missing:
            self._incomplete[row, column] = tile, missing
        else:
            self._check(self._output.write_tile(x, y, 0, tile))

    def finish(self) -> None:
        self._check(self._output.close())
        height, width = self.shape[:2]
        _check_complete(self._path, ceil(height / TILE) * ceil(width / TILE))

    def close(self) -> None:
        self._output.close()

    def _check(self, done: bool) -> None:
        if not done:
            problem = " ".join(error_of(self._output).split())
            check_system_error(problem, self._path)
            raise OSError(problem or os.strerror(errno.EIO))


def _check_complete(path: Path, tiles: int) -> None:
    """Raise OSError if a file lacks the position of a tile, or ends before its last tile does.

    OpenEXR 3.5 writes the positions, and what is still buffered, in a destructor, which cannot raise an error.  The
    layout of a file of one part is, after 8 bytes: attributes, each a name, a type, a size and a value; a byte 0; the
    positions of the tiles; and the tiles, each 20 bytes that end with a size, and data ("OpenEXR File Layout").
    """
    with path.open("rb") as file:
        file.seek(8)
        while _name_in(file):
            _name_in(file)
            file.seek(int.from_bytes(file.read(4), "little"), os.SEEK_CUR)
        table = file.read(8 * tiles)
        positions = np.frombuffer(table, "<u8") if len(table) == 8 * tiles else np.zeros(1, "<u8")
        last = int(positions.max())
        file.seek(last + 16)
        end = last + 20 + int.from_bytes(file.read(4), "little")
        if not positions.all() or file.seek(0, os.SEEK_END) < end:
            raise OSError(errno.EIO, "the file is not complete on the disk", os.fspath(path))


def _name_in(file: BinaryIO) -> bytes:
    """Read a name, which ends with a byte 0."""
    return b"".join(iter(lambda: file.read(1).strip(b"\0"), b""))
