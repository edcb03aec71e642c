"""Screen-space reflections: mirrors that reflect other parts of the picture."""

# mypy: disable-error-code="no-any-return"
# Values of the kernel language are Any to Python's type checkers.
from __future__ import annotations

from typing import Annotated

import passgraph as pg
from passgraph import Const, Image, clamp, dot, floor, isfinite, ivec2, length, mix, output_size, pixel, uv, vec2, vec4
from passgraph.effects.ambient.occlusion_search import facing_normal
from passgraph.effects.checked import effect
from passgraph.effects.pictures.decoded import decoded
from passgraph.effects.quantities import FieldOfView, Reach, Share
from passgraph.effects.screen.seen_by import camera_of
from passgraph.effects.surfaces.depth_normals import depth_normals
from passgraph.effects.surfaces.geometry import (
    ViewFrame,
    linear_on_planes,
    picture_place,
    pixel_step,
    toward_eye,
    unpack_normal,
    view_position,
)
from passgraph.effects.surfaces.views import View
from passgraph.scene.camera import DEFAULT_FOV_RAD

#: A ray begins this many pixels in front of its surface, and ends at this fraction of the distance to the eye.
START_PX, NEAREST = 0.5, 0.05
#: Halvings of the step that hit a surface; fraction of the reach over which reflections fade at its end.
HALVINGS, END = 6, 0.2


@pg.function
def share_inside(first: float, across: float, size: float) -> float:
    """Return the fraction of a ray from ``first`` on before it leaves the range from 0 to ``size``."""
    return ((size if across > 0.0 else 0.0) - first) / across if across != 0.0 else 1.0


@pg.kernel
def mirrored(
    color: Image, depth: Image, normals: Image, mask: Image, frame: ViewFrame, reflectance: float, reach: float,
    thickness: float, fade: float, steps: Const[int], has_mask: Const[bool],
) -> vec4:  # fmt: skip
    """Add to the picture what the reflected line of sight hits."""
    here, far = color[0, 0], depth[0, 0].r
    if far <= 0.0:
        return here
    size, position = vec2(output_size()), view_position(frame, uv(), far)
    v = toward_eye(frame, position)
    n = facing_normal(normals[0, 0].zw, v)
    cosine = dot(n, v)
    ray = n * (2.0 * cosine) - v
    start = position + n * (START_PX * pixel_step(frame, output_size(), far).y)
    # not behind the eye: distances along the ray are positive
    way = ray * (reach * min((1.0 - NEAREST) * far / max(reach * ray.z, 1e-20), 1.0))
    # a straight line on the screen too, with a linear `linear_on_planes`
    first, last = picture_place(frame, start) * size, picture_place(frame, start + way) * size
    near = linear_on_planes(frame, -start.z)
    change = linear_on_planes(frame, -start.z - way.z) - near
    across = last - first
    end = min(1.0, share_inside(first.x, across.x, size.x), share_inside(first.y, across.y, size.y))
    count = clamp(int(max(abs(across.x), abs(across.y)) * end), 1, steps)
    step, before = end / float(count), -start.z
    met = -1.0
    for i in range(count):
        t = step * (float(i) + 1.0)
        distance = linear_on_planes(frame, near + change * t)
        at = ivec2(floor(first + across * t))
        found = depth.texel(at).r
        behind = distance - found
        apart = at.x != pixel().x or at.y != pixel().y
        # a step that goes deeper than the surface's thickness may begin in front of it
        if found > 0.0 and apart and behind >= 0.0 and behind <= max(thickness, distance - before):
            met = t
            break
        before = distance
    if met < 0.0:
        return here
    low = met - step
    for _ in range(HALVINGS):
        t = 0.5 * (low + met)
        found = depth.texel(ivec2(floor(first + across * t))).r
        if found > 0.0 and linear_on_planes(frame, near + change * t) >= found:
            met = t
        else:
            low = t
    there = first + across * met
    at = ivec2(floor(there))
    found = depth.texel(at).r
    distance = linear_on_planes(frame, near + change * met)
    around = depth.gather(there / size, 0)
    farthest = max(around.x, around.y, around.z, around.w)
    nearest = min(around.x, around.y, around.z, around.w)
    # next to an edge, the background does not count
    light = color.sample(there / size) if nearest > 0.0 and farthest - nearest <= thickness else color.texel(at)
    # the back of a visible surface may look different
    faces = dot(unpack_normal(normals.texel(at).zw), ray) < 0.0
    inside = at.x >= 0 and at.y >= 0 and at.x < output_size().x and at.y < output_size().y
    if not (faces and inside and distance - found <= thickness and isfinite(light.r + light.g + light.b)):
        return here
    rim = min(there, size - there) / size
    shown = clamp(min(rim.x, rim.y) / max(fade, 1e-6), 0.0, 1.0)
    gone = length(view_position(frame, there / size, found) - position) / reach
    shown *= clamp((1.0 - gone) / END, 0.0, 1.0)
    grazing = 1.0 - cosine
    share = reflectance + (1.0 - reflectance) * grazing * grazing * grazing * grazing * grazing
    if has_mask:
        share *= clamp(mask[0, 0].r, 0.0, 1.0)
    return vec4(mix(here.rgb, light.rgb, share * shown), here.a)


@effect("ssr", "picture+depth", linear=True, alpha="premultiplied")
def ssr(
    color: pg.Target,
    depth: pg.Target,
    *,
    reflectance: Share | pg.Value = 0.3,
    mask: pg.Target | None = None,
    reach: Reach | pg.Value = 10.0,
    thickness: Reach | pg.Value = 0.2,
    fade: Share | pg.Value = 0.1,
    steps: Annotated[int, pg.Range(1, 1024)] = 64,
    camera: pg.Camera | pg.Value | None = None,
    vertical_fov_rad: FieldOfView = DEFAULT_FOV_RAD,
    into: pg.TargetSpec | None = None,
    name: str = "ssr",
) -> pg.Target:
    """Add screen-space reflections: mirrors that reflect other parts of the picture.

    Parameters
    ----------
    color : any picture, linear light
    depth : red is the distance along the view axis in scene units, 0 where there is no surface; of the size of
        ``color``. `passgraph.effects.surfaces.engine_depth.distances` computes it from an engine's depth buffer
    reflectance : reflected fraction of the light at normal incidence, 1 at grazing angles: 0.04 is water, glass and
        lacquer, 0.5 to 1 metal
    mask : reflecting surfaces; red is a factor of their reflectance, 0 to 1. Default: all reflect
    reach : length of the reflected rays; they fade over the last fifth
    thickness : of visible surfaces: a ray that passes farther behind them continues
    fade : fraction of the picture's size over which reflections of objects near its border fade
    steps : steps along the ray, each at least a pixel; more find thin objects
    camera : the camera of both, from `passgraph.Camera.from_matrices` for an engine's, or its run value. Default: one
        with ``vertical_fov_rad`` at the origin
    vertical_fov_rad : full vertical angle of view, without ``camera``
    into : destination target; default: float32 named ``name``
    name : name of the last pass and target

    Objects outside of the picture, hidden or seen from behind are not reflected, nor is the sky: there the picture
    stays unchanged.  Normals are computed from the depth, and mirrors are smooth.
    Source: M. McGuire, M. Mara, "Efficient GPU Screen-Space Ray Tracing", JCGT 2014; C. Schlick, "An Inexpensive BRDF
    Model for Physically-based Rendering", 1994. Deviations: steps are as long as the ray in the picture needs, and the
    one that hits a surface is halved six times.

    Examples
    --------
    A wall that faces the eye reflects objects behind the eye, which are in no picture:

    >>> import numpy as np
    >>> made = ssr(pg.Input("frame"), pg.Input("depth"), reflectance=1.0)
    >>> frame = np.random.default_rng(1).random((4, 4, 4), np.float32)
    >>> with pg.compile(made, backend="reference") as program:
    ...     bool((program(frame=frame, depth=np.full((4, 4, 1), 3.0))["ssr"] == frame).all())
    True
    """
    seen_by = camera_of(camera, vertical_fov_rad)
    light = decoded(color, f"{name}_light", "rgba32f")
    normals, frame = depth_normals(depth, seen_by, f"{name} normals"), View(seen_by).frame()
    result: pg.Target = mirrored(
        light, depth, normals, mask or depth, frame, reflectance, reach, thickness, fade, steps, mask is not None,
        into=into or pg.target(name, "rgba32f"), name=name,
    )  # fmt: skip
    return result
