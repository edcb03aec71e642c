"""Sinks of tiles: TIFF and OpenEXR files and Zarr stores, written atomically, and arrays of the caller."""

from __future__ import annotations

from os import PathLike
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from passgraph import arguments
from passgraph.backends.steps import numbers_of
from passgraph.errors import InputError
from passgraph.formats import FORMATS, Format
from passgraph.image_formats import Metadata
from passgraph.tiles import exr, tiff
from passgraph.tiles.grid import Convert, Numbers, Part, block_of, checked_dtype, checked_shape, imported, pieces
from passgraph.writing import NewFile, place_of

#: By suffix.
_KINDS = {".tif": "TIFF", ".tiff": "TIFF", ".exr": "OpenEXR", ".zarr": "Zarr"}
#: Sides of the chunks of a new Zarr array, in pixels.
CHUNK = 512


class Sink(Protocol):
    """A sink of tiles, written one by one in any order.

    ``block`` is the (height, width) that it writes at once, ``cost`` the bytes that it holds between tiles.
    """

    @property
    def block(self) -> tuple[int, int]: ...
    @property
    def dtype(self) -> np.dtype[Any]: ...
    @property
    def cost(self) -> int: ...
    def open(self) -> None:
        """Make what is written into."""

    def write(self, part: Part, picture: Convert) -> None: ...
    def finish(self) -> None:
        """All is written: a file takes its name."""

    def abandon(self) -> None:
        """Leave nothing behind; idempotent, also after `finish`."""


def planned_sink(
    given: Any, shape: tuple[int, int, int], format_: Format, dtype: Any, what: str, notes: Metadata | None = None
) -> Sink:
    """A sink for a picture of (height, width, channels); nothing is made before it is opened.

    Parameters
    ----------
    given : a path that ends in .tif, .tiff, .exr or .zarr, or an array that takes ``array[rows, columns] = numbers``
    format_ : of the target; a new file holds its numbers where ``dtype`` is None
    notes : of the picture that the result is made of, for a TIFF file; where it is opaque, and the result too, no alpha
        is stored

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
    """Results as a sink's numbers: 8 and 16 bits hold 0 to 1, rounded to the nearest, NaN as 0.

    >>> converted(np.array([0.5, 2.0], np.float32), np.dtype("u1"))
    array([128, 255], dtype=uint8)
    """
    if dtype.kind == "u":
        return numbers_of(picture, FORMATS["r8" if dtype.itemsize == 1 else "r16"])
    with np.errstate(over="ignore"):  # above 65504 a half is infinite
        return picture.astype(dtype, copy=False)


class ArraySink:
    """An array of the caller's, written in place."""

    cost = 0

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
        found = checked_shape(array.shape, what)
        if found != shape:
            raise InputError(f"{what} has shape {array.shape}; the result is (height, width, channels) {shape}")
        self.dtype = checked_dtype(array.dtype, what)
        if self.dtype.kind == "b":
            raise InputError(f"{what} has dtype bool; give uint8, uint16 or floats")
        self.array, self.block, self._flat = array, block_of(array, written=True), len(array.shape) == 2

    def open(self) -> None:
        """It is there."""

    def write(self, part: Part, picture: Convert) -> None:
        for top, bottom, left, right in pieces(part, self.block):
            numbers = picture((top, bottom, left, right))
            self.array[top:bottom, left:right] = numbers[:, :, 0] if self._flat else numbers

    def finish(self) -> None:
        """It is written."""

    def abandon(self) -> None:
        """Keep what is written: the array is the caller's."""


class FileSink:
    """A file or Zarr store under another name, which it takes at the end: whole or not at all."""

    def __init__(
        self, path: Path, shape: tuple[int, int, int], dtype: np.dtype[Any], what: str, kind: str,
        notes: Metadata | None = None,
    ) -> None:  # fmt: skip
        place_of(path, is_folder=kind == "Zarr")  # refused before the work
        self.path = path
        self.shape, self.dtype, self.what, self._kind = shape, dtype, f"{what} ({path})", kind
        blocks = {"TIFF": tiff.TiffSink.block, "OpenEXR": exr.ExrSink.block}
        self.block = blocks.get(kind, (min(CHUNK, shape[0]), min(CHUNK, shape[1])))
        self.cost = exr.ExrSink.cost(shape, dtype) if kind == "OpenEXR" else 0
        if dtype.kind == "b":
            raise InputError(f"{self.what}: dtype bool cannot be written; give uint8, uint16 or floats")
        self._package: Any = (
            None if kind == "OpenEXR" else imported("tifffile" if kind == "TIFF" else "zarr", self.what)
        )
        self._made: NewFile | None = None
        self._inner: Any = None
        self._notes = notes or Metadata()

    def open(self) -> None:
        self._made = NewFile(self.path, is_folder=self._kind == "Zarr")
        try:
            if self._kind == "TIFF":
                height, width, channels = self.shape
                stored = channels - 1 if self._notes.opaque and channels == 4 else channels
                self._inner = tiff.TiffSink(self._made.temporary, (height, width, stored), self.dtype, self._notes)
            elif self._kind == "OpenEXR":
                self._inner = exr.ExrSink(self._made.temporary, self.shape, self.dtype, self._notes)
            else:
                self._inner = ArraySink(self._new_zarr(self._made.temporary), self.shape, self.what)
        except OSError as error:
            raise self._failed(error) from error

    def _new_zarr(self, path: Path) -> Any:
        chunks = (*self.block, self.shape[2])
        return self._package.create_array(store=str(path), shape=self.shape, dtype=self.dtype, chunks=chunks)

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
        """Begin anew with alpha, which was left out until now."""
        assert self._made is not None
        wide = NewFile(self.path)
        narrow, self._made, old = self._inner, wide, self._made
        try:
            self._inner = tiff.TiffSink(wide.temporary, self.shape, self.dtype, self._notes)
            narrow.copy_with_alpha(self._inner)
        finally:
            narrow.close()
            old.discard()

    def finish(self) -> None:
        try:
            self._inner.finish()
            assert self._made is not None
            self._made.complete()
        except OSError as error:
            raise self._failed(error) from error
        self._inner = None

    def _failed(self, error: OSError) -> InputError:
        reason = error.strerror or " ".join(str(error).split())
        return InputError(f"{self.what}: cannot be written ({reason}); check the folder's permissions and free space")

    def abandon(self) -> None:
        if isinstance(self._inner, (tiff.TiffSink, exr.ExrSink)):
            self._inner.close()
        self._inner = None
        if self._made is not None:
            self._made.discard()
