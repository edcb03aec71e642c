"""Soft shadows in five passes: a shadow map, a mask of 3 × 3 comparisons, its blur in two passes, the lit scene."""

# mypy: disable-error-code="no-any-return"
# Values of the kernel language are Any to Python's type checkers.
from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

import passgraph as pg
from passgraph.effects.checked import checked, effect
from passgraph.effects.color.srgb_encoding import encode_srgb_wide
from passgraph.effects.effect_options import picture_of
from passgraph.effects.quantities import Color, MapSize, NotNegative
from passgraph.effects.shadows.five_pass_blur import BlurKernel, WeightsFrom, blur_mask
from passgraph.effects.shadows.shadow_filters import caster_at, receiver_at
from passgraph.effects.shadows.shadow_light import KINDS
from passgraph.effects.shadows.shadow_map import NOTHING, caster_meshes, shadow_map
from passgraph.effects.surfaces.batches import Batch, batches
from passgraph.effects.surfaces.g_buffer import Surface, place, sided
from passgraph.effects.surfaces.geometry import facing
from passgraph.effects.surfaces.material_textures import addressed, texture_input, wrap_number
from passgraph.effects.surfaces.views import Casters, LightFrame, MapView, View
from passgraph.language import Const, Image, discard, length, mat3, mat4, output_size, pixel, vec2, vec3, vec4
from passgraph.srgb import linear_to_srgb

MaskFormat = Literal["r8", "r16f", "r32f"]
#: Result of a comparison that finds a caster, so that the mask runs from here to 1.
DARKEST = 0.1
#: Width of the spotlight's picture, texels, and the fraction of its radius over which it fades.
SPOT_TEXELS = 64
SPOT_RIM = 0.35


@dataclass(frozen=True)
class FivePass:
    """The targets of the five passes.

    Attributes
    ----------
    shadow_map : pass 1, r32f, distance along the light's axis in scene units, 1e30 where there is no caster
    mask : pass 2, 0.1 in shadow to 1 in light; 1 where there is no surface
    mask_x, mask_blurred : passes 3 and 4
    picture : pass 5
    """

    shadow_map: pg.Target
    mask: pg.Target
    mask_x: pg.Target
    mask_blurred: pg.Target
    picture: pg.Target


@pg.fragment
def compared(
    surface: Surface, map: Image, base_map: Image, map_from_view: mat4, depth_row: vec4, light_place: vec3,
    light_texel: float, light_bias: float, cutoff: float,
    kind: Const[int], double_sided: Const[bool], receives: Const[bool], masked: Const[bool], has_base: Const[bool],
    base_wrap: Const[int],
) -> float:  # fmt: skip
    """Pass 2: compare nine texels of the shadow map one by one, and average."""
    at = addressed(base_map, surface.uv, base_wrap)
    if masked and surface.color.a * (base_map.sample(at).a if has_base else 1.0) < cutoff:
        discard()
    if not receives:
        return 1.0
    none = vec3(0.0)
    light = LightFrame(
        map_from_view, depth_row, light_place, none, mat3(1.0), none, vec2(0.0), light_texel, light_bias, 0.0, 0.0
    )
    seen = receiver_at(map, light, surface.view, sided(surface.normal, double_sided), 0.0, kind)
    if seen.share >= 0.0:
        return DARKEST + (1.0 - DARKEST) * seen.share
    total = 0.0
    for y in range(-1, 2):
        for x in range(-1, 2):
            total += 1.0 if caster_at(map, seen, vec2(x, y), kind, -1) >= NOTHING else DARKEST
    return total / 9.0


@pg.fragment
def lit(
    surface: Surface, mask: Image, spotlight: Image, base_map: Image, map_from_view: mat4, light_place: vec3,
    light_color: vec3, ambient: float, cutoff: float,
    kind: Const[int], double_sided: Const[bool], masked: Const[bool], has_base: Const[bool], base_wrap: Const[int],
    unlit: Const[bool], display: Const[bool],
) -> vec4:  # fmt: skip
    """Pass 5: multiply light per pixel by the mask and the spotlight's picture."""
    color = surface.color
    if has_base:
        color = color * base_map.sample(addressed(base_map, surface.uv, base_wrap))
    if masked and color.a < cutoff:
        discard()
    # the spotlight's picture replaces the cone: the light itself shines in all directions
    arriving = light_color * facing(sided(surface.normal, double_sided), light_place)
    if kind != 0:
        offset = light_place - surface.view
        far = max(length(offset), 1e-6)
        arriving = light_color * (facing(sided(surface.normal, double_sided), offset / far) / (far * far))
    clip = map_from_view * vec4(surface.view, 1.0)
    spot = vec3(0.0)
    if clip.w > 0.0:
        at = vec2(0.5 + 0.5 * clip.x / clip.w, 0.5 - 0.5 * clip.y / clip.w)
        spot = spotlight.sample(at).rgb
    shadow = mask.sample((vec2(pixel()) + 0.5) / vec2(output_size())).r
    shaded = color.rgb * (vec3(1.0) if unlit else vec3(ambient) + arriving * spot * shadow)
    if display:
        shaded = min(max(shaded, vec3(0.0)), vec3(1.0))
        shaded = vec3(encode_srgb_wide(shaded.r), encode_srgb_wide(shaded.g), encode_srgb_wide(shaded.b))
    return vec4(shaded, 1.0)


@checked
def five_pass_targets(
    scene: pg.Scene,
    *,
    kernel: BlurKernel = "normalised",
    weights: WeightsFrom = "host",
    map_size: MapSize = 512,
    mask_format: MaskFormat = "r16f",
    ambient: NotNegative = 0.0,
    background: Color = (0.0, 0.0, 0.0),
    spotlight: pg.Texture | None = None,
    display: bool = True,
) -> FivePass:
    """Return `five_pass` with all intermediate targets; parameters as there."""
    _check(scene)
    default = scene.lights[0]
    casters = Casters.in_scene(scene)
    if not casters.nodes:
        raise pg.GraphError(f"five_pass: nothing in scene {scene.name!r} casts a shadow")
    if default.kind == "point" and default.fitted_frustum(casters.bounds_for(default)) is None:
        raise pg.GraphError(
            f"five_pass: light {default.name!r} does not see all casters in one view; soft_shadow has cube maps"
        )
    opaque = [batch for batch in batches(scene) if batch.material.alpha_mode != "blend"]
    if not opaque:
        raise pg.GraphError(f"five_pass: every surface of scene {scene.name!r} is translucent")
    view = View(pg.Value("camera", pg.Camera, default=scene.camera))
    light = pg.Value("light", pg.Light, static=True, default=default)
    look = MapView(light, casters)
    map_ = shadow_map(look, caster_meshes(casters), map_size, "pass 1: shadow map")
    picture = texture_input(spotlight or round_spot(), "base color").border("clamp")
    frame = look.frame(view, map_size)
    common: dict[str, object] = {
        "kind": KINDS.index(default.kind),
        "map_from_view": frame.map(lambda light: light.map_from_view),
        "light_place": frame.map(lambda light: light.place),
    }
    for_mask: dict[str, object] = {
        "depth_row": frame.map(lambda light: light.depth_row),
        "map": map_,
        "light_texel": frame.map(lambda light: light.texel),
        "light_bias": frame.map(lambda light: light.bias),
    }
    for_light = {"light_color": frame.map(lambda light: light.color), "spotlight": picture}

    into: pg.Target | pg.TargetSpec = pg.target("mask", mask_format, scale=1.0, clear=1.0)
    depth: pg.Target | pg.TargetSpec = pg.target("mask_test", "depth32f", scale=1.0)
    for batch in opaque:
        values = {
            **common,
            **for_mask,
            **_surface(batch, view, map_),
            "receives": batch.receives and not batch.material.unlit,
        }
        into = _draw(batch, compared, into, depth, "pass 2: mask", values)
        depth = into.depth
    assert isinstance(into, pg.Target)
    mask, (across, blurred) = into, blur_mask(into, kernel, weights, mask_format)

    shown = linear_to_srgb(np.clip(np.array(background, np.float64), 0.0, 1.0)).tolist() if display else background
    into = pg.target("picture", "rgba8" if display else "rgba16f", scale=1.0, clear=(*shown, 1.0))
    depth = pg.target("picture_test", "depth32f", scale=1.0)
    for batch in opaque:
        values = {**common, **for_light, **_surface(batch, view, picture)}
        values |= {"mask": blurred, "ambient": ambient, "unlit": batch.material.unlit, "display": display}
        into = _draw(batch, lit, into, depth, "pass 5: lit scene", values)
        depth = into.depth
    assert isinstance(into, pg.Target)
    return FivePass(map_, mask, across, blurred, into)


@effect("five-pass", "scene")
@picture_of(five_pass_targets)
def five_pass() -> None:
    """Render a scene under one light with a soft shadow, in the five passes of 2006.

    Parameters
    ----------
    scene : the scene to draw, with one light, which must see all casters in one view
    kernel : kernel of the blur, normalized or as printed. "normalised" blurs symmetrically with weights that add up to
        1; "faithful" blurs as printed: each pass makes the mask 1.0665 times as bright (1.137 both) and moves it 0.408
        texel, to the left and up
    weights : computed by the "host", or by the "kernel" for each pixel
    map_size : texels along each side of the shadow map
    mask_format : format of the mask and its blurs; "r8" clips values that the faithful kernel brightens beyond 1
    ambient : scene-linear light that neither shadow nor spotlight affects
    background : scene-linear color where there is no surface
    spotlight : a picture that the light projects, over the whole shadow map; default: a soft round spot
    display : return an 8-bit sRGB picture; off, scene-linear rgba16f

    Returns
    -------
    The target "picture". A run takes ``camera=`` and ``light=``; defaults are those of the scene.

    Source: "Soft-Edged Shadows", GameDev.net article 2193, 2005. Deviations: comparisons against the plane of the
    receiver instead of a constant offset; the texture matrix is applied for each pixel; translucent surfaces are
    skipped; ambient light, 0 there.

    Examples
    --------
    >>> with pg.compile(five_pass(pg.Scene.shipped(), map_size=64), backend="null", size=(32, 18)) as program:
    ...     sorted({step.name for step in program.plan.steps})[2:]
    ['pass 3: blur x', 'pass 4: blur y', 'pass 5: lit scene']
    """


def round_spot() -> pg.Texture:
    """Return the default spotlight picture: white, fading to black toward a circle inside the border."""
    at = (np.arange(SPOT_TEXELS) + 0.5) / SPOT_TEXELS * 2.0 - 1.0
    radius = np.hypot(*np.meshgrid(at, at))
    # the map is a little wider than the cone, and its outermost texels must be black
    t = np.clip((1.0 - 3.0 / SPOT_TEXELS - radius) / SPOT_RIM, 0.0, 1.0)
    bright = np.rint(255.0 * t * t * (3.0 - 2.0 * t)).astype(np.uint8)
    return pg.Texture.make(bright, "linear", "round spot")


def _surface(batch: Batch, view: View, stand_in: pg.Target) -> dict[str, object]:
    """Return the values of both draws; ``stand_in`` replaces a missing base color map, whose code is removed."""
    material = batch.material
    texture = material.base_color_texture
    return {
        "clip_from_local": view.clip_from(batch.origin),
        "view_from_local": view.view_from(batch.origin),
        "base_map": stand_in if texture is None else texture_input(texture, "base color"),
        "has_base": texture is not None,
        "base_wrap": wrap_number(texture),
        "cutoff": material.alpha_cutoff,
        "masked": material.alpha_mode == "mask",
        "double_sided": material.double_sided,
    }


def _draw(
    batch: Batch, fragment: Any, into: object, depth: pg.Target | pg.TargetSpec, name: str, values: dict[str, object]
) -> pg.Target:
    cull = "none" if batch.material.double_sided else "back"
    result: pg.Target = pg.draw(
        batch.mesh, vertex=place, fragment=fragment, into=into, depth=depth, cull=cull, name=name, values=values
    )
    return result


def _check(scene: pg.Scene) -> None:
    if not scene.lights:
        raise pg.GraphError(f"five_pass: scene {scene.name!r} has no light")
    if len(scene.lights) > 1:
        names = ", ".join(repr(light.name) for light in scene.lights)
        raise pg.GraphError(
            f"five_pass needs one light, and scene {scene.name!r} has {len(scene.lights)}: {names}; choose with "
            "scene.with_(lights=[...]), or use soft_shadow, which takes any number"
        )
