"""Pictures on an OpenCL device: plain buffers in the layout of their format."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

from numpy.typing import NDArray

from passgraph.formats import Format


@dataclass(eq=False)
class Storage:
    """Interleaved channels, rows from the top, without padding; the stencil in a buffer of its own.

    ``lent`` is the caller's array whose memory the buffer is, until it is released: for one run.
    """

    format: Format
    size: tuple[int, int]
    buffer: Any
    stencil: Any = None
    lent: NDArray[Any] | None = None
    released: bool = field(default=False, init=False)

    @property
    def shape(self) -> tuple[int, int, int]:
        return self.size[1], self.size[0], self.format.channels

    @cached_property
    def layout(self) -> ImageLayout:
        return ImageLayout(self.format, self.size)


@dataclass(frozen=True)
class ImageLayout:
    """What generated code must know about a storage."""

    format: Format
    size: tuple[int, int]

    @property
    def channels(self) -> int:
        return self.format.channels

    @property
    def bytes(self) -> int:
        return self.size[0] * self.size[1] * self.channels * self.format.bits // 8
