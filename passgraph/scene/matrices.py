"""Affine and projection matrices in float64, for column vectors: ``M @ v``.

Clip space is OpenGL's: x, y and z in [-w, w], the camera looks along -z of its own frame.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from passgraph.arguments import as_float, numbers, shown
from passgraph.errors import InputError

Float64 = NDArray[np.float64]
Vec3 = tuple[float, float, float]

# Directions with a smaller sine of their angle count as parallel.
_PARALLEL_SINE = 1e-6
#: Least and largest radius of a scene: float32 holds their squares, and those of a thousandth of them.
LEAST_RADIUS, MOST_RADIUS = 1e-15, 1e15


def floats(value: object, what: str, expected: str) -> Float64:
    """Return an array of numbers as a new float64 one; ``expected`` describes the shape in the error."""
    try:
        return np.array(numbers(value, what), np.float64)
    except InputError:
        raise InputError(f"{what}: expected {expected}, got {shown(value)}") from None


def vec3(value: ArrayLike, what: str) -> Vec3:
    """Return three finite numbers as a tuple; ``what`` names them in the error.

    >>> vec3([1, 2, 3], "eye")
    (1.0, 2.0, 3.0)
    """
    array = floats(value, what, "three finite numbers")
    if array.shape != (3,) or not np.isfinite(array).all():
        raise InputError(f"{what}: expected three finite numbers, got {shown(value)}")
    return (float(array[0]), float(array[1]), float(array[2]))


def number(value: object, what: str, low: float, high: float, *, open_low: bool = False) -> float:
    """Return a finite number in [low, high] (or ]low, high] with ``open_low``); ``what`` names it in the error."""
    result = as_float(value)
    if result is None or result < low or result > high or (open_low and result == low):
        bracket = "]" if open_low else "["
        raise InputError(f"{what}: expected a finite number in {bracket}{low:g}, {high:g}], got {shown(value)}")
    return result


def matrix4(value: ArrayLike, what: str) -> Float64:
    """Return a finite, invertible affine matrix, (4, 4) float64; ``what`` names it in the error."""
    array = floats(value, what, "a (4, 4) matrix of numbers")
    if array.shape != (4, 4):
        raise InputError(f"{what}: expected a (4, 4) matrix, got shape {array.shape}")
    if not np.isfinite(array).all():
        raise InputError(f"{what}: the matrix holds NaN or infinite values")
    if not np.array_equal(array[3], (0.0, 0.0, 0.0, 1.0)):
        raise InputError(f"{what}: expected an affine matrix with last row 0 0 0 1, got {array[3].tolist()}")
    if is_singular(array):
        raise InputError(f"{what}: the matrix is singular (a scale of zero?); give every axis a length")
    return array


def is_singular(matrix: Float64) -> bool:
    """Return True if the upper 3x3 of a matrix is singular, relative to its overall scale."""
    linear = matrix[:3, :3]
    lengths = np.linalg.norm(linear, axis=0)
    if not np.all(lengths > 0.0):
        return True
    return bool(abs(np.linalg.det(linear / lengths)) < 1e-12)


def bounds_of(value: ArrayLike, what: str = "bounds") -> Float64:
    """Return a box as (2, 3) float64: row 0 the minimum, row 1 the maximum."""
    array = floats(value, what, "(2, 3) numbers (minimum, maximum)")
    if array.shape != (2, 3):
        raise InputError(f"{what}: expected shape (2, 3) (minimum, maximum), got {array.shape}")
    if not np.isfinite(array).all() or np.any(array[0] > array[1]):
        raise InputError(f"{what}: expected finite numbers with minimum <= maximum, got {array.tolist()}")
    return array


def corners_of(bounds: Float64) -> Float64:
    """Return the eight corners of a box, (8, 3) float64.

    >>> corners_of(np.array([[0.0, 0, 0], [1, 1, 1]])).sum(axis=0).tolist()
    [4.0, 4.0, 4.0]
    """
    pick = np.array([[i & 1, i >> 1 & 1, i >> 2 & 1] for i in range(8)])
    return np.asarray(bounds[pick, np.arange(3)], dtype=np.float64)


def sphere_of(bounds: Float64) -> tuple[Float64, float]:
    """Return the center (3,) and the radius of the sphere around a box; the radius is positive also for a point.

    The least radius is the larger of `LEAST_RADIUS` and 1e-9 of the distance from the origin; below that, float64
    differences of world coordinates are mostly rounding.
    """
    centre = bounds.mean(axis=0)
    radius = 0.5 * float(np.linalg.norm(bounds[1] - bounds[0]))
    return centre, max(radius, LEAST_RADIUS, 1e-9 * float(np.abs(centre).max()))


def transform_points(matrix: Float64, points: ArrayLike) -> Float64:
    """Apply an affine matrix to points, (n, 3) in and (n, 3) float64 out.

    >>> transform_points(translation((1, 0, 0)), [[1, 2, 3]]).tolist()
    [[2.0, 2.0, 3.0]]
    """
    array = np.asarray(points, dtype=np.float64)
    return np.asarray(array @ matrix[:3, :3].T + matrix[:3, 3], dtype=np.float64)


def translation(offset: ArrayLike) -> Float64:
    """Return the matrix that translates by ``offset`` (3,)."""
    result = np.eye(4)
    result[:3, 3] = np.asarray(offset, dtype=np.float64)
    return result


def rotation_y(angle_rad: float) -> Float64:
    """Return the matrix that rotates counter-clockwise about +y, seen from above."""
    c, s = np.cos(angle_rad), np.sin(angle_rad)
    return np.array([[c, 0, s, 0], [0, 1, 0, 0], [-s, 0, c, 0], [0, 0, 0, 1.0]])


def unit(vector: ArrayLike) -> Float64:
    """Return a vector scaled to length 1; safe for tiny and huge lengths."""
    array = np.asarray(vector, dtype=np.float64)
    array = array / np.abs(array).max()
    return np.asarray(array / np.linalg.norm(array), dtype=np.float64)


def are_parallel(a: ArrayLike, b: ArrayLike) -> bool:
    """Return True if two directions are nearly parallel."""
    return bool(np.linalg.norm(np.cross(unit(a), unit(b))) < _PARALLEL_SINE)


def look_rotation(forward: ArrayLike, up: ArrayLike = (0.0, 1.0, 0.0)) -> Float64:
    """Return the rotation, (4, 4), from the world to a frame that looks along ``forward``, its own -z.

    If ``up`` is parallel to ``forward``, another axis replaces it, for lights that shine straight down.

    >>> look_rotation((0, 0, -1)).tolist() == np.eye(4).tolist()
    True
    """
    z = -unit(forward)
    if are_parallel(z, up):
        up = (0.0, 0.0, -1.0) if abs(z[2]) < 0.9 else (1.0, 0.0, 0.0)
    x = unit(np.cross(np.asarray(up, dtype=np.float64), z))
    result = np.eye(4)
    result[0, :3], result[1, :3], result[2, :3] = x, np.cross(z, x), z
    return result + 0.0  # turns -0.0 into 0.0


def look_from(eye: ArrayLike, forward: ArrayLike, up: ArrayLike = (0.0, 1.0, 0.0)) -> Float64:
    """Return the view matrix, (4, 4), of a frame at ``eye`` that looks along ``forward``."""
    return look_rotation(forward, up) @ translation(-np.asarray(eye, dtype=np.float64))


def perspective(
    tan_half_x: float, tan_half_y: float, near: float, far: float, middle: tuple[float, float] = (0.0, 0.0)
) -> Float64:
    """Return a perspective projection to OpenGL clip space.

    Parameters
    ----------
    tan_half_x, tan_half_y : tangents of half the horizontal and vertical angle
    near, far : distances along the view axis, scene units, 0 < near < far; far may be infinite
    middle : offset of the picture's middle from the view axis, at distance 1

    Source: OpenGL 2.1 specification, section 2.11.2, glFrustum; with its limit for an infinite far plane.
    """
    result = np.zeros((4, 4))
    result[0, 0], result[1, 1] = 1.0 / tan_half_x, 1.0 / tan_half_y
    result[0, 2], result[1, 2] = middle[0] / tan_half_x, middle[1] / tan_half_y
    result[2, 2], result[2, 3] = -1.0, -2.0 * near
    if np.isfinite(far):
        result[2, 2], result[2, 3] = -(far + near) / (far - near), -2.0 * far * near / (far - near)
    result[3, 2] = -1.0
    return result


def orthographic(
    half_x: float, half_y: float, near: float, far: float, middle: tuple[float, float] = (0.0, 0.0)
) -> Float64:
    """Return an orthographic projection to OpenGL clip space (OpenGL 2.1, section 2.11.2, glOrtho)."""
    result = np.diag([1.0 / half_x, 1.0 / half_y, -2.0 / (far - near), 1.0])
    result[:3, 3] = -middle[0] / half_x, -middle[1] / half_y, -(far + near) / (far - near)
    return result + 0.0  # turns -0.0 into 0.0


def rigid(view: ArrayLike, what: str) -> tuple[Float64, Float64]:
    """Return the rotation, (3, 3), of a view matrix without scale, and the position of its eye, (3,); float64 both.

    The rotation is orthogonalized, since engines store matrices in float32.
    """
    matrix = matrix4(view, what)
    left, lengths, right = np.linalg.svd(matrix[:3, :3])
    if np.abs(lengths - 1.0).max() > 1e-4:
        raise InputError(
            f"{what}: expected a rotation and a shift, got axes of lengths {lengths.round(6).tolist()}; take the scale "
            "out of it"
        )
    turn = left @ right
    if np.linalg.det(turn) < 0.0:
        raise InputError(
            f"{what}: the matrix mirrors, as views of left-handed worlds do; negate one axis of the world, and the "
            "matrix's column of that axis"
        )
    return turn, -turn.T @ matrix[:3, 3]
