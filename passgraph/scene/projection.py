"""Read an engine's projection matrix: angle or extent, shift, near and far planes, reversed depth."""

from __future__ import annotations

from dataclasses import field
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from passgraph.arguments import flag, is_number, numbers, shown
from passgraph.errors import InputError
from passgraph.records import dataclass
from passgraph.scene.matrices import Float64, floats, number

#: Tolerance of entries that must be 0, relative to the largest in their row: engines store matrices in float32.
ROUNDING = 2e-6
#: Below this ratio of 1 / far to 1 / near, far counts as infinite. Infinite far planes that are moved before the clear
#: value (E. Lengyel, "Projection Matrix Tricks", 2007) are below it too.
INFINITE = 5e-7
#: Distance of the moved eye before an orthographic depth range that begins behind the eye, as a share of the range.
STEP_BACK = 1.0 / 64.0


class Planes(NamedTuple):
    """The ends of a depth range as distances from the eye, which may have been moved back."""

    near: float
    far: float
    back: float


@dataclass(frozen=True)
class Projection:
    """The parameters of a projection matrix.

    Attributes
    ----------
    half : half the width and height of the view, at distance 1; at any distance if orthographic
    middle : the picture's middle, in the same units, from the view axis
    near, far : distances along the view axis, scene units, 0 < near < far; far may be infinite
    back : distance by which the eye is moved back along the view axis to make near positive; 0 for perspective
    orthographic : True for an orthographic projection
    reversed_z : True if depth decreases with distance
    """

    half: tuple[float, float]
    middle: tuple[float, float]
    near: float
    far: float
    back: float
    orthographic: bool
    reversed_z: bool

    @classmethod
    def from_matrix(cls, matrix: ArrayLike, zero_to_one: bool | None = None) -> Projection:
        """Read a matrix.

        Parameters
        ----------
        matrix : (4, 4), from the camera's frame, which looks along -z, to clip space; ``M @ v``
        zero_to_one : True if depth in clip space is from 0 to 1, as in Direct3D, Vulkan, Metal, WebGPU and with
            ``glClipControl``; False for -1 to 1, OpenGL's default. None takes -1 to 1, unless the matrix rules it out

        Raises
        ------
        InputError
            For other matrices: sheared, with an oblique near plane, or left-handed.

        >>> from passgraph.scene.matrices import perspective
        >>> read = Projection.from_matrix(perspective(0.5, 0.25, 1.0, 100.0))
        >>> read.half, round(read.near, 9), round(read.far, 9)
        ((0.5, 0.25), 1.0, 100.0)
        """
        m = _checked(matrix)
        orthographic = bool(m[3, 2] == 0.0)
        m = m / (m[3, 3] if orthographic else -m[3, 2])
        if m[1, 1] < 0.0:  # Vulkan: y of clip space points down
            m[1] = -m[1]
        if m[0, 0] <= 0.0 or m[1, 1] <= 0.0:
            raise _error("the picture is mirrored: entry [0][0] is not positive", m)
        half = (1.0 / float(m[0, 0]), 1.0 / float(m[1, 1]))
        # perspective: x / w = (m00 x + m02 z) / -z; orthographic: m00 x + m03
        shift = -m[:2, 3] if orthographic else m[:2, 2]
        middle = (float(shift[0]) * half[0], float(shift[1]) * half[1])
        a, b = float(m[2, 2]), float(m[2, 3])
        conventions = [False, True] if zero_to_one is None else [flag(zero_to_one, "zero_to_one", InputError)]
        planes = _parallel_planes if orthographic else _perspective_planes
        for lowest in (0.0 if one else -1.0 for one in conventions):
            planes_ = planes(a, b, lowest)
            if planes_ is not None:
                return cls(half, middle, *planes_, orthographic, a > 0.0 if orthographic else b > 0.0)
        raise _error(f"no near and far planes come from its third row{_range_said(zero_to_one)}", m)


def _checked(matrix: ArrayLike) -> Float64:
    m = floats(matrix, "projection", "a (4, 4) matrix of numbers")
    if m.shape != (4, 4):
        raise InputError(f"projection: expected a (4, 4) matrix, got shape {m.shape}")
    if not np.isfinite(m).all():
        raise InputError("projection: the matrix holds NaN or infinite values")
    largest = np.maximum(np.abs(m).max(axis=1, keepdims=True), 1e-300)
    rounded = np.where(np.abs(m) <= ROUNDING * largest, 0.0, m)
    m[3] = last = rounded[3]
    if not any(np.array_equal(last != 0.0, (False, False, one, not one)) for one in (True, False)):
        raise _error("expected the last row 0 0 -1 0 (perspective) or 0 0 0 1 (orthographic)", m)
    if m[2, 3] == -1.0 != last[2] and last[3] == 0.0:
        raise _error("it looks transposed; matrices are M @ v, with 0 0 -1 0 in the last row", m)
    if last[2] > 0.0 and last[3] == 0.0 and m[0, 0] > 0.0:
        raise _error("it looks along +z, a left-handed camera; negate its third column and the view's third row", m)
    must_be_0 = [(0, 1), (1, 0), (2, 0), (2, 1), *([(0, 3), (1, 3)] if last[2] else [(0, 2), (1, 2)])]
    if any(rounded[place] for place in must_be_0):
        raise _error("it is sheared or its near plane is oblique", m)
    return m


def _perspective_planes(a: float, b: float, lowest: float) -> Planes | None:
    """Return the planes of depth = -a + b / distance, which is ``lowest`` or 1 at its ends."""
    at_low, at_high = lowest + a, 1.0 + a
    nearest, farthest = (at_high, at_low) if b > 0.0 else (at_low, at_high)
    if b == 0.0 or nearest * b <= 0.0:
        return None
    near = b / nearest
    if abs(farthest) <= INFINITE * abs(nearest):
        return Planes(near, np.inf, 0.0)
    far = b / farthest
    return Planes(near, far, 0.0) if far > near else None


def _parallel_planes(a: float, b: float, lowest: float) -> Planes | None:
    """Return the planes of depth = -a * distance + b."""
    if a == 0.0:
        return None
    low, high = (b - lowest) / a, (b - 1.0) / a
    near, far = min(low, high), max(low, high)
    if near > 0.0:
        return Planes(near, far, 0.0)
    if near >= -ROUNDING * far:  # it begins at the eye, which need not be moved
        return Planes(ROUNDING * far, far, 0.0)
    # moving an orthographic eye back does not change the picture
    back = STEP_BACK * (far - near) - near
    return Planes(near + back, far + back, back)


def _range_said(zero_to_one: bool | None) -> str:
    return "" if zero_to_one is None else f" if depth reaches from {'0' if zero_to_one else '-1'} to 1"


def _error(text: str, matrix: Float64) -> InputError:
    rows = "; ".join(" ".join(f"{value:.6g}" for value in row) for row in matrix)
    return InputError(f"projection: {text}; got {rows}")


DepthNumbers = NDArray[np.float64]


@dataclass(frozen=True)
class HardwareDepth:
    """The convention of a depth buffer: numbers from 0 to 1, for any clip space of the engine.

    The number is linear in 1 / distance for perspective, and in the distance for orthographic projections.

    Attributes
    ----------
    near, far : distances along the view axis, scene units, 0 < near < far; in perspective far may be infinite
    reversed_z : True if near is 1 and far is 0, which is also the number where nothing is drawn
    orthographic : True for an orthographic projection
    back : distance of the eye behind the engine's own; not 0 only for orthographic projections that begin behind the
        engine's eye, for which ``distance(...) - back`` is the engine's distance

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
        """Return the convention of an engine's projection matrix, (4, 4); see `passgraph.Camera.from_matrices`.

        ``zero_to_one`` is True if depth in clip space is from 0 to 1. A matrix shows this only with reversed depth. For
        other matrices of Direct3D, Vulkan, Metal, WebGPU and ``glClipControl`` set it; else near is half of its value.

        If an orthographic projection begins behind the eye, distances are from the eye of the camera that
        `passgraph.Camera.from_matrices` returns for the same matrix, which is ``back`` behind the engine's.

        >>> from passgraph.scene.matrices import perspective
        >>> HardwareDepth.of_projection(perspective(1.0, 1.0, 0.5, 8.0))
        HardwareDepth(near=0.5, far=8.0..., reversed_z=False, orthographic=False)
        """
        read = Projection.from_matrix(projection, zero_to_one)
        return cls(read.near, read.far, read.reversed_z, read.orthographic, read.back)

    @property
    def ends(self) -> tuple[float, float]:
        """Return the value that is linear in the number, at 0 and at 1: 1 / distance, or the distance if orthographic.

        In between it is ``(1 - d) * ends[0] + d * ends[1]``. Both terms are positive, so that float32 keeps every digit
        of ``d`` or ``1 - d``, also for a large far / near.
        """
        pair = (self.near, self.far) if self.orthographic else (1.0 / self.near, 1.0 / self.far)
        return (pair[1], pair[0]) if self.reversed_z else pair

    def distance(self, depth: ArrayLike) -> DepthNumbers:
        """Return the distances along the view axis of a depth buffer's numbers, any shape; 0 where nothing is drawn.

        Nothing is drawn where the number is that of the far plane, or NaN.
        """
        d = np.asarray(numbers(depth, "hardware depth: depth"), np.float64)
        first, last = self.ends
        clamped = np.clip(d, 0.0, 1.0)
        with np.errstate(divide="ignore"):
            linear = (1.0 - clamped) * first + clamped * last
            distance = linear if self.orthographic else 1.0 / linear
        drawn = d > 0.0 if self.reversed_z else d < 1.0
        return np.where(drawn, distance, 0.0)

    def depth(self, distance: ArrayLike) -> DepthNumbers:
        """Return the depth buffer's numbers for distances, any shape, float64; that of the far plane for 0.

        >>> holds = HardwareDepth(0.5, np.inf, reversed_z=True)
        >>> holds.depth([0.5, 5.0, 0.0]).tolist()
        [1.0, 0.1, 0.0]
        """
        z = np.asarray(numbers(distance, "hardware depth: distance"), np.float64)
        first, last = self.ends
        with np.errstate(divide="ignore"):
            linear = z if self.orthographic else 1.0 / z
            clamped = np.clip((linear - first) / (last - first), 0.0, 1.0)
        return np.where(z > 0.0, clamped, 0.0 if self.reversed_z else 1.0)


def far_plane(value: object, what: str, near: float, orthographic: bool) -> float:
    """Return a far distance, greater than near and infinite only in perspective; ``what`` is for errors."""
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
