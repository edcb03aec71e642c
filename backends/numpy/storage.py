"""Pictures in memory: numbers in their format, in our own memory or in place in foreign memory."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from passgraph.backends.numpy.machine.workers import ROOM, aligned_zeros, rest_of_page
from passgraph.cached import cached_property
from passgraph.formats import FORMATS, Format

#: Format of intermediate results of a chain, and of depth buffers.
FLOAT = FORMATS["r32f"]
#: Numbers that loads of single texels read together.
TOGETHER = 4
#: Compiled code indexes the pixels of a picture in 32 bits.
MAX_PIXELS = 2**31


@dataclass(eq=False)
class Storage:
    """A picture in memory.

    Attributes
    ----------
    numbers : (height, width, channels) in the format's dtype; pixels are contiguous, rows may have any stride
    stencil : height x width, flat
    is_ours : True if the numbers are padded (machine/workers.py)
    """

    format: Format
    size: tuple[int, int]
    numbers: NDArray[Any]
    stencil: NDArray[np.uint8] | None = None
    is_ours: bool = True

    def __post_init__(self) -> None:
        #: Address of the top left pixel, for machine code.
        self.address: int = self.numbers.__array_interface__["data"][0]
        #: Row stride in pixels; negative if rows are stored bottom up.
        self.pitch: int = self.size[0]
        if self.size[1] > 1:
            self.pitch = self.numbers.strides[0] // (self.format.channels * self.numbers.itemsize)
        #: Facts for machine code that reads along rows: address, width, height, row stride in pixels.
        self.by_rows: tuple[int, ...] = (self.address, *self.size, self.pitch)

    @property
    def _last(self) -> int:
        """Return the number of the row that is last in memory."""
        return self.size[1] - 1 if self.pitch > 0 else 0

    @cached_property
    def last_row(self) -> tuple[int, int]:
        """Return the number of the last row and the address of its padded copy; -1 if none is needed."""
        if self.is_ours or self._readable_bytes_behind >= ROOM * self.numbers.itemsize:
            return -1, self.address
        row = self.numbers[self._last].reshape(-1)
        self._copy_of_last = aligned_zeros(row.size, row.dtype)
        self._copy_of_last[:] = row
        return self._last, self._copy_of_last.ctypes.data

    @cached_property
    def anywhere(self) -> tuple[int, ...]:
        """Return the same as :attr:`by_rows` for code that reads single texels, a few numbers together."""
        enough = self.is_ours or self._readable_bytes_behind >= TOGETHER * self.numbers.itemsize
        return self.by_rows if enough else self._own.by_rows

    @property
    def _readable_bytes_behind(self) -> int:
        """Return the readable bytes behind a foreign picture's last row: up to the end of its memory page."""
        width, _ = self.size
        item = self.numbers.itemsize
        pixel = self.format.channels * item
        return rest_of_page(self.address + (self._last * self.pitch + width) * pixel)

    @cached_property
    def _own(self) -> Storage:
        own = new_storage(self.format, self.size)
        np.copyto(own.numbers, self.numbers)
        return own


def new_storage(format_: Format, size: tuple[int, int]) -> Storage:
    """Return a zeroed picture in our own memory.  Raises MemoryError."""
    width, height = size
    numbers = aligned_zeros(width * height * format_.channels, format_.number)
    stencil = aligned_zeros(width * height, np.uint8) if format_.stencil else None
    return Storage(format_, size, numbers.reshape(height, width, format_.channels), stencil)


def adopted(numbers: NDArray[Any], format_: Format) -> Storage | None:
    """Return a foreign array (height, width, channels) as a picture, in place; None if compiled code cannot use it.

    Pixels must be contiguous.  Rows may have any stride in whole pixels, also negative, and must be long enough that
    reads behind one end in the next.
    """
    height, width, channels = numbers.shape
    size, item = (width, height), numbers.itemsize
    pixel = channels * item
    fits = numbers.dtype == np.dtype(format_.number) and channels == format_.channels and not format_.stencil
    side_by_side = (channels == 1 or numbers.strides[2] == item) and (width == 1 or numbers.strides[1] == pixel)
    if not fits or not side_by_side or not numbers.flags.aligned:
        return None
    step = numbers.strides[0] if height > 1 else width * pixel
    apart = abs(step)
    if step % pixel or apart < max(width * pixel, ROOM * item) or apart // pixel * height >= MAX_PIXELS:
        return None
    return Storage(format_, size, numbers, is_ours=False)
