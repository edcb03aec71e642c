"""The choice of a shadow filter: one of ten kinds, each with its settings."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated, Literal

import passgraph as pg
from passgraph.effects.checked import Choice
from passgraph.effects.parameters import Called
from passgraph.effects.shadows.shadow_moments import LARGEST_EXPONENT

Taps = Annotated[int, pg.Range(1, 128)]
Bleed = Annotated[float, pg.Range(0, 0.9)]
BlurWidth = Literal["world", "constant"]
MomentFormat = Literal["rgba32f", "rgba16"]


@dataclass(frozen=True, slots=True)
class Blur(Choice):
    """Blurs the shadows on the screen.

    Attributes
    ----------
    width : whether in scene units, or in pixels as plain blurs have it. "world" keeps the width in the scene;
        "constant" blurs ``radius_px`` pixels wherever the camera is
    radius_px : taps to each side (7 makes 15); with "constant" the width itself
    """

    width: Annotated[BlurWidth, Called("blur")] = "world"
    radius_px: Annotated[int, pg.Range(1, 31, "px")] = 7


@dataclass(frozen=True, slots=True)
class Hard(Choice):
    """Compares one texel."""


@dataclass(frozen=True, slots=True)
class Pcf(Choice):
    """Compares a square of texels, and takes the mean.

    Attributes
    ----------
    size : texels along each side
    """

    size: Annotated[int, pg.Range(1, 15, "texels", odd=True), Called("pcf_size")] = 5


@dataclass(frozen=True, slots=True)
class Disc(Choice):
    """Compares texels of a disc of half width ``softness``.

    Attributes
    ----------
    taps : comparisons of each pixel, or of each step
    """

    taps: Taps = 32


@dataclass(frozen=True, slots=True)
class Pcss(Choice):
    """Compares over a disc as wide as the light's radius and the casters' distance make the penumbra.

    Attributes
    ----------
    taps : of the search for casters, and again of the filter
    """

    taps: Taps = 32


@dataclass(frozen=True, slots=True)
class Penumbra(Choice):
    """The same, with the search in half the width and height, and comparisons in full size where shadows are narrow.

    Casters far from the receiver and casters near it have penumbrae of their own width.

    Attributes
    ----------
    taps : of the search, which then compares twice as many
    """

    taps: Taps = 16


@dataclass(frozen=True, slots=True)
class Vsm(Choice):
    """Blurs a map of two moments of the depth over a box of half width ``softness``: variance shadow maps.

    Attributes
    ----------
    bleed : share of light up to this counts as none, which takes leaks where casters overlap, and narrows penumbrae
    """

    bleed: Bleed = 0.2


@dataclass(frozen=True, slots=True)
class Evsm4(Choice):
    """The same of both exponential warps of the depth.

    Attributes
    ----------
    bleed : as of `Vsm`; there is less of it
    exponent : of the warps, more leaks less, to where float32 ends
    """

    bleed: Bleed = 0.02
    exponent: Annotated[float, pg.Range(1, LARGEST_EXPONENT)] = 40.0


@dataclass(frozen=True, slots=True)
class Msm(Choice):
    """The same of four moments of the depth.

    Attributes
    ----------
    bleed : as of `Vsm`; there is less of it
    format : of the map of moments; "rgba16" has its optimized quantization
    """

    bleed: Bleed = 0.02
    format: Annotated[MomentFormat, Called("moment_format")] = "rgba32f"


@dataclass(frozen=True, slots=True)
class Auto(Choice):
    """`Penumbra`, or `Blur` where ``softness`` is given, the blur's width is "constant" or no light has a radius.

    Attributes
    ----------
    penumbra, blur : the settings of either
    """

    penumbra: Penumbra = field(default_factory=Penumbra)
    blur: Blur = field(default_factory=Blur)


#: Those that blur maps of moments.
MomentFilter = Vsm | Evsm4 | Msm
#: Those that look for casters as far as the light's extent asks.
SearchingFilter = Pcss | Penumbra
#: What "auto" is decided to be.
DecidedFilter = Blur | Hard | Pcf | Disc | SearchingFilter | MomentFilter
ShadowFilter = Auto | DecidedFilter
#: Every kind by the command line's word.
SHADOW_FILTERS: dict[str, type[Choice]] = {
    one.word(): one for one in (Blur, Hard, Pcf, Disc, Pcss, Penumbra, Vsm, Evsm4, Msm)
}
