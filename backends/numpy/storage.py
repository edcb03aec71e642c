"""Pictures in memory: numbers as their format holds them, in memory of ours or in place in somebody else's."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from passgraph.backends.numpy.machine.workers import ROOM, aligned_zeros, rest_of_page
from passgraph.cached import cached_property
from passgraph.formats import FORMATS, Format

#: What lies between the passes of a chain, and what a depth buffer holds.
FLOAT = FORMATS["r32f"]
#: Loads of single texels take as many numbers at once.
TOGETHER = 4
#: Compiled code counts the pixels from the first to the last of a picture in 32 bits.
MAX_PIXELS = 2**31


@dataclass(eq=False)
class Storage:
    """One picture.

    Attributes
    ----------
    numbers : (height, width, channels) of the format's number; pixels lie side by side, rows as far apart as may be
    stencil : height x width, flat
    is_ours : whether there is room behind the numbers (machine/memory.py)
    """

    format: Format
    size: tuple[int, int]
    numbers: NDArray[Any]
    stencil: NDArray[np.uint8] | None = None
    is_ours: bool = True

    def __post_init__(self) -> None:
        #: Where the top left pixel is, for machine code.
        self.address: int = self.numbers.__array_interface__["data"][0]
        #: Pixels from row to row; negative where rows lie from the bottom up.
        self.pitch: int = self.size[0]
        if self.size[1] > 1:
            self.pitch = self.numbers.strides[0] // (self.format.channels * self.numbers.itemsize)
        #: What machine code knows that reads along rows: beginning, width, height, pixels from row to row.
        self.by_rows: tuple[int, ...] = (self.address, *self.size, self.pitch)

    @property
    def _last(self) -> int:
        """The number of the row that lies last in memory."""
        return self.size[1] - 1 if self.pitch > 0 else 0

    @cached_property
    def last_row(self) -> tuple[int, int]:
        """Return the number of the last row and the address of its padded copy; -1 if none is needed."""
        if self.is_ours or self._room_behind >= ROOM * self.numbers.itemsize:
            return -1, self.address
        row = self.numbers[self._last].reshape(-1)
        self._copy_of_last = aligned_zeros(row.size, row.dtype)
        self._copy_of_last[:] = row
        return self._last, self._copy_of_last.ctypes.data

    @cached_property
    def anywhere(self) -> tuple[int, ...]:
        """The same as :attr:`by_rows` for code that reads texels one by one, a few numbers at once."""
        enough = self.is_ours or self._room_behind >= TOGETHER * self.numbers.itemsize
        return self.by_rows if enough else self._own.by_rows

    @property
    def _room_behind(self) -> int:
        """Bytes behind somebody's last row that may be read, since the processor lets no page be read in part."""
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
    """A picture in memory of ours, zeroed.  Raises MemoryError."""
    width, height = size
    numbers = aligned_zeros(width * height * format_.channels, format_.number)
    stencil = aligned_zeros(width * height, np.uint8) if format_.stencil else None
    return Storage(format_, size, numbers.reshape(height, width, format_.channels), stencil)


def adopted(numbers: NDArray[Any], format_: Format) -> Storage | None:
    """Somebody's array (height, width, channels) as a picture, in place; None where compiled code cannot go through it.

    Pixels must lie side by side.  Rows may be any whole number of pixels apart, up or down, and long enough that what
    is read behind one is still in the next.
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
