"""Filters around the search for occlusion: half resolution before it, blur and upsampling after it."""

# mypy: disable-error-code="no-any-return"
# Values of the kernel language are Any to Python's type checkers.
from __future__ import annotations

from typing import Any

import passgraph as pg
from passgraph.effects.ambient.occlusion_search import plane_step
from passgraph.effects.surfaces.geometry import ViewFrame, line_of_sight, linear_on_planes, pixel_step, spread
from passgraph.language import Const, Image, dot, ivec2, output_size, pixel, uv, vec2, vec4

#: The weight of a tap falls with its distance from the receiver's plane, to 0 at this fraction of the radius.
OFF_PLANE = 0.25
#: Least tolerance: the depth that this many pixels span.
OFF_PLANE_PX = 2.0


@pg.function
def sharpness(frame: ViewFrame, far: float, radius: float, pixel_width: float) -> float:
    """Return the factor that maps a depth difference at the edge limit to 1."""
    wide = spread(frame, far)
    return wide * wide / max(OFF_PLANE * radius, OFF_PLANE_PX * pixel_width * wide)


@pg.kernel
def linearised(depth: Image, frame: ViewFrame) -> float:
    """Return `linear_on_planes` of a depth picture."""
    return linear_on_planes(frame, depth[0, 0].r)


@pg.kernel
def linearised_half(depth: Image, normals: Image, frame: ViewFrame) -> tuple[float, vec4]:
    """Return every other pixel of every other row; a mean of depths would not be on any surface."""
    p = pixel() * 2
    return linear_on_planes(frame, depth.texel(p).r), normals.texel(p)


@pg.function
def along_plane(frame: ViewFrame, packed: vec2, linear: float, radius: float, dx: int, dy: int) -> vec2:
    """Return by how much `linear_on_planes` grows per pixel on the plane through this one, and the `sharpness`."""
    far = linear_on_planes(frame, linear)
    size = pixel_step(frame, output_size(), 1.0)
    step = plane_step(frame, packed, line_of_sight(frame, uv()), far, size)
    return vec2(step.x * float(dx) + step.y * float(dy), sharpness(frame, far, radius, size.y))


@pg.kernel
def denoise(mask: Image, normals: Image, frame: ViewFrame, radius: float, dx: Const[int], dy: Const[int]) -> vec2:
    """Average over one period of the noise along a row or column, for taps on the plane through the center.

    The mask holds visibility and linear depth, so a tap is one read.  The weights 1/2, 1, 1, 1, 1/2 take each remainder
    modulo 4 once.
    """
    here = mask[0, 0].rg
    if here.y <= 0.0:
        return here
    plane = along_plane(frame, normals[0, 0].zw, here.y, radius, dx, dy)
    total = here.x
    weight = 1.0
    for i in range(1, 3):
        window = 1.0 if i == 1 else 0.5
        for side in range(2):
            s = i - 2 * i * side
            tap = mask[s * dx, s * dy].rg
            w = window * max(1.0 - abs(tap.y - here.y - plane.x * float(s)) * plane.y, 0.0)
            total += tap.x * w
            weight += w
    return vec2(total / weight, here.y)


@pg.kernel
def denoise_light(
    light: Image, linear_depth: Image, normals: Image, frame: ViewFrame, radius: float, dx: Const[int], dy: Const[int]
) -> vec4:
    """`denoise` for pictures of four channels, whose linear depth is another picture."""
    total, linear = light[0, 0], linear_depth[0, 0].r
    if linear <= 0.0:
        return total
    plane = along_plane(frame, normals[0, 0].zw, linear, radius, dx, dy)
    weight = 1.0
    for i in range(1, 3):
        window = 1.0 if i == 1 else 0.5
        for side in range(2):
            s = i - 2 * i * side
            off = linear_depth[s * dx, s * dy].r - linear - plane.x * float(s)
            w = window * max(1.0 - abs(off) * plane.y, 0.0)
            total += light[s * dx, s * dy] * w
            weight += w
    return total / weight


def denoised_light(
    light: pg.Target, depth: pg.Target, normals: pg.Target, frame: Any, radius: Any, name: str
) -> pg.Target:
    """Return a picture of four channels, averaged over one period of the noise along both axes by `denoise_light`."""
    linear = linearised(depth, frame, into=pg.target(f"{name}_linear_depth", "r32f", like=depth))
    for axis, direction in (("x", (1, 0)), ("y", (0, 1))):
        label = f"{name}_denoised_{axis}"
        into = pg.target(label, "rgba32f", like=light)
        light = denoise_light(light, linear, normals, frame, radius, *direction, into=into, name=label)
    return light


@pg.kernel
def enlarge(mask: Image, depth: Image, normals: Image, frame: ViewFrame, radius: float) -> float:
    """Upsample from half the size: bilinear, without the pixels off the plane through the center."""
    far = depth[0, 0].r
    if far <= 0.0:
        return 1.0
    p = pixel()
    size = pixel_step(frame, output_size(), 1.0)
    step = plane_step(frame, normals[0, 0].zw, line_of_sight(frame, uv()), far, size)
    scale = sharpness(frame, far, radius, size.y)
    linear = linear_on_planes(frame, far)
    total = 0.0
    weight = 0.0
    closest = 1.0
    least = 1e38
    for k in range(4):
        place = ivec2((p.x >> 1) + (k & 1), (p.y >> 1) + (k >> 1))
        # in full pixels; an even one is at a tap, an odd one between two
        away = vec2(place * 2 - p)
        window = max(1.0 - abs(away.x) * 0.5, 0.0) * max(1.0 - abs(away.y) * 0.5, 0.0)
        tap = mask.texel(place).rg
        off = abs(tap.y - linear - dot(step, away)) * scale
        if window > 0.0 and off < least:
            closest = tap.x
            least = off
        w = window * max(1.0 - off, 0.0)
        total += tap.x * w
        weight += w
    # if no tap fits, the best one
    return total / weight if weight > 1e-3 else closest
