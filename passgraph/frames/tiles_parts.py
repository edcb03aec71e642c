"""Parts of pictures: what sources, sinks and tiles agree on."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from importlib import import_module
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from passgraph.arguments import shown
from passgraph.errors import InputError

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
    """What pictures hold: bools, uint8, uint16 and floats."""
    try:
        made: np.dtype[Any] = np.dtype(dtype)
    except TypeError:
        raise InputError(f"{what} must be uint8, uint16 or floats, got {shown(dtype)}") from None
    if made.kind not in "fb" and not (made.kind == "u" and made.itemsize <= 2):
        raise InputError(f"{what} has dtype {made}; give uint8, uint16 or floats (0 to 1 for colours)")
    return made


def block_of(array: Any, *, written: bool = False) -> tuple[int, int]:
    """(height, width) of an array's chunks, or of the shards in which they are written; (1, 1) where it has none."""
    chunks = (getattr(array, "shards", None) if written else None) or getattr(array, "chunks", None)
    if not chunks or len(chunks) < 2:
        return 1, 1
    # dask lists the chunks along each axis
    sides = [max(side) if isinstance(side, tuple) else int(side) for side in chunks[:2]]
    return sides[0], sides[1]
