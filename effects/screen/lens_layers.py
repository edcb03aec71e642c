"""Kernels of depth of field: a picture in layers behind and before the plane of focus, gathered over the aperture."""

# mypy: disable-error-code="no-any-return"
# Values of the kernel language are Any to Python's type checkers.
from __future__ import annotations

from functools import lru_cache
from math import sqrt as _sqrt
from typing import Any

import passgraph as pg
from passgraph import Image, clamp, floor, ivec2, mix, output_size, pixel, smoothstep, sqrt, vec2, vec3, vec4
from passgraph.effects.screen.aperture import aperture_places

#: Half the size: blurred pictures have no detail that they would lose by it.
HALF = 0.5
#: Half-size pixels along a tile, whose widest blur is known.
TILE = 8
#: Places of the second pass over each layer, and how far it reaches, in ways between the taps of the first.
FILL_TAPS, FILL_GAPS = 8, 2.0
#: Largest half float: brighter light is not blurred as what it is.
BRIGHTEST = 65504.0
#: Radii, px: up to the first blurs are gathered at full size, from the second on at half size, between as both.
SMALL, LARGE = 2.0, 4.0
#: How far blurs at full size reach, px.
WINDOW = 2


@pg.kernel
def circle(depth: Image, blur: vec2, widest: float) -> float:
    """The radius by which each pixel is blurred, px, negative before the plane of focus; nothing drawn is far away."""
    z = depth[0, 0].r
    nearness = 1.0 / z if z > 0.0 else 0.0
    return clamp((blur.x - blur.y * nearness) * float(output_size().y), -widest, widest)


@pg.function
def nearer(radius: float) -> float:
    """The share in which a pixel counts as one of the layer before the plane of focus."""
    return smoothstep(SMALL, LARGE, -radius)


@pg.function
def disc(radius: float, away: float) -> float:
    """How bright a point, blurred to a disc of this radius, is so far away from its middle; even but for the rim."""
    least = max(radius, 0.5)
    return clamp(radius - away + 0.5, 0.0, 1.0) / (least * least)


@pg.kernel
def blurred_a_little(color: Image, circles: Image) -> vec4:
    """Blurs of a few pixels, gathered at full size: pixels as far as they reach, and no farther than what they hide."""
    here = circles[0, 0].r
    total, weight = vec3(0.0), 0.0
    for y in range(-WINDOW, WINDOW + 1):
        for x in range(-WINDOW, WINDOW + 1):
            there = circles[x, y].r
            # what lies behind this pixel is seen around it as far as this pixel itself is blurred
            own = min(abs(there), abs(here)) if there > here else abs(there)
            seen = disc(min(own, SMALL), sqrt(float(x * x + y * y))) * (1.0 - nearer(there))
            total += min(vec3(BRIGHTEST), max(vec3(0.0), color[x, y].rgb)) * seen
            weight += seen
    return vec4(total / weight if weight > 0.0 else color[0, 0].rgb, color[0, 0].a)


@pg.kernel
def halved(color: Image, circles: Image) -> tuple[vec4, vec4, float]:
    """Half the size, two layers: what is in focus or behind, with its radius, and what is before it, with its share.

    Radii are of half-size pixels; of the farther layer -1 where there is none.  Of several distances each layer keeps
    one side of: the farthest, and the nearest.
    """
    first = 2 * pixel()
    far, near = -1.0, 0.0
    for y in range(2):
        for x in range(2):
            r = circles.texel(first + ivec2(x, y)).r
            near = max(near, -r if nearer(r) > 0.0 else 0.0)
            if nearer(r) < 0.5:
                far = max(far, r, 0.0)
    back, back_weight, front = vec3(0.0), 0.0, vec4(0.0)
    for y in range(2):
        for x in range(2):
            r = circles.texel(first + ivec2(x, y)).r
            c = min(vec3(BRIGHTEST), max(vec3(0.0), color.texel(first + ivec2(x, y)).rgb))
            share = nearer(r)
            front += vec4(c, 1.0) * (0.25 * share)
            if share < 0.5 and max(r, 0.0) >= 0.75 * far - 0.5:
                back += c
                back_weight += 1.0
    return vec4(back / max(back_weight, 1.0), HALF * far if far > 0.0 else far), front, HALF * near


@pg.kernel
def widest_of_tile(reach: Image) -> float:
    """The largest radius of a tile."""
    found = 0.0
    for y in range(TILE):
        for x in range(TILE):
            found = max(found, reach.texel(TILE * pixel() + ivec2(x, y)).r)
    return found


@lru_cache(maxsize=16)
def widest_around_by(tiles: int) -> Any:
    """A kernel for the largest radius of a tile and so many around it, one more than blurs reach.

    Read between tiles it is nowhere less than what reaches there, and has no steps.
    """

    @pg.kernel
    def widest_around(widest: Image) -> float:
        found = 0.0
        for y in range(-tiles, tiles + 1):
            for x in range(-tiles, tiles + 1):
                found = max(found, widest[x, y].r)
        return found

    return widest_around


@lru_cache(maxsize=16)
def gathers(taps: int, blades: int) -> tuple[Any, Any]:
    """The kernels that gather the layer behind and the layer before the plane of focus."""
    places = aperture_places(taps, blades)
    # blurs much smaller than the widest around are to be met by some
    crowded = aperture_places(taps, blades, crowded=True)

    @pg.kernel
    def behind(back: Image) -> vec4:
        here = back[0, 0]
        radius = here.a
        if radius < HALF * SMALL:
            return vec4(0.0)
        total, weight = here.rgb, 1.0
        for i in range(taps):
            # lenses show points behind the plane of focus upside down
            at = vec2(pixel()) + 0.5 - vec2(places[i][0], places[i][1]) * radius
            there = back.texel(ivec2(floor(at)))
            # what is sharper lies in front, and is seen here as far as its own blur reaches
            own = min(there.a, radius)
            seen = disc(own, places[i][2] * radius) * (radius * radius) if own >= 0.0 else 0.0
            total += there.rgb * seen
            weight += seen
        return vec4(total / weight, 1.0)

    @pg.kernel
    def before(front: Image, reach: Image, back: Image, widest: Image) -> tuple[vec4, vec4]:
        """Light and share of the lens that what is near covers, and what is behind it."""
        most = widest.sample((vec2(pixel()) + 0.5) / float(TILE) / vec2(widest.size)).r
        if most == 0.0:
            return vec4(0.0), vec4(0.0)
        around = most + 0.5
        covered, filled = vec4(0.0), vec4(0.0)
        for i in range(taps):
            at = ivec2(floor(vec2(pixel()) + 0.5 + vec2(crowded[i][0], crowded[i][1]) * around))
            own = reach.texel(at).r
            if own > 0.0:
                covered += front.texel(at) * (disc(own, crowded[i][2] * around) * (crowded[i][3] * around * around))
            hidden = back.texel(at)
            if hidden.a >= 0.0:
                # a guess must not invent light: lamps count little
                filled += vec4(hidden.rgb, 1.0) * crowded[i][3] / (1.0 + max(hidden.r, hidden.g, hidden.b))
        covered = covered / float(taps)
        return covered / max(covered.a, 1.0), filled / float(taps)

    return behind, before


@lru_cache(maxsize=16)
def fillings(taps: int) -> tuple[Any, Any]:
    """The kernels that fill in what lies between taps, where few of them met what is small and bright."""
    places = aperture_places(FILL_TAPS, 0)
    # of the way between neighbouring taps
    gap = FILL_GAPS / _sqrt(taps)

    @pg.function
    def filled(layer: Image, radius: float) -> vec4:
        total = layer[0, 0]
        for i in range(FILL_TAPS):
            at = vec2(pixel()) + 0.5 + vec2(places[i][0], places[i][1]) * (radius * gap)
            total += layer.sample(at / vec2(layer.size))
        return total / float(FILL_TAPS + 1)

    @pg.kernel
    def filled_behind(far: Image, back: Image) -> vec4:
        return filled(far, max(back[0, 0].a, 0.0)) if far[0, 0].a > 0.0 else vec4(0.0)

    @pg.kernel
    def filled_before(near: Image, hidden: Image, widest: Image) -> tuple[vec4, vec4]:
        around = widest.sample((vec2(pixel()) + 0.5) / float(TILE) / vec2(widest.size)).r
        if around == 0.0:
            return vec4(0.0), vec4(0.0)
        return filled(near, around), filled(hidden, around)

    return filled_behind, filled_before


@pg.function
def enlarged(half: Image) -> vec4:
    """A picture of half the size where this pixel is, bilinearly."""
    return half.sample((vec2(pixel()) + 0.5) * HALF / vec2(half.size))


@pg.kernel
def together(little: Image, circles: Image, far: Image, near: Image, hidden: Image) -> vec4:
    """What is sharp, what is blurred behind it, and what is blurred before both."""
    here, radius = little[0, 0], circles[0, 0].r
    shown = here.rgb
    if radius > SMALL:
        blurred = enlarged(far)
        if blurred.a > 0.0:
            shown = mix(shown, blurred.rgb / blurred.a, smoothstep(SMALL, LARGE, radius))
    over = enlarged(near)
    if over.a > 0.0:
        # a pixel before the plane of focus shows what it hides where its own layer lets the lens through
        open_share = max(nearer(radius) - over.a, 0.0)
        rest = 1.0 - over.a - open_share
        if open_share > 0.0:
            through = enlarged(hidden)
            shown = shown * rest + (through.rgb / through.a if through.a > 0.0 else over.rgb / over.a) * open_share
        else:
            shown = shown * rest
        shown += over.rgb
    return vec4(shown, here.a)
