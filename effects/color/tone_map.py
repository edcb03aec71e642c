"""Tone mapping: convert scene-linear HDR for display."""

# mypy: disable-error-code="no-any-return"
# Values of the kernel language are Any to Python's type checkers.
from __future__ import annotations

from math import log2 as _log2
from typing import Literal, get_args

import passgraph as pg
from passgraph.color_tags import LINEAR, SRGB, ColorSpace
from passgraph.effects.checked import effect
from passgraph.effects.color.srgb_encoding import encode_srgb
from passgraph.effects.quantities import Exposure
from passgraph.language import Const, Image, clamp, exp2, log2, mix, sqrt, vec3, vec4

Curve = Literal["linear", "reinhard", "hable", "aces", "agx", "pbr-neutral"]
CURVES: tuple[Curve, ...] = get_args(Curve)
#: Brightest input in scene-linear units: the largest float16. Infinity becomes this.
BRIGHTEST = 65504.0
#: Hable's white point: the input that becomes 1.
HABLE_WHITE = 11.2

#: AgX: log2 of the darkest and brightest scene values that it distinguishes, -10 and +6.5 stops about middle gray 0.18.
AGX_DARKEST, AGX_STOPS = _log2(0.18) - 10.0, 16.5
#: Position of middle gray on that scale; the curve maps it to 0.5 with a slope of 2.
AGX_PIVOT, AGX_SLOPE = 10.0 / 16.5, 2.0
AGX_TOE, AGX_SHOULDER = 3.0, 3.25
#: AgX mixes a fifth of this mean of the channels into each of them before the curve, and removes it after it.
AGX_MEAN, AGX_SHARE = (0.21200536, 0.39218251, 0.39581213), 0.2
#: AgX's result is for a display with this exponent.
AGX_DISPLAY = 2.2

#: PBR Neutral: Fresnel reflection of common materials (index 1.5) at normal incidence, which desaturates base colors.
NEUTRAL_FRESNEL = 0.04
#: Start of highlight compression, and its rate of desaturation.
NEUTRAL_START, NEUTRAL_DESATURATION = 0.8 - NEUTRAL_FRESNEL, 0.15


def _limit(way: float, rise: float, power: float) -> float:
    """Return s of y = u / (1 + (u / s)^power)^(1 / power), u = AGX_SLOPE · x, such that y(way) = rise."""
    return float((rise**-power - (AGX_SLOPE * way) ** -power) ** (-1.0 / power))


AGX_TOE_LIMIT = _limit(AGX_PIVOT, 0.5, AGX_TOE)
AGX_SHOULDER_LIMIT = _limit(1.0 - AGX_PIVOT, 0.5, AGX_SHOULDER)


@pg.function
def finite(x: float) -> float:
    """Clamp to 0 to BRIGHTEST; NaN becomes 0."""
    return min(x if x > 0.0 else 0.0, BRIGHTEST)


@pg.function
def hable(x: float) -> float:
    """Hable's filmic curve before scaling by the white point, as one fraction: exactly 0 at 0."""
    return x * (0.14 * x + 1.0 / 60.0) / (x * (0.15 * x + 0.5) + 0.06)


@pg.function
def agx_sigmoid(x: float) -> float:
    """Map log-encoded [0, 1] to display-encoded [0, 1]: slope 2 at the pivot, bending toward both ends."""
    away = AGX_SLOPE * (x - AGX_PIVOT)
    dark = away < 0.0
    share = abs(away) / (AGX_TOE_LIMIT if dark else AGX_SHOULDER_LIMIT)
    # the powers 3 and 3.25, by products and roots
    raised = share * share * share * (1.0 if dark else sqrt(sqrt(share)))
    return 0.5 + away * exp2(log2(1.0 + raised) * (-1.0 / AGX_TOE if dark else -1.0 / AGX_SHOULDER))


@pg.function
def agx_channel(x: float) -> float:
    """Map one channel from scene-linear to display-encoded."""
    stops = log2(max(x, exp2(AGX_DARKEST))) - AGX_DARKEST
    return agx_sigmoid(min(stops / AGX_STOPS, 1.0))


@pg.function
def agx_mean(c: vec3) -> vec3:
    """Return the gray that the inset mixes in."""
    return vec3(AGX_MEAN[0] * c.r + AGX_MEAN[1] * c.g + AGX_MEAN[2] * c.b)


@pg.function
def agx(c: vec3) -> vec3:
    """Apply the sigmoid to each channel, in narrower primaries, so that bright colors become white."""
    inset = mix(c, agx_mean(c), AGX_SHARE)
    y = vec3(agx_channel(inset.r), agx_channel(inset.g), agx_channel(inset.b))
    outset = clamp((y - AGX_SHARE * agx_mean(y)) / (1.0 - AGX_SHARE), 0.0, 1.0)
    return vec3(pow(outset.r, AGX_DISPLAY), pow(outset.g, AGX_DISPLAY), pow(outset.b, AGX_DISPLAY))


@pg.function
def pbr_neutral(c: vec3) -> vec3:
    """Keep base colors, less the Fresnel reflection; compress highlights by their peak, toward white."""
    low = min(c.r, c.g, c.b)
    offset = NEUTRAL_FRESNEL
    if low <= 2.0 * NEUTRAL_FRESNEL:
        offset = low - low * low / (4.0 * NEUTRAL_FRESNEL)
    base = c - offset
    peak = max(base.r, base.g, base.b)
    shown = base
    if peak > NEUTRAL_START:
        rest = 1.0 - NEUTRAL_START
        pressed = 1.0 - rest * rest / (peak + 1.0 - 2.0 * NEUTRAL_START)
        kept = 1.0 / (NEUTRAL_DESATURATION * (peak - pressed) + 1.0)
        shown = mix(vec3(pressed), base * (pressed / peak), kept)
    return shown


@pg.function
def compress(x: float, curve: int) -> float:
    """Map one channel to [0, 1] by a curve."""
    y = x
    if curve == 1:
        y = x / (1.0 + x)
    if curve == 2:
        y = hable(x) / hable(HABLE_WHITE)
    if curve == 3:
        y = x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14)
    return y


@pg.function
def compressed(c: vec3, curve: int) -> vec3:
    """Map a color to [0, 1] by a curve."""
    shown = c
    if curve < 4:
        shown = vec3(compress(c.r, curve), compress(c.g, curve), compress(c.b, curve))
    if curve == 4:
        shown = agx(c)
    if curve == 5:
        shown = pbr_neutral(c)
    return clamp(shown, 0.0, 1.0)


@pg.kernel
def tone(color: Image, exposure_stops: float, curve: Const[int], encode: Const[bool]) -> vec4:
    """Apply exposure, curve and encoding."""
    here = color[0, 0]
    lit = here.rgb * exp2(exposure_stops)
    shown = compressed(vec3(finite(lit.r), finite(lit.g), finite(lit.b)), curve)
    if encode:
        shown = vec3(encode_srgb(shown.r), encode_srgb(shown.g), encode_srgb(shown.b))
    return vec4(shown, min(finite(here.a), 1.0))


def _result_space(encode: bool = True, **_: object) -> ColorSpace:
    return ColorSpace("sRGB", SRGB) if encode else ColorSpace("linear Rec. 709", LINEAR)


@effect("tone-map", linear=True, encodes=True, result_space=_result_space)
def tone_map(
    frame: pg.Target,
    exposure_stops: Exposure | pg.Value | pg.Derived = 0.0,
    curve: Curve = "aces",
    encode: bool = True,
    into: pg.TargetSpec | None = None,
    name: str = "tone_map",
) -> pg.Target:
    """Map scene-linear light to a display; NaN and negative values become black, infinity white.

    Parameters
    ----------
    frame : scene-linear, Rec. 709 primaries, any range
    exposure_stops : brightness before the curve, factor 2 per stop
    curve : compression of high values. "linear" clips at 1; "reinhard" x / (1 + x); "hable" filmic, white at 11.2;
        "aces" Narkowicz's fit; "agx" 16.5 stops, bright colors turn white; "pbr-neutral" keeps base colors and
        compresses only highlights
    encode : sRGB-encode the result, for display and 8-bit files; off leaves it linear in [0, 1]
    into : destination target; default: 8 bits per channel if encoded, else float16, named ``name``
    name : name of the pass

    Source: E. Reinhard et al., "Photographic Tone Reproduction for Digital Images", 2002, eq. 3; J. Hable,
    "Uncharted 2: HDR Lighting", GDC 2010; K. Narkowicz, "ACES Filmic Tone Mapping Curve", 2015; T. Sobotka and
    J. Smith, "AgX", 2022 (sigmoid, range, slope, powers); Khronos Group, "PBR Neutral Tone Mapper", 2024.
    Deviations: AgX's inset is a fifth of a mean, which leaves gray exactly gray and is within 1.5e-4 of the published
    matrix; its curve is the sigmoid itself instead of a table.

    Examples
    --------
    >>> import numpy as np
    >>> shown = tone_map(pg.Input("frame"), curve="reinhard", encode=False)
    >>> with pg.compile(shown, backend="reference") as program:
    ...     program(frame=np.full((1, 1, 4), 1.0, np.float32))["tone_map"][0, 0, 0].item()
    0.5
    """
    target = into or pg.target(name, "rgba8" if encode else "rgba16f")
    return tone(frame, exposure_stops, CURVES.index(curve), encode, into=target, name=name)
