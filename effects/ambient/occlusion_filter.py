"""What stands before and behind the search for occlusion: half the size, a blur over its noise, full size again."""

# mypy: disable-error-code="no-any-return"
# Values of the kernel language are Any to Python's type checkers.
from __future__ import annotations

import passgraph as pg
from passgraph import Const, Image, dot, ivec2, output_size, pixel, vec2, vec3, vec4
from passgraph.effects.ambient.horizon_occlusion import plane_step
from passgraph.effects.surfaces.geometry import pack_normal, view_ray

#: A tap counts less the farther it lies off the receiver's plane, and not at all at this share of the radius.
OFF_PLANE = 0.25
#: Nor is it left out for less than the depth that this many pixels are wide.
OFF_PLANE_PX = 2.0


@pg.function
def rise(far: float, z: float) -> float:
    """1 / z - 1 / far without cancellation; where there is no surface, so much that it fits no plane."""
    return (far - z) / (far * z) if z > 0.0 else 1e30


@pg.function
def flatter(ahead: float, behind: float) -> float:
    """The smaller slope of two: that of the surface which a pixel lies on, at an edge of it."""
    return ahead if abs(ahead) < abs(behind) else behind


@pg.function
def sharpness(far: float, radius: float, pixel_width: float) -> float:
    """What a difference of inverse depths is multiplied by, so that 1 is too much."""
    return far * far / max(OFF_PLANE * radius, OFF_PLANE_PX * pixel_width * far)


@pg.kernel
def normals_of_depth(depth: Image, tan_half: vec2) -> vec4:
    """Normals of the surfaces that a depth picture shows, packed as in the G-buffer."""
    far = depth[0, 0].r
    if far <= 0.0:
        return vec4(0.0)
    # 1 / depth is linear over the picture on any plane: its value and its steps are the plane
    step = 2.0 * tan_half / vec2(output_size())
    right = flatter(rise(far, depth[1, 0].r), -rise(far, depth[-1, 0].r)) / step.x
    down = flatter(rise(far, depth[0, 1].r), -rise(far, depth[0, -1].r)) / step.y
    ray = view_ray(tan_half)
    # packing takes any length
    packed = pack_normal(vec3(-right, down, 1.0 / far - right * ray.x + down * ray.y))
    return vec4(packed, packed)


@pg.kernel
def invert(depth: Image) -> float:
    """1 / depth, 0 where there is no surface: linear over the picture on any plane."""
    z = depth[0, 0].r
    return 1.0 / z if z > 0.0 else 0.0


@pg.kernel
def invert_half(depth: Image, normals: Image) -> tuple[float, vec4]:
    """Every other pixel of every other row: a mean of depths would lie on no surface."""
    p = pixel() * 2
    z = depth.texel(p).r
    return 1.0 / z if z > 0.0 else 0.0, normals.texel(p)


@pg.kernel
def denoise(mask: Image, normals: Image, tan_half: vec2, radius: float, dx: Const[int], dy: Const[int]) -> vec2:
    """The mean over one pattern of the noise along a row or column, of taps on the plane through the centre.

    The mask holds visibility and 1 / depth, so that a tap is one read.  The weights 1/2, 1, 1, 1, 1/2 take each
    remainder modulo 4 once.
    """
    here = mask[0, 0].rg
    if here.y <= 0.0:
        return here
    far = 1.0 / here.y
    pixel_width = 2.0 * tan_half.y / float(output_size().y)
    step = plane_step(normals[0, 0].zw, view_ray(tan_half), far, pixel_width)
    slope = step.x * float(dx) + step.y * float(dy)
    scale = sharpness(far, radius, pixel_width)
    total = here.x
    weight = 1.0
    for i in range(1, 3):
        window = 1.0 if i == 1 else 0.5
        for side in range(2):
            s = i - 2 * i * side
            tap = mask[s * dx, s * dy].rg
            w = window * max(1.0 - abs(tap.y - here.y - slope * float(s)) * scale, 0.0)
            total += tap.x * w
            weight += w
    return vec2(total / weight, here.y)


@pg.kernel
def enlarge(mask: Image, depth: Image, normals: Image, tan_half: vec2, radius: float) -> float:
    """Full size from half the size: bilinear, without the pixels that lie off the plane through the centre."""
    far = depth[0, 0].r
    if far <= 0.0:
        return 1.0
    p = pixel()
    pixel_width = 2.0 * tan_half.y / float(output_size().y)
    step = plane_step(normals[0, 0].zw, view_ray(tan_half), far, pixel_width)
    scale = sharpness(far, radius, pixel_width)
    total = 0.0
    weight = 0.0
    closest = 1.0
    least = 1e38
    for k in range(4):
        place = ivec2((p.x >> 1) + (k & 1), (p.y >> 1) + (k >> 1))
        # in full pixels; an even one lies on its own tap, an odd one between two
        away = vec2(place * 2 - p)
        window = max(1.0 - abs(away.x) * 0.5, 0.0) * max(1.0 - abs(away.y) * 0.5, 0.0)
        tap = mask.texel(place).rg
        off = abs(tap.y - 1.0 / far - dot(step, away)) * scale
        if window > 0.0 and off < least:
            closest = tap.x
            least = off
        w = window * max(1.0 - off, 0.0)
        total += tap.x * w
        weight += w
    # where nothing fits, what fits best
    return total / weight if weight > 1e-3 else closest
