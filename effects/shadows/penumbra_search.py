"""Shadows of area lights, searched for at half the size, and sharpened at full size where they are sharp."""

# mypy: disable-error-code="no-any-return"
# Values of the kernel language are Any to Python's type checkers.
from __future__ import annotations

import math
from functools import lru_cache
from math import cos, pi, sin
from typing import Any

import passgraph as pg
from passgraph.effects.shadows.nearest_casters import search_reach
from passgraph.effects.shadows.shadow_filters import (
    DEPTH_SLACK_TEXELS,
    Receiver,
    at_offset,
    caster_at,
    limit_at,
    mean_of,
    reach_of,
    receiver_at,
    toward_light,
    vogel_disc,
)
from passgraph.effects.shadows.shadow_light import SCREEN_ROUNDING, light_at, on_face
from passgraph.effects.shadows.shadow_map import NOTHING
from passgraph.effects.surfaces.geometry import (
    ViewFrame,
    across_plane,
    flat_place,
    half_extent,
    plane_terms,
    spread,
    toward_eye,
    unpack_normal,
)
from passgraph.effects.surfaces.views import LightFrame
from passgraph.language import (
    Const,
    Image,
    dot,
    floor,
    ivec2,
    length,
    mix,
    normalize,
    output_size,
    smoothstep,
    uv,
    vec2,
    vec3,
)

#: Half widths of penumbrae, in pixels of the foreshortened side: below the first, full size decides; above the second,
#: half size. The small picture's pixels are 2 wide, and would sample a narrow penumbra at only one or two points.
SHARP_PX, SOFT_PX = 1.5, 4.0
#: Comparisons per search point: a mean of few has steps that are visible as bands in wide penumbrae.
COMPARED = 2
#: Comparisons of each pixel at full size: enough for a penumbra of SOFT_PX.
FEW = 12
FEW_PLACES: Any = vogel_disc(FEW)
#: At full size casters count from this many texels in front of the receiver on if it is behind the plane of the
#: foremost one, or if all comparisons find one; else from DEPTH_SLACK_TEXELS on, as surfaces that meet in a concave
#: edge are no casters.
NEAR_SLACK_TEXELS = 0.5
#: Largest distance of a half-size pixel from the plane of a pixel that it is blended into.
SAME_PLANE_PX = 2.0
#: Half width of the smallest filter, in texels: edges in a map are known to one texel, and smoothed by that much.
LEAST = 0.6
#: A texel is hit by rays that pass its center within half its diagonal.
HALF_DIAGONAL = 0.75
#: Casters count as near if their penumbra is narrower by this factor than the widest that a search could find, and the
#: search is wider than this many texels.
FAR_AND_NEAR = 0.5
LAYERED_TEXELS = 4.0
#: Search points are denser toward the center, with this power of their index; 0.5 would spread them uniformly. Most
#: casters are near the receiver, and can occlude it only near its own position.
CROWDING = 1.25


def search_disc(taps: int) -> tuple[tuple[float, float], ...]:
    """Return points of a disc of radius 1, denser toward its center.

    >>> [round(math.hypot(x, y), 3) for x, y in search_disc(4)]
    [0.074, 0.293, 0.556, 0.846]
    """
    turn = pi * (3.0 - math.sqrt(5.0))
    radii = [((i + 0.5) / taps) ** CROWDING for i in range(taps)]
    return tuple((r * cos(i * turn), r * sin(i * turn)) for i, r in enumerate(radii))


@pg.struct
class Layers:
    """Half widths of the penumbrae of the casters in front of a receiver, scene units."""

    far: float  # of casters far from it; -1 if there are none
    near: float  # of casters near it; -1 if there are none
    split: float  # least half width of far casters


@pg.function
def facing_light(light: LightFrame, position: vec3, n: vec3, kind: int) -> bool:
    """Return True if the light's center is above the surface."""
    return dot(n, toward_light(light, position, kind)) > 0.0


@pg.function
def step_aside(size: ivec2, frame: ViewFrame) -> vec2:
    """Return the offset between the flat places of neighboring pixels, to the right and down."""
    return vec2(2.0, -2.0) * half_extent(frame, size) / vec2(size)


@lru_cache(maxsize=64)
def find_penumbrae(taps: int) -> Any:
    """Return a kernel for every other pixel of every other row: the fraction of the light that arrives, and the
    penumbra's half width in pixels.

    The width is 0 where nothing occludes, and -1 where no light can arrive or there is no surface.

    Source: R. Fernando, "Percentage-Closer Soft Shadows", 2005. Deviations: of the casters found only those in the cone
    from the receiver to the light count, for their mean and for the comparisons; the mean is harmonic in their
    distance, as the nearest ones bound the light; search points are denser toward the center.
    """
    search_places: Any = search_disc(taps)
    compared = COMPARED * taps
    places: Any = vogel_disc(compared)

    @pg.function
    def casters_about(
        map: Image, nearest: Image, light: LightFrame, receiver: Receiver, kind: int, face: int
    ) -> Layers:
        """Return harmonic means of the distances to the casters in the cone to the light, far ones and near ones."""
        search = search_reach(map, nearest, light, receiver, kind)
        margin = HALF_DIAGONAL * receiver.texel
        split = search * FAR_AND_NEAR if search > LAYERED_TEXELS * receiver.texel else 0.0
        far, far_count, near, near_count = 0.0, 0.0, 0.0, 0.0
        for i in range(taps):
            offset = search_places[i] * (search + margin)
            caster = caster_at(map, receiver, at_offset(receiver, offset), kind, face)
            reach = reach_of(light, receiver, caster, kind)
            if caster < NOTHING and length(offset) <= reach + margin:
                inverse = 1.0 / max(receiver.depth - caster, 1e-6 * receiver.depth)
                if reach < split:
                    near += inverse
                    near_count += 1.0
                else:
                    far += inverse
                    far_count += 1.0
        return Layers(
            reach_of(light, receiver, receiver.depth - far_count / max(far, 1e-30), kind) if far > 0.0 else -1.0,
            reach_of(light, receiver, receiver.depth - near_count / max(near, 1e-30), kind) if near > 0.0 else -1.0,
            split,
        )

    @pg.function
    def share_of_rays(map: Image, light: LightFrame, receiver: Receiver, layers: Layers, kind: int, face: int) -> float:
        """Average over rays to points of the light; each is compared once or twice with the map's depths on its way.

        A ray that hits nothing in the widest layer is compared again in the near layer. One that hits a caster too near
        to the receiver to occlude it there is compared at that caster's depth: the map shows either that caster or
        something in front of it, and the caster is assumed to continue below. Where a farther caster hides the near
        layer, near casters are assumed to be as common as elsewhere.
        """
        margin = HALF_DIAGONAL * receiver.texel
        widest = max(max(layers.far, layers.near), LEAST * receiver.texel)
        both = layers.far >= 0.0 and layers.near >= 0.0
        lit, blocked, hidden = 0.0, 0.0, 0.0
        for i in range(compared):
            offset = places[i] * widest
            caster = caster_at(map, receiver, at_offset(receiver, offset), kind, face)
            reach = reach_of(light, receiver, caster, kind)
            found = caster < NOTHING
            if not found and not both:
                lit += 1.0
            elif not found or length(offset) > reach + margin:
                nearer = at_offset(receiver, places[i] * (reach if found else layers.near))
                caster = caster_at(map, receiver, nearer, kind, face)
                if caster >= NOTHING:
                    lit += 1.0
                elif not found and reach_of(light, receiver, caster, kind) >= layers.split:
                    hidden += 1.0
                else:
                    blocked += 1.0
        return mean_of(lit + hidden * lit / max(lit + blocked, 1.0), compared)

    @pg.kernel
    def penumbrae(
        normals: Image, depth: Image, map: Image, nearest: Image, light: LightFrame, frame: ViewFrame,
        kind: Const[int], face: Const[int],
    ) -> vec2:  # fmt: skip
        size = depth.size
        at = pg.pixel() * 2
        far = depth.texel(at).r
        aside = step_aside(size, frame)
        flat = frame.shift * half_extent(frame, size) + (vec2(at) + 0.5 - 0.5 * vec2(size)) * aside
        position = vec3(flat * spread(frame, far), -far)
        n = unpack_normal(normals.texel(at).zw)
        if far <= 0.0 or not facing_light(light, position, n, kind):
            return vec2(0.0, -1.0)
        pixel_width = -aside.y * spread(frame, far)
        receiver = receiver_at(map, light, position, n, 0.5 * pixel_width * SCREEN_ROUNDING, kind)
        if receiver.share >= 0.0:
            return vec2(receiver.share, 0.0)
        layers = casters_about(map, nearest, light, receiver, kind, face)
        widest = max(layers.far, layers.near)
        if widest < 0.0:
            return vec2(1.0, 0.0)
        return vec2(share_of_rays(map, light, receiver, layers, kind, face), widest / pixel_width)

    return penumbrae


@pg.function
def own_plane(frame: ViewFrame, flat: vec2, far: float, slope: vec2, smooth: vec3, toward: vec3) -> vec3:
    """Return the triangle's own normal if it faces the light and the smooth normal, which decides, does too."""
    plane = normalize(across_plane(frame, flat, far, slope))
    return plane if dot(plane, toward) > 0.0 and dot(smooth, toward) > 0.0 else smooth


@pg.struct
class Found:
    """A texel of the map, and the caster there."""

    texel: ivec2
    away: vec2  # offset of its center from the receiver's position, in texels
    depth: float  # depth of the caster; NOTHING beyond the map's border
    before: float  # how far it is in front of the receiver's plane and cone, scene units


@pg.function
def found_at(map: Image, receiver: Receiver, offset: vec2, kind: int, face: int) -> Found:
    """Return the caster at an offset of ``offset`` scene units from a receiver."""
    place = floor(receiver.place + at_offset(receiver, offset))
    texel, away = ivec2(place), place + 0.5 - receiver.place
    limit = limit_at(receiver, away, kind)
    size = vec2(map.size)
    inside = face >= 0 or (place.x >= 0.0 and place.y >= 0.0 and place.x < size.x and place.y < size.y)
    depth = map.texel(texel).r if inside else NOTHING
    return Found(texel, away, depth, limit + receiver.slack - depth)


@pg.function
def behind_plane(map: Image, receiver: Receiver, caster: Found) -> bool:
    """Return True if a receiver is behind the plane of a caster, given by the texels beyond it.

    In a concave edge the plane of one surface ends on the other, all of which is in front of it.
    """
    onward = ivec2(1 if caster.away.x > 0.0 else -1, 1 if caster.away.y > 0.0 else -1)
    across = map.texel(caster.texel + ivec2(onward.x, 0)).r - caster.depth
    along = map.texel(caster.texel + ivec2(0, onward.y)).r - caster.depth
    return receiver.depth > caster.depth - dot(vec2(across, along), abs(caster.away))


@pg.function
def sharp_share(map: Image, receiver: Receiver, reach: float, soft: bool, kind: int, face: int) -> float:
    """Average FEW comparisons over a disc; only the first one if it is lit and nothing is near.

    Where two surfaces meet, some of the points see the receiver's own surface, which is in front of the plane of the
    other; otherwise a caster that nearly touches the receiver counts.
    """
    near = receiver.slack - (DEPTH_SLACK_TEXELS - NEAR_SLACK_TEXELS) * receiver.texel
    first = found_at(map, receiver, FEW_PLACES[0] * reach, kind, face)
    nearest = first
    lit = 0.0 if first.before > receiver.slack else 1.0
    lit_near = 0.0 if first.before > near else 1.0
    if soft or first.before > near:
        # a known count: PoCL vectorizes unrolled loops only, and takes twice as long for the frame otherwise
        for i in range(1, FEW):
            found = found_at(map, receiver, FEW_PLACES[i] * reach, kind, face)
            lit += 0.0 if found.before > receiver.slack else 1.0
            lit_near += 0.0 if found.before > near else 1.0
            if found.before > nearest.before:
                nearest = found
        touched = lit_near <= 0.0 or behind_plane(map, receiver, nearest)
        lit = mean_of(lit_near if touched else lit, FEW)
    return lit


@pg.kernel
def add_light_with_penumbrae(
    free: Image, shadowed: Image, normals: Image, depth: Image, rises: Image, map: Image, penumbrae: Image,
    light: LightFrame, frame: ViewFrame, kind: Const[int], face: Const[int], has_rises: Const[bool],
) -> tuple[vec3, vec3]:  # fmt: skip
    """Add one light to both sums, as `passgraph.effects.shadows.shadow_light.add_shadowed_light` does.

    The small picture is upsampled along the surface of each pixel; where its penumbrae are narrow, a few comparisons
    over their width replace it.
    """
    here = pg.pixel()
    far = depth[0, 0].r
    flat = flat_place(frame, uv())
    position = vec3(flat * spread(frame, far), -far)
    packed = normals[0, 0]
    n = unpack_normal(packed.zw)
    more = light_at(light, position, unpack_normal(packed.xy), kind).rgb
    if face >= 0 and not on_face(light.world * (position - light.place), face):
        more = vec3(0.0)
    aside = step_aside(output_size(), frame)
    pixel_width = -aside.y * spread(frame, far)
    if has_rises:
        n = own_plane(frame, flat, far, rises[0, 0].rg / abs(aside), n, toward_light(light, position, kind))
    # the height of a neighbor above this pixel's plane
    terms = plane_terms(frame, n, flat)
    level = terms.x * spread(frame, far) + terms.y * far
    rise = n.xy * aside
    first = here // 2
    odd = here - first * 2
    part = 0.5 * vec2(odd)
    total = 0.0
    weight = 0.0
    wide = 0.0
    wide_weight = 0.0
    for i in range(4):
        near = min(first + ivec2(i % 2, i // 2), penumbrae.size - 1)
        away = vec2(near * 2 - here)
        found = penumbrae.texel(near).rg
        z = depth.texel(near * 2).r
        off = spread(frame, z) * (terms.x + dot(rise, away)) + terms.y * z - level
        off = off / (SAME_PLANE_PX * pixel_width)
        w = (part.x if i % 2 == 1 else 1.0 - part.x) * (part.y if i // 2 == 1 else 1.0 - part.y)
        w = w * max(1.0 - off * off, 0.0) if found.y >= 0.0 else 0.0
        total += found.x * w
        weight += w
        wide += found.y * w
        wide_weight += w if found.y > 0.0 else 0.0
    width_px = wide / max(wide_weight, 1e-6)
    shortened_px = width_px * abs(dot(n, toward_eye(frame, position)))
    receiver = receiver_at(map, light, position, n, 0.5 * pixel_width * SCREEN_ROUNDING, kind)
    share = receiver.share
    if receiver.share < 0.0:
        share = min(total / max(weight, 1e-6), 1.0)
        if shortened_px < SOFT_PX:
            reach = min(max(width_px * pixel_width, LEAST * receiver.texel), receiver.farthest)
            sharp = sharp_share(map, receiver, reach, width_px > 0.0, kind, face)
            share = mix(sharp, share, smoothstep(SHARP_PX, SOFT_PX, shortened_px))
    return free[0, 0].rgb + more, shadowed[0, 0].rgb + more * share
