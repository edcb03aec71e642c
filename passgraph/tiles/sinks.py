"""Sinks of tiles: TIFF and OpenEXR files and Zarr stores, written atomically, and arrays of the caller."""

from __future__ import annotations

from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from passgraph import arguments
from passgraph.errors import InputError
from passgraph.formats import FORMATS, Format
from passgraph.image_formats import Metadata
from passgraph.quantise import numbers_of
from passgraph.tiles import exr, tiff
from passgraph.tiles.grid import Convert, Numbers, Part, block_of, checked_dtype, checked_shape, imported, pieces
from passgraph.writing import NewFile, place_of, unwritable

#: Kinds of files by suffix.
_KINDS = {".tif": "TIFF", ".tiff": "TIFF", ".exr": "OpenEXR", ".zarr": "Zarr"}
#: Sides of the chunks of a new Zarr array, in pixels.
CHUNK = 512


class Sink:
    """A sink of tiles in any order; this one keeps nothing.

    Attributes
    ----------
    block : (height, width) of a block of its storage
    cost : memory that it keeps between tiles
    """

    block: tuple[int, int] = (1, 1)
    dtype: np.dtype[Any] = np.dtype(np.float32)
    cost = 0

    def open(self) -> None:
        """Create the output."""

    def write(self, part: Part, picture: Convert) -> None:
        """Write a part."""

    def finish(self) -> None:
        """Complete the output; a file is renamed to its path."""

    def abandon(self) -> None:
        """Remove an incomplete file; idempotent, and without effect after `finish`."""


def planned_sink(
    given: Any, shape: tuple[int, int, int], format_: Format, dtype: Any, what: str, notes: Metadata | None = None
) -> Sink:
    """Return the sink of a (height, width, channels) picture; it writes nothing before it is opened.

    Parameters
    ----------
    given : a path that ends in .tif, .tiff, .exr or .zarr, or an array that supports
        ``array[rows, columns] = numbers``
    format_ : the target's format, which gives the dtype of a new file if ``dtype`` is None
    notes : metadata of the source picture; if that is opaque, and the result too, a TIFF file has no alpha

    Raises
    ------
    InputError : it cannot be written, or has another shape
    """
    if isinstance(given, (str, PathLike)):
        path = Path(given)
        kind = _KINDS.get(path.suffix.lower())
        if kind is None:
            raise InputError(
                f"{what}: {path} has the suffix {path.suffix!r}; tiles are written to {', '.join(_KINDS)}, or an array"
            )
        if not path.absolute().parent.is_dir():
            raise InputError(f"{what}: the folder {path.absolute().parent} does not exist; make it first")
        if kind != "Zarr" and path.is_dir():
            raise InputError(f"{what}: {path} is a directory; give the name of a file")
        own_dtype = "f4" if kind == "OpenEXR" and not format_.number.startswith("f") else format_.number
        checked = checked_dtype(own_dtype if dtype is None else dtype, f"{what}: dtype")
        if kind == "OpenEXR" and checked.str[1:] not in ("f2", "f4"):
            raise InputError(f"{what}: {path} holds float16 or float32, got dtype {checked}; leave dtype out")
        return FileSink(path, shape, checked, what, kind, notes)
    if dtype is not None:
        raise InputError(f"{what}: dtype is for new files; an array keeps its own")
    return ArraySink(given, shape, what)


def converted(picture: Numbers, dtype: np.dtype[Any]) -> Numbers:
    """Convert results to a sink's dtype: 8 and 16 bits hold 0 to 1, rounded to nearest, and NaN as 0.

    >>> converted(np.array([0.5, 2.0], np.float32), np.dtype("u1"))
    array([128, 255], dtype=uint8)
    """
    if dtype.kind == "u":
        return numbers_of(picture, FORMATS["r8" if dtype.itemsize == 1 else "r16"])
    with np.errstate(over="ignore"):  # floats above 65504 become infinite halves
        return picture.astype(dtype, copy=False)


class ArraySink(Sink):
    """A sink that writes into the caller's array."""

    def __init__(self, array: Any, shape: tuple[int, int, int], what: str) -> None:
        if not (hasattr(array, "shape") and hasattr(array, "dtype") and hasattr(array, "__setitem__")):
            raise InputError(
                f"{what} must be a path (.tif, .tiff, .exr, .zarr) or an array that takes its parts, got "
                f"{arguments.shown(array)}"
            )
        if type(array).__module__.partition(".")[0] == "dask":
            raise InputError(
                f"{what} is a dask array, which holds what is to be computed and no numbers; give a path or a Zarr "
                "array, and read that with dask.array.from_zarr"
            )
        if getattr(getattr(array, "flags", None), "writeable", True) is False:
            raise InputError(f"{what} is read-only; open it for writing (mode 'r+')")
        if checked_shape(array.shape, what) != shape:
            raise InputError(f"{what} has shape {array.shape}; the result is (height, width, channels) {shape}")
        self.dtype = checked_dtype(array.dtype, what)
        if self.dtype.kind == "b":
            raise InputError(f"{what} has dtype bool; give uint8, uint16 or floats")
        self.array, self.block, self._flat = array, block_of(array, written=True), len(array.shape) == 2

    def write(self, part: Part, picture: Convert) -> None:
        for top, bottom, left, right in pieces(part, self.block):
            numbers = picture((top, bottom, left, right))
            self.array[top:bottom, left:right] = numbers[:, :, 0] if self._flat else numbers


class FileSink(Sink):
    """A sink that writes a file or Zarr store atomically, under a temporary name until it is complete."""

    def __init__(
        self,
        path: Path,
        shape: tuple[int, int, int],
        dtype: np.dtype[Any],
        what: str,
        kind: str,
        notes: Metadata | None = None,
    ) -> None:
        place_of(path, is_folder=kind == "Zarr")  # raises InputError before anything is computed
        self.path = path
        self.shape, self.what, self._kind = shape, f"{what} ({path})", kind
        self._stored_dtype = dtype
        # OpenEXR multiplies by alpha before it rounds to half floats, beyond which straight color may be.
        self.dtype = np.dtype(np.float32) if kind == "OpenEXR" and shape[2] in (2, 4) else dtype
        blocks = {"TIFF": tiff.TiffSink.block, "OpenEXR": exr.ExrSink.block}
        self.block = blocks.get(kind, (min(CHUNK, shape[0]), min(CHUNK, shape[1])))
        self.cost = exr.ExrSink.cost(shape, dtype) if kind == "OpenEXR" else 0
        if dtype.kind == "b":
            raise InputError(f"{self.what}: dtype bool cannot be written; give uint8, uint16 or floats")
        self._package: Any = (
            None if kind == "OpenEXR" else imported("tifffile" if kind == "TIFF" else "zarr", self.what)
        )
        self._new_file: NewFile | None = None
        self._inner: Any = None
        self._notes = notes or Metadata()

    def open(self) -> None:
        self._new_file = NewFile(self.path, is_folder=self._kind == "Zarr")
        try:
            if self._kind == "TIFF":
                height, width, channels = self.shape
                stored = channels - 1 if self._notes.opaque and channels == 4 else channels
                self._inner = tiff.TiffSink(self._new_file.temporary, (height, width, stored), self.dtype, self._notes)
            elif self._kind == "OpenEXR":
                self._inner = exr.ExrSink(self._new_file.temporary, self.shape, self._stored_dtype, self._notes)
            else:
                array = self._package.create_array(
                    store=str(self._new_file.temporary), shape=self.shape, dtype=self.dtype,
                    chunks=(*self.block, self.shape[2]),
                )  # fmt: skip
                self._inner = ArraySink(array, self.shape, self.what)
        except OSError as error:
            raise self._failed(error) from error

    def write(self, part: Part, picture: Convert) -> None:
        try:
            try:
                self._inner.write(part, picture)
            except tiff.AlphaUsedError:
                self._add_alpha()
                self._inner.write(part, picture)
        except OSError as error:
            raise self._failed(error) from error

    def _add_alpha(self) -> None:
        """Copy the file without alpha into a new one with alpha."""
        assert self._new_file is not None
        opaque_sink, opaque_file = self._inner, self._new_file
        self._new_file = NewFile(self.path)
        try:
            self._inner = tiff.TiffSink(self._new_file.temporary, self.shape, self.dtype, self._notes)
            opaque_sink.copy_with_alpha(self._inner)
        finally:
            opaque_sink.close()
            opaque_file.discard()

    def finish(self) -> None:
        try:
            self._inner.finish()
            assert self._new_file is not None
            self._new_file.complete()
        except OSError as error:
            raise self._failed(error) from error
        self._inner = None

    def _failed(self, error: OSError) -> InputError:
        return unwritable(self.what, error)

    def abandon(self) -> None:
        if isinstance(self._inner, (tiff.TiffSink, exr.ExrSink)):
            self._inner.close()
        self._inner = None
        if self._new_file is not None:
            self._new_file.discard()
