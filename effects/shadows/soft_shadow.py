"""Soft shadows by post-effect: RTT1 × blurred RTT2."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Any, Literal

import numpy as np

import passgraph as pg
from passgraph.effects.checked import checked, effect
from passgraph.effects.color.tone_map import Curve, tone_map
from passgraph.effects.effect_options import picture_of
from passgraph.effects.filters.blur import gaussian_blur
from passgraph.effects.parameters import Called
from passgraph.effects.quantities import Color, Exposure, MapSize, NotNegative, Share, Width
from passgraph.effects.shadows.lighting import Lighting
from passgraph.effects.shadows.shadow_blur import blur_along_surfaces
from passgraph.effects.shadows.shadow_choice import Auto, Blur, DecidedFilter, MomentFilter, ShadowFilter
from passgraph.effects.shadows.shadow_light import (
    lit,
    lit_rgb,
    multiply,
    multiply_rgb,
    split,
    split_rgb,
)
from passgraph.effects.surfaces.g_buffer import GBuffer, g_buffer
from passgraph.effects.surfaces.views import Casters, View
from passgraph.records import dataclass

HdrFormat = Literal["rgba16f", "rgb32f", "rgba32f"]
#: A linear sky blue, distinct from a white surface under the default light.
SKY = (0.32, 0.42, 0.55)


@dataclass(frozen=True)
class SoftShadow:
    """The targets of the effect, to inspect or to build on.

    Attributes
    ----------
    picture : the result of `soft_shadow`
    soft_shadow : RTT4, scene-linear HDR
    unshadowed : RTT1, the textured scene without shadows, scene-linear HDR
    shadows : RTT2, white objects with shadows only: the fraction of each channel's light that arrives, 0 to 1
    shadows_blurred : RTT3; RTT2 itself without a blur
    depth : RTTDepth, distance along the view axis in scene units, 0 where there is no surface
    normals : see `passgraph.effects.surfaces.g_buffer.GBuffer`
    base_color : linear, with the background
    shadow_maps : one per light, six for a point light amid the scene
    notes : steps that this scene makes unnecessary
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
    softness: Width | pg.Value | None = None,
    filter: Annotated[ShadowFilter | None, Called("shadow_filter")] = None,
    map_size: MapSize = 1024,
    fit: Literal["view", "scene"] = "view",
    map_blur_px: Annotated[int, pg.Range(0, 31, "texels")] = 0,
    ambient: NotNegative | Color = 0.25,
    background: Color = SKY,
    background_alpha: Share = 1.0,
    hdr_format: HdrFormat = "rgba16f",
    exposure_stops: Exposure | pg.Value = 0.0,
    curve: Curve = "linear",
    display: bool = True,
) -> SoftShadow:
    """Return `soft_shadow` with all intermediate targets; parameters as there.

    Examples
    --------
    >>> passes = soft_shadow_passes(pg.Scene.shipped(), softness=0.0)
    >>> passes.shadows_blurred is passes.shadows
    True
    """
    chosen = decided(Auto() if filter is None else filter, scene, softness)
    notes: list[str] = []
    view = View(pg.Value("camera", pg.Camera, default=scene.camera))
    seen = g_buffer(scene, view, background)
    lights = lights_of(scene)
    casters = Casters.in_scene(scene)
    width = width_of_edges(softness, lights, casters)
    lighting = Lighting(scene, view, seen, lights, casters, map_size, map_blur_px, notes, chosen, fit == "view", width)
    free, shadowed = lighting.sums((ambient, ambient, ambient) if isinstance(ambient, (int, float)) else ambient)
    wide = hdr_format == "rgb32f"
    without_surface: dict[str, Any] = {} if wide else {"background_alpha": background_alpha}
    if not lighting.maps:
        light = (lit_rgb if wide else lit)(
            free,
            seen.color,
            seen.depth,
            **without_surface,
            into=pg.target("unshadowed", hdr_format, notes=tuple(notes)),
        )
        picture = _shown(light, exposure_stops, curve) if display else light
        return SoftShadow(picture, light, light, None, None, seen.depth, seen.normals, seen.color, (), tuple(notes))
    unshadowed, shadows = (split_rgb if wide else split)(
        free, shadowed, seen.color, seen.depth, **without_surface,
        into=(pg.target("unshadowed", hdr_format), pg.target("shadows", "rgba16f")),
        name="unshadowed and shadows",
    )  # fmt: skip
    blurred = blurred_shadows(shadows, seen, view, chosen, width, notes)
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


@effect("soft-shadow", "scene")
@picture_of(soft_shadow_passes)
def soft_shadow() -> None:
    """Render a scene with soft shadows: one shadow map per light, one mask of all, times the lit scene.

    Parameters
    ----------
    scene : the scene to draw; geometry and materials are built in, the camera and the lights are values of each run
    softness : half width of shadow edges; 0 disables the blur. Filters with a width of their own ignore it (`Penumbra`,
        `Pcss`, `Pcf`, `Hard`); for the others the default comes from the lights' radius and the size of the casters
    filter : shadow filter, soft or hard; default: `Auto`. Else `Blur`, `Hard`, `Pcf`, `Disc`, `Pcss`, `Penumbra`,
        `Vsm`, `Evsm4` or `Msm`, with its settings, such as ``Pcss(taps=16)``. `Blur` blurs the shadows on the screen;
        the others filter during the comparison with the map, or blur maps of moments of the depth once for each
        position of the light, and nothing is blurred after that
    map_size : texels along each side of a shadow map; maps of moments are blurred over at most an eighth of that to
        each side
    fit : region of maps: the camera's view, or the whole scene. "view" narrows each map to the visible receivers and
        the casters in front of them, with more texels near the camera under suns; the map is drawn again when that
        changes by more than a 64th. "scene" contains all casters, as do maps of `Disc` and of moments
    map_blur_px : blurs the shadow maps themselves, before they are compared, which softens nothing. Texels to each
        side: a depth is not a color, so this moves edges and softens nothing; for demonstration, 0 is right
    ambient : scene-linear ambient light (or its red, green, blue), not affected by shadows
    background : scene-linear color where there is no surface
    background_alpha : alpha there; 0 for a picture to be overlaid on others, in formats with alpha. Translucent
        surfaces in front of the background are as opaque as that
    hdr_format : format of the lit picture (RTT1 and RTT4); "rgb32f" is 96-bit HDR
    exposure_stops : brightness before the curve, factor 2 per stop
    curve : compression of high values. See `passgraph.effects.color.tone_map.tone_map`
    display : return an 8-bit sRGB picture; off, the scene-linear HDR target

    Returns
    -------
    The target "picture", or "soft_shadow" with ``display=False``.  A run takes ``camera=``, and ``light=`` (with
    several lights ``light0=``, ``light1=`` …); defaults are those of the scene.

    Source: soft shadows by blurring the shadow mask on the screen, with a depth texture against its shrinking as the
    camera recedes. Deviations: the mask is the fraction of each channel's light that arrives, so that many lights need
    one blur; the blur's width is given in scene units; translucent surfaces get the shadow of the surface behind them.
    The sources of the filters are in `passgraph.effects.shadows.shadow_filters` and
    `passgraph.effects.shadows.shadow_moments`. Maps of moments are blurred uniformly: under point and spot lights their
    ``softness`` holds at the middle of the casters' depths, and under light at a grazing angle a caster casts no shadow
    on surfaces nearer to it than the depth of the floor within the blur.

    Examples
    --------
    >>> picture = soft_shadow(pg.Scene.shipped(), map_size=64)
    >>> with pg.compile(picture, backend="null", size=(32, 18)) as program:
    ...     [step.name for step in program.plan.steps][-3:]
    ['penumbrae of light', 'soft_shadow', 'picture']
    """


def _shown(hdr: pg.Target, exposure_stops: float | pg.Value, curve: Curve) -> pg.Target:
    return tone_map(hdr, exposure_stops, curve, into=pg.target("picture", "rgba8"), name="picture")


def lights_of(scene: pg.Scene) -> list[pg.Value]:
    """Return the lights of a scene as run values: "light", or "light0", "light1" …"""
    return [
        pg.Value("light" if len(scene.lights) == 1 else f"light{i}", pg.Light, static=True, default=light)
        for i, light in enumerate(scene.lights)
    ]


def blurred_shadows(
    shadows: pg.Target, seen: GBuffer, view: View, chosen: DecidedFilter, width: object, notes: list[str]
) -> pg.Target:
    """Return RTT3 from RTT2, which it is without a blur on the screen; ``notes`` gives the reason."""
    if isinstance(chosen, MomentFilter):
        notes.append(f"no blur on the screen: filter={chosen} blurs the shadow maps")
        return shadows
    if not isinstance(chosen, Blur):
        notes.append(f"no blur: filter={chosen} filters where the map is compared")
        return shadows
    if width is None:
        notes.append("no blur: the shadows' softness is 0")
        return shadows
    if chosen.width == "constant":
        into = pg.target("shadows_blurred", "rgba16f")
        return gaussian_blur(shadows, chosen.radius_px / 2.0, chosen.radius_px, into=into, name="shadow blur")
    return blur_along_surfaces(shadows, seen.normals, seen.depth, width, view.frame(), chosen.radius_px)


def decided(given: ShadowFilter, scene: pg.Scene, softness: float | pg.Value | None) -> DecidedFilter:
    """Resolve `Auto`: penumbrae of the lights' own width need lights with an extent, and no other width."""
    if not isinstance(given, Auto):
        return given
    if softness is not None or given.blur.width == "constant" or all(light.radius == 0.0 for light in scene.lights):
        return given.blur
    return given.penumbra


def width_of_edges(given: float | pg.Value | None, lights: Sequence[pg.Value], casters: Casters) -> object:
    """Return the blur's half width in scene units: a number, a run value, or None for no blur."""
    if given is not None:
        return given if isinstance(given, (pg.Value, pg.Derived)) or given > 0.0 else None
    if all(isinstance(value.default, pg.Light) and value.default.radius == 0.0 for value in lights):
        return None
    sizes = sorted(float(np.linalg.norm(node.bounds[1] - node.bounds[0])) for node in casters.shadowing_nodes())
    if not sizes:
        return None
    # Half their median; np.median imports numpy.ma.
    away = 0.25 * (sizes[(len(sizes) - 1) // 2] + sizes[len(sizes) // 2])
    centre = casters.origin

    def width(*given_lights: pg.Light) -> float:
        """Return penumbra half widths at that distance behind a caster, weighted by intensity."""
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
