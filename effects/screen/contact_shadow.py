"""Short shadows from a picture's own depth, for details too fine for a shadow map."""

# mypy: disable-error-code="no-any-return"
# Values of the kernel language are Any to Python's type checkers.
from __future__ import annotations

from typing import Annotated

import numpy as np

import passgraph as pg
from passgraph.effects.ambient.occlusion_filter import denoise, linearised
from passgraph.effects.ambient.occlusion_search import facing_normal, linear_depth_step, pattern
from passgraph.effects.checked import effect
from passgraph.effects.quantities import FieldOfView, Reach, Share, combined
from passgraph.effects.surfaces.depth_normals import depth_normals
from passgraph.effects.surfaces.geometry import (
    ViewFrame,
    line_of_sight,
    linear_on_planes,
    picture_place,
    pixel_step,
    spread,
    toward_eye,
    view_position,
)
from passgraph.effects.surfaces.seen_by import camera_of
from passgraph.effects.surfaces.views import View
from passgraph.language import Const, Image, dot, floor, ivec2, length, mix, output_size, pixel, uv, vec2, vec4
from passgraph.scene.camera import DEFAULT_FOV_RAD

#: Occluders near the end of the ray, and of the thickness, fade over this fraction, so that shadows end softly.
FADE = 0.5
#: The ray ends at this fraction of the distance to the eye, if the picture has no space for it.
NEAREST = 0.1
#: A sun from the upper left.
DEFAULT_LIGHT = pg.Light.directional((0.5, -0.8, -0.4))
#: A step of the ray counts as in front of a surface while it is less than this many pixels behind it.
SLACK_PX = 1.0


@pg.kernel
def way_to_light(
    linear_depth: Image, normals: Image, frame: ViewFrame, toward: vec4, reach: float, thickness: float,
    steps: Const[int],
) -> vec2:  # fmt: skip
    """Return the fraction of the light not occluded by the depth picture (1 without a surface); and the linear depth.

    ``toward`` is the light in the camera's frame: a position (w = 1), or the direction toward it (w = 0).
    """
    linear = linear_depth[0, 0].r
    if linear <= 0.0:
        return vec2(1.0, 0.0)
    far = linear_on_planes(frame, linear)
    position = view_position(frame, uv(), far)
    n = facing_normal(normals[0, 0].zw, toward_eye(frame, position))
    offset = toward.xyz - position * toward.w
    away = max(length(offset), 1e-20)
    way = offset * (min(reach, away if toward.w > 0.0 else reach) / away)
    # where the surface faces away from the light, the picture is dark already
    if dot(n, way) <= 0.0:
        return vec2(1.0, linear)
    # not behind the eye: distances along the ray are positive
    way = way * min((1.0 - NEAREST) * far / max(way.z, 1e-20), 1.0)
    size = pixel_step(frame, output_size(), 1.0)
    step_of_plane = linear_depth_step(frame, n, line_of_sight(frame, uv()), far, size)
    # a straight line on the screen too, and linear there in the linear depth
    last = picture_place(frame, position + way)
    across = (last - uv()) * vec2(output_size())
    along = linear_on_planes(frame, far - way.z) - linear
    hidden = 0.0
    noise = pattern(pixel()).x
    for i in range(steps):
        t = (float(i) + 0.5 + noise) / (float(steps) + 0.5)
        at = across * t
        nearest = floor(at + 0.5)
        found = linear_depth.texel(pixel() + ivec2(nearest)).r
        # the texel's center is next to the ray: its depth is moved along the receiver's plane
        w = found + dot(at - nearest, step_of_plane)
        passing = linear_on_planes(frame, linear + along * t)
        behind = passing - linear_on_planes(frame, max(w, 1e-20))
        slack = SLACK_PX * size.y * spread(frame, passing)
        apart = abs(nearest.x) + abs(nearest.y) > 0.5
        if found > 0.0 and apart and behind > slack and behind < thickness:
            near_end = max(t, behind / thickness)
            hidden = max(hidden, min((1.0 - near_end) / FADE, 1.0))
    return vec2(1.0 - hidden, linear)


@pg.kernel
def take_light(color: Image, share: Image, darkness: float) -> vec4:
    """Remove the shadow's part of the light from a picture."""
    here = color[0, 0]
    return vec4(here.rgb * mix(1.0, share[0, 0].r, darkness), here.a)


@effect("contact-shadow", "picture+depth")
def contact_shadow(
    color: pg.Target,
    depth: pg.Target,
    *,
    light: pg.Light | pg.Value | None = None,
    reach: Reach | pg.Value = 0.25,
    thickness: Reach | pg.Value = 0.25,
    darkness: Share | pg.Value = 0.7,
    steps: Annotated[int, pg.Range(1, 128)] = 16,
    denoised: bool = True,
    camera: pg.Camera | pg.Value | None = None,
    vertical_fov_rad: FieldOfView = DEFAULT_FOV_RAD,
    into: pg.TargetSpec | None = None,
    name: str = "contact_shadow",
) -> pg.Target:
    """Add short shadows where the depth shows something between a surface and the light.

    Parameters
    ----------
    color : any picture, linear light
    depth : red is the distance along the view axis in scene units, 0 where there is no surface; of the size of
        ``color``. `passgraph.effects.surfaces.engine_depth.distances` computes it from an engine's depth buffer
    light : the light, in world space, or its run value; default: a sun from the upper left
    reach : length of the ray toward the light
    thickness : of visible surfaces: a ray that passes farther behind them is free
    darkness : fraction of the picture's light that a shadow removes: the contribution of this light
    steps : steps along the ray; each pixel of 4 by 4 begins at another place
    denoised : average over the 4 by 4 pixels of the noise, along surfaces
    camera : the camera of both, from `passgraph.Camera.from_matrices` for an engine's, or its run value. Default: one
        with ``vertical_fov_rad`` at the origin
    vertical_fov_rad : full vertical angle of view, without ``camera``
    into : destination target; default: float32 named ``name``
    name : name of the last pass and target

    Objects outside of the picture or hidden cast none.  Surfaces that face away from the light stay unchanged, as they
    are not lit.

    Examples
    --------
    >>> import numpy as np
    >>> made = contact_shadow(pg.Input("frame"), pg.Input("depth"))
    >>> with pg.compile(made, backend="reference", size=(4, 4)) as program:
    ...     flat = program(frame=np.ones((4, 4, 4)), depth=np.full((4, 4, 1), 3.0))["contact_shadow"]
    >>> bool((flat == 1.0).all())
    True
    """
    seen_by = camera_of(camera, vertical_fov_rad)
    view = View(seen_by)
    share = share_of_ways(depth, view, light or DEFAULT_LIGHT, reach, thickness, steps, denoised, name)
    shadowed: pg.Target = take_light(color, share, darkness, into=into or pg.target(name, "rgba32f"), name=name)
    return shadowed


def share_of_ways(
    depth: pg.Target,
    view: View,
    light: pg.Light | pg.Value,
    reach: object,
    thickness: object,
    steps: int,
    denoised: bool,
    name: str = "contact_shadow",
) -> pg.Target:
    """Return, for each pixel, the share of one light that the depth lets through, in red."""
    normals, frame, toward = (
        depth_normals(depth, view.camera, f"{name} normals"),
        view.frame(),
        combined(toward_light, view.camera, light),
    )
    linear = linearised(depth, frame, into=pg.target(f"{name} linear depth", "r32f"))
    share: pg.Target = way_to_light(
        linear.border("zero"), normals, frame, toward, reach, thickness, steps,
        into=pg.target(f"{name} ways", "rg32f", like=depth), name="ways to the light",
    )  # fmt: skip
    if denoised:
        for axis, direction in (("x", (1, 0)), ("y", (0, 1))):
            into = pg.target(f"{name} ways_{axis}", "rg32f", like=depth)
            share = denoise(share, normals, frame, reach, *direction, into=into, name=f"denoise ways {axis}")
    return share


def toward_light(camera: pg.Camera, light: pg.Light) -> tuple[float, float, float, float]:
    """Return a light in the camera's frame: its position (w = 1), or its direction (w = 0)."""
    turn = camera.view_rotation()[:3, :3]
    if light.kind == "directional":
        return (*(turn @ -np.asarray(light.direction)).tolist(), 0.0)
    return (*(turn @ np.subtract(light.position, camera.eye)).tolist(), 1.0)
