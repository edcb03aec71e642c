"""Occlusion from points: the share of a hemisphere over each pixel that lies behind what the depth shows."""

# mypy: disable-error-code="no-any-return"
# Values of the kernel language are Any to Python's type checkers.
from __future__ import annotations

import math
from functools import lru_cache
from math import pi
from typing import Any

import passgraph as pg
from passgraph import Const, Image, clamp, cos, cross, dot, floor, ivec2, output_size, pixel, sin, uv, vec2, vec3
from passgraph.effects.ambient.horizon_occlusion import (
    FAR_AWAY,
    facing_normal,
    linear_depth_step,
    pattern,
    shaped,
    unit,
)
from passgraph.effects.surfaces.geometry import (
    ViewFrame,
    half_extent,
    line_of_sight,
    linear_on_planes,
    pixel_step,
    spread,
)

TURN = 2.0 * pi
#: Angle between successive points, so that no two lie in line.
GOLDEN_ANGLE = pi * (3.0 - math.sqrt(5.0))


def hemisphere_points(count: int) -> tuple[tuple[float, float, float], ...]:
    """Points of the unit hemisphere over z = 0, denser toward the pole (cosine) and toward the centre.

    >>> [round(v, 3) for v in hemisphere_points(1)[0]]
    [0.177, 0.0, 0.177]
    """
    points = []
    for k in range(count):
        share = (k + 0.5) / count
        # radii in the order of bit-reversed numbers, so that they do not go with the height
        reach = _bit_reversed(k, count) ** 2
        flat = math.sqrt(share) * reach
        points.append(
            (flat * math.cos(k * GOLDEN_ANGLE), flat * math.sin(k * GOLDEN_ANGLE), math.sqrt(1.0 - share) * reach)
        )
    return tuple(points)


def _bit_reversed(k: int, count: int) -> float:
    """The k-th number of the van der Corput sequence in base 2, in the middle of its part of ]0, 1[."""
    value, scale = 0.0, 0.5
    while k:
        value += scale * (k & 1)
        k, scale = k >> 1, 0.5 * scale
    return value + 0.5 / (1 << max(count - 1, 0).bit_length() if count > 1 else 1)


@lru_cache(maxsize=16)
def hemisphere_visibility(taps: int) -> Any:
    """A kernel with this many points built in."""
    points: Any = hemisphere_points(taps)  # vectors in the kernel

    @pg.kernel
    def visibility(
        linear_depth: Image, normals: Image, frame: ViewFrame, radius: float, bias: float, power: float,
        range_check: Const[bool],
    ) -> vec2:  # fmt: skip
        """The share of the points that is seen (1 without a surface); the linear depth."""
        linear = linear_depth[0, 0].r
        if linear <= 0.0:
            return vec2(1.0, 0.0)
        far = linear_on_planes(frame, linear)
        ray = line_of_sight(frame, uv())
        n = facing_normal(normals[0, 0].zw, unit(-ray))
        step_of_plane = linear_depth_step(frame, n, ray, far, pixel_step(frame, output_size(), 1.0))
        noise = pattern(pixel())
        # a frame round the normal, turned by the noise about it
        turn = vec2(cos(TURN * noise.x), sin(TURN * noise.x))
        start = vec3(turn, 0.0) if abs(n.z) > 0.7 else vec3(turn.x, 0.0, turn.y)
        t = unit(start - n * dot(n, start))
        b = cross(n, t)
        # x and y in pixels from this one, z as it is: of the pixel's own place and of the frame
        scale = vec2(0.5, -0.5) * vec2(output_size()) / half_extent(frame, output_size())
        t_px, b_px, n_px = t.xy * scale * radius, b.xy * scale * radius, n.xy * scale * radius
        middle = ray.xy * scale
        t_z, b_z, n_z = t.z * radius, b.z * radius, n.z * radius
        per_radius = 1.0 / radius
        least = bias * radius
        hidden = 0.0
        for k in range(taps):
            p = points[k]
            away = far - (t_z * p.x + b_z * p.y + n_z * p.z)
            # behind the eye nothing is seen
            share = 1.0 / spread(frame, max(away, 1e-6 * far))
            at = (middle * spread(frame, far) + t_px * p.x + b_px * p.y + n_px * p.z) * share - middle
            tap = floor(at + 0.5)
            # the texel's centre lies beside the point: its depth is carried over along the receiver's plane
            found = linear_depth.texel(pixel() + ivec2(tap)).r
            w = max(found + dot(at - tap, step_of_plane), 1e-20)
            seen = linear_on_planes(frame, w) if found > 0.0 else FAR_AWAY  # the depth there
            near = 1.0
            if range_check:
                near = clamp(2.0 - abs(far - seen) * per_radius, 0.0, 1.0)
            hidden += near if seen < away - least else 0.0
        return vec2(shaped(1.0 - hidden / float(taps), power), linear)

    return visibility
