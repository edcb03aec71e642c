"""Screen-space global illumination: light that visible surfaces throw on one another."""

# mypy: disable-error-code="no-any-return"
# Values of the kernel language are Any to Python's type checkers.
from __future__ import annotations

from typing import Annotated

import passgraph as pg
from passgraph.effects.ambient.occlusion_filter import denoised_light
from passgraph.effects.ambient.occlusion_search import facing_normal, pattern, spread_point
from passgraph.effects.checked import effect
from passgraph.effects.pictures.decoded import decoded
from passgraph.effects.quantities import FieldOfView, Reach, Share
from passgraph.effects.screen.ssr import Search, hit_by
from passgraph.effects.surfaces.depth_normals import depth_normals
from passgraph.effects.surfaces.geometry import ViewFrame, on_sphere, toward_eye, view_position
from passgraph.effects.surfaces.seen_by import camera_of
from passgraph.effects.surfaces.views import View
from passgraph.effects.temporal.accumulate import MostFrames, accumulate, frame_number
from passgraph.language import Const, Image, clamp, ivec2, normalize, pixel, uv, vec3, vec4
from passgraph.scene.camera import DEFAULT_FOV_RAD

#: Frames after which rays repeat.
PERIOD = 16


@pg.kernel
def gathered(
    color: Image, depth: Image, normals: Image, number: Image, frame: ViewFrame, reach: float, thickness: float,
    steps: Const[int], rays: Const[int], is_moving: Const[bool],
) -> vec4:  # fmt: skip
    """Return the mean light that cosine-weighted rays hit; in alpha the fraction of rays that hit."""
    far = depth[0, 0].r
    if far <= 0.0:
        return vec4(0.0)
    position = view_position(frame, uv(), far)
    n = facing_normal(normals[0, 0].zw, toward_eye(frame, position))
    first = int(16.0 * pattern(pixel()).x) * rays
    if is_moving:
        first += int(number.texel(ivec2(0)).r) % PERIOD * 16 * rays
    search, total = Search(reach, thickness, 0.0), vec4(0.0)
    for i in range(rays):
        point = spread_point(first + i + 1)
        # the normal plus a point of the unit sphere, and a little more, so that the sum is not 0
        ray = normalize(n * 1.0001 + on_sphere(1.0 - 2.0 * point.y, point.x))
        found = hit_by(color, depth, normals, frame, position, n, ray, search, steps)
        total += vec4(found.rgb, 1.0) * found.a
    return total / float(rays)


@pg.kernel
def with_bounced(color: Image, light: Image, albedo: Image, share: float, has_albedo: Const[bool]) -> vec4:
    """Add the part of the gathered light that the surface reflects."""
    here = color[0, 0]
    reflected = clamp(albedo[0, 0].rgb, 0.0, 1.0) if has_albedo else vec3(share)
    return vec4(here.rgb + light[0, 0].rgb * reflected, here.a)


@effect("ssgi", "picture+depth", linear=True, alpha="premultiplied")
def ssgi(
    color: pg.Target,
    depth: pg.Target,
    *,
    albedo: Share | pg.Value | pg.Target = 0.5,
    rays: Annotated[int, pg.Range(1, 64)] = 4,
    reach: Reach | pg.Value = 4.0,
    thickness: Reach | pg.Value = 0.2,
    steps: Annotated[int, pg.Range(1, 1024)] = 32,
    denoise: bool = True,
    most_frames: MostFrames = 1,
    camera: pg.Camera | pg.Value | None = None,
    previous_camera: pg.Camera | pg.Value | None = None,
    vertical_fov_rad: FieldOfView = DEFAULT_FOV_RAD,
    into: pg.TargetSpec | None = None,
    name: str = "ssgi",
) -> pg.Target:
    """Add one bounce of diffuse light between the surfaces of a picture (global illumination).

    Parameters
    ----------
    color : any picture, linear light; what it shows lights its surroundings
    depth : red is the distance along the view axis in scene units, 0 where there is no surface; of the size of
        ``color``. `passgraph.effects.surfaces.engine_depth.distances` computes it from an engine's depth buffer
    albedo : diffusely reflected fraction of the light, 0 to 1. Or a picture of the surfaces' base color, linear, of
        the size of ``color``
    rays : rays of each pixel, denser toward the normal; 4 by 4 pixels share theirs
    reach : length of the rays; light fades over the last fifth
    thickness : of visible surfaces: a ray that passes farther behind them continues
    steps : steps along a ray, each at least a pixel; more find thin objects
    denoise : average over the 4 by 4 pixels of the noise, along surfaces
    most_frames : from 2 on, average over frames, with other rays in each
    camera : the camera of both, from `passgraph.Camera.from_matrices` for an engine's, or its run value. Default: one
        with ``vertical_fov_rad`` at the origin
    previous_camera : with ``most_frames``, the camera of the frame before; default: it does not move
    vertical_fov_rad : full vertical angle of view, without ``camera``
    into : destination target; default: float32 named ``name``
    name : name of the last pass and target

    Surfaces outside of the picture, hidden or seen from behind give no light, nor does the sky. Normals are computed
    from the depth.  Ambient light in the picture is counted twice: lower it in the engine by as much.

    Source: T. Ritschel, T. Grosch, H.-P. Seidel, "Approximating Dynamic Global Illumination in Image Space", I3D 2009.
    Deviation: rays are followed through the picture, as by `passgraph.effects.ssr`, so hidden light is not gathered.

    Examples
    --------
    A wall that faces the eye is lit by nothing else in the picture:

    >>> import numpy as np
    >>> made = ssgi(pg.Input("frame"), pg.Input("depth"))
    >>> frame = np.random.default_rng(1).random((4, 4, 4), np.float32)
    >>> with pg.compile(made, backend="reference") as program:
    ...     bool((program(frame=frame, depth=np.full((4, 4, 1), 3.0))["ssgi"] == frame).all())
    True
    """
    seen_by, is_moving = camera_of(camera, vertical_fov_rad), most_frames > 1
    color = decoded(color, f"{name}_color", "rgba32f")
    normals, frame = depth_normals(depth, seen_by, f"{name} normals"), View(seen_by).frame()
    number = frame_number(f"{name}_number") if is_moving else depth
    label = f"{name}_gathered"
    light = gathered(
        color, depth, normals, number, frame, reach, thickness, steps, rays, is_moving,
        into=pg.target(label, "rgba32f", like=color), name=label,
    )  # fmt: skip
    if denoise:
        light = denoised_light(light, depth, normals, frame, thickness, name)
    if is_moving:
        light = accumulate(light, depth, seen_by, previous_camera, most_frames, name=f"{name}_mean")
    given = (albedo, 0.0, True) if isinstance(albedo, pg.Target) else (depth, albedo, False)
    return with_bounced(color, light, *given, into=into or pg.target(name, "rgba32f"), name=name)
