"""Where a camera stands so that points fill its picture, exactly: from their projection, not from a box round them."""

from __future__ import annotations

from math import cos, pi, sin
from typing import NamedTuple

import numpy as np

from passgraph.scene.matrices import Float64, Vec3, look_rotation, sphere_of

#: Free room round framed points, as a fraction of the picture that they fill.
FRAME_MARGIN = 0.08
#: The eye stays at least so far from the points, in radii of the sphere round their box.
CLOSEST = 0.05
#: Of the near plane: before the nearest point, and for an eye amid the points as a share of the far plane.
NEAR_SLACK, NEAR_OF_FAR = 0.95, 1e-3
#: Rounds of the search for the middle of a projection; each finds which points bound it, and a few suffice.
MOST_ROUNDS = 24
#: Directions in which a profile is cut off, and places of each of its points on the way round.
PROFILE_WAYS, AROUND = 256, 64


class Aim(NamedTuple):
    """From the target to the camera, and what is up in the picture: unit vectors."""

    back: Vec3
    up: Vec3


def aim_of(azimuth_rad: float, elevation_rad: float) -> Aim:
    """Azimuth 0 looks from +z; it grows toward +x, to the right of who stands there.  Elevation counts from level.

    >>> [round(x, 6) for x in aim_of(pi / 2, 0.0).back]
    [1.0, 0.0, 0.0]
    """
    ca, sa, ce, se = cos(azimuth_rad), sin(azimuth_rad), cos(elevation_rad), sin(elevation_rad)
    return Aim((ce * sa, se, ce * ca), (-se * sa, ce, -se * ca))


def eye_for(points: Float64, aim: Aim, half: tuple[float, float]) -> Float64:
    """The nearest eye, (3,), from which (n, 3) points are within ``half`` the width and height at distance 1.

    In the direction in which they do not fill the picture they lie in its middle.
    """
    bounds = np.stack([points.min(axis=0), points.max(axis=0)])
    centre, radius = sphere_of(bounds)
    rotation = look_rotation(tuple(-x for x in aim.back), aim.up)[:3, :3]
    local = (points - centre) @ rotation.T
    z = local[:, 2]
    # |x - eye| <= half (eye_z - z) for all points: two half planes a point, and they meet in the nearest eye
    needed = []
    for axis, tangent in zip((0, 1), half, strict=True):
        above, below = (tangent * z + local[:, axis]).max(), (tangent * z - local[:, axis]).max()
        needed.append((float(above) + float(below)) / (2.0 * tangent))
    distance = max(*needed, float(z.max()) + CLOSEST * radius)
    across = [_middle(local[:, axis], distance - z, tangent) for axis, tangent in zip((0, 1), half, strict=True)]
    return np.asarray(centre + np.array([*across, distance]) @ rotation, dtype=np.float64)


def _middle(across: Float64, depth: Float64, tangent: float) -> float:
    """The eye's place on one axis from which the outermost points lie equally far off the middle."""
    low, high = float((across - tangent * depth).max()), float((across + tangent * depth).min())
    at = 0.5 * (low + high)
    for _ in range(MOST_ROUNDS):
        seen = (across - at) / depth
        right, left = int(seen.argmax()), int(seen.argmin())
        weights = 1.0 / depth[right], 1.0 / depth[left]
        found = float((across[right] * weights[0] + across[left] * weights[1]) / (weights[0] + weights[1]))
        if found == at:
            break
        at = found
    # rounding may put the ends of what is allowed in the wrong order
    return min(max(at, low), max(low, high))


def ways_round(points: Float64, centre: Float64) -> Float64:
    """Points that hold what (n, 3) points sweep in a turn about the vertical through ``centre``."""
    radius = np.hypot(points[:, 0] - centre[0], points[:, 2] - centre[2])
    height = points[:, 1] - centre[1]
    angle = np.arange(PROFILE_WAYS) * (pi / PROFILE_WAYS) - 0.5 * pi
    outermost = {int((radius * cos(a) + height * sin(a)).argmax()) for a in angle} | {int(height.argmin())}
    kept = sorted(outermost)
    around = np.arange(AROUND) * (2.0 * pi / AROUND)
    # circles are drawn as polygons round them
    wide = radius[kept, None] / cos(pi / AROUND)
    x, z = wide * np.sin(around), wide * np.cos(around)
    y = np.broadcast_to(height[kept, None], x.shape)
    return np.asarray(np.stack([x, y, z], axis=-1).reshape(-1, 3) + centre, dtype=np.float64)


def depths(eye: Float64, forward: Float64, points: Float64, others: Float64) -> tuple[float, float]:
    """Near and far planes that hold the points, and of ``others`` what does not cost precision."""
    seen = (points - eye) @ forward
    _, radius = sphere_of(np.stack([points.min(axis=0), points.max(axis=0)]))
    far = max(float(seen.max()), float(((others - eye) @ forward).max()), radius) + 0.05 * radius
    nearest = NEAR_SLACK * float(seen.min())
    return max(nearest, min(NEAR_OF_FAR * far, 0.01 * radius)), far
