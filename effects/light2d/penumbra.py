"""The exact shadow of a luminous disc in the plane: the fraction of its angle that is visible."""

# mypy: disable-error-code="no-any-return"
# Values of the kernel language are Any to Python's type checkers.
from __future__ import annotations

import passgraph as pg
from passgraph.effects.pictures.stretched import Spot
from passgraph.language import Const, Image, atan, dot, ivec2, length, pixel, sqrt, vec2, vec3, vec4

#: Texels in a row of the table of lights and edges, as a power of two.
ROW_BITS = 10
#: Tangents of angles stay below this.
STEEP = 1e9


@pg.function
def falloff(distance: float, radius: float) -> float:
    """Return (1 - (distance / radius)²)², 0 from the radius on."""
    t = min(distance / radius, 1.0)
    return (1.0 - t * t) * (1.0 - t * t)


@pg.function
def falloff_squared(distance2: float, radius: float) -> float:
    """Return the same for the squared distance."""
    t2 = min(distance2 / (radius * radius), 1.0)
    return (1.0 - t2) * (1.0 - t2)


@pg.function
def cross2(a: vec2, b: vec2) -> float:
    return a.x * b.y - a.y * b.x


@pg.fragment
def gradient(spot: Spot, color: vec3, light: vec4) -> vec4:
    """Return the light without shadows; ``light`` is (x, y, radius, size)."""
    return vec4(color * falloff(length(spot.place - light.xy), light.z), 0.0)


@pg.function
def entry(table: Image, at: int) -> vec4:
    return table.texel(ivec2(at & 1023, at >> 10))


@pg.function
def slope(end: vec2, other: vec2, turn: float) -> float:
    """Return the tangent of the angle of an edge's end off the axis; for an end behind, where the edge comes forward.

    Ends are (along the axis, across it); ``turn`` is cross2(end, other).
    """
    if end.x > 0.0:
        return end.y / end.x
    return STEEP if turn * (end.x - other.x) > 0.0 else -STEEP


@pg.function
def covered(edge: vec4, place: vec2, axis: vec2, lamp: vec3) -> vec2:
    """Return tangents between which an edge covers the lamp; ``lamp`` is (distance², size², tangent of half its angle).

    (STEEP, -STEEP) if it covers nothing.
    """
    a = edge.xy - place
    b = edge.zw - place
    # along the axis, and across it
    p = vec2(dot(axis, a), cross2(axis, a))
    q = vec2(dot(axis, b), cross2(axis, b))
    turn = cross2(p, q)
    first = slope(p, q, turn)
    second = slope(q, p, -turn)
    low = max(min(first, second), -lamp.z)
    high = min(max(first, second), lamp.z)
    # an edge that does not touch the lamp is either before or behind it in all of the overlap
    m = 0.5 * (low + high)
    way = turn / ((q.y - p.y) - m * (q.x - p.x))
    lean = 1.0 + m * m
    near = (sqrt(lamp.x) - sqrt(max(lamp.x - lean * (lamp.x - lamp.y), 0.0))) / lean
    hides = max(p.x, q.x) > 0.0 and low <= high and way < near
    return vec2(low, high) if hides else vec2(STEEP, -STEEP)


@pg.kernel
def tile_light(
    tiles: Image,
    table: Image,
    sofar: Image,
    corner: vec4,
    side: Const[int],
    most_open: Const[int],
    most_shaded: Const[int],
    most_edges: Const[int],
) -> vec4:
    """Add the light of one layer to the target; ``corner`` is x and y of the upper left, then a pixel's size.

    A tile has the start of its list in red, the number of unoccluded lights in green, of shaded ones in blue. A light
    is (x, y, radius, size), then (red, green, blue, number of edges), then its edges.
    """
    place = corner.xy + (vec2(pixel()) + 0.5) * corner.zw
    tile = tiles.texel(pixel() // side)
    at = int(tile.r)
    free = int(tile.g)
    shaded = int(tile.b)
    base = sofar[0, 0]
    total = base.rgb
    for i in range(most_open):
        if i >= free:
            break
        light = entry(table, at)
        off = light.xy - place
        total += entry(table, at + 1).rgb * falloff_squared(dot(off, off), light.z)
        at += 2
    for i in range(most_shaded):
        if i >= shaded:
            break
        light = entry(table, at)
        color = entry(table, at + 1)
        count = int(color.a)
        at += 2
        toward = light.xy - place
        far2 = dot(toward, toward)
        size2 = light.w * light.w
        axis = toward / sqrt(max(far2, 1e-30))
        # tangent of half the lamp's angle
        wide = light.w / sqrt(max(far2 - size2, 1e-30))
        lamp = vec3(far2, size2, wide)
        # walk from one end of the lamp to the other, through covered intervals and gaps in turn
        here = -wide
        seen = 0.0
        outside = far2 > size2 and far2 < light.z * light.z
        for _step in range(2 * most_edges + 1):
            if not outside:
                break
            end = -STEEP
            gap = wide
            for k in range(most_edges):
                if k >= count:
                    break
                stretch = covered(entry(table, at + k), place, axis, lamp)
                if stretch.x <= here:
                    end = max(end, stretch.y)
                else:
                    gap = min(gap, stretch.x)
            if light.w == 0.0:
                seen = 1.0 if end < here else 0.0
                break
            if end <= here:
                seen += atan(gap) - atan(here)
                end = gap
            here = end
            if here >= wide:
                break
        share = seen if light.w == 0.0 else seen / (2.0 * atan(wide))
        at += count
        total += color.rgb * (falloff_squared(far2, light.z) * (share if far2 > size2 else 1.0))
    return vec4(total, base.a)
