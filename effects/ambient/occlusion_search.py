# mypy: disable-error-code="no-any-return"
"""Search for occlusion in a depth picture, by points in a hemisphere or by horizons in slices."""

from __future__ import annotations

import math
from functools import lru_cache
from math import pi
from typing import Any

import passgraph as pg
from passgraph.effects.surfaces.geometry import (
    ViewFrame,
    half_extent,
    line_of_sight,
    linear_on_planes,
    pixel_step,
    spread,
    unpack_normal,
)
from passgraph.language import (
    Const,
    Image,
    acos,
    atan,
    clamp,
    cos,
    cross,
    dot,
    exp2,
    floor,
    fract,
    inversesqrt,
    ivec2,
    length,
    log2,
    mix,
    normalize,
    output_size,
    pixel,
    sin,
    sqrt,
    uv,
    vec2,
    vec3,
)

PI = pi
#: Interpolated normals may face away from the eye while the triangle does not: below this cosine with the line of sight
#: they count as wrong …
SMALLEST_COSINE = 0.002
#: … and are turned to about 45 degrees from it, which minimizes the error.
TURNED_COSINE = 0.7
#: The linear depth of a tap is moved along the receiver's plane by at most this fraction of the receiver's own.
LARGEST_SHIFT = 0.25
#: A depth in parallel views that no radius reaches, and whose square fits float32.
FAR_AWAY = 1e15


@pg.function
def pattern(p: ivec2) -> vec2:
    """Return two numbers in [0, 1): the first takes each of 16 values once in every 4 by 4 pixels, the second each of
    4.

    Source: J. Jimenez, X. Wu, A. Pesce, A. Jarabo, "Practical Real-Time Strategies for Accurate Indirect
    Occlusion", 2016, the spatial noise of its implementation.
    """
    turn = (((p.x + p.y) & 3) << 2) + (p.x & 3)
    return vec2(float(turn) / 16.0, float((p.y - p.x) & 3) / 4.0)


@pg.function
def spread_point(number: int) -> vec2:
    """Return a point of the unit square; those of successive numbers are far apart.

    Source: M. Roberts, "The Unreasonable Effectiveness of Quasirandom Sequences", 2018, R2, in integers that wrap.
    """
    x, y = number * 0xC13FA9A9, number * 0x91E10DA6
    return vec2(float((x >> 8) & 0xFFFFFF), float((y >> 8) & 0xFFFFFF)) / 16777216.0


@pg.function
def noise_of(number: Image, is_moving: Const[bool]) -> vec2:
    """Return this pixel's `pattern`, in each frame another one if its number (one texel) is given."""
    noise = pattern(pixel())
    return fract(noise + spread_point(int(number.texel(ivec2(0)).r))) if is_moving else noise


@pg.function
def unit(v: vec3) -> vec3:
    """`normalize` for vectors that are not near zero, by one division instead of three."""
    return v * inversesqrt(dot(v, v))


@pg.function
def facing_normal(packed: vec2, v: vec3) -> vec3:
    """Unpack a unit normal, turned toward the eye (unit direction) if it faces away from it."""
    n = unpack_normal(packed)
    cosine = dot(n, v)
    return n if cosine > SMALLEST_COSINE else unit(n + v * (TURNED_COSINE - cosine))


@pg.function
def linear_depth_step(frame: ViewFrame, n: vec3, ray: vec3, far: float, pixel: vec2) -> vec2:
    """Return the step of `linear_on_planes` of the depth on the plane through a pixel, to the right and down.

    In perspective it is dot(n, ray) / (dot(n, ray of the pixel) * far), in parallel views -n.xy · way / dot(n, ray).
    ``pixel`` is a pixel's width and height at distance 1.
    """
    step = vec2(n.x * pixel.x, -n.y * pixel.y) / (dot(n, ray) * (far if frame.perspective else -1.0))
    most = LARGEST_SHIFT * linear_on_planes(frame, far)
    return clamp(step, -most, most)


@pg.function
def shaped(visibility: float, power: float) -> float:
    """Raise a number in [0, 1] to a power, with float16 accuracy; ``**`` is accurate to the last bits of float32."""
    return exp2(power * log2(clamp(visibility, 1e-37, 1.0)))


@pg.function
def plane_step(frame: ViewFrame, packed: vec2, ray: vec3, far: float, pixel: vec2) -> vec2:
    """Return `linear_depth_step` of the `facing_normal`, whose length cancels out and need not be 1."""
    n = unpack_normal(packed)
    toward = -dot(n, ray)
    ray_squared = dot(ray, ray)
    ray_length = sqrt(ray_squared)
    turned = n - ray * ((TURNED_COSINE * ray_length - toward) / ray_squared)
    return linear_depth_step(frame, n if toward > SMALLEST_COSINE * ray_length else turned, ray, far, pixel)


@pg.kernel
def horizon_visibility(
    linear_depth: Image, normals: Image, frame: ViewFrame, radius: float, falloff: float, thickness: float,
    power: float, slices: Const[int], steps: Const[int], number: Image, is_moving: Const[bool],
) -> vec2:  # fmt: skip
    """Return the cosine-weighted fraction of ambient light that arrives (1 without a surface); and the linear depth."""
    linear = linear_depth[0, 0].r
    if linear <= 0.0:
        return vec2(1.0, 0.0)
    far = linear_on_planes(frame, linear)
    here = pixel()
    ray = line_of_sight(frame, uv())
    size = pixel_step(frame, output_size(), 1.0)
    pixel_width = size.y
    ray_length = length(ray)
    # from here to a tap of linear depth w along the line of sight, times `most / radius`: lift * (gain * w - same)
    lift = ray_length if frame.perspective else -1.0
    gain = far if frame.perspective else 1.0
    same = 1.0 if frame.perspective else far
    nothing = 0.0 if frame.perspective else FAR_AWAY
    v = -ray / ray_length
    n = facing_normal(normals[0, 0].zw, v)
    # a frame across the line of sight; v.z is above 0
    a = 1.0 / (1.0 + v.z)
    across = vec3(1.0 - v.x * v.x * a, -v.x * v.y * a, -v.x)
    along = vec3(-v.x * v.y * a, 1.0 - v.y * v.y * a, -v.y)
    n_v = dot(n, v)
    step_of_plane = linear_depth_step(frame, n, ray, far, size)
    reach_px = min(radius / (pixel_width * spread(frame, far)), float(output_size().x + output_size().y))
    full = 1.0 / falloff  # occluders nearer than radius * (1 - falloff) count in full
    noise = noise_of(number, is_moving)
    seen = 0.0
    unoccluded = 0.0
    for i in range(slices):
        angle = (float(i) + noise.x) * (PI / float(slices))
        d = across * cos(angle) + along * sin(angle)
        n_d = dot(n, d)
        bent = sqrt(n_d * n_d + n_v * n_v)  # length of the normal's part in the slice
        # the slice's direction on the screen
        screen = normalize(d.xy + ray.xy * d.z)
        toward = vec2(screen.x * (size.y / size.x), -screen.y)
        # movement per pixel toward the eye and across the line of sight, at distance 1
        toward_eye = dot(vec3(screen, 0.0), v) * pixel_width
        sideways = dot(vec3(screen, 0.0), d) * pixel_width
        lowest = [-n_d / bent, n_d / bent]
        cosines = [-n_d / bent, n_d / bent]
        for j in range(steps):
            t = (float(j) + noise.y) / float(steps)
            away = t * t * reach_px + 1.0
            at = toward * away
            nearest = floor(at + 0.5)
            tap = ivec2(nearest)
            # a texel's center is next to the slice: its depth is moved along the receiver's plane
            carried = dot(at - nearest, step_of_plane)
            for side in range(2):
                sign = 1 - 2 * side
                found = linear_depth.texel(here + tap * sign).r
                w = max(found + carried * float(sign) if found > 0.0 else nothing, 1e-20)
                # from the pixel to the tap, in perspective both times w, which cancels in cosines
                up = lift * (gain * w - same) + away * float(sign) * toward_eye
                off_slice = away * sideways
                squared = up * up + off_slice * off_slice
                # one division instead of two: by the distance, and of it by the radius
                most = radius * spread(frame, w)
                scale = 1.0 / (sqrt(max(squared, 1e-30)) * most)
                near = clamp((1.0 - squared * scale) * full, 0.0, 1.0)
                c = mix(lowest[side], up * most * scale, near)
                horizon = cosines[side]
                cosines[side] = c if c > horizon else mix(horizon, max(c, lowest[side]), thickness)
        # the arc's integral of cosine times sine, from the line of sight to each horizon
        c1, c2 = cosines[0], cosines[1]
        s1 = sqrt(max(1.0 - c1 * c1, 0.0))
        s2 = sqrt(max(1.0 - c2 * c2, 0.0))
        arc = acos(clamp(c1, -1.0, 1.0)) - c1 * s1 - acos(clamp(c2, -1.0, 1.0)) + c2 * s2
        seen += 0.5 * (n_v * (s1 * s1 + s2 * s2) + n_d * arc)
        unoccluded += n_v + n_d * atan(n_d, n_v)
    return vec2(shaped(seen / unoccluded, power), linear)


TURN = 2.0 * pi
#: Angle between successive points, so that no two are in line.
GOLDEN_ANGLE = pi * (3.0 - math.sqrt(5.0))


def hemisphere_points(count: int) -> tuple[tuple[float, float, float], ...]:
    """Return points of the unit hemisphere over z = 0, denser toward the pole (cosine) and toward the center.

    >>> [round(v, 3) for v in hemisphere_points(1)[0]]
    [0.177, 0.0, 0.177]
    """
    points = []
    for k in range(count):
        share = (k + 0.5) / count
        # radii in the order of bit-reversed numbers, so that they are not correlated with the height
        reach = _bit_reversed(k, count) ** 2
        flat = math.sqrt(share) * reach
        points.append(
            (flat * math.cos(k * GOLDEN_ANGLE), flat * math.sin(k * GOLDEN_ANGLE), math.sqrt(1.0 - share) * reach)
        )
    return tuple(points)


def _bit_reversed(k: int, count: int) -> float:
    """Return the k-th number of the van der Corput sequence in base 2, in the middle of its part of ]0, 1[."""
    value, scale = 0.0, 0.5
    while k:
        value += scale * (k & 1)
        k, scale = k >> 1, 0.5 * scale
    return value + 0.5 / (1 << max(count - 1, 0).bit_length() if count > 1 else 1)


@lru_cache(maxsize=16)
def hemisphere_visibility(taps: int) -> Any:
    """Return a kernel with this number of points built in."""
    points: Any = hemisphere_points(taps)  # vectors in the kernel

    @pg.kernel
    def visibility(
        linear_depth: Image, normals: Image, frame: ViewFrame, radius: float, bias: float, power: float,
        range_check: Const[bool], number: Image, is_moving: Const[bool],
    ) -> vec2:  # fmt: skip
        """Return the fraction of the points that is visible (1 without a surface); and the linear depth."""
        linear = linear_depth[0, 0].r
        if linear <= 0.0:
            return vec2(1.0, 0.0)
        far = linear_on_planes(frame, linear)
        ray = line_of_sight(frame, uv())
        n = facing_normal(normals[0, 0].zw, unit(-ray))
        step_of_plane = linear_depth_step(frame, n, ray, far, pixel_step(frame, output_size(), 1.0))
        noise = noise_of(number, is_moving)
        # a frame around the normal, rotated by the noise
        turn = vec2(cos(TURN * noise.x), sin(TURN * noise.x))
        start = vec3(turn, 0.0) if abs(n.z) > 0.7 else vec3(turn.x, 0.0, turn.y)
        t = unit(start - n * dot(n, start))
        b = cross(n, t)
        # x and y in pixels from this one, z unscaled: for the pixel's own position and for the frame
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
            # behind the eye nothing is visible
            share = 1.0 / spread(frame, max(away, 1e-6 * far))
            at = (middle * spread(frame, far) + t_px * p.x + b_px * p.y + n_px * p.z) * share - middle
            tap = floor(at + 0.5)
            # the texel's center is next to the point: its depth is moved along the receiver's plane
            found = linear_depth.texel(pixel() + ivec2(tap)).r
            w = max(found + dot(at - tap, step_of_plane), 1e-20)
            seen = linear_on_planes(frame, w) if found > 0.0 else FAR_AWAY  # the depth there
            near = 1.0
            if range_check:
                near = clamp(2.0 - abs(far - seen) * per_radius, 0.0, 1.0)
            hidden += near if seen < away - least else 0.0
        return vec2(shaped(1.0 - hidden / float(taps), power), linear)

    return visibility
