"""What a projection matrix of an engine says: angle or extent, shift, near and far, reversed depth."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from passgraph.arguments import flag
from passgraph.errors import InputError
from passgraph.scene.matrices import Float64, floats

#: Entries that have to be 0 may be off by this share of the largest beside them: engines hold matrices in float32.
ROUNDING = 2e-6
#: Where nearly nothing is left of 1 / far, relative to 1 / near, far is infinite.  Engines that push their infinite far
#: plane in front of what is cleared (E. Lengyel, "Projection Matrix Tricks", 2007) stay below it too.
INFINITE = 5e-7
#: Of an orthographic depth range that begins behind the eye: how far before it the eye is put.
STEP_BACK = 1.0 / 64.0


class Planes(NamedTuple):
    """Where a depth range begins and ends; both from the eye, which may have been put back."""

    near: float
    far: float
    back: float


@dataclass(frozen=True)
class Projection:
    """A projection matrix, understood.

    Attributes
    ----------
    half : half the width and height of what is seen, at distance 1, or anywhere if orthographic
    middle : the middle of the picture, in the same units, from the view axis
    near, far : distances along the view axis, scene units, 0 < near < far; far may be infinite
    back : how far the eye is put back along the view axis to make near positive; 0 in perspective
    orthographic : whether rays are parallel
    reversed_z : whether depth falls with the distance
    """

    half: tuple[float, float]
    middle: tuple[float, float]
    near: float
    far: float
    back: float
    orthographic: bool
    reversed_z: bool

    @classmethod
    def of(cls, matrix: ArrayLike, zero_to_one: bool | None = None) -> Projection:
        """Read a matrix.

        Parameters
        ----------
        matrix : (4, 4), from the camera's frame, which looks along -z, to clip space; ``M @ v``
        zero_to_one : whether clip space reaches from 0 to 1 in depth, as with Direct3D, Vulkan, Metal, WebGPU and
            ``glClipControl``, or from -1 to 1, as else with OpenGL; left out, -1 to 1 unless the matrix cannot mean it

        Raises
        ------
        InputError
            What is no perspective and no orthographic projection: sheared, with an oblique near plane, left-handed.

        >>> from passgraph.scene.matrices import perspective
        >>> read = Projection.of(perspective(0.5, 0.25, 1.0, 100.0))
        >>> read.half, round(read.near, 9), round(read.far, 9)
        ((0.5, 0.25), 1.0, 100.0)
        """
        m = _checked(matrix)
        orthographic = bool(m[3, 2] == 0.0)
        m = m / (m[3, 3] if orthographic else -m[3, 2])
        if m[1, 1] < 0.0:  # Vulkan: y of clip space points down, and so do its rows
            m[1] = -m[1]
        if m[0, 0] <= 0.0 or m[1, 1] <= 0.0:
            raise _error("the picture is mirrored: entry [0][0] is not positive", m)
        half = (1.0 / float(m[0, 0]), 1.0 / float(m[1, 1]))
        # in perspective x / w = (m00 x + m02 z) / -z, in parallel m00 x + m03
        shift = -m[:2, 3] if orthographic else m[:2, 2]
        middle = (float(shift[0]) * half[0], float(shift[1]) * half[1])
        a, b = float(m[2, 2]), float(m[2, 3])
        asked = [False, True] if zero_to_one is None else [flag(zero_to_one, "zero_to_one", InputError)]
        planes = _parallel_planes if orthographic else _perspective_planes
        for lowest in (0.0 if one else -1.0 for one in asked):
            found = planes(a, b, lowest)
            if found is not None:
                return cls(half, middle, *found, orthographic, a > 0.0 if orthographic else b > 0.0)
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
    """Depth is -a + b / distance, ``lowest`` or 1 at its ends."""
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
    """Depth is -a * distance + b."""
    if a == 0.0:
        return None
    low, high = (b - lowest) / a, (b - 1.0) / a
    near, far = min(low, high), max(low, high)
    if near > 0.0:
        return Planes(near, far, 0.0)
    if near >= -ROUNDING * far:  # it begins at the eye: nothing lies behind, and distances stay the engine's
        return Planes(ROUNDING * far, far, 0.0)
    # parallel rays see the same from farther back
    back = STEP_BACK * (far - near) - near
    return Planes(near + back, far + back, back)


def _range_said(zero_to_one: bool | None) -> str:
    return "" if zero_to_one is None else f" if depth reaches from {'0' if zero_to_one else '-1'} to 1"


def _error(text: str, matrix: Float64) -> InputError:
    rows = "; ".join(" ".join(f"{value:.6g}" for value in row) for row in matrix)
    return InputError(f"projection: {text}; got {rows}")
