"""What the numbers in an engine's depth buffer mean."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from passgraph.arguments import flag, is_number, numbers, shown
from passgraph.errors import InputError
from passgraph.scene.matrices import number
from passgraph.scene.projection import Projection

Float64 = NDArray[np.float64]


@dataclass(frozen=True)
class HardwareDepth:
    """How a depth buffer holds distances: as numbers from 0 to 1, whatever clip space the engine has.

    In perspective 1 / distance is linear in the number, in parallel projections the distance.

    Attributes
    ----------
    near, far : distances along the view axis, scene units, 0 < near < far; in perspective far may be infinite
    reversed_z : near is 1 and far is 0, and 0 where nothing is drawn
    orthographic : whether the projection is parallel
    back : how far behind the engine's own eye distances begin to count; not 0 only in parallel projections that begin
        behind it, where ``distance(...) - back`` is what the engine calls the distance

    >>> HardwareDepth(0.1, 1000.0).distance([0.0, 0.5, 0.999, 1.0]).round(4).tolist()
    [0.1, 0.2, 90.9174, 0.0]
    """

    near: float
    far: float
    reversed_z: bool = False
    orthographic: bool = False
    back: float = field(default=0.0, repr=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "near", number(self.near, "hardware depth: near", 0.0, np.inf, open_low=True))
        flag(self.reversed_z, "hardware depth: reversed_z", InputError)
        flag(self.orthographic, "hardware depth: orthographic", InputError)
        object.__setattr__(self, "far", far_plane(self.far, "hardware depth", self.near, self.orthographic))
        object.__setattr__(self, "back", number(self.back, "hardware depth: back", 0.0, np.inf))

    @classmethod
    def of_projection(cls, projection: ArrayLike, zero_to_one: bool | None = None) -> HardwareDepth:
        """Return what an engine writes with a projection matrix, (4, 4); see `passgraph.Camera.from_matrices`.

        ``zero_to_one`` says whether clip space reaches from 0 to 1 in depth.  Only with reversed depth does the matrix
        show it; give it for others of Direct3D, Vulkan, Metal, WebGPU and ``glClipControl``: near comes out at
        half of what it is otherwise.

        Where a parallel projection begins behind the eye, distances count from the eye of the camera that
        `passgraph.Camera.from_matrices` makes of the same matrix, which lies ``back`` farther back.

        >>> from passgraph.scene.matrices import perspective
        >>> HardwareDepth.of_projection(perspective(1.0, 1.0, 0.5, 8.0))
        HardwareDepth(near=0.5, far=8.0..., reversed_z=False, orthographic=False)
        """
        read = Projection.of(projection, zero_to_one)
        return cls(read.near, read.far, read.reversed_z, read.orthographic, read.back)

    @property
    def ends(self) -> tuple[float, float]:
        """What is linear in the number, at 0 and at 1: 1 / distance, or the distance if orthographic.

        Between them lies ``(1 - d) * ends[0] + d * ends[1]``: both terms are positive, so that float32 keeps every
        digit that ``d`` or ``1 - d`` has, however large far / near is.
        """
        pair = (self.near, self.far) if self.orthographic else (1.0 / self.near, 1.0 / self.far)
        return (pair[1], pair[0]) if self.reversed_z else pair

    def distance(self, depth: ArrayLike) -> Float64:
        """Distances along the view axis of numbers from a depth buffer, any shape; 0 where nothing is drawn.

        Nothing is drawn where the number is that of the far plane, or none.
        """
        d = np.asarray(numbers(depth, "hardware depth: depth"), np.float64)
        first, last = self.ends
        held = np.clip(d, 0.0, 1.0)
        with np.errstate(divide="ignore"):
            linear = (1.0 - held) * first + held * last
            distance = linear if self.orthographic else 1.0 / linear
        drawn = d > 0.0 if self.reversed_z else d < 1.0
        return np.where(drawn, distance, 0.0)

    def depth(self, distance: ArrayLike) -> Float64:
        """The number in the depth buffer for distances, any shape, float64; that of the far plane for 0.

        >>> holds = HardwareDepth(0.5, np.inf, reversed_z=True)
        >>> holds.depth([0.5, 5.0, 0.0]).tolist()
        [1.0, 0.1, 0.0]
        """
        z = np.asarray(numbers(distance, "hardware depth: distance"), np.float64)
        first, last = self.ends
        with np.errstate(divide="ignore"):
            linear = z if self.orthographic else 1.0 / z
            held = np.clip((linear - first) / (last - first), 0.0, 1.0)
        return np.where(z > 0.0, held, 0.0 if self.reversed_z else 1.0)


def far_plane(value: object, what: str, near: float, orthographic: bool) -> float:
    """A distance beyond near, infinite only in perspective; ``what`` names its owner in errors."""
    if is_number(value) and value == np.inf:
        if orthographic:
            raise InputError(f"{what}: far: a parallel projection has a finite far plane, got inf")
        return np.inf
    if not is_number(value):
        raise InputError(f"{what}: far: expected a number above near, got {shown(value)}")
    far = number(value, f"{what}: far", 0.0, np.inf, open_low=True)
    if far <= near:
        raise InputError(f"{what}: expected near < far, got near {near:g} and far {far:g}")
    return far
