"""Means over frames of noisy pictures, each pixel followed to the earlier positions of its surface."""

# mypy: disable-error-code="no-any-return"
# Values of the kernel language are Any to Python's type checkers.
from __future__ import annotations

from typing import Annotated

import passgraph as pg
from passgraph.effects.checked import checked
from passgraph.effects.temporal.taa import is_finite, stands_before
from passgraph.effects.temporal.velocity import camera_velocity
from passgraph.language import Const, Image, floor, ivec2, mix, pixel, vec2, vec3, vec4

#: The number of frames in a mean; 1 takes each frame alone.
MostFrames = Annotated[int, pg.Range(1, 256, "frames")]
#: Frames after which noise repeats.
PERIOD = 256
#: Least weight of the reprojected texels that count.
LEAST_WEIGHT = 0.01


@pg.kernel
def next_number(before: Image) -> float:
    number = before.texel(ivec2(0)).r + 1.0
    return number if number < float(PERIOD) else 0.0


def frame_number(name: str) -> pg.Target:
    """Return a picture of one texel that counts the runs of a program, from 1 to `PERIOD` - 1 and on from 0."""
    spec = pg.target(name, "r32f", (1, 1))
    number: pg.Target = next_number(pg.previous(spec), into=spec, name=name)
    return number


@pg.kernel
def averaged(
    picture: Image, depth: Image, velocity: Image, history: Image, kept: Image, most_frames: float, moves: Const[bool]
) -> tuple[vec4, vec2]:
    """Return the mean over frames; and the distance, with the number of frames."""
    here, distance = picture[0, 0], depth[0, 0].r
    if not is_finite(here):
        return here, vec2(distance, 0.0)
    way = velocity[0, 0].rgb if moves else vec3(0.0, 0.0, distance)
    place = vec2(pixel()) - way.xy
    base = ivec2(floor(place))
    f = place - vec2(base)
    old, weight, frames = vec4(0.0), 0.0, 0.0
    for k in range(4):
        at = base + ivec2(k & 1, k >> 1)
        before = kept.texel(at)
        inside = at.x >= 0 and at.y >= 0 and at.x < kept.size.x and at.y < kept.size.y
        # another surface was there, or nothing
        same = not stands_before(before.r, way.z) and not stands_before(way.z, before.r)
        if inside and same and before.g > 0.0 and way.z >= 0.0:
            share = (f.x if k & 1 == 1 else 1.0 - f.x) * (f.y if k >> 1 == 1 else 1.0 - f.y)
            old += history.texel(at) * share
            frames += before.g * share
            weight += share
    if weight < LEAST_WEIGHT:
        return here, vec2(distance, 1.0)
    frames = min(frames / weight, most_frames - 1.0)
    return mix(old / weight, here, 1.0 / (frames + 1.0)), vec2(distance, frames + 1.0)


@checked
def accumulate(
    picture: pg.Target,
    depth: pg.Target,
    camera: pg.Camera | pg.Value,
    previous_camera: pg.Camera | pg.Value | None = None,
    most_frames: MostFrames = 16,
    into: pg.TargetSpec | None = None,
    name: str = "accumulated",
) -> pg.Target:
    """Average a noisy picture over frames, along the motion of the surfaces that the camera sees.

    Parameters
    ----------
    picture : any values, up to four channels, with other noise in each frame
    depth : red is the distance along the view axis in scene units, 0 where there is no surface; of the size of
        ``picture``
    camera : the camera of both
    previous_camera : the camera of the frame before; default: surfaces stay where they are
    most_frames : weight limit of the history, in frames; more is smoother, and follows changes later
    into : destination target, which keeps the mean from run to run; default: float32 named ``name``
    name : name of the passes and targets

    A pixel's surface was at four texels of the frame before.  Those outside of the picture, or at another distance
    (by 5 %), count as other surfaces. Where all four are, the mean starts again.  NaN and infinity stay for one frame.

    Source: D. Nehab et al., "Accelerating Real-Time Shading with Reverse Reprojection Caching", Graphics Hardware 2007.

    Examples
    --------
    >>> import numpy as np
    >>> camera = pg.Camera((0, 0, 0), (0, 0, -1))
    >>> made = accumulate(pg.Input("noise"), pg.Input("depth"), camera)
    >>> with pg.compile(made, backend="reference") as program:
    ...     for value in (1.0, 2.0, 6.0):
    ...         shown = program(noise=np.full((2, 2, 4), value), depth=np.ones((2, 2, 1)))["accumulated"]
    >>> shown[0, 0].round(6).tolist()
    [3.0, 3.0, 3.0, 3.0]
    """
    velocity = depth
    if previous_camera is not None:
        velocity = camera_velocity(depth, camera, previous_camera, name=f"{name}_velocity")
    spec = into or pg.target(name, "rgba32f", like=picture)
    kept = pg.target(f"{name}_kept", "rg32f", like=picture)
    mean, _ = averaged(
        picture, depth, velocity, pg.previous(spec), pg.previous(kept), most_frames, previous_camera is not None,
        into=(spec, kept), name=name,
    )  # fmt: skip
    assert isinstance(mean, pg.Target)
    return mean
