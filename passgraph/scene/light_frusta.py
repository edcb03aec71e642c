"""Frusta of shadow maps, fitted to a world box of casters and receivers.

All matrices are composed in float64. A frustum is square and a little larger than the box, so that a filter
near the border still reads depth.
"""

from __future__ import annotations

from math import radians, tan

import numpy as np

from passgraph.scene.matrices import (
    Float64,
    Vec3,
    corners_of,
    look_from,
    orthographic,
    perspective,
    sphere_of,
    transform_points,
)

# A wider single perspective map wastes nearly all texels on its border: tan(80 deg) = 5.7.
WIDEST_HALF_RAD = radians(80.0)
# A point light gets one fitted map up to a full angle of 150 degrees.
FITTED_HALF_RAD = radians(75.0)
# Room on each side, as a fraction of the extent.
MARGIN = 0.02
# A perspective depth buffer of 24 bits still resolves 1e-4 of the far distance at this ratio.
NEAREST_OF_FAR = 1e-3


def directional(direction: Vec3, bounds: Float64) -> tuple[Float64, Float64]:
    """Orthographic frustum along ``direction`` that holds the box."""
    centre, radius = sphere_of(bounds)
    # two radii back, so that near stays positive: depth counts from the eye as for the other lights
    view = look_from(centre - 2.0 * radius * np.array(direction), direction)
    points = transform_points(view, corners_of(bounds))
    half = max(float(np.abs(points[:, :2]).max()), 0.01 * radius) * (1.0 + MARGIN)
    depth = -points[:, 2]
    slack = MARGIN * radius
    return view, orthographic(half, half, float(depth.min()) - slack, float(depth.max()) + slack)


def _depth_range(depth: Float64, radius: float) -> tuple[float, float]:
    """Near and far for distances along the axis; a box behind or round the light gets a usable range."""
    far = float(depth.max())
    if far <= 0.0:
        far = radius
    far *= 1.0 + MARGIN
    near = max(float(depth.min()) * (1.0 - MARGIN), far * NEAREST_OF_FAR)
    return near, far


def spot(position: Vec3, direction: Vec3, cone_outer_rad: float, bounds: Float64) -> tuple[Float64, Float64]:
    """Perspective frustum of the cone; near and far hold the box."""
    view = look_from(position, direction)
    depth = -transform_points(view, corners_of(bounds))[:, 2]
    near, far = _depth_range(depth, sphere_of(bounds)[1])
    half = tan(min(cone_outer_rad, WIDEST_HALF_RAD)) * (1.0 + MARGIN)
    return view, perspective(half, half, near, far)


def fitted(position: Vec3, bounds: Float64) -> tuple[Float64, Float64] | None:
    """Perspective frustum from ``position`` that holds the box, or None where it is too wide."""
    centre, radius = sphere_of(bounds)
    towards = centre - np.array(position)
    if float(np.linalg.norm(towards)) <= 1e-3 * radius:
        return None
    view = look_from(position, towards)
    points = transform_points(view, corners_of(bounds))
    depth = -points[:, 2]
    across = np.linalg.norm(points[:, :2], axis=1)
    if np.any(depth <= 0.0) or np.any(across > tan(FITTED_HALF_RAD) * depth):
        return None
    half = max(float((np.abs(points[:, :2]) / depth[:, None]).max()), 1e-3) * (1.0 + MARGIN)
    near, far = _depth_range(depth, radius)
    return view, perspective(half, half, near, far)


def cube_views(position: Vec3) -> tuple[Float64, ...]:
    """Six views in the order and orientation of OpenGL cube map faces (OpenGL 4.6, table 8.19)."""
    faces = (
        ((1, 0, 0), (0, -1, 0)),
        ((-1, 0, 0), (0, -1, 0)),
        ((0, 1, 0), (0, 0, 1)),
        ((0, -1, 0), (0, 0, -1)),
        ((0, 0, 1), (0, -1, 0)),
        ((0, 0, -1), (0, -1, 0)),
    )
    return tuple(look_from(position, forward, up) for forward, up in faces)


def cube_projection(position: Vec3, bounds: Float64) -> Float64:
    """The 90 degree projection of a cube face; near is the distance to the box where the light is outside."""
    offsets = corners_of(bounds) - np.array(position)
    # depth is measured along an axis, and no axis sees the box further than its largest coordinate
    far = max(float(np.abs(offsets).max()), sphere_of(bounds)[1]) * (1.0 + MARGIN)
    # the nearest surface may appear in any face with a depth of at least its largest coordinate
    gap = np.maximum(np.maximum(bounds[0] - position, position - bounds[1]), 0.0)
    near = max(float(gap.max()) * (1.0 - MARGIN), far * NEAREST_OF_FAR)
    return perspective(1.0, 1.0, min(near, 0.5 * far), far)
