"""Shadow lookups in a depth map: one comparison, several, or a disc as wide as the light requires.

Every tap of a filter compares one texel with the depth of the receiver's own plane there, so that wide filters need no
larger offset than narrow ones.
"""

# mypy: disable-error-code="no-any-return"
# Values of the kernel language are Any to Python's type checkers.
from __future__ import annotations

import math
from math import cos, pi, sin
from typing import Any

import passgraph as pg
from passgraph.effects.shadows.shadow_map import NOTHING
from passgraph.effects.surfaces.views import LightFrame
from passgraph.language import Image, cross, dot, floor, ivec2, length, normalize, sqrt, vec2, vec3, vec4

#: Offset of a receiver along its normal for "blur", in texels and times the part of the normal in the map's plane.  On
#: the plane n·p = -k, a lookup at q texels' distance (in scene units at the receiver's depth) meets the plane at a
#: depth that an offset of q * |n in the map's plane| along n compensates, in parallel and in perspective maps alike;
#: the four texels of a lookup are up to sqrt(2) texels away, and the rest is for vertices rounded to 1/256 texel.  So a
#: plane never shadows itself, at any angle.
NORMAL_OFFSET_TEXELS = 1.5
#: A caster nearer to the receiver than this many texels does not count: where two surfaces meet in a concave edge, the
#: texels of one are in front of the other. Thin cards lose as much of the shadow at their foot, solid bodies nothing.
DEPTH_SLACK_TEXELS = 1.5
#: A tap counts only for casters nearer to the light by more than its own distance times this: casters outside of that
#: cone could only shadow the receiver under a light wider than 90 degrees, and are most often the next wall of a room.
CONE_SLOPE = 1.0
#: Uncertainty of a plane's slope from half-float normals, before division by the cosine of the light.
NORMAL_ROUNDING = 2.0**-10
#: Largest reach of a filter as a fraction of the map's width: beyond it taps would be too far apart to find casters.
FARTHEST = 0.5


@pg.struct
class FilterFrame:
    """Run values of a filter; fields from ``near`` on are for maps of moments."""

    width: float  # half width of edges, scene units
    bleed: float  # fractions of light up to this count as 0
    exponent: float  # of the warp of exponential moments
    near: float  # depth that counts as -1, scene units
    scale: float  # scale from depths to -1 … 1, per scene unit
    radius: float  # half width of the map's blur, texels
    block: int  # texels to each side of the center in the means that the blur combines


@pg.struct
class Receiver:
    """A point of a surface in its shadow map."""

    place: vec2  # position in the map, in texels
    depth: float  # along the light's axis, scene units
    slope: vec2  # slope of its plane per texel: of the depth in parallel maps, of 1 / depth in perspective ones
    texel: float  # width of a texel at its position and depth, the larger of both sides, scene units
    right: vec2  # texels per scene unit across the light's axis
    above: vec2  # and per unit across both that and the light's axis
    slack: float  # scene units
    farthest: float  # farthest reach of a filter, scene units
    share: float  # 0 facing away, 1 where no filter reaches the map, -1 where casters decide


@pg.function
def toward_light(light: LightFrame, position: vec3, kind: int) -> vec3:
    """Return the unit direction to the light."""
    return light.place if kind == 0 else normalize(light.place - position)


@pg.function
def nowhere(share: float) -> Receiver:
    """Return a receiver that no caster affects."""
    none = vec2(0.0)
    return Receiver(none, 0.0, none, 0.0, none, none, 0.0, 0.0, share)


@pg.function
def flat(row: vec3, axis: vec3) -> vec3:
    """Return the part of a direction perpendicular to the light's axis."""
    return row - axis * dot(row, axis)


@pg.function
def receiver_at(map: Image, light: LightFrame, position: vec3, surface: vec3, lift: float, kind: int) -> Receiver:
    """Return a point's place in the map, the size of a texel there, and the slope of the point's plane.

    On the plane n·(x - L) = k, seen from L along d (A + u B + v C), 1/d is linear in u and v; in a parallel map a texel
    is an offset across the axis, and d changes over it such that n·x stays constant. A parallel map may be drawn in
    perspective across its own plane, so that texels differ in size; taps use the size at the receiver.
    """
    if dot(surface, toward_light(light, position, kind)) <= 0.0:
        return nowhere(0.0)
    lifted = vec4(position + surface * lift, 1.0)
    m = light.map_from_view
    clip = m * lifted
    if clip.w <= 0.0:
        return nowhere(1.0)
    size = vec2(map.size)
    ndc = clip.xy / clip.w
    place = vec2(0.5 + 0.5 * ndc.x, 0.5 - 0.5 * ndc.y) * size
    outside = max(max(-place.x, -place.y), max(place.x - size.x, place.y - size.y))
    if outside > FARTHEST * size.x:
        return nowhere(1.0)
    axis = light.depth_row.xyz
    depth = dot(light.depth_row, lifted)
    # texels per scene unit, to the right and downwards, as directions across the axis
    u_row, v_row = flat(vec3(m[0].x, m[1].x, m[2].x), axis), flat(vec3(m[0].y, m[1].y, m[2].y), axis)
    w_row = flat(vec3(m[0].w, m[1].w, m[2].w), axis)
    u = (u_row - w_row * ndc.x) * (0.5 * size.x / clip.w)
    v = (v_row - w_row * ndc.y) * (-0.5 * size.y / clip.w)
    long = max(length(u), 1e-20)
    first = u / long
    second = cross(axis, first)
    right, above = vec2(long, dot(v, first)), vec2(0.0, dot(v, second))
    # and the offset of a texel across the axis
    tall = above.y if abs(above.y) > 1e-20 else 1e-20
    over = first / long - second * (right.y / (long * tall))
    down = second / tall
    texel = max(length(over), length(down))
    sure = 1.0 + NORMAL_ROUNDING / max(-dot(surface, axis), 1e-3)
    slope = vec2(0.0)
    if kind == 0:
        slope = vec2(dot(surface, over), dot(surface, down)) * (sure / max(-dot(surface, axis), 1e-6))
    else:
        # 1 / d at the neighboring texel, along the plane: d n·(axis + offset / d) is the same there
        plane = min(dot(surface, lifted.xyz - light.place), -1e-6 * depth)
        slope = vec2(dot(surface, over), dot(surface, down)) * (sure / (plane * depth))
    slack = light.bias + DEPTH_SLACK_TEXELS * texel
    return Receiver(
        place, depth, slope, texel, right, above, slack, FARTHEST * size.x * min(length(over), length(down)), -1.0
    )


@pg.function
def at_offset(receiver: Receiver, offset: vec2) -> vec2:
    """Convert an offset across the light's axis from scene units to texels of the map."""
    return receiver.right * offset.x + receiver.above * offset.y


@pg.function
def limit_at(receiver: Receiver, away: vec2, kind: int) -> float:
    """Return the depth limit of a caster in a texel whose center is at an offset from the receiver, in texels."""
    plane = receiver.depth + dot(receiver.slope, away)
    if kind != 0:
        plane = 1.0 / max(1.0 / receiver.depth + dot(receiver.slope, away), 1e-20)
    return min(plane, receiver.depth) - CONE_SLOPE * receiver.texel * length(away) - receiver.slack


@pg.function
def caster_at(map: Image, receiver: Receiver, offset: vec2, kind: int, face: int) -> float:
    """Return the depth of the caster in front of the receiver at an offset in texels; NOTHING if there is none.

    Beyond the border of a map there is no caster; beyond that of a cube's face the nearest texel counts.
    """
    texel = floor(receiver.place + offset)
    limit = limit_at(receiver, texel + 0.5 - receiver.place, kind)
    size = vec2(map.size)
    inside = face >= 0 or (texel.x >= 0.0 and texel.y >= 0.0 and texel.x < size.x and texel.y < size.y)
    found = map.texel(ivec2(texel)).r
    return found if inside and found < limit else NOTHING


@pg.function
def mean_of(lit: float, taps: int) -> float:
    """Return a fraction of taps; exactly 1 if all of them are lit."""
    return lit / float(taps) if lit < float(taps) else 1.0


@pg.function
def reach_of(light: LightFrame, receiver: Receiver, caster: float, kind: int) -> float:
    """Return the radius of the light's image on the receiver through a point at the caster's depth, scene units."""
    far = receiver.depth - caster if kind == 0 else (receiver.depth - caster) / max(caster, 1e-20)
    return min(light.radius * max(far, 0.0), receiver.farthest)


def vogel_disc(taps: int) -> tuple[tuple[float, float], ...]:
    """Return points spread uniformly over a disc of radius 1.

    Source: H. Vogel, "A better way to construct the sunflower head", 1979.

    >>> vogel_disc(1)
    ((0.0, 0.0),)
    """
    if taps == 1:
        return ((0.0, 0.0),)
    turn = pi * (3.0 - math.sqrt(5.0))
    radii = [math.sqrt((i + 0.5) / taps) for i in range(taps)]
    return tuple((r * cos(i * turn), r * sin(i * turn)) for i, r in enumerate(radii))


@pg.function
def bilinear(
    map: Image,
    nearest: Image,
    light: LightFrame,
    position: vec3,
    surface: vec3,
    lift: float,
    by: FilterFrame,
    kind: int,
    face: int,
) -> float:
    """Return the fraction of four texels (bilinear weights) without a caster in front of the receiver; 1 outside the
    map.

    Source: W. Reeves et al., "Rendering Antialiased Shadows with Depth Maps", 1987; the normal offset after
    D. Holbert, "Saying Goodbye to Shadow Acne", GDC 2011, with the derivation at NORMAL_OFFSET_TEXELS.
    """
    if dot(surface, toward_light(light, position, kind)) <= 0.0:
        return 0.0
    along = dot(surface, light.depth_row.xyz)
    depth = dot(light.depth_row, vec4(position, 1.0))
    texel = light.texel if kind == 0 else light.texel * max(depth, 0.0)
    offset = NORMAL_OFFSET_TEXELS * texel * sqrt(max(1.0 - along * along, 0.0)) + lift
    lifted = vec4(position + surface * offset, 1.0)
    clip = light.map_from_view * lifted
    if clip.w <= 0.0:
        return 1.0
    at = vec2(0.5 + 0.5 * clip.x / clip.w, 0.5 - 0.5 * clip.y / clip.w)
    if at.x < 0.0 or at.x > 1.0 or at.y < 0.0 or at.y > 1.0:
        return 1.0
    limit = dot(light.depth_row, lifted) - light.bias - DEPTH_SLACK_TEXELS * texel
    p = at * vec2(map.size) - 0.5
    corner = floor(p)
    f = p - corner
    first = ivec2(corner)
    a = 1.0 if map.texel(first).r >= limit else 0.0
    b = 1.0 if map.texel(first + ivec2(1, 0)).r >= limit else 0.0
    c = 1.0 if map.texel(first + ivec2(0, 1)).r >= limit else 0.0
    d = 1.0 if map.texel(first + ivec2(1, 1)).r >= limit else 0.0
    top = a + (b - a) * f.x
    bottom = c + (d - c) * f.x
    return top + (bottom - top) * f.y


def square(side: int) -> Any:
    """Return the lookup of "pcf" with ``side`` texels along each side, odd; of "hard" with 1."""
    half = side // 2

    @pg.function
    def mean_of_square(
        map: Image,
        nearest: Image,
        light: LightFrame,
        position: vec3,
        surface: vec3,
        lift: float,
        by: FilterFrame,
        kind: int,
        face: int,
    ) -> float:
        """Average side × side comparisons.

        Source: W. Reeves et al., "Rendering Antialiased Shadows with Depth Maps", 1987.
        """
        receiver = receiver_at(map, light, position, surface, lift, kind)
        if receiver.share >= 0.0:
            return receiver.share
        lit = 0.0
        for y in range(-half, half + 1):
            for x in range(-half, half + 1):
                lit += 1.0 if caster_at(map, receiver, vec2(x, y), kind, face) >= NOTHING else 0.0
        return mean_of(lit, side * side)

    return mean_of_square


def disc(taps: int) -> Any:
    """Return the lookup of "disc"."""
    places: Any = vogel_disc(taps)

    @pg.function
    def mean_of_disc(
        map: Image,
        nearest: Image,
        light: LightFrame,
        position: vec3,
        surface: vec3,
        lift: float,
        by: FilterFrame,
        kind: int,
        face: int,
    ) -> float:
        """Average comparisons spread over a disc of ``by.width`` scene units."""
        receiver = receiver_at(map, light, position, surface, lift, kind)
        if receiver.share >= 0.0:
            return receiver.share
        reach = min(by.width, receiver.farthest)
        lit = 0.0
        for i in range(taps):
            lit += (
                1.0 if caster_at(map, receiver, at_offset(receiver, places[i] * reach), kind, face) >= NOTHING else 0.0
            )
        return mean_of(lit, taps)

    return mean_of_disc
