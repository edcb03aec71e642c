"""What a device takes: facts that a backend states, fusion stops at, and a plan is held against (within_limits.py)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

#: Where a device has no limit of its own.
NONE = 1 << 62


@dataclass(frozen=True)
class Limits:
    """Limits of one device; those left out hold nothing back.

    Attributes
    ----------
    device : what messages call it, such as ``"gl (llvmpipe)"``
    side : pixels along one side of a picture
    pixels : of one picture
    picture_bytes : of one picture
    images : that one pass reads, those of both kernels of a draw together
    targets : that one pass writes, depth apart
    bindings : images and targets of one pass together
    vertex_numbers, numbers : parameters of a vertex kernel, and of any other, in numbers of 4 bytes
    rounding : floats and ints take multiples of so many numbers each
    filters : whether its own filter may stand for bilinear samples
    varyings : numbers that a vertex kernel hands to the fragment kernel
    trips : of all loops of one pixel together, those of loops inside loops every time; a plan is refused where every
        pixel makes more, whatever its data
    not_kept, not_written : what channels hold (`Format.number`) that no picture can hold here, and that no pass can
        write; and what the device lacks for it
    """

    device: str = "this device"
    side: int = NONE
    pixels: int = NONE
    picture_bytes: int = NONE
    images: int = NONE
    targets: int = NONE
    bindings: int = NONE
    vertex_numbers: int = NONE
    numbers: int = NONE
    rounding: int = 1
    varyings: int = NONE
    filters: bool = False
    trips: int = NONE
    not_kept: Mapping[str, str] = field(default_factory=dict)
    not_written: Mapping[str, str] = field(default_factory=dict)

    def numbers_taken(self, floats: int, ints: int) -> int:
        """Room that so many parameters take."""
        return sum(-(-count // self.rounding) * self.rounding for count in (floats, ints))

    def fits(self, images: int, targets: int, floats: int, ints: int, trips: int = 0) -> bool:
        """Whether a pixel pass with so much is within the limits."""
        return (
            images <= self.images
            and images + targets <= self.bindings
            and self.numbers_taken(floats, ints) <= self.numbers
            and trips <= self.trips
        )
