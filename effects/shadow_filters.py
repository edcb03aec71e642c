"""Shadow lookups without a blur on the screen: one comparison, several in the map, or as wide as the light asks.

Every tap compares one texel with the depth that the receiver's own plane has there, so that wide filters do
not need a larger offset than narrow ones.
"""

# mypy: disable-error-code="no-any-return"
# Values of the kernel language are Any to Python's type checkers.
from __future__ import annotations

from functools import lru_cache
from math import cos, pi, sin, sqrt
from typing import Any, Literal

import passgraph as pg
from passgraph import Image, dot, floor, ivec2, length, normalize, vec2, vec3, vec4
from passgraph.effects.shadow_map import NOTHING
from passgraph.effects.views import LightFrame

ShadowFilter = Literal["blur", "hard", "pcf", "disc", "pcss"]
SHADOW_FILTERS: tuple[ShadowFilter, ...] = ("blur", "hard", "pcf", "disc", "pcss")
#: A caster nearer to the receiver than this many texels does not count: where two surfaces meet in a hollow
#: edge, the texels of one lie before the other. Thin cards lose as much of the shadow at their foot, solid
#: bodies nothing.
DEPTH_SLACK_TEXELS = 1.5
#: A tap counts only for casters nearer to the light by more than its own distance times this: what lies
#: outside that cone could only shadow the receiver under a light wider than 90 degrees, and is most often the
#: next wall of a room.
CONE_SLOPE = 1.0
#: Normals are packed as half floats; a plane's slope is this uncertain, divided by the cosine of the light.
NORMAL_ROUNDING = 2.0**-10
#: No filter reads farther than this share of the map's width: taps would lie too far apart to find casters.
FARTHEST = 0.5


@pg.struct
class Receiver:
    """A point of a surface as its shadow map sees it."""

    place: vec2  # in the map, in texels
    depth: float  # along the light's axis, scene units
    slope: vec2  # of its plane, a texel: of the depth in parallel maps, of 1 / depth in perspective ones
    texel: float  # width of a texel at its depth, scene units
    slack: float  # scene units
    farthest: float  # that a filter reaches, texels
    share: float  # 0 facing away, 1 where no filter reaches the map, -1 where casters decide


@pg.function
def toward_light(light: LightFrame, position: vec3, kind: int) -> vec3:
    """Unit direction to the light."""
    return light.place if kind == 0 else normalize(light.place - position)


@pg.function
def across(n: vec3, row: vec3, axis: vec3) -> float:
    """How much of ``n`` one unit of a clip space coordinate moves along, at depth 1."""
    flat = row - axis * dot(row, axis)
    return dot(n, flat) / max(dot(flat, flat), 1e-30)


@pg.function
def receiver_at(map: Image, light: LightFrame, position: vec3, surface: vec3, lift: float, kind: int) -> Receiver:
    """Where a point lies in the map, and how its plane slopes there.

    On the plane n·(x - L) = k, seen from L along d (A + u B + v C), 1/d is linear in u and v; in a parallel
    map d itself is.
    """
    nowhere = vec2(0.0)
    if dot(surface, toward_light(light, position, kind)) <= 0.0:
        return Receiver(nowhere, 0.0, nowhere, 0.0, 0.0, 0.0, 0.0)
    lifted = vec4(position + surface * lift, 1.0)
    m = light.map_from_view
    clip = m * lifted
    if clip.w <= 0.0:
        return Receiver(nowhere, 0.0, nowhere, 0.0, 0.0, 0.0, 1.0)
    size = vec2(map.size)
    place = vec2(0.5 + 0.5 * clip.x / clip.w, 0.5 - 0.5 * clip.y / clip.w) * size
    outside = max(max(-place.x, -place.y), max(place.x - size.x, place.y - size.y))
    if outside > FARTHEST * size.x:
        return Receiver(nowhere, 0.0, nowhere, 0.0, 0.0, 0.0, 1.0)
    axis = light.depth_row.xyz
    depth = dot(light.depth_row, lifted)
    texel = light.texel if kind == 0 else light.texel * depth
    plane = dot(surface, axis) if kind == 0 else dot(surface, lifted.xyz - light.place)
    plane = min(plane, -1e-6) if kind == 0 else min(plane, -1e-6 * depth)
    u = across(surface, vec3(m[0].x, m[1].x, m[2].x), axis)
    v = across(surface, vec3(m[0].y, m[1].y, m[2].y), axis)
    step = 2.0 / size
    sure = 1.0 + NORMAL_ROUNDING / max(-dot(surface, axis), 1e-3)
    slope = vec2(u * step.x, -v * step.y) * (sure / plane)
    if kind == 0:
        slope = -slope
    slack = light.bias + DEPTH_SLACK_TEXELS * texel
    return Receiver(place, depth, slope, texel, slack, FARTHEST * size.x, -1.0)


@pg.function
def caster_at(map: Image, receiver: Receiver, offset: vec2, kind: int, face: int) -> float:
    """Depth of the caster before the receiver, so many texels beside it; NOTHING where there is none.

    Beyond the border of a map there is no caster; beyond that of a cube's face the nearest texel counts.
    """
    texel = floor(receiver.place + offset)
    away = texel + 0.5 - receiver.place
    plane = receiver.depth + dot(receiver.slope, away)
    if kind != 0:
        plane = 1.0 / max(1.0 / receiver.depth + dot(receiver.slope, away), 1e-20)
    limit = min(plane, receiver.depth) - CONE_SLOPE * receiver.texel * length(away) - receiver.slack
    size = vec2(map.size)
    inside = face >= 0 or (texel.x >= 0.0 and texel.y >= 0.0 and texel.x < size.x and texel.y < size.y)
    found = map.texel(ivec2(texel)).r
    return found if inside and found < limit else NOTHING


@pg.function
def mean_of(lit: float, taps: int) -> float:
    """A share of taps; exactly 1 where all of them are lit."""
    return lit / float(taps) if lit < float(taps) else 1.0


@pg.function
def reach_texels(light: LightFrame, receiver: Receiver, caster: float, kind: int) -> float:
    """Radius of the light's image on the receiver through a point at the caster's depth."""
    far = receiver.depth - caster if kind == 0 else (receiver.depth - caster) / max(caster, 1e-20)
    return min(light.radius * max(far, 0.0) / receiver.texel, receiver.farthest)


def vogel_disc(taps: int) -> tuple[tuple[float, float], ...]:
    """Points spread evenly over a disc of radius 1.

    Source: H. Vogel, "A better way to construct the sunflower head", 1979.

    >>> vogel_disc(1)
    ((0.0, 0.0),)
    """
    if taps == 1:
        return ((0.0, 0.0),)
    turn = pi * (3.0 - sqrt(5.0))
    radii = [sqrt((i + 0.5) / taps) for i in range(taps)]
    return tuple((r * cos(i * turn), r * sin(i * turn)) for i, r in enumerate(radii))


@lru_cache(maxsize=64)
def lookup(shadow_filter: ShadowFilter, pcf_size: int, taps: int) -> Any:
    """The kernel function of a filter: the share of the light that arrives, 0 to 1.

    Parameters
    ----------
    shadow_filter : "hard", "pcf", "disc" or "pcss", see `passgraph.effects.soft_shadow.soft_shadow`
    pcf_size : texels along each side of "pcf", odd
    taps : of "disc" and of each of the two steps of "pcss"
    """
    if shadow_filter == "disc":
        return _disc(taps)
    if shadow_filter == "pcss":
        return _pcss(taps)
    return _square(1 if shadow_filter == "hard" else pcf_size)


def _square(side: int) -> Any:
    half = side // 2

    @pg.function
    def square(
        map: Image, light: LightFrame, position: vec3, surface: vec3, lift: float, width: float, kind: int, face: int
    ) -> float:
        """side × side comparisons, the mean of them.

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

    return square


def _disc(taps: int) -> Any:
    places: Any = vogel_disc(taps)

    @pg.function
    def disc(
        map: Image, light: LightFrame, position: vec3, surface: vec3, lift: float, width: float, kind: int, face: int
    ) -> float:
        """Comparisons spread over a disc of ``width`` scene units."""
        receiver = receiver_at(map, light, position, surface, lift, kind)
        if receiver.share >= 0.0:
            return receiver.share
        reach = min(width / receiver.texel, receiver.farthest)
        lit = 0.0
        for i in range(taps):
            lit += 1.0 if caster_at(map, receiver, places[i] * reach, kind, face) >= NOTHING else 0.0
        return mean_of(lit, taps)

    return disc


def _pcss(taps: int) -> Any:
    places: Any = vogel_disc(taps)

    @pg.function
    def pcss(
        map: Image, light: LightFrame, position: vec3, surface: vec3, lift: float, width: float, kind: int, face: int
    ) -> float:
        """Comparisons over as much of the map as the light's size and the casters' mean depth make a penumbra.

        Source: R. Fernando, "Percentage-Closer Soft Shadows", 2005.
        """
        receiver = receiver_at(map, light, position, surface, lift, kind)
        if receiver.share >= 0.0:
            return receiver.share
        search = reach_texels(light, receiver, light.near, kind)
        total = 0.0
        count = 0.0
        for i in range(taps):
            caster = caster_at(map, receiver, places[i] * search, kind, face)
            if caster < NOTHING:
                total += caster
                count += 1.0
        if count == 0.0:
            return 1.0
        reach = reach_texels(light, receiver, total / count, kind)
        lit = 0.0
        for i in range(taps):
            lit += 1.0 if caster_at(map, receiver, places[i] * reach, kind, face) >= NOTHING else 0.0
        return mean_of(lit, taps)

    return pcss
