"""Ambient occlusion: darken ambient light where the depth picture shows occluders."""

# mypy: disable-error-code="no-any-return"
# Values of the kernel language are Any to Python's type checkers.
from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np

import passgraph as pg
from passgraph.effects.ambient.occlusion_filter import denoise as denoise_line
from passgraph.effects.ambient.occlusion_filter import enlarge, linearised, linearised_half
from passgraph.effects.ambient.occlusion_search import hemisphere_visibility, horizon_visibility
from passgraph.effects.checked import checked, effect
from passgraph.effects.color.tone_map import tone_map
from passgraph.effects.effect_options import picture_of
from passgraph.effects.quantities import Color, NotNegative, Reach, Share
from passgraph.effects.shadows.shadow_light import ambient_light, is_lit
from passgraph.effects.shadows.soft_shadow import soft_shadow_passes
from passgraph.effects.surfaces.depth_normals import depth_normals
from passgraph.effects.surfaces.views import Casters, View
from passgraph.effects.temporal.accumulate import MostFrames, accumulate, frame_number
from passgraph.language import Const, Image, vec3, vec4

Method = Literal["gtao", "ssao"]
#: Limits of slices, taps and points of a search, and fractions of its radius.
Slices = Annotated[int, pg.Range(1, 64)]
Steps = Annotated[int, pg.Range(1, 256)]
Falloff = Annotated[float, pg.Range(0, 1, above=True)]
Bias = Annotated[float, pg.Range(0, 1, "of the radius")]
#: Default radius as a fraction of the diagonal of the scene's objects.
RADIUS_SHARE = 0.08


@pg.function
def after_bounces(visibility: float, albedo: vec3) -> vec3:
    """Return the visible fraction of light after interreflections between surfaces of the same color.

    Source: J. Jimenez et al., 2016, the cubic fitted to path-traced scenes.
    """
    a = 2.0404 * albedo - 0.3324
    b = 0.6417 - 4.7951 * albedo
    c = 2.7552 * albedo + 0.6903
    fitted = ((a * visibility + b) * visibility + c) * visibility
    return max(vec3(visibility), min(fitted, vec3(1.0)))


@pg.kernel
def dim_ambient(lit: Image, base: Image, ambient: Image, occlusion: Image, bounces: Const[bool]) -> vec4:
    """Darken only the ambient part of a surface's light."""
    here = lit[0, 0]
    share = vec3(occlusion[0, 0].r)
    color = base[0, 0].rgb if is_lit(base[0, 0]) else vec3(0.0)
    if bounces:
        share = after_bounces(occlusion[0, 0].r, color)
    return vec4(max(here.rgb - color * ambient[0, 0].rgb * (1.0 - share), vec3(0.0)), here.a)


@pg.kernel
def first_channel(mask: Image) -> float:
    """Drop the depth that the blur needs, and return the visibility; fused into its reader."""
    return mask[0, 0].r


@dataclass(frozen=True)
class Occlusion:
    """Targets of `occlusion`.

    Attributes
    ----------
    visibility : the result, of the size of the depth: the fraction of ambient light that arrives, 0 to 1
    raw : visibility before the blur, noisy, in red, and the linear depth in green; half the size with
        ``half_resolution``
    denoised : of the size of ``raw``; ``raw`` itself without ``denoise``
    linear_depth, normals : inputs of the search: 1 / depth in perspective, the depth in parallel views, 0 where there
        is no surface
    """

    visibility: pg.Target
    raw: pg.Target
    denoised: pg.Target
    linear_depth: pg.Target
    normals: pg.Target


@dataclass(frozen=True)
class AmbientOcclusion:
    """Targets of `ambient_occlusion`.

    Attributes
    ----------
    picture : the result of `ambient_occlusion`
    lit : scene-linear, with occluded ambient light
    unoccluded : the same without occlusion; `passgraph.effects.shadows.soft_shadow.SoftShadow.soft_shadow`
    ambient : ambient light on white surfaces, scene-linear
    occlusion : targets of the search, which takes normals from the depth
    depth, normals, base_color : see `passgraph.effects.surfaces.g_buffer.GBuffer`
    """

    picture: pg.Target
    lit: pg.Target
    unoccluded: pg.Target
    ambient: pg.Target
    occlusion: Occlusion
    depth: pg.Target
    normals: pg.Target
    base_color: pg.Target


@checked
def occlusion(
    depth: pg.Target,
    normals: pg.Target,
    camera: pg.Camera | pg.Value,
    *,
    radius: Reach | pg.Value | pg.Derived,
    method: Method = "gtao",
    slices: Slices = 2,
    steps: Steps = 4,
    falloff: Falloff = 0.6,
    thickness: Share = 0.0,
    taps: Steps = 16,
    bias: Bias = 0.02,
    range_check: bool = True,
    power: NotNegative | pg.Value = 1.0,
    half_resolution: bool = False,
    denoise: bool = True,
    most_frames: MostFrames = 1,
    previous_camera: pg.Camera | pg.Value | None = None,
    prefix: str = "",
) -> Occlusion:
    """Compute the ambient visibility of every pixel from depth and normals, for any graph that has them.

    Parameters
    ----------
    depth : red is the distance along the view axis in scene units, 0 where there is no surface
    normals : packed, in the camera's frame, in blue and alpha, as in `passgraph.effects.surfaces.g_buffer.GBuffer`
    camera : the camera of both, or its run value
    radius : reach of occluders, scene units
    method, slices, steps, falloff, thickness, taps, bias, range_check, power, half_resolution, denoise :
        see `ambient_occlusion`
    most_frames : from 2 on, the result is the mean over this many frames
        (`passgraph.effects.temporal.accumulate.accumulate`), with other noise in each: fewer slices suffice
    previous_camera : with ``most_frames``, the camera of the frame before; default: it does not move
    prefix : prefix of all names, for graphs that use this several times

    Examples
    --------
    >>> import numpy as np
    >>> depth, normals = pg.Input("depth", "r32f"), pg.Input("normals", "rgba16f")
    >>> camera = pg.Camera((0, 0, 0), (0, 0, -1))
    >>> found = occlusion(depth, normals, pg.Value("camera", pg.Camera, default=camera), radius=1.0)
    >>> with pg.compile(found.visibility, backend="reference", size=(8, 8)) as program:
    ...     flat = program(depth=np.full((8, 8, 1), 3.0), normals=np.zeros((8, 8, 4)))["visibility"]
    >>> bool((flat == 1.0).all())
    True
    """
    frame = View(camera).frame()
    if half_resolution:
        small = (
            pg.target(f"{prefix}linear depth", "r32f", like=depth, scale=0.5),
            pg.target(f"{prefix}small normals", "rgba16f", like=depth, scale=0.5),
        )
        searched = linearised_half(depth, normals, frame, into=small, name="half size")
    else:
        searched = linearised(depth, frame, into=pg.target(f"{prefix}linear depth", "r32f")), normals
    # outside of the picture nothing is known, so nothing occludes
    seen = (searched[0].border("zero"), searched[1], frame, radius)
    is_moving = most_frames > 1
    frames = frame_number(f"{prefix}frame number") if is_moving else searched[0], is_moving
    into = pg.target(f"{prefix}raw visibility", "rg32f", like=searched[0])
    if method == "gtao":
        raw = horizon_visibility(*seen, falloff, thickness, power, slices, steps, *frames, into=into, name="horizons")
    else:
        raw = hemisphere_visibility(taps)(*seen, bias, power, range_check, *frames, into=into, name="hemisphere")
    clean = raw
    if denoise:
        for axis, direction in (("x", (1, 0)), ("y", (0, 1))):
            into = pg.target(f"{prefix}denoised_{axis}", "rg32f", like=searched[0])
            clean = denoise_line(clean, searched[1], frame, radius, *direction, into=into, name=f"denoise {axis}")
    into = pg.target(f"{prefix}visibility", "r16f", like=depth)
    visibility = clean
    if half_resolution:
        full = pg.target(f"{prefix}full size", "r32f", like=depth) if is_moving else into
        visibility = enlarge(clean, depth, normals, frame, radius, into=full, name="full size")
    if is_moving:
        label = f"{prefix}accumulated"
        visibility = accumulate(visibility, depth, camera, previous_camera, most_frames, name=label)
    if is_moving or not half_resolution:
        visibility = first_channel(visibility, into=into, name="visibility")
    return Occlusion(visibility, raw, clean, *searched)


@checked
def ambient_occlusion_passes(
    scene: pg.Scene,
    *,
    method: Method = "gtao",
    radius: Reach | pg.Value | None = None,
    slices: Slices = 2,
    steps: Steps = 4,
    falloff: Falloff = 0.6,
    thickness: Share = 0.0,
    taps: Steps = 16,
    bias: Bias = 0.02,
    range_check: bool = True,
    power: NotNegative | pg.Value = 1.0,
    half_resolution: bool = False,
    denoise: bool = True,
    bounces: bool = False,
    ambient: NotNegative | Color = 0.5,
    most_frames: MostFrames = 1,
    display: bool = True,
) -> AmbientOcclusion:
    """Return `ambient_occlusion` with all intermediate targets; parameters as there."""
    light = (ambient, ambient, ambient) if isinstance(ambient, (int, float)) else ambient
    shaded = soft_shadow_passes(scene, ambient=light, display=False)
    camera = pg.Value("camera", pg.Camera, default=scene.camera)
    found = occlusion(
        shaded.depth, depth_normals(shaded.depth, camera), camera,
        radius=_radius_in(scene) if radius is None else radius, method=method,
        slices=slices, steps=steps, falloff=falloff, thickness=thickness, taps=taps, bias=bias,
        range_check=range_check, power=power, half_resolution=half_resolution, denoise=denoise,
        most_frames=most_frames, previous_camera=pg.Value("previous_camera", pg.Camera),
    )  # fmt: skip
    around, _ = ambient_light(
        shaded.normals,
        light,
        View(camera).up(),
        into=(pg.target("ambient", "rgb32f"), pg.target("ambient again", "rgb32f")),
        name="ambient",
    )
    lit = dim_ambient(
        shaded.soft_shadow, shaded.base_color, around, found.visibility, bounces,
        into=pg.target("lit", "rgba16f"), name="lit",
    )  # fmt: skip
    picture = tone_map(lit, 0.0, "linear", into=pg.target("picture", "rgba8"), name="picture") if display else lit
    return AmbientOcclusion(
        picture, lit, shaded.soft_shadow, around, found, shaded.depth, shaded.normals, shaded.base_color
    )


@effect("ambient-occlusion", "scene")
@picture_of(ambient_occlusion_passes)
def ambient_occlusion() -> None:
    """Render a scene with soft shadows and ambient occlusion.

    Parameters
    ----------
    scene : the scene to draw; the camera and the lights are values of each run
    method : horizons, or points of a hemisphere. "gtao" finds, in ``slices`` planes through the line of sight, how high
        occluders rise on both sides, and integrates the light between; "ssao" tests if points of a hemisphere are
        visible
    radius : reach of occluders; default: 8 % of the diagonal of the scene's objects
    slices : for gtao: planes through the line of sight; each pixel of 4 by 4 rotates them by another angle
    steps : for gtao: taps to each side of a slice, closer together near the pixel
    falloff : for gtao: fraction of the radius, at its end, over which occluders fade out
    thickness : for gtao: by how much a horizon sinks again toward each lower tap behind it; with 0 all occluders are
        infinitely thick
    taps : for ssao: points of the hemisphere; each pixel of 4 by 4 rotates them by another angle
    bias : for ssao: least distance of an occluder in front of a point, as a fraction of the radius
    range_check : for ssao: occluders farther in front or behind than the radius fade out, and beyond twice the radius
        have no effect; off, a near object darkens everything behind it
    power : exponent of the visibility: 1 is physical, more is darker
    half_resolution : search at half the width and height, then upsample along surfaces
    denoise : average over the 4 by 4 pixels of the noise, along surfaces
    bounces : lighten by interreflections between surfaces of the same color
    ambient : scene-linear ambient light (or its red, green, blue); only this light is occluded
    most_frames : from 2 on, the occlusion is the mean over this many frames, with other noise in each. 4 frames have a
        third of the noise, and a camera that turns 1 degree a frame smears no more than that noise; 16 have a fifth,
        and smear 2.5 times as much
    display : return an 8-bit sRGB picture; off, the scene-linear HDR target

    A run takes ``camera=`` and the lights, as `passgraph.effects.shadows.soft_shadow.soft_shadow` does; with
    ``most_frames``, also ``previous_camera=``, the camera of the run before.

    Returns
    -------
    The target "picture", or "lit" with ``display=False``.

    Source: J. Jimenez, X. Wu, A. Pesce, A. Jarabo, "Practical Real-Time Strategies for Accurate Indirect
    Occlusion", SIGGRAPH 2016 (gtao); M. Mittring, "Finding Next Gen: CryEngine 2", SIGGRAPH 2007, and
    D. Filion, R. McNaughton, "Effects & Techniques", SIGGRAPH 2008 (ssao).  Deviations: slices are spread evenly about
    the line of sight, not on the screen; a pixel's sum is divided by the sum for an open hemisphere, so that open
    surfaces stay at 1; a tap's depth is moved from its texel's center along the receiver's plane, so that planes do not
    occlude themselves at any angle; normals come from the depth, since interpolated ones make the triangles of a coarse
    model occlude themselves; ssao rotates its points by a pattern computed from the pixel's position, not by a texture.

    Limits of screen space: hidden objects and those outside of the picture do not occlude, and visible objects count as
    infinitely deep.  `passgraph.effects.ambient.contact.contact` has neither limit, on floors.

    Examples
    --------
    >>> ambient_occlusion(pg.Scene.shipped()).name
    'picture'
    """


def _radius_in(scene: pg.Scene) -> float:
    """Return RADIUS_SHARE of the diagonal of everything that casts shadows, without the ground."""
    nodes = Casters.in_scene(scene).shadowing_nodes() or list(scene.nodes)
    low = np.min([node.bounds[0] for node in nodes], axis=0)
    high = np.max([node.bounds[1] for node in nodes], axis=0)
    return RADIUS_SHARE * float(np.linalg.norm(high - low))
