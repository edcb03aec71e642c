"""Read and write parts of TIFF files with tifffile: strips and tiles, BigTIFF, 8 and 16 bits and floats.

Unlike OpenImageIO, tifffile reserves space for the tiles of a file, so that they can be written in any order.
"""

from __future__ import annotations

import warnings
from contextlib import ExitStack
from math import ceil
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from passgraph.errors import InputError
from passgraph.image_files import FIRST_OF_SEVERAL, paste, straight
from passgraph.image_formats import Metadata
from passgraph.quantise import opaque
from passgraph.tiles.grid import Convert, Numbers, Part, Source, checked_dtype, checked_shape, imported, pieces, touched

#: Sides of the tiles that are written, in pixels, as readers of large pictures expect; the format requires a multiple
#: of 16 (TIFF 6.0, section 15).
TILE = 256
#: Meanings of extra samples.
_ASSOCIATED, _UNASSOCIATED = 1, 2


def _channels(page: Any) -> tuple[list[int], bool]:
    """Return the samples that are read, and True if the last is alpha by which color is multiplied.

    As of OpenImageIO: samples without a meaning are left out, but for the second of two, which are data. Without the
    tag ExtraSamples the first four are RGBA, with color multiplied by alpha.
    """
    samples, meanings = page.samplesperpixel, [int(meaning) for meaning in page.extrasamples]
    if samples < 3:
        return list(range(samples)), meanings[:1] == [_ASSOCIATED]
    if not meanings:
        return list(range(min(samples, 4))), samples >= 4
    alphas = [3 + index for index, meaning in enumerate(meanings) if meaning in (_ASSOCIATED, _UNASSOCIATED)]
    alphas = [alpha for alpha in alphas if alpha < samples][:1]
    return [0, 1, 2, *alphas], bool(alphas) and meanings[alphas[0] - 3] == _ASSOCIATED


def _holds_several(tiff: Any) -> bool:
    """Return True if the second page of a TIFF file is neither a smaller copy of the first nor its mask."""
    try:
        return len(tiff.pages) > 1 and not (tiff.pages[1].is_reduced or tiff.pages[1].is_mask)
    except Exception:  # a damaged page after the first, which is not read
        return False


class TiffSource(Source):
    """The first picture of a TIFF file; read by one thread at a time."""

    def __init__(self, path: Path, what: str) -> None:
        tifffile = imported("tifffile", what)
        self.name = f"{what} ({path})"
        with ExitStack() as opened:
            try:
                self._tiff = opened.enter_context(tifffile.TiffFile(path))
                self._page = page = self._tiff.pages[0]
            except Exception as error:  # damaged files raise errors of any type
                raise InputError(f"{self.name}: is no TIFF file that can be read ({error}); make it again") from error
            self._check(page)
            self._planar = page.planarconfig == 2 and page.samplesperpixel > 1
            height, width = page.imagelength, page.imagewidth
            self._order, self._is_associated = _channels(page)
            self.shape = checked_shape((height, width, len(self._order)), self.name)
            self._dtype = checked_dtype(page.dtype, self.name)
            # Divided by alpha, half floats become float32.
            is_half = self._dtype.kind == "f" and self._dtype.itemsize == 2
            self.dtype = np.dtype(np.float32) if self._is_associated and is_half else self._dtype
            self.is_grey = len(self._order) == 1
            self._plain = self._begin(page)
            stored = (page.tilelength, page.tilewidth) if page.is_tiled else (min(page.rowsperstrip, height), width)
            # Any part of uncompressed rows can be read.
            self.block = (1, 1) if self._plain is not None else stored
            if _holds_several(self._tiff):
                warnings.warn(f"{self.name}: {FIRST_OF_SEVERAL}", stacklevel=2)
            opened.pop_all()  # stays open until close

    def _check(self, page: Any) -> None:
        bits = page.bitspersample
        if page.dtype is None or bits not in (8, 16, 32, 64):
            raise InputError(f"{self.name}: {bits} bits a channel; expected 8, 16, or floats of 16, 32 or 64")
        rows, columns = (page.tilelength, page.tilewidth) if page.is_tiled else (page.rowsperstrip, 1)
        if not (rows and rows > 0 and columns and columns > 0):
            kind = f"tiles of {columns}x{rows} pixels" if page.is_tiled else f"strips of {rows} rows"
            raise InputError(f"{self.name}: says that it has {kind}; it is corrupt, make or copy it again")
        if page.imagedepth != 1 or page.photometric not in (1, 2, 6):
            kind = getattr(page.photometric, "name", page.photometric)
            raise InputError(f"{self.name}: is {kind}; expected gray (MINISBLACK) or RGB; convert it first")
        if page.tags.valueof(274, 1) != 1:
            raise InputError(f"{self.name}: is stored turned (tag Orientation); turn it upright first")

    def _begin(self, page: Any) -> int | None:
        """Return the file offset of the picture if its rows are contiguous and not compressed."""
        if page.is_tiled or self._planar or not page.is_contiguous or page.compression != 1:
            return None
        return int(page.dataoffsets[0])

    def read(self, part: Part) -> Numbers:
        try:
            pixels = self._rows(part) if self._plain is not None else self._segments(part)
            pixels = pixels if len(self._order) == pixels.shape[2] else pixels[..., self._order]
            return straight(pixels) if self._is_associated else pixels
        except InputError:
            raise
        except Exception as error:
            if "imagecodecs" in str(error):
                raise InputError(
                    f"{self.name}: {error}, which decodes it; install it with: pip install imagecodecs"
                ) from error
            raise InputError(
                f"{self.name}: truncated or corrupt at rows {part[0]} to {part[1]} ({error}); make or copy it again"
            ) from error

    def _rows(self, part: Part) -> Numbers:
        top, bottom, left, right = part
        width, channels = self.shape[1], self._page.samplesperpixel
        rows = np.empty((bottom - top, right - left, channels), self._dtype.newbyteorder(self._tiff.byteorder))
        bytes_, pixel = rows.view(np.uint8).reshape(bottom - top, -1), channels * self._dtype.itemsize
        assert self._plain is not None
        if right - left == width:
            self._fill(self._plain + top * width * pixel, bytes_.reshape(-1))
        else:
            for row in range(top, bottom):
                self._fill(self._plain + (row * width + left) * pixel, bytes_[row - top])
        return rows

    def _fill(self, place: int, into: NDArray[np.uint8]) -> None:
        file = self._tiff.filehandle
        file.seek(place)
        if file.readinto(into.data) != into.size:
            raise InputError(f"{self.name}: ends before its picture does; make or copy it again")

    def _segments(self, part: Part) -> Numbers:
        """Read a part from the blocks that overlap it."""
        top, bottom, left, right = part
        rows, columns = self.block
        samples = self._page.samplesperpixel
        pixels = np.zeros((bottom - top, right - left, samples), self._dtype)
        across, down = ceil(self.shape[1] / columns), ceil(self.shape[0] / rows)
        for plane in range(samples if self._planar else 1):
            for row, column in touched(part, self.block):
                self._decode(plane * across * down + row * across + column, (top, left), pixels)
        return pixels

    def _decode(self, index: int, corner: tuple[int, int], pixels: Numbers) -> None:
        page, file = self._page, self._tiff.filehandle
        size = page.databytecounts[index]
        data = None
        if size:
            file.seek(page.dataoffsets[index])
            data = file.read(size)
            if len(data) != size:
                raise InputError(f"{self.name}: ends before its picture does; make or copy it again")
        segment, (plane, _, y, x, _), _ = page.decode(data, index, jpegtables=page.jpegtables)
        if segment is None:  # omitted by the writer: all zeros
            return
        channels = slice(plane, plane + 1) if self._planar else slice(None)
        paste(pixels[:, :, channels], corner, segment[0], (y, x))

    def close(self) -> None:
        self._tiff.close()


class AlphaUsedError(Exception):
    """Raised for pixels that are not opaque, for a file without alpha."""


class TiffSink:
    """A tiled TIFF file without compression. The offset of each tile is known, so tiles are written in any order.

    Pixels may have one channel more than ``shape``: alpha, which is not stored. If it is not 1, AlphaUsedError is
    raised. ``notes`` are the metadata of the source picture.
    """

    block = (TILE, TILE)

    def __init__(
        self, path: Path, shape: tuple[int, int, int], dtype: np.dtype[Any], notes: Metadata | None = None
    ) -> None:
        import tifffile

        notes = notes or Metadata()
        self.shape, self.dtype = shape, dtype.newbyteorder("=")
        channels = shape[2]
        # tifffile reserves space for the picture without writing it.
        tifffile.imwrite(
            path,
            None,
            shape=shape[:2] if channels == 1 else shape,
            dtype=self.dtype,
            tile=self.block,
            photometric="rgb" if channels > 2 else "minisblack",
            planarconfig=None if channels == 1 else "contig",
            extrasamples=["unassalpha"] if channels in (2, 4) else None,
            metadata=None,
            iccprofile=notes.profile or None,
            resolution=notes.resolution,
            resolutionunit="INCH" if notes.resolution else None,
        )
        with tifffile.TiffFile(path) as file:
            self._offsets = file.pages[0].dataoffsets
            self.dtype = self.dtype.newbyteorder(file.byteorder)
        self._file = path.open("r+b")

    def write(self, part: Part, picture: Convert) -> None:
        """Write a part, piece by piece."""
        for piece in pieces(part, self.block):
            numbers = np.ascontiguousarray(self._without_alpha(picture(piece)), self.dtype)
            top, bottom, left, right = piece
            for y in range(top // TILE * TILE, bottom, TILE):
                y0, y1 = max(top, y), min(bottom, y + TILE)
                for x in range(left // TILE * TILE, right, TILE):
                    x0, x1 = max(left, x), min(right, x + TILE)
                    pixels = numbers[y0 - top : y1 - top, x0 - left : x1 - left]
                    self._put(y, x, y0 - y, x0 - x, np.ascontiguousarray(pixels))

    def _without_alpha(self, numbers: Numbers) -> Numbers:
        if numbers.shape[2] == self.shape[2]:
            return numbers
        if (numbers[..., -1] != opaque(self.dtype)).any():
            raise AlphaUsedError
        return numbers[..., :-1]

    def copy_with_alpha(self, into: TiffSink) -> None:
        """Copy all tiles, with alpha 1, into a file with one more channel; unwritten tiles have zeros and alpha 1."""
        pixels, channels = TILE * TILE, self.shape[2]
        self._file.flush()
        for offset, new_offset in zip(self._offsets, into._offsets, strict=True):
            self._file.seek(offset)
            data = self._file.read(pixels * channels * self.dtype.itemsize)
            numbers = np.zeros(pixels * channels, self.dtype)
            written = np.frombuffer(data, self.dtype)
            numbers[: len(written)] = written
            alpha = np.full((pixels, 1), opaque(self.dtype), self.dtype)
            into._at(new_offset, np.concatenate([numbers.reshape(pixels, channels), alpha], axis=1))

    def _put(self, y: int, x: int, down: int, along: int, piece: Numbers) -> None:
        """Write a piece into the tile at (y, x), ``down`` rows and ``along`` columns from its corner."""
        begin = self._offsets[y // TILE * ceil(self.shape[1] / TILE) + x // TILE]
        pixel = self.shape[2] * self.dtype.itemsize
        if piece.shape[1] == TILE:
            self._at(begin + down * TILE * pixel, piece)
            return
        for number, row in enumerate(piece):
            self._at(begin + ((down + number) * TILE + along) * pixel, row)

    def _at(self, place: int, numbers: Numbers) -> None:
        self._file.seek(place)
        self._file.write(numbers.data.cast("B"))

    def finish(self) -> None:
        self._file.flush()
        self.close()

    def close(self) -> None:
        self._file.close()
