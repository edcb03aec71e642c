"""Motion blur: simulate an open shutter, from one frame and its velocity."""

# mypy: disable-error-code="no-any-return"
# Values of the kernel language are Any to Python's type checkers.
from __future__ import annotations

from typing import Annotated

import passgraph as pg
from passgraph.effects.checked import effect
from passgraph.effects.pictures.decoded import decoded
from passgraph.effects.quantities import FieldOfView, Share
from passgraph.effects.surfaces.seen_by import camera_of
from passgraph.effects.temporal.velocity import camera_velocity
from passgraph.language import Const, Image, clamp, dot, floor, isfinite, ivec2, length, pixel, vec2, vec3, vec4
from passgraph.scene.camera import DEFAULT_FOV_RAD

#: Distances with this relative difference belong to two surfaces.
APART = 0.05
#: Streaks that reach this far to each side, px, stay inside their pixel.
INSIDE_PX = 0.5


@pg.function
def cut(half: vec2, longest: float) -> vec2:
    reach = length(half)
    return half * (longest / reach) if reach > longest else half


@pg.kernel
def streak(depth: Image, velocity: Image, shutter: float) -> vec3:
    """Return half the motion of a pixel while the shutter is open, pixels; 1 / distance, 0 for the sky."""
    z = depth[0, 0].r
    half = velocity[0, 0].rg * (0.5 * shutter)
    return vec3(half if isfinite(dot(half, half)) else vec2(0.0), 1.0 / z if z > 0.0 else 0.0)


@pg.kernel
def longest_of_tile(streaks: Image, side: Const[int]) -> vec2:
    found, reach = vec2(0.0), 0.0
    for y in range(side):
        for x in range(side):
            half = streaks.texel(side * pixel() + ivec2(x, y)).rg
            if dot(half, half) > reach:
                found, reach = half, dot(half, half)
    return found


@pg.kernel
def longest_around(tiles: Image, longest: float) -> vec2:
    found, reach = vec2(0.0), 0.0
    for y in range(-1, 2):
        for x in range(-1, 2):
            half = tiles[x, y].rg
            if dot(half, half) > reach:
                found, reach = half, dot(half, half)
    return cut(found, longest)


@pg.function
def nearer(there: float, here: float) -> float:
    """Return the confidence that a surface is in front of another one, from 1 / distance of both."""
    nearest = max(there, here)
    return clamp((there - here) / (APART * nearest), 0.0, 1.0) if nearest > 0.0 else 0.0


@pg.kernel
def blurred(
    color: Image, streaks: Image, around: Image, longest: float, side: Const[int], taps: Const[int]
) -> vec4:  # fmt: skip
    """Return this pixel's surface blurred along its own motion, and over it the moving surfaces in front."""
    here, nearness = color[0, 0], streaks[0, 0].b
    way, own = around.texel(pixel() // side).rg, cut(streaks[0, 0].rg, longest)
    reach, own_reach = length(way), length(own)
    if reach <= INSIDE_PX or not isfinite(dot(here, vec4(1.0))):
        return here
    gap = 2.0 * reach / float(taps)
    before, before_share = vec4(0.0), 0.0
    back, back_share = vec4(0.0), 0.0
    for i in range(taps):
        along = (2.0 * float(i) + 1.0) / float(taps) - 1.0
        at = ivec2(floor(vec2(pixel()) + 0.5 + way * along))
        c, there = color.texel(at), streaks.texel(at)
        # the fraction of the time in which a surface at this tap's distance moves over the pixel
        half_way = min(length(there.rg), longest)
        passing = clamp((half_way - abs(along) * reach) / gap + 0.5, 0.0, 1.0) * 0.5 * gap / max(half_way, 0.5 * gap)
        share = passing * nearer(there.b, nearness) if isfinite(dot(c, vec4(1.0))) else 0.0
        before += c * share if share > 0.0 else vec4(0.0)
        before_share += share
        if own_reach > INSIDE_PX:
            at = ivec2(floor(vec2(pixel()) + 0.5 + own * along))
            c = color.texel(at)
            share = 1.0 - nearer(streaks.texel(at).b, nearness) if isfinite(dot(c, vec4(1.0))) else 0.0
            back += c * share if share > 0.0 else vec4(0.0)
            back_share += share
    rest = back / back_share if back_share > 0.0 else here
    if before_share >= 1.0:
        return before / before_share
    return before + rest * (1.0 - before_share) if before_share > 0.0 else rest


@pg.kernel
def one_distance() -> float:
    """Return one distance for all pixels."""
    return 1.0


@effect("motion-blur", "picture+depth", linear=True, alpha="premultiplied")
def motion_blur(
    color: pg.Target,
    depth: pg.Target | None = None,
    *,
    camera: pg.Camera | pg.Value | None = None,
    previous_camera: pg.Camera | pg.Value | None = None,
    velocity: pg.Target | None = None,
    shutter: Share | pg.Value | pg.Derived = 0.5,
    longest_px: Annotated[int, pg.Range(2, 256, "px")] = 40,
    taps: Annotated[int, pg.Range(2, 128)] = 16,
    vertical_fov_rad: FieldOfView = DEFAULT_FOV_RAD,
    into: pg.TargetSpec | None = None,
    name: str = "motion_blur",
) -> pg.Target:
    """Blur moving surfaces along their path while the shutter is open.

    Parameters
    ----------
    color : linear light, any range; before tone mapping
    depth : red is the distance along the view axis in scene units, 0 where there is no surface; of the size of
        ``color``. With ``velocity`` it may be left out: all surfaces are at one distance then
    camera : the camera of both; default: one with ``vertical_fov_rad`` at the origin
    previous_camera : the camera of the frame before; without it and ``velocity``, nothing moves
    velocity : replaces that of the cameras: red and green are the motion of each pixel since the frame before, in
        pixels, to the right and down
    shutter : fraction of a frame during which it is open; 0.5 is a film camera's 180 degrees. The frame is its middle
    longest_px : limit of the streaks' length
    taps : samples along a streak; fewer than its pixels leave gaps
    vertical_fov_rad : full vertical angle of view, without ``camera``
    into : destination target; default: float32 named ``name``
    name : name of the passes and targets

    Moving objects are blurred over the background; static ones are not blurred into moving objects behind them.  The
    background hidden by a streak is taken from next to it.  Over the background, an object is blurred by the motion of
    the fastest one within ``longest_px``, even if that is another.  Pixels that are NaN or infinite stay, and do not
    affect others.

    Source: M. McGuire, P. Hennessy, M. Bukowski, B. Osman, "A Reconstruction Filter for Plausible Motion Blur", 2012
    (tiles); J. Jimenez, "Next Generation Post Processing in Call of Duty: Advanced Warfare", SIGGRAPH 2014 (what the
    taps before a pixel leave is its own); J.-P. Guertin, M. McGuire, D. Nowrouzezahrai, "A Fast and Stable
    Feature-Aware Motion Blur Filter", HPG 2014 (taps along the pixel's own motion too). Deviations: a tap is weighted
    by the fraction of the time in which it is visible, so that equal velocity is a box filter; there is no noise;
    distances are compared by their ratio.

    Examples
    --------
    A line that moves 8 pixels in a frame, half of them while the shutter is open:

    >>> import numpy as np
    >>> line = np.zeros((1, 9, 4), np.float32)
    >>> line[:, 4] = 1.0
    >>> made = motion_blur(pg.Input("frame"), pg.Input("depth"), velocity=pg.Input("velocity"), taps=8)
    >>> with pg.compile(made, backend="reference") as program:
    ...     shown = program(frame=line, depth=np.ones((1, 9, 1)), velocity=np.full((1, 9, 2), (8.0, 0.0)))
    >>> shown["motion_blur"][0, :, 0].tolist()
    [0.0, 0.0, 0.125, 0.25, 0.25, 0.25, 0.125, 0.0, 0.0]
    """
    color = decoded(color, f"{name}_light")
    into = into or pg.target(name, "rgba32f", like=color)
    if depth is None:
        if velocity is None:
            raise pg.GraphError(f"{name}: nothing tells how surfaces move; give their velocity, or depth and cameras")
        depth = one_distance(into=pg.target(f"{name}_depth", "r32f", like=color), name=f"{name}_depth")
    if velocity is None:
        seen_by = camera_of(camera, vertical_fov_rad)
        velocity = camera_velocity(depth, seen_by, previous_camera or seen_by, name=f"{name}_velocity")
    side, longest = -(-longest_px // 2), 0.5 * longest_px

    def part(what: str, format: str, scale: float = 1.0) -> pg.TargetSpec:
        return pg.target(f"{name}_{what}", format, like=color, scale=scale)

    streaks = streak(depth, velocity, shutter, into=part("streaks", "rgb32f"), name=f"{name}_streaks")
    tiles = longest_of_tile(streaks, side, into=part("tiles", "rg32f", 1.0 / side), name=f"{name}_tiles")
    around = longest_around(tiles, longest, into=part("around", "rg32f", 1.0 / side), name=f"{name}_around")
    picture: pg.Target = blurred(color, streaks, around, longest, side, taps, into=into, name=name)
    return picture
