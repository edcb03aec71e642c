"""Pictures on an OpenCL device: buffers in the layout of their format, or in foreign layouts."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from numpy.typing import NDArray

from passgraph.cached import cached_property
from passgraph.formats import Format
from passgraph.language.lowering.buffers import INT_LIMIT as INT_LIMIT
from passgraph.language.lowering.buffers import Buffer


@dataclass(eq=False)
class Storage:
    """Interleaved channels, rows from the top, without padding unless ``placement`` says otherwise; the stencil is in a
    buffer of its own.

    ``borrowed`` is the caller's array whose memory the buffer uses for one run.  ``is_callers``: the buffer is in
    device memory of the caller, or a copy of their image.
    """

    format: Format
    size: tuple[int, int]
    buffer: Any
    stencil: Any = None
    borrowed: NDArray[Any] | None = None
    placement: Placement | None = None
    is_callers: bool = False
    released: bool = field(default=False, init=False)

    @property
    def shape(self) -> tuple[int, int, int]:
        return self.size[1], self.size[0], self.format.channels

    @property
    def is_borrowed(self) -> bool:
        """Return True if it is valid for one run only, so no reference may be kept."""
        return self.borrowed is not None or self.is_callers

    @cached_property
    def layout(self) -> ImageLayout:
        return ImageLayout(self.format, self.size, self.placement)


@dataclass(frozen=True)
class Placement:
    """The layout of a picture in a buffer, counted in numbers.

    Attributes
    ----------
    first : position of the top left pixel
    row, pixel : distance from row to row, and from pixel to pixel; negative rows are bottom up
    channels : position of each channel in its pixel
    """

    first: int
    row: int
    pixel: int
    channels: tuple[int, ...]

    def span(self, size: tuple[int, int]) -> tuple[int, int]:
        """Return the first position of a picture of (width, height), and the one behind its last."""
        across, down = (size[0] - 1) * self.pixel, (size[1] - 1) * self.row
        low = self.first + min(across, 0) + min(down, 0) + min(self.channels)
        return low, self.first + max(across, 0) + max(down, 0) + max(self.channels) + 1


def tight(channels: int, width: int) -> Placement:
    """Return interleaved channels without padding, from the first byte on."""
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
        """Return the OpenCL C type that can index all of it."""
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

    @cached_property
    def buffer(self) -> Buffer:
        """Return how programs are lowered that read or write it."""
        lies = self.placement or tight(self.channels, self.size[0])
        wide = self.index_type == "long"
        return Buffer(self.size, lies.row, lies.pixel, lies.first, lies.channels, wide, self.format)

    def channel(self, number: int) -> int:
        """Return the offset of a channel in its pixel."""
        return number if self.placement is None else self.placement.channels[number]
