# mypy: disable-error-code="no-any-return"
"""Depth of field: blur what is out of focus, like a lens."""

from __future__ import annotations

from functools import lru_cache
from math import sqrt as _sqrt
from typing import Annotated, Any

import passgraph as pg
from passgraph.effects.checked import effect
from passgraph.effects.pictures.decoded import decoded
from passgraph.effects.quantities import Reach, Share
from passgraph.effects.screen.aperture import ThinLens, aperture_places, corner_radius
from passgraph.language import (
    Image,
    clamp,
    floor,
    ivec2,
    length,
    mix,
    output_size,
    pixel,
    smoothstep,
    sqrt,
    vec2,
    vec3,
    vec4,
)

#: Half the size: blurred pictures lose no detail by it.
HALF = 0.5
#: Half-size pixels along a tile with a known widest blur.
TILE = 8
#: Taps of the second pass over each layer, and its reach, in distances between the taps of the first.
FILL_TAPS, FILL_GAPS = 8, 2.0
#: Largest half float; brighter light is clamped before the blur.
BRIGHTEST = 65504.0
#: Radii, px: up to the first blurs are gathered at full size, from the second on at half size, between them both are
#: mixed.
SMALL, LARGE = 2.0, 4.0
#: Reach of blurs at full size, px.
WINDOW = 2


@pg.kernel
def circle(depth: Image, blur: vec2, widest: float) -> float:
    """Return the blur radius of each pixel, px, negative in front of the plane of focus; the sky is infinitely far."""
    z = depth[0, 0].r
    nearness = 1.0 / z if z > 0.0 else 0.0
    return clamp((blur.x - blur.y * nearness) * float(output_size().y), -widest, widest)


@pg.function
def nearer(radius: float) -> float:
    """Return the fraction in which a pixel belongs to the layer in front of the plane of focus."""
    return smoothstep(SMALL, LARGE, -radius)


@pg.function
def disc(radius: float, away: float) -> float:
    """Return the brightness of a point, blurred to a disc of this radius, at a distance from its center; uniform except
    for the rim."""
    least = max(radius, 0.5)
    return clamp(radius - away + 0.5, 0.0, 1.0) / (least * least)


@pg.kernel
def blurred_a_little(color: Image, circles: Image) -> vec4:
    """Gather blurs of a few pixels at full size: pixels as far as they reach, and no farther than the blur of
    occluders."""
    here = circles[0, 0].r
    total, weight = vec3(0.0), 0.0
    for y in range(-WINDOW, WINDOW + 1):
        for x in range(-WINDOW, WINDOW + 1):
            there = circles[x, y].r
            # pixels behind this one are visible around it as far as this pixel itself is blurred
            own = min(abs(there), abs(here)) if there > here else abs(there)
            seen = disc(min(own, SMALL), sqrt(float(x * x + y * y))) * (1.0 - nearer(there))
            total += min(vec3(BRIGHTEST), max(vec3(0.0), color[x, y].rgb)) * seen
            weight += seen
    return vec4(total / weight if weight > 0.0 else color[0, 0].rgb, color[0, 0].a)


@pg.kernel
def halved(color: Image, circles: Image) -> tuple[vec4, vec4, float]:
    """Halve the size into two layers: in focus or behind, with the radius; and in front, with its fraction.

    Radii are in half-size pixels; -1 in the farther layer if it is empty.  At depth edges each layer keeps one side:
    the farthest, or the nearest.
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
    """Return the largest radius of a tile."""
    found = 0.0
    for y in range(TILE):
        for x in range(TILE):
            found = max(found, reach.texel(TILE * pixel() + ivec2(x, y)).r)
    return found


@lru_cache(maxsize=16)
def widest_around_by(tiles: int) -> Any:
    """Return a kernel for the largest radius of the tiles around a tile, one tile farther than blurs reach.

    Sampled between tiles it is nowhere less than the blurs there, and has no steps.
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
def gathers(taps: int, blades: int, rotation_rad: float, cats_eye: float) -> tuple[Any, Any]:
    """Return the kernels that gather the layers behind and in front of the plane of focus."""
    places = aperture_places(taps, blades, rotation_rad)
    # blurs much smaller than the widest around need some taps too
    crowded = aperture_places(taps, blades, rotation_rad, crowded=True)
    rim = corner_radius(blades)

    @pg.function
    def passed(at: vec2, size: ivec2, place: vec2, radius: float) -> float:
        """Return True if the lens's front rim lets light from a picture position through to an aperture position.

        Seen from the side, the rim is a circle shifted against the aperture; its edge is as wide as a pixel.
        """
        shift = cats_eye * (2.0 * at - vec2(size)) / length(vec2(size))
        return clamp((rim - length(place + shift)) * radius + 0.5, 0.0, 1.0)

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
            # sharper pixels are in front, and visible here as far as their own blur reaches
            own = min(there.a, radius)
            seen = disc(own, places[i][2] * radius) * (radius * radius) if own >= 0.0 else 0.0
            if cats_eye > 0.0:
                place = vec2(places[i][0], places[i][1]) * (radius / max(own, 0.5))
                seen *= passed(at, back.size, place, own)
            total += there.rgb * seen
            weight += seen
        return vec4(total / weight, 1.0)

    @pg.kernel
    def before(front: Image, reach: Image, back: Image, widest: Image) -> tuple[vec4, vec4]:
        """Return light and coverage of near objects, and the light behind them."""
        most = widest.sample((vec2(pixel()) + 0.5) / float(TILE) / vec2(widest.size)).r
        if most == 0.0:
            return vec4(0.0), vec4(0.0)
        around = most + 0.5
        covered, filled, lens = vec4(0.0), vec4(0.0), 0.0
        for i in range(taps):
            place = vec2(crowded[i][0], crowded[i][1])
            at = ivec2(floor(vec2(pixel()) + 0.5 + place * around))
            own = reach.texel(at).r
            if own > 0.0:
                seen = disc(own, crowded[i][2] * around) * (crowded[i][3] * around * around)
                if cats_eye > 0.0:
                    seen *= passed(vec2(at) + 0.5, front.size, place * (around / max(own, 0.5)), own)
                covered += front.texel(at) * seen
            if cats_eye > 0.0:
                # the part hidden by the rim is no part of the lens
                lens += crowded[i][3] * passed(vec2(pixel()) + 0.5, front.size, place, around)
            hidden = back.texel(at)
            if hidden.a >= 0.0:
                # an estimate must not invent light: lamps get little weight
                filled += vec4(hidden.rgb, 1.0) * crowded[i][3] / (1.0 + max(hidden.r, hidden.g, hidden.b))
        covered = covered / (max(lens, 0.5) if cats_eye > 0.0 else float(taps))
        return covered / max(covered.a, 1.0), filled / float(taps)

    return behind, before


@lru_cache(maxsize=16)
def fillings(taps: int) -> tuple[Any, Any]:
    """Return the kernels that fill in between taps, which may miss small bright spots."""
    places = aperture_places(FILL_TAPS, 0)
    # distance between neighboring taps
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
    """Upsample a picture of half the size bilinearly."""
    return half.sample((vec2(pixel()) + 0.5) * HALF / vec2(half.size))


@pg.kernel
def together(little: Image, circles: Image, far: Image, near: Image, hidden: Image) -> vec4:
    """Composite the sharp picture, the blur behind it and the blur in front."""
    here, radius = little[0, 0], circles[0, 0].r
    shown = here.rgb
    if radius > SMALL:
        blurred = enlarged(far)
        if blurred.a > 0.0:
            shown = mix(shown, blurred.rgb / blurred.a, smoothstep(SMALL, LARGE, radius))
    over = enlarged(near)
    if over.a > 0.0:
        # a pixel in front of the plane of focus shows hidden pixels where its own layer lets light through
        open_share = max(nearer(radius) - over.a, 0.0)
        rest = 1.0 - over.a - open_share
        if open_share > 0.0:
            through = enlarged(hidden)
            shown = shown * rest + (through.rgb / through.a if through.a > 0.0 else over.rgb / over.a) * open_share
        else:
            shown = shown * rest
        shown += over.rgb
    return vec4(shown, here.a)


@effect("depth-of-field", "picture+depth", linear=True, alpha="premultiplied")
def depth_of_field(
    color: pg.Target,
    depth: pg.Target,
    focus_distance: Reach | pg.Value | pg.Derived = 5.0,
    f_number: Annotated[float, pg.Range(0.5, 128)] = 2.8,
    focal_length_mm: Annotated[float, pg.Range(1, 2000, "mm")] = 50.0,
    sensor_height_mm: Annotated[float, pg.Range(1, 500, "mm")] = 24.0,
    unit_m: Annotated[float, pg.Range(0, None, "metres", above=True)] = 1.0,
    blades: Annotated[int, pg.Range(0, 16)] = 0,
    rotation_rad: Annotated[float, pg.Range(-7, 7, "radians")] = 0.0,
    cats_eye: Share = 0.0,
    widest_px: Annotated[int, pg.Range(1, 128, "px")] = 32,
    taps: Annotated[int, pg.Range(4, 256)] = 96,
    into: pg.TargetSpec | None = None,
    name: str = "depth_of_field",
) -> pg.Target:
    """Blur what is out of focus, by the circle of confusion of a thin lens.

    Parameters
    ----------
    color : linear light, any range; before tone mapping. Alpha stays
    depth : red is the distance along the view axis in scene units, 0 where nothing is drawn; of the size of ``color``
    focus_distance : distance of the plane of focus
    f_number : focal length divided by the aperture's diameter; 1.4 blurs much, 16 little
    focal_length_mm : focal length. The picture's vertical angle of view is 2 atan(sensor height / (2 focal length))
    sensor_height_mm : 24 is full frame
    unit_m : meters of a scene unit
    blades : corners of the aperture, and of highlights; 0 is round, else 3 or more
    rotation_rad : rotation of the blades, counterclockwise from standing on a corner
    cats_eye : narrowing of highlights off the axis by the lens's front rim: its shift against the aperture in the
        picture's corners, in radii. Only their shape changes; corners do not darken
    widest_px : limit of blur radii
    taps : samples of the aperture
    into : destination target; default: float16 named ``name``
    name : name of the passes and targets

    Sharp pixels do not bleed into blurred ones behind them, and near objects blur over sharp ones, with their coverage
    of the lens.  Areas hidden behind a near object's blurred rim are estimated from around it.

    Source: M. Potmesil, I. Chakravarty, "A Lens and Aperture Camera Model for Synthetic Image Generation", 1981 (circle
    of confusion); J. Jimenez, "Next Generation Post Processing in Call of Duty: Advanced Warfare", SIGGRAPH 2014
    (layers gathered at half size, tiles). Deviation: each layer is gathered by a radius of its own.

    Examples
    --------
    >>> import numpy as np
    >>> made = depth_of_field(pg.Input("frame"), pg.Input("depth"), 2.0, f_number=1.4, focal_length_mm=135)
    >>> step = np.where(np.arange(32) < 16, 1.0, 0.0).astype(np.float32)
    >>> frame, sharp = np.tile(step[:, None], (24, 1, 4)), np.full((24, 32), 2.0, np.float32)
    >>> with pg.compile(made, backend="numpy") as program:
    ...     focused, behind = (program(frame=frame, depth=sharp * far)["depth_of_field"][12, :, 0] for far in (1, 9))
    >>> bool((focused == step).all()), bool(0.0 < behind[17] < behind[14] < 1.0)
    (True, True)
    """
    if 0 < blades < 3:
        raise pg.GraphError(f"depth_of_field: blades must be 0 or 3 to 16, got {blades}")
    color = decoded(color, f"{name}_light")
    lens = ThinLens(f_number, focal_length_mm, sensor_height_mm, unit_m)
    blur: Any = (
        focus_distance.map(lens.blur)
        if isinstance(focus_distance, (pg.Value, pg.Derived))
        else lens.blur(focus_distance)
    )
    circles = circle(depth, blur, float(widest_px), into=pg.target(f"{name}_circle", "r16f"), name=f"{name}_circle")

    def half(part: str, format: str = "rgba16f", scale: float = HALF) -> pg.TargetSpec:
        return pg.target(f"{name}_{part}", format, like=color, scale=scale)

    layers = (half("back"), half("front"), half("reach", "r16f"))
    back, front, reach = halved(color, circles, into=layers, name=f"{name}_layers")
    behind, before = gathers(taps, blades, rotation_rad, cats_eye)
    fill_behind, fill_before = fillings(taps)
    gathered = behind(back, into=half("far_taps"), name=f"{name}_far_taps")
    far = fill_behind(gathered, back, into=half("far"), name=f"{name}_far")
    tiles = pg.target(f"{name}_tiles", "r16f", like=reach, scale=1.0 / TILE)
    widest = widest_around_by(1 - -widest_px // (2 * TILE))(
        widest_of_tile(reach, into=tiles, name=f"{name}_tiles"),
        into=pg.target(f"{name}_widest", "r16f", like=reach, scale=1.0 / TILE), name=f"{name}_widest",
    )  # fmt: skip
    into_taps = (half("near_taps"), half("hidden_taps"))
    near, hidden = before(front, reach, back, widest, into=into_taps, name=f"{name}_near_taps")
    near, hidden = fill_before(near, hidden, widest, into=(half("near"), half("hidden")), name=f"{name}_near")
    little = blurred_a_little(color, circles, into=pg.target(f"{name}_little", "rgba16f", like=color))
    result: pg.Target = together(little, circles, far, near, hidden, into=into or pg.target(name, "rgba16f"), name=name)
    return result
