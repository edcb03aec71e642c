"""Rays through a hierarchy of boxes."""

# mypy: disable-error-code="untyped-decorator"
from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

Float64 = NDArray[np.float64]
Int32 = NDArray[np.int32]
#: Deepest tree that is walked; binned splits of 2^24 triangles stay far below it.
DEEPEST = 128


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _meets_box(box: Float64, o: Float64, inverse: Float64, length: float) -> bool:
    """Slab test; an infinite inverse on a slab's own plane gives NaN, which the comparisons let pass."""
    near, far = 0.0, length
    for k in range(3):
        a, b = (box[k] - o[k]) * inverse[k], (box[3 + k] - o[k]) * inverse[k]
        if a > b:
            a, b = b, a
        if a > near:
            near = a
        if b < far:
            far = b
    # two roundings of each product: T. Ize, "Robust BVH Ray Traversal", 2013
    return bool(near <= far * (1.0 + 4e-16))


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _distance(corner: Float64, o: Float64, shear: Float64, kx: int, ky: int, kz: int) -> float:
    """Distance along the ray to a triangle, infinite where it is missed; a ray on an edge meets both its triangles.

    Source: S. Woop et al., "Watertight Ray/Triangle Intersection", 2013.
    """
    az, bz, cz = corner[0, kz] - o[kz], corner[1, kz] - o[kz], corner[2, kz] - o[kz]
    ax, ay = corner[0, kx] - o[kx] - shear[0] * az, corner[0, ky] - o[ky] - shear[1] * az
    bx, by = corner[1, kx] - o[kx] - shear[0] * bz, corner[1, ky] - o[ky] - shear[1] * bz
    cx, cy = corner[2, kx] - o[kx] - shear[0] * cz, corner[2, ky] - o[ky] - shear[1] * cz
    u, v, w = cx * by - cy * bx, ax * cy - ay * cx, bx * ay - by * ax
    if (u < 0.0 or v < 0.0 or w < 0.0) and (u > 0.0 or v > 0.0 or w > 0.0):
        return np.inf
    total = u + v + w
    if total == 0.0:
        return np.inf
    t = shear[2] * (u * az + v * bz + w * cz) / total
    return t if t > 0.0 else np.inf


@njit(cache=True, nogil=True, error_model="numpy")
def _walk(
    boxes: Float64, child: Int32, counts: Int32, corners: Float64,
    o: Float64, d: Float64, length: float, any_hit: bool, pending: Int32,
) -> int:  # fmt: skip
    """Place in ``corners`` of the nearest triangle (or of any) within the length, -1 where there is none."""
    inverse, shear = 1.0 / d, np.empty(3)
    kz = 0 if abs(d[0]) > max(abs(d[1]), abs(d[2])) else (1 if abs(d[1]) > abs(d[2]) else 2)
    kx, ky = (kz + 1) % 3, (kz + 2) % 3
    shear[0], shear[1], shear[2] = d[kx] / d[kz], d[ky] / d[kz], 1.0 / d[kz]
    found, left = -1, 1
    pending[0] = 0
    while left > 0:
        left -= 1
        node = pending[left]
        if not _meets_box(boxes[node], o, inverse, length):
            continue
        first = child[node]
        if counts[node] == 0:
            # the child whose middle lies further along the ray waits
            a, b = boxes[first], boxes[first + 1]
            near = (a[kz] + a[3 + kz] - b[kz] - b[3 + kz]) * d[kz] <= 0.0
            pending[left] = first + 1 if near else first
            pending[left + 1] = first if near else first + 1
            left += 2
            continue
        for t in range(first, first + counts[node]):
            far = _distance(corners[t], o, shear, kx, ky, kz)
            if far < length:
                found, length = t, far
                if any_hit:
                    return int(found)
    return int(found)


@njit(cache=True, nogil=True, error_model="numpy")
def closest(
    boxes: Float64, child: Int32, counts: Int32, order: Int32, corners: Float64,
    origins: Float64, directions: Float64, lengths: Float64, found: Int32,
) -> None:  # fmt: skip
    """Fill ``found`` with numbers of the nearest triangles, -1 where there is none."""
    pending = np.empty(DEEPEST, np.int32)
    for i in range(len(origins)):
        t = _walk(boxes, child, counts, corners, origins[i], directions[i], lengths[i], False, pending)
        found[i] = order[t] if t >= 0 else -1


@njit(cache=True, nogil=True, error_model="numpy")
def blocked(
    boxes: Float64, child: Int32, counts: Int32, order: Int32, corners: Float64,
    origins: Float64, directions: Float64, lengths: Float64, found: NDArray[np.bool_],
) -> None:  # fmt: skip
    """Fill ``found`` with whether any triangle lies within each ray's length."""
    pending = np.empty(DEEPEST, np.int32)
    for i in range(len(origins)):
        t = _walk(boxes, child, counts, corners, origins[i], directions[i], lengths[i], True, pending)
        found[i] = t >= 0
