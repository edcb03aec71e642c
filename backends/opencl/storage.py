"""Pictures on an OpenCL device: buffers, and where in them a picture lies."""

from __future__ import annotations

from dataclasses import field
from typing import Any

from numpy.typing import NDArray

from passgraph.cached import cached_property
from passgraph.formats import Format
from passgraph.language.lowering.buffers import INT_LIMIT as INT_LIMIT
from passgraph.language.lowering.buffers import Buffer
from passgraph.records import dataclass


@dataclass(eq=False)
class Storage:
    """A picture in a buffer; the stencil is in a buffer of its own.

    ``borrowed`` is the caller's array whose memory the buffer uses for one run.  ``is_callers``: the buffer is in
    device memory of the caller, or a copy of their image.
    """

    layout: ImageLayout
    buffer: Any
    stencil: Any = None
    borrowed: NDArray[Any] | None = None
    is_callers: bool = False
    released: bool = field(default=False, init=False)

    @property
    def format(self) -> Format:
        return self.layout.format

    @property
    def size(self) -> tuple[int, int]:
        return self.layout.size

    @property
    def is_borrowed(self) -> bool:
        """Return True if it is valid for one run only, so no reference may be kept."""
        return self.borrowed is not None or self.is_callers


@dataclass(frozen=True)
class ImageLayout:
    """Where a picture lies in memory, counted in numbers of its format.  Generated code depends on it.

    Attributes
    ----------
    first : position of the top left pixel
    row, pixel : distance from row to row, and from pixel to pixel; negative rows are bottom up
    places : position of each channel in its pixel
    """

    format: Format
    size: tuple[int, int]
    first: int
    row: int
    pixel: int
    places: tuple[int, ...]

    @classmethod
    def tight(cls, format_: Format, size: tuple[int, int]) -> ImageLayout:
        """Return interleaved channels without padding, rows from the top, from the first byte on."""
        channels = format_.channels
        return cls(format_, size, 0, size[0] * channels, channels, tuple(range(channels)))

    @cached_property
    def is_tight(self) -> bool:
        return self == ImageLayout.tight(self.format, self.size)

    @property
    def channels(self) -> int:
        return self.format.channels

    @cached_property
    def span(self) -> tuple[int, int]:
        """Return the first position of the picture, and the one behind its last."""
        across, down = (self.size[0] - 1) * self.pixel, (self.size[1] - 1) * self.row
        low = self.first + min(across, 0) + min(down, 0) + min(self.places)
        return low, self.first + max(across, 0) + max(down, 0) + max(self.places) + 1

    @property
    def bytes(self) -> int:
        """Return the size in bytes, from the first byte to the last."""
        low, end = self.span
        return (end - low) * self.format.bits // 8

    @property
    def overlaps_itself(self) -> bool:
        """Return True if two numbers share memory, as in broadcast arrays."""
        count, reach = len(self.places), 1
        channel = self.places[-1] // max(1, count - 1)
        strides = (abs(self.pixel), self.size[0]), (abs(self.row), self.size[1]), (abs(channel), count)
        for stride, places in sorted(strides):
            if places > 1 and stride < reach:
                return True
            reach += stride * (places - 1)
        return False

    @cached_property
    def index_type(self) -> str:
        """Return the OpenCL C type that can index all of it."""
        return "int" if self.span[1] < INT_LIMIT else "long"

    def place(self, x: str, y: str) -> str:
        """Return the index of a pixel as an expression of its column and row."""
        type_, width = self.index_type, self.size[0]
        if self.is_tight:
            at = f"(({type_}){y} * {width} + {x})"
            return at if self.channels == 1 else f"{at} * {self.channels}"
        return f"({type_}){y} * {self.row} + ({type_}){x} * {self.pixel} + {self.first}"

    @cached_property
    def buffer(self) -> Buffer:
        """Return how programs are lowered that read or write it."""
        wide = self.index_type == "long"
        return Buffer(self.size, self.row, self.pixel, self.first, self.places, wide, self.format)
