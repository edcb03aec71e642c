"""Pictures on an OpenCL device: plain buffers in the layout of their format, or of somebody else's."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from numpy.typing import NDArray

from passgraph.cached import cached_property
from passgraph.formats import Format

#: The first index that no longer fits into int.
INT_LIMIT = 1 << 31


@dataclass(eq=False)
class Storage:
    """Interleaved channels, rows from the top, without padding unless ``placement`` says otherwise; the stencil in a
    buffer of its own.

    ``lent`` is the caller's array whose memory the buffer is until it is released: for one run.  ``is_callers`` says
    that the buffer is in memory of the caller's on the device, or a copy of their image.
    """

    format: Format
    size: tuple[int, int]
    buffer: Any
    stencil: Any = None
    lent: NDArray[Any] | None = None
    placement: Placement | None = None
    is_callers: bool = False
    released: bool = field(default=False, init=False)

    @property
    def shape(self) -> tuple[int, int, int]:
        return self.size[1], self.size[0], self.format.channels

    @property
    def is_borrowed(self) -> bool:
        """Whether it is gone after the run, so that nothing may keep it."""
        return self.lent is not None or self.is_callers

    @cached_property
    def layout(self) -> ImageLayout:
        return ImageLayout(self.format, self.size, self.placement)


@dataclass(frozen=True)
class Placement:
    """The layout of a picture in a buffer, counted in numbers.

    Attributes
    ----------
    first : the place of the top left pixel
    row, pixel : from one row, and one pixel, to the next; rows may lie from the bottom up
    channels : the place of each channel in its pixel
    """

    first: int
    row: int
    pixel: int
    channels: tuple[int, ...]

    def span(self, size: tuple[int, int]) -> tuple[int, int]:
        """The first place that a picture of (width, height) takes, and the one behind its last."""
        across, down = (size[0] - 1) * self.pixel, (size[1] - 1) * self.row
        low = self.first + min(across, 0) + min(down, 0) + min(self.channels)
        return low, self.first + max(across, 0) + max(down, 0) + max(self.channels) + 1


def tight(channels: int, width: int) -> Placement:
    """Interleaved channels without padding, from the first byte on."""
    return Placement(0, width * channels, channels, tuple(range(channels)))


@dataclass(frozen=True)
class ImageLayout:
    """The storage layout that generated code depends on."""

    format: Format
    size: tuple[int, int]
    placement: Placement | None = None

    @property
    def channels(self) -> int:
        return self.format.channels

    @property
    def bytes(self) -> int:
        return self.size[0] * self.size[1] * self.channels * self.format.bits // 8

    @cached_property
    def index_type(self) -> str:
        """The type in OpenCL C that every place in it fits into."""
        placement = self.placement or tight(self.channels, self.size[0])
        return "int" if placement.span(self.size)[1] < INT_LIMIT else "long"

    def place(self, x: str, y: str) -> str:
        """Return the index of a pixel as an expression of its column and row."""
        type_, width = self.index_type, self.size[0]
        if self.placement is None:
            at = f"(({type_}){y} * {width} + {x})"
            return at if self.channels == 1 else f"{at} * {self.channels}"
        first, row, pixel = self.placement.first, self.placement.row, self.placement.pixel
        return f"({type_}){y} * {row} + ({type_}){x} * {pixel} + {first}"

    def channel(self, number: int) -> int:
        """Return the offset of a channel in its pixel."""
        return number if self.placement is None else self.placement.channels[number]
