"""Temporal antialiasing: reproject samples of earlier frames to the present positions of their surfaces."""

# mypy: disable-error-code="no-any-return"
# Values of the kernel language are Any to Python's type checkers.
from __future__ import annotations

from typing import Annotated

import passgraph as pg
from passgraph.effects.checked import effect
from passgraph.effects.quantities import FieldOfView
from passgraph.effects.surfaces.seen_by import camera_of
from passgraph.effects.temporal.velocity import camera_velocity
from passgraph.language import Const, Image, dot, floor, ivec2, mix, pixel, sqrt, vec2, vec3, vec4
from passgraph.scene.camera import DEFAULT_FOV_RAD

#: Distances with a smaller relative difference belong to one surface.
SAME_SURFACE = 0.05


@pg.function
def is_finite(c: vec4) -> bool:
    return dot(c, vec4(0.0)) == 0.0


@pg.function
def to_ycocg(c: vec4) -> vec4:
    """Convert to luma and two color differences, whose box around a neighborhood is tighter; alpha stays."""
    return vec4(0.25 * c.r + 0.5 * c.g + 0.25 * c.b, 0.5 * c.r - 0.5 * c.b, -0.25 * c.r + 0.5 * c.g - 0.25 * c.b, c.a)


@pg.function
def from_ycocg(c: vec4) -> vec4:
    rest = c.x - c.z
    return vec4(rest + c.y, c.x + c.z, rest - c.y, c.w)


@pg.function
def catmull_rom(f: float) -> vec4:
    """Return the weights of four texels in a row for a position between the middle two."""
    return vec4(
        f * (-0.5 + f * (1.0 - 0.5 * f)),
        1.0 + f * f * (-2.5 + 1.5 * f),
        f * (0.5 + f * (2.0 - 1.5 * f)),
        f * f * (-0.5 + 0.5 * f),
    )


@pg.function
def between_texels(picture: Image, place: vec2) -> vec4:
    """Sample a picture by a Catmull-Rom spline at a position in texels; the nearest texel if a neighbor is not
    finite."""
    base = ivec2(floor(place - 0.5))
    f = place - 0.5 - vec2(base)
    across, down = catmull_rom(f.x), catmull_rom(f.y)
    total = vec4(0.0)
    for y in range(4):
        row = vec4(0.0)
        for x in range(4):
            row += picture.texel(base + ivec2(x - 1, y - 1)) * across[x]
        total += row * down[y]
    return total if is_finite(total) else picture.texel(ivec2(floor(place)))


@pg.function
def stands_before(distance: float, other: float) -> bool:
    """Return True if a surface is nearer than another one, or than the sky (0)."""
    return distance > 0.0 and (other <= 0.0 or distance < (1.0 - SAME_SURFACE) * other)


@pg.function
def clipped(history: vec4, mean: vec4, half: vec4) -> vec4:
    """Return the part of the way from a box's center to a color that lies inside the box."""
    way = history - mean
    out = abs(way) / max(half, vec4(1e-20))
    return mean + way / max(out.x, out.y, out.z, out.w, 1.0)


@pg.kernel
def resolved(
    color: Image, depth: Image, velocity: Image, history: Image, kept: Image, sigmas: float, most_frames: float,
    moves: Const[bool], knows_distance: Const[bool], hdr: Const[bool],
) -> tuple[vec4, vec2]:  # fmt: skip
    """Return the picture accumulated over frames; and the distance, with the number of frames."""
    here = color[0, 0]
    distance = depth[0, 0].r
    way = velocity[0, 0].rgb if moves else vec3(0.0, 0.0, distance)
    if not is_finite(here):
        return here, vec2(distance, 0.0)
    # follow the nearest surface around, so that edges move with the foreground
    middle, nearest = to_ycocg(here), distance
    first, count = vec4(0.0), 0.0
    for y in range(-1, 2):
        for x in range(-1, 2):
            c, z = to_ycocg(color[x, y]) - middle, depth[x, y].r
            if is_finite(c):
                first += c
                count += 1.0
            if z > 0.0 and (nearest <= 0.0 or z < nearest):
                nearest = z
                way = velocity[x, y].rgb if moves else vec3(0.0, 0.0, z)
    first = first / count
    second = vec4(0.0)
    for y in range(-1, 2):
        for x in range(-1, 2):
            c = to_ycocg(color[x, y]) - middle - first
            second += c * c if is_finite(c) else vec4(0.0)
    spread = sqrt(second / count) * sigmas

    place = vec2(pixel()) + 0.5 - way.xy
    there = ivec2(floor(place))
    inside = there.x >= 0 and there.y >= 0 and there.x < history.size.x and there.y < history.size.y
    frames = kept.texel(there).g if inside else 0.0
    if knows_distance and frames > 0.0:
        # hidden before, if everything visible around it was nearer
        hidden = True
        for y in range(-1, 2):
            for x in range(-1, 2):
                hidden = hidden and stands_before(kept.texel(there + ivec2(x, y)).r, way.z)
        # a position behind the previous eye was in no picture, whatever its pixel shows
        frames = 0.0 if hidden or way.z < 0.0 else frames
    before = between_texels(history, place) if frames > 0.0 else here
    frames = min(frames, most_frames - 1.0) if is_finite(before) else 0.0
    if frames <= 0.0:
        return here, vec2(distance, 1.0)
    old = clipped(to_ycocg(before), middle + first, spread)
    share = 1.0 / (frames + 1.0)
    if hdr:
        # lamps that only some frames sample get little weight, and do not flicker
        new_weight, old_weight = share / (1.0 + max(middle.x, 0.0)), (1.0 - share) / (1.0 + max(old.x, 0.0))
        share = new_weight / (new_weight + old_weight)
    return from_ycocg(mix(old, middle, share)), vec2(distance, frames + 1.0)


@effect("taa", "picture+depth", linear=True, alpha="premultiplied")
def taa(
    color: pg.Target,
    depth: pg.Target,
    *,
    camera: pg.Camera | pg.Value | None = None,
    previous_camera: pg.Camera | pg.Value | None = None,
    velocity: pg.Target | None = None,
    most_frames: Annotated[int, pg.Range(1, 256, "frames")] | pg.Value = 16,
    sigmas: Annotated[float, pg.Range(0, 16)] | pg.Value = 1.25,
    hdr: bool = False,
    vertical_fov_rad: FieldOfView = DEFAULT_FOV_RAD,
    into: pg.TargetSpec | None = None,
    name: str = "taa",
) -> pg.Target:
    """Smooth edges and flicker over the frames of a moving picture (temporal antialiasing).

    Parameters
    ----------
    color : one frame, its camera moved by `passgraph.effects.temporal.jitter.jittered`
    depth : red is the distance along the view axis in scene units, 0 where there is no surface; of the size of
        ``color``
    camera : the camera of both, without jitter; default: one with ``vertical_fov_rad`` at the origin
    previous_camera : the camera of the frame before, without jitter; default: pixels stay where they are
    velocity : replaces that of the cameras: red and green are the motion of each pixel since the frame before, in
        pixels, to the right and down
    most_frames : weight limit of the history, in frames; more is smoother, and follows changing light later
    sigmas : how far history may differ from the new frame, in standard deviations of the 3 by 3 pixels around; less
        leaves fewer ghosts, more is smoother
    hdr : bright samples get less weight, so that small lamps do not flicker; their edges are smooth too
    vertical_fov_rad : full vertical angle of view, without ``camera``
    into : destination target; default: float32 named ``name``
    name : name of the passes and targets

    History follows the nearest surface of the 3 by 3 pixels, is read by a Catmull-Rom spline, and clipped to a box in
    YCoCg.  It starts again where the picture shows areas that were outside of it or, with the cameras' velocity, hidden
    before. Pixels that are NaN or infinite stay for one frame, and do not affect others.

    Source: B. Karis, "High Quality Temporal Supersampling", SIGGRAPH 2014; M. Salvi, "An Excursion in Temporal
    Supersampling", GDC 2016 (variance clipping). Deviation: until ``most_frames`` are reached, all count the same.

    Examples
    --------
    An edge through the center of a pixel, seen in 16 frames by a jittered camera:

    >>> import numpy as np
    >>> from passgraph.effects.temporal.jitter import jitter_px
    >>> with pg.compile(taa(pg.Input("frame"), pg.Input("depth"), sigmas=16.0), backend="reference") as program:
    ...     for number in range(16):
    ...         edge = np.float32(np.arange(5) + jitter_px(number)[0] > 2.0)[None, :, None] * np.ones((5, 5, 4))
    ...         shown = program(frame=edge, depth=np.ones((5, 5, 1)))["taa"]
    >>> shown[2, :, 0].tolist()
    [0.0, 0.0, 0.5, 1.0, 1.0]
    """
    moves, knows_distance = velocity is not None or previous_camera is not None, velocity is None
    if velocity is None and previous_camera is not None:
        seen_by = camera_of(camera, vertical_fov_rad)
        velocity = camera_velocity(depth, seen_by, previous_camera, name=f"{name}_velocity")
    spec = into or pg.target(name, "rgba32f", like=color)
    kept = pg.target(f"{name}_kept", "rg32f", like=color)
    smooth, _ = resolved(
        color, depth, velocity or depth, pg.previous(spec), pg.previous(kept), sigmas, most_frames, moves,
        knows_distance, hdr, into=(spec, kept), name=name,
    )  # fmt: skip
    assert isinstance(smooth, pg.Target)
    return smooth
