"""What is asked of whatever traces rays."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Float64 = NDArray[np.float64]
Int32 = NDArray[np.int32]
#: Stands for a ray without an end; finite in float32 too.
ENDLESS = 1e30


class Tracer(Protocol):
    """Answers for many rays at once, about one set of triangles.

    Attributes
    ----------
    name : "embree" or "bvh"
    rounding : how far a hit may lie off its triangle, as a share of the largest coordinate
    """

    name: str
    rounding: float

    def closest(self, origins: Float64, directions: Float64) -> Int32:
        """Number of the first triangle along each ray, (n,), -1 where there is none; directions are unit vectors."""

    def blocked(self, origins: Float64, directions: Float64, lengths: Float64) -> NDArray[np.bool_]:
        """Whether any triangle lies within each ray's length, (n,)."""
