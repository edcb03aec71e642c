"""Soft shadows by post-effect: RTT1 × blurred RTT2."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

import passgraph as pg
from passgraph.effects.blur import gaussian_blur
from passgraph.effects.checked import checked
from passgraph.effects.g_buffer import g_buffer
from passgraph.effects.lighting import Lighting
from passgraph.effects.passes import picture_of
from passgraph.effects.shadow_blur import blur_along_surfaces
from passgraph.effects.shadow_light import (
    lit,
    lit_rgb,
    multiply,
    multiply_rgb,
    split,
    split_rgb,
)
from passgraph.effects.shadow_lookup import FilterChoice, MomentFormat, ShadowFilter
from passgraph.effects.textures import TextureInputs
from passgraph.effects.tone_map import Curve, tone_map
from passgraph.effects.views import Casters, View

HdrFormat = Literal["rgba16f", "rgb32f", "rgba32f"]
HDR_FORMATS: tuple[HdrFormat, ...] = ("rgba16f", "rgb32f", "rgba32f")
#: A linear sky blue that a white surface under the default light stands out from.
SKY = (0.32, 0.42, 0.55)


@dataclass(frozen=True)
class SoftShadow:
    """Every target of the effect, for looking at and for building on.

    Attributes
    ----------
    picture : what `soft_shadow` returns
    soft_shadow : RTT4, scene-linear HDR
    unshadowed : RTT1, the textured scene without shadows, scene-linear HDR
    shadows : RTT2, white objects with shadows only: the share of each channel's light that arrives, 0 to 1
    shadows_blurred : RTT3; RTT2 itself where nothing is to be blurred
    depth : RTTDepth, distance along the view axis in scene units, 0 where there is no surface
    normals : see `passgraph.effects.g_buffer.GBuffer`
    base_color : linear, with the background
    shadow_maps : one a light, six for a point light amid the scene
    notes : what this scene made unnecessary
    """

    picture: pg.Target
    soft_shadow: pg.Target
    unshadowed: pg.Target
    shadows: pg.Target | None
    shadows_blurred: pg.Target | None
    depth: pg.Target
    normals: pg.Target
    base_color: pg.Target
    shadow_maps: tuple[pg.Target, ...] = ()
    notes: tuple[str, ...] = ()


@checked
def soft_shadow_passes(
    scene: pg.Scene,
    *,
    softness: float | pg.Value | None = None,
    shadow_filter: ShadowFilter | Literal["auto"] = "auto",
    pcf_size: int = 5,
    taps: int | None = None,
    bleed: float | None = None,
    exponent: float = 40.0,
    moment_format: MomentFormat = "rgba32f",
    blur: Literal["world", "constant"] = "world",
    radius_px: int = 7,
    map_size: int = 1024,
    fit: Literal["view", "scene"] = "view",
    map_blur_px: int = 0,
    ambient: float | tuple[float, float, float] = 0.25,
    background: tuple[float, float, float] = SKY,
    hdr_format: HdrFormat = "rgba16f",
    exposure_stops: float | pg.Value = 0.0,
    curve: Curve = "linear",
    display: bool = True,
) -> SoftShadow:
    """`soft_shadow` with every target on the way; parameters as there.

    Examples
    --------
    >>> passes = soft_shadow_passes(pg.Scene.shipped(), softness=0.0)
    >>> passes.shadows_blurred is passes.shadows
    True
    """
    _check(softness, blur, radius_px, map_size, map_blur_px, hdr_format)
    if shadow_filter == "auto":
        shadow_filter = _filter_for(scene, softness, blur)
    chosen = FilterChoice(shadow_filter, pcf_size, taps, bleed, exponent, moment_format)
    notes: list[str] = []
    view = View(pg.Value("camera", pg.Camera, default=scene.camera))
    textures = TextureInputs()
    seen = g_buffer(scene, view, textures, background)
    lights = [
        pg.Value("light" if len(scene.lights) == 1 else f"light{i}", pg.Light, static=True, default=light)
        for i, light in enumerate(scene.lights)
    ]
    casters = Casters.of(scene)
    width = _softness(softness, lights, casters)
    lighting = Lighting(
        scene, view, seen, lights, textures, casters, map_size, map_blur_px, notes, chosen, fit == "view", width
    )
    free, shadowed = lighting.sums((ambient,) * 3 if isinstance(ambient, (int, float)) else ambient)
    wide = hdr_format == "rgb32f"
    if not lighting.maps:
        made = (lit_rgb if wide else lit)(
            free,
            seen.color,
            seen.depth,
            into=pg.target("unshadowed", hdr_format, notes=tuple(notes)),
        )
        picture = _shown(made, exposure_stops, curve) if display else made
        return SoftShadow(picture, made, made, None, None, seen.depth, seen.normals, seen.color, (), tuple(notes))
    unshadowed, shadows = (split_rgb if wide else split)(
        free, shadowed, seen.color, seen.depth,
        into=(pg.target("unshadowed", hdr_format), pg.target("shadows", "rgba16f")),
        name="unshadowed and shadows",
    )  # fmt: skip
    if chosen.blurs_maps:
        notes.append(f"no blur on the screen: shadow_filter={shadow_filter!r} blurs the shadow maps")
        blurred = shadows
    elif shadow_filter != "blur":
        notes.append(f"no blur: shadow_filter={shadow_filter!r} filters where the map is compared")
        blurred = shadows
    elif width is None:
        notes.append("no blur: the shadows' softness is 0")
        blurred = shadows
    elif blur == "constant":
        into = pg.target("shadows_blurred", "rgba16f")
        blurred = gaussian_blur(shadows, radius_px / 2.0, radius_px, into=into, name="shadow blur")
    else:
        blurred = blur_along_surfaces(shadows, seen.normals, seen.depth, width, view.tan_half(), radius_px)
    result = (multiply_rgb if wide else multiply)(
        unshadowed, blurred, into=pg.target("soft_shadow", hdr_format, notes=tuple(notes))
    )
    picture = _shown(result, exposure_stops, curve) if display else result
    return SoftShadow(
        picture,
        result,
        unshadowed,
        shadows,
        blurred,
        seen.depth,
        seen.normals,
        seen.color,
        tuple(lighting.maps),
        tuple(notes),
    )


@picture_of(soft_shadow_passes)
def soft_shadow() -> None:
    """A scene with soft shadows: a shadow map a light, one mask of all shadows, times the lit scene.

    Parameters
    ----------
    scene : what is drawn; geometry and materials are built in, the camera and the lights are values of each
        run
    softness : half width of shadow edges in scene units, 0 or more; 0 leaves the blur out. "penumbra", "pcss",
        "pcf" and "hard" have no such width; the others take it, where it is left out, from the lights' radius and
        the size of the casters
    shadow_filter : "auto" is "penumbra", or "blur" where ``softness`` is given, ``blur`` is "constant" or no light
        has a radius. "blur" blurs the shadows on the screen. The others filter where the map is compared, and
        nothing is blurred after that: "penumbra" searches for casters in half the width and height, makes
        penumbrae as wide as the lights' radius and the casters' distance ask, and compares in full size where
        they are narrow. "hard" compares one texel, "pcf" the mean of ``pcf_size`` squared,
        "disc" of ``taps`` over a disc of ``softness``, "pcss" over a disc as wide as the light's radius and
        the casters' distance make the penumbra. "vsm", "evsm4" and "msm" blur maps of moments of the depth
        over a box of half width ``softness``, once for each place of the light: variance, both exponential
        warps, and four moments
    pcf_size : texels along each side with "pcf", odd, 1 to 15
    taps : of "disc", and of the search and of the filter of "pcss", 1 to 128, 32 where left out; of the search of
        "penumbra", which then compares twice as many, 16 where left out
    bleed : shares of light up to this count as none with "vsm", "evsm4" and "msm", 0 to 0.9: it takes leaks
        where casters overlap, and narrows penumbrae; left out, 0.2 with "vsm", else 0.02
    exponent : of "evsm4", 1 to 42, where float32 ends: more leaks less
    moment_format : of the map of "msm": "rgba32f", or "rgba16" with its optimised quantisation
    blur : "world" keeps that width in the scene; "constant" blurs ``radius_px`` pixels wherever the camera is
    radius_px : taps to each side, 1 to 31 (7 makes 15); with blur="constant" the width itself
    map_size : texels along each side of a shadow map, 16 to 8192; maps of moments are blurred over at most
        an eighth of that to each side
    fit : "view" narrows each map to the receivers that the camera sees and the casters before them, with more texels
        near the camera under suns; the map is drawn again when that changes by more than a 64th. "scene" holds all
        casters, whatever the camera sees, as do maps of "disc" and of moments
    map_blur_px : blurs the shadow maps themselves, before they are compared, 0 to 31 texels to each side: a
        depth is not a colour, so that this moves edges and softens nothing; here to be seen, 0 is right
    ambient : scene-linear light (or its red, green, blue) from all around that no shadow takes away
    background : scene-linear colour where there is no surface
    hdr_format : of RTT1 and RTT4: "rgba16f", "rgba32f", or "rgb32f", which is 96-bit HDR
    exposure_stops, curve : see `passgraph.effects.tone_map.tone_map`
    display : return an 8-bit sRGB picture; off, the scene-linear HDR target

    Returns
    -------
    The target "picture", or "soft_shadow" with ``display=False``.  A run takes ``camera=``, and ``light=``
    (with several lights ``light0=``, ``light1=`` …); what is left out is as in the scene.

    Source: soft shadows by blurring the shadow mask on the screen, with a depth texture against its shrinking
    as the camera recedes. Deviations: the mask is the share of each channel's light that arrives, so that
    many lights need one blur; the blur's width is given in scene units; translucent surfaces take the shadow
    of what lies behind them. The sources of the filters stand in `passgraph.effects.shadow_filters` and
    `passgraph.effects.shadow_moments`. Maps of moments are blurred alike everywhere: under point and spot
    lights their ``softness`` holds at the middle of the casters' depths, and under light at a grazing angle a
    caster throws no shadow on what is nearer to it than the depth of the floor within the blur.

    Examples
    --------
    >>> picture = soft_shadow(pg.Scene.shipped(), map_size=64)
    >>> with pg.compile(picture, backend="null", size=(32, 18)) as program:
    ...     [step.name for step in program.plan.steps][-3:]
    ['nearest casters of light', 'penumbrae of light', 'picture']
    """


def _shown(hdr: pg.Target, exposure_stops: float | pg.Value, curve: Curve) -> pg.Target:
    return tone_map(hdr, exposure_stops, curve, into=pg.target("picture", "rgba8"), name="picture")


def _filter_for(scene: pg.Scene, softness: float | pg.Value | None, blur: str) -> ShadowFilter:
    """What "auto" stands for: penumbrae of the lights' own width need lights with an extent, and no other width."""
    if softness is not None or blur == "constant" or all(light.radius == 0.0 for light in scene.lights):
        return "blur"
    return "penumbra"


def _softness(given: float | pg.Value | None, lights: Sequence[pg.Value], casters: Casters) -> object:
    """The blur's half width in scene units: a number, a run value, or None for no blur at all."""
    if given is not None:
        return given if isinstance(given, (pg.Value, pg.Derived)) or given > 0.0 else None
    if all(isinstance(value.default, pg.Light) and value.default.radius == 0.0 for value in lights):
        return None
    sizes = [float(np.linalg.norm(node.bounds[1] - node.bounds[0])) for node in casters.shadowing_nodes()]
    if not sizes:
        return None
    away = 0.5 * float(np.median(sizes))
    centre = casters.origin

    def width(*given_lights: pg.Light) -> float:
        """Penumbra half widths at that distance behind a caster, weighted by intensity."""
        widths, weights = [], []
        for light in given_lights:
            far = (
                1.0
                if light.kind == "directional"
                else max(float(np.linalg.norm(np.subtract(light.position, centre))), away)
            )
            widths.append(light.radius * away / far)
            weights.append(light.intensity + 1e-12)
        return float(np.average(widths, weights=weights))

    return pg.combine(width, *lights)


def _check(softness: object, blur: str, radius_px: int, map_size: int, map_blur_px: int, hdr_format: str) -> None:
    if isinstance(softness, (int, float)) and not 0.0 <= softness < float("inf"):
        raise pg.GraphError(f"soft_shadow: softness must be 0 or more scene units, got {softness!r}")
    if blur not in ("world", "constant"):
        raise pg.GraphError(f"soft_shadow: blur cannot be {blur!r}; it is 'world' or 'constant'")
    if not 1 <= radius_px <= 31:
        raise pg.GraphError(f"soft_shadow: radius_px must be 1 to 31, got {radius_px!r}")
    if not 16 <= map_size <= 8192:
        raise pg.GraphError(f"soft_shadow: map_size must be 16 to 8192, got {map_size!r}")
    if not 0 <= map_blur_px <= 31:
        raise pg.GraphError(f"soft_shadow: map_blur_px must be 0 to 31, got {map_blur_px!r}")
    if hdr_format not in HDR_FORMATS:
        raise pg.GraphError(f"soft_shadow: hdr_format cannot be {hdr_format!r}; it is one of {', '.join(HDR_FORMATS)}")
