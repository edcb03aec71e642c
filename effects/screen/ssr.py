"""Screen-space reflections: mirrors, smooth and rough, that reflect other parts of the picture."""

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
from passgraph.effects.surfaces.depth_normals import depth_normals
from passgraph.effects.surfaces.geometry import (
    ViewFrame,
    linear_on_planes,
    on_sphere,
    picture_place,
    pixel_step,
    toward_eye,
    unpack_normal,
    view_position,
)
from passgraph.effects.surfaces.seen_by import camera_of
from passgraph.effects.surfaces.views import View
from passgraph.language import (
    Const,
    Image,
    clamp,
    dot,
    floor,
    isfinite,
    ivec2,
    length,
    mix,
    normalize,
    output_size,
    pixel,
    sqrt,
    uv,
    vec2,
    vec3,
    vec4,
)
from passgraph.scene.camera import DEFAULT_FOV_RAD

#: A ray begins this many pixels in front of its surface, and ends at this fraction of the distance to the eye.
START_PX, NEAREST = 0.5, 0.05
#: Halvings of the step that hit a surface; fraction of the reach over which reflections fade at its end.
HALVINGS, END = 6, 0.2
#: Smoother surfaces than this are denoised less: their rays are close together, and what they reflect is sharp.
SMOOTH = 0.1


@pg.function
def share_inside(first: float, across: float, size: float) -> float:
    """Return the fraction of a ray from ``first`` on before it leaves the range from 0 to ``size``."""
    return ((size if across > 0.0 else 0.0) - first) / across if across != 0.0 else 1.0


@pg.struct
class Search:
    """Limits of reflected rays; see `ssr`."""

    reach: float
    thickness: float
    fade: float


@pg.function
def hit_by(
    color: Image, depth: Image, normals: Image, frame: ViewFrame, position: vec3, n: vec3, ray: vec3, search: Search,
    steps: Const[int],
) -> vec4:  # fmt: skip
    """Return the light of the surface that a ray hits; in alpha the fraction of it that is shown, 0 without a hit."""
    size, far = vec2(output_size()), -position.z
    start = position + n * (START_PX * pixel_step(frame, output_size(), far).y)
    # not behind the eye: distances along the ray are positive
    way = ray * (search.reach * min((1.0 - NEAREST) * far / max(search.reach * ray.z, 1e-20), 1.0))
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
        if found > 0.0 and apart and behind >= 0.0 and behind <= max(search.thickness, distance - before):
            met = t
            break
        before = distance
    if met < 0.0:
        return vec4(0.0)
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
    is_surface = nearest > 0.0 and farthest - nearest <= search.thickness
    light = color.sample(there / size) if is_surface else color.texel(at)
    # the back of a visible surface may look different
    faces = dot(unpack_normal(normals.texel(at).zw), ray) < 0.0
    inside = at.x >= 0 and at.y >= 0 and at.x < output_size().x and at.y < output_size().y
    if not (faces and inside and distance - found <= search.thickness and isfinite(light.r + light.g + light.b)):
        return vec4(0.0)
    rim = min(there, size - there) / size
    shown = clamp(min(rim.x, rim.y) / max(search.fade, 1e-6), 0.0, 1.0)
    gone = length(view_position(frame, there / size, found) - position) / search.reach
    return vec4(light.rgb, shown * clamp((1.0 - gone) / END, 0.0, 1.0))


@pg.function
def facet(n: vec3, v: vec3, alpha: float, point: vec2) -> vec3:
    """Return the normal of a facet that is visible from a direction, of a surface with GGX roughness ``alpha``.

    Source: J. Dupuy, A. Benyoub, "Sampling Visible GGX Normals with Spherical Caps", HPG 2023.  The frame about the
    normal: T. Duff et al., "Building an Orthonormal Basis, Revisited", JCGT 2017.
    """
    side = 1.0 if n.z >= 0.0 else -1.0
    a = -1.0 / (side + n.z)
    x = vec3(1.0 + side * n.x * n.x * a, side * n.x * n.y * a, -side * n.x)
    y = vec3(n.x * n.y * a, side + n.y * n.y * a, -n.y)
    # the surface stretched to a hemisphere, on which visible normals are halfway to points of a spherical cap
    seen = normalize(vec3(dot(v, x) * alpha, dot(v, y) * alpha, dot(v, n)))
    z = (1.0 - point.y) * (1.0 + seen.z) - seen.z
    half = on_sphere(z, point.x) + seen
    return normalize(x * (half.x * alpha) + y * (half.y * alpha) + n * half.z)


@pg.function
def unshadowed(n_v: float, n_l: float, alpha: float) -> float:
    """Return the fraction of the light reflected by visible facets that no other facet blocks.

    Source: E. Heitz, "Understanding the Masking-Shadowing Function in Microfacet-Based BRDFs", JCGT 2014, G2 / G1 with
    height-correlated masking.
    """
    to_eye = n_l * sqrt(mix(n_v * n_v, 1.0, alpha * alpha))
    to_light = n_v * sqrt(mix(n_l * n_l, 1.0, alpha * alpha))
    return (n_l * n_v + to_eye) / (to_light + to_eye)


@pg.kernel
def reflected(
    color: Image, depth: Image, normals: Image, mask: Image, roughness: Image, frame: ViewFrame, reflectance: float,
    rough: float, reach: float, thickness: float, fade: float, steps: Const[int], rays: Const[int],
    has_mask: Const[bool], has_roughness: Const[bool],
) -> vec4:  # fmt: skip
    """Return reflected light times its share of the pixel, and that share: of one mirrored ray, or the mean of
    ``rays`` about it."""
    far = depth[0, 0].r
    if far <= 0.0:
        return vec4(0.0)
    position = view_position(frame, uv(), far)
    v = toward_eye(frame, position)
    n = facing_normal(normals[0, 0].zw, v)
    search = Search(reach, thickness, fade)
    most = clamp(mask[0, 0].r, 0.0, 1.0) if has_mask else 1.0
    given = clamp(roughness[0, 0].r, 0.0, 1.0) if has_roughness else rough
    alpha = given * given
    first = int(16.0 * pattern(pixel()).x) * rays
    total = vec4(0.0)
    for i in range(rays if rays > 0 else 1):
        m = n
        if rays > 0:
            m = facet(n, v, alpha, spread_point(first + i + 1))
        cosine = dot(m, v)
        ray = m * (2.0 * cosine) - v
        n_l = dot(n, ray)
        if rays == 0 or n_l > 0.0:
            found = hit_by(color, depth, normals, frame, position, n, ray, search, steps)
            grazing = 1.0 - cosine
            share = reflectance + (1.0 - reflectance) * grazing * grazing * grazing * grazing * grazing
            if rays > 0:
                share *= unshadowed(dot(n, v), n_l, alpha)
            share = share * most * found.a
            total += vec4(found.rgb * share, share)
    return total / float(rays) if rays > 0 else total


@pg.kernel
def with_reflections(
    color: Image, sharp: Image, smooth: Image, roughness: Image, rough: float, has_roughness: Const[bool]
) -> vec4:
    """Replace a share of each pixel by its reflection; rough surfaces take the denoised one."""
    here, light = color[0, 0], sharp[0, 0]
    given = clamp(roughness[0, 0].r, 0.0, 1.0) if has_roughness else rough
    light = mix(light, smooth[0, 0], clamp(given / SMOOTH, 0.0, 1.0))
    return vec4(here.rgb * (1.0 - light.a) + light.rgb, here.a) if light.a > 0.0 else here


@effect("ssr", "picture+depth", linear=True, alpha="premultiplied")
def ssr(
    color: pg.Target,
    depth: pg.Target,
    *,
    reflectance: Share | pg.Value = 0.3,
    mask: pg.Target | None = None,
    roughness: Share | pg.Value | pg.Target = 0.0,
    rays: Annotated[int, pg.Range(1, 64)] = 4,
    reach: Reach | pg.Value = 10.0,
    thickness: Reach | pg.Value = 0.2,
    fade: Share | pg.Value = 0.1,
    steps: Annotated[int, pg.Range(1, 1024)] = 64,
    camera: pg.Camera | pg.Value | None = None,
    vertical_fov_rad: FieldOfView = DEFAULT_FOV_RAD,
    into: pg.TargetSpec | None = None,
    name: str = "ssr",
) -> pg.Target:
    """Add screen-space reflections: smooth or rough mirrors that reflect other parts of the picture.

    Parameters
    ----------
    color : any picture, linear light
    depth : red is the distance along the view axis in scene units, 0 where there is no surface; of the size of
        ``color``. `passgraph.effects.surfaces.engine_depth.distances` computes it from an engine's depth buffer
    reflectance : reflected fraction of the light at normal incidence, 1 at grazing angles: 0.04 is water, glass and
        lacquer, 0.5 to 1 metal
    mask : reflecting surfaces; red is a factor of their reflectance, 0 to 1. Default: all reflect
    roughness : of the reflecting surfaces, 0 (mirrors) to 1 as in glTF: its square is GGX's alpha. Or a picture with it
        in red, of the size of ``color``
    rays : rays of each pixel, for rough surfaces; 4 by 4 pixels share theirs
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
    stays unchanged.  Normals are computed from the depth.

    Rays of rough surfaces are spread as GGX facets are, so reflections blur with the distance from the mirror, and
    stretch at grazing angles.  Each pixel of 4 by 4 has other rays, and the mean over these is taken along surfaces.

    Source: M. McGuire, M. Mara, "Efficient GPU Screen-Space Ray Tracing", JCGT 2014; C. Schlick, "An Inexpensive BRDF
    Model for Physically-based Rendering", 1994; T. Stachowiak, "Stochastic Screen-Space Reflections", SIGGRAPH 2015
    (rough surfaces). Deviations: steps are as long as the ray in the picture needs, and the one that hits a surface is
    halved six times; neighbors share the mean of their rays, not the hits.

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
    rough = (roughness, 0.0, True) if isinstance(roughness, pg.Target) else (depth, roughness, False)
    is_mirror = roughness == 0.0
    sharp = reflected(
        light, depth, normals, mask or depth, rough[0], frame, reflectance, rough[1], reach, thickness, fade, steps,
        0 if is_mirror else rays, mask is not None, rough[2],
        into=pg.target(f"{name}_sharp", "rgba32f", like=color), name=f"{name}_sharp",
    )  # fmt: skip
    smooth = sharp
    if not is_mirror:
        smooth = denoised_light(sharp, depth, normals, frame, thickness, name)
    result: pg.Target = with_reflections(
        light, sharp, smooth, *rough, into=into or pg.target(name, "rgba32f"), name=name
    )
    return result
