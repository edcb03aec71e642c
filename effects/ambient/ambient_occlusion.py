"""Ambient occlusion: light from all around, dimmed where the depth picture shows something in its way."""

# mypy: disable-error-code="no-any-return"
# Values of the kernel language are Any to Python's type checkers.
from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np

import passgraph as pg
from passgraph import Const, Image, vec3, vec4
from passgraph.effects.ambient.occlusion_filter import denoise as denoise_line
from passgraph.effects.ambient.occlusion_filter import enlarge, linearised, linearised_half
from passgraph.effects.ambient.occlusion_search import hemisphere_visibility, horizon_visibility
from passgraph.effects.checked import checked, effect
from passgraph.effects.color.tone_map import tone_map
from passgraph.effects.effect_options import picture_of
from passgraph.effects.quantities import Color, NotNegative, Reach, Share
from passgraph.effects.shadows.shadow_light import ambient_light
from passgraph.effects.shadows.soft_shadow import soft_shadow_passes
from passgraph.effects.surfaces.depth_normals import depth_normals
from passgraph.effects.surfaces.views import Casters, View

Method = Literal["gtao", "ssao"]
#: Planes, taps and points of a search, and shares of its radius.
Slices = Annotated[int, pg.Range(1, 64)]
Steps = Annotated[int, pg.Range(1, 256)]
Falloff = Annotated[float, pg.Range(0, 1, above=True)]
Bias = Annotated[float, pg.Range(0, 1, "of the radius")]
#: The radius where none is given, as a share of the diagonal of what stands in the scene.
RADIUS_SHARE = 0.08


@pg.function
def after_bounces(visibility: float, albedo: vec3) -> vec3:
    """The share of light that arrives when what is hidden reflects light of the surface's own color.

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
    color = base[0, 0].rgb
    if bounces:
        share = after_bounces(occlusion[0, 0].r, color)
    return vec4(max(here.rgb - color * ambient[0, 0].rgb * (1.0 - share), vec3(0.0)), here.a)


@pg.kernel
def first_channel(mask: Image) -> float:
    """Visibility without the depth that the blur needs; fused into its reader."""
    return mask[0, 0].r


@dataclass(frozen=True)
class Occlusion:
    """Targets of `occlusion`.

    Attributes
    ----------
    visibility : the result, of the size of the depth: the share of the light from all around that arrives, 0 to 1
    raw : visibility as searched for, with the noise of few directions, in red, and the linear depth in green; half
        the size with ``half_resolution``
    denoised : of the size of ``raw``; ``raw`` itself without ``denoise``
    linear_depth, normals : what was searched: 1 / depth in perspective, the depth in parallel views, 0 where there is
        no surface
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
    picture : what `ambient_occlusion` returns
    lit : scene-linear, occlusion taken from its ambient light
    unoccluded : the same before; `passgraph.effects.shadows.soft_shadow.SoftShadow.soft_shadow`
    ambient : light from all around on white surfaces, scene-linear
    occlusion : every target of the search, which takes normals from the depth
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
    prefix: str = "",
) -> Occlusion:
    """Ambient visibility of every pixel from depth and normals alone, for any graph that has them.

    Parameters
    ----------
    depth : red is the distance along the view axis in scene units, 0 where there is no surface
    normals : packed, of the camera's frame, in blue and alpha, as in `passgraph.effects.surfaces.g_buffer.GBuffer`
    camera : which both were seen by, or the run value of it
    radius : how far away things still take light, scene units
    method, slices, steps, falloff, thickness, taps, bias, range_check, power, half_resolution, denoise :
        see `ambient_occlusion`
    prefix : of all names, where a graph has several of these

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
    # outside the picture nothing is known, and nothing taken away
    seen = (searched[0].border("zero"), searched[1], frame, radius)
    into = pg.target(f"{prefix}raw visibility", "rg32f", like=searched[0])
    if method == "gtao":
        raw = horizon_visibility(*seen, falloff, thickness, power, slices, steps, into=into, name="horizons")
    else:
        raw = hemisphere_visibility(taps)(*seen, bias, power, range_check, into=into, name="hemisphere")
    clean = raw
    if denoise:
        for axis, direction in (("x", (1, 0)), ("y", (0, 1))):
            into = pg.target(f"{prefix}denoised_{axis}", "rg32f", like=searched[0])
            clean = denoise_line(clean, searched[1], frame, radius, *direction, into=into, name=f"denoise {axis}")
    into = pg.target(f"{prefix}visibility", "r16f", like=depth)
    if half_resolution:
        visibility = enlarge(clean, depth, normals, frame, radius, into=into, name="full size")
    else:
        visibility = first_channel(clean, into=into, name="visibility")
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
    display: bool = True,
) -> AmbientOcclusion:
    """`ambient_occlusion` with every target on the way; parameters as there."""
    light = (ambient, ambient, ambient) if isinstance(ambient, (int, float)) else ambient
    shaded = soft_shadow_passes(scene, ambient=light, display=False)
    camera = pg.Value("camera", pg.Camera, default=scene.camera)
    found = occlusion(
        shaded.depth, depth_normals(shaded.depth, camera), camera,
        radius=_radius_in(scene) if radius is None else radius, method=method,
        slices=slices, steps=steps, falloff=falloff, thickness=thickness, taps=taps, bias=bias,
        range_check=range_check, power=power, half_resolution=half_resolution, denoise=denoise,
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
    """Render a scene with soft shadows and with ambient light that corners and contacts darken.

    Parameters
    ----------
    scene : what is drawn; the camera and the lights are values of each run
    method : horizons, or points of a hemisphere. "gtao" finds, in ``slices`` planes through the line of sight, how
        high things rise on both sides, and integrates the light between; "ssao" asks whether points of a hemisphere
        are seen
    radius : how far away things still take light; left out, 8 % of the diagonal of what stands in the scene
    slices : of gtao: planes through the line of sight; each pixel of 4 by 4 turns them by another angle
    steps : of gtao: taps to each side of a slice, closer together near the pixel
    falloff : of gtao: the share of the radius, from its end, over which things fade out
    thickness : of gtao: by how much a horizon sinks again toward each lower tap behind it; with 0 all that is
        seen is endlessly thick
    taps : of ssao: points of the hemisphere; each pixel of 4 by 4 turns them by another angle
    bias : of ssao: how far before a point something must lie to hide it, as a share of the radius
    range_check : of ssao: what lies farther before or behind than the radius fades out, and beyond twice the
        radius counts nothing; off, a near thing darkens all that it is seen before
    power : exponent on the visibility: 1 is physical, more is darker
    half_resolution : search at half the width and height, then enlarge along surfaces
    denoise : average over the 4 by 4 pixels of the noise, along surfaces
    bounces : lighten by what hidden surfaces of the same color would reflect
    ambient : scene-linear light (or its red, green, blue) from all around, which alone is dimmed
    display : return an 8-bit sRGB picture; off, the scene-linear HDR target

    A run takes ``camera=`` and the lights, as `passgraph.effects.shadows.soft_shadow.soft_shadow` does.

    Returns
    -------
    The target "picture", or "lit" with ``display=False``.

    Source: J. Jimenez, X. Wu, A. Pesce, A. Jarabo, "Practical Real-Time Strategies for Accurate Indirect
    Occlusion", SIGGRAPH 2016 (gtao); M. Mittring, "Finding Next Gen: CryEngine 2", SIGGRAPH 2007, and
    D. Filion, R. McNaughton, "Effects & Techniques", SIGGRAPH 2008 (ssao).  Deviations: slices are spread evenly
    about the line of sight, not on the screen; a pixel's sum is divided by what its slices see of an open
    hemisphere, so that open surfaces stay at 1; a tap's depth is carried over from its texel's center along the
    receiver's plane, so that planes do not hide themselves at any angle; normals are those of the depth, since
    interpolated ones let the triangles of a coarse model hide themselves; there is no temporal filter; ssao
    turns its points by a pattern computed from the pixel's place, not by a texture.

    What a screen-space search cannot know stays: what is hidden or outside the picture takes no light, and
    what is seen is taken to reach endlessly away from the eye.  `passgraph.effects.ambient.contact.contact` has
    neither fault, on floors.

    Examples
    --------
    >>> ambient_occlusion(pg.Scene.shipped()).name
    'picture'
    """


def _radius_in(scene: pg.Scene) -> float:
    """RADIUS_SHARE of the diagonal of all that casts and is no ground."""
    nodes = Casters.of(scene).shadowing_nodes() or list(scene.nodes)
    low = np.min([node.bounds[0] for node in nodes], axis=0)
    high = np.max([node.bounds[1] for node in nodes], axis=0)
    return RADIUS_SHARE * float(np.linalg.norm(high - low))
