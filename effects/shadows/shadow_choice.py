"""The choice of a shadow filter: one of ten kinds, each with its settings."""

from __future__ import annotations

from dataclasses import field
from typing import Annotated, Literal

import passgraph as pg
from passgraph.effects.checked import Choice
from passgraph.effects.parameters import Called
from passgraph.effects.shadows.shadow_moments import LARGEST_EXPONENT
from passgraph.records import dataclass

Taps = Annotated[int, pg.Range(1, 128)]
Bleed = Annotated[float, pg.Range(0, 0.9)]
BlurWidth = Literal["world", "constant"]
MomentFormat = Literal["rgba32f", "rgba16"]


@dataclass(frozen=True, slots=True)
class Blur(Choice):
    """Blur the shadows on the screen.

    Attributes
    ----------
    width : unit of the width: scene units, or pixels as in plain blurs. "world" keeps the width in the scene;
        "constant" blurs ``radius_px`` pixels at any camera distance
    radius_px : taps to each side (7 makes 15); with "constant" the width itself
    """

    width: Annotated[BlurWidth, Called("blur")] = "world"
    radius_px: Annotated[int, pg.Range(1, 31, "px")] = 7


@dataclass(frozen=True, slots=True)
class Hard(Choice):
    """Compare one texel."""


@dataclass(frozen=True, slots=True)
class Pcf(Choice):
    """Average comparisons over a square of texels.

    Attributes
    ----------
    size : texels along each side
    """

    size: Annotated[int, pg.Range(1, 15, "texels", odd=True), Called("pcf_size")] = 5


@dataclass(frozen=True, slots=True)
class Disc(Choice):
    """Average comparisons over a disc of half width ``softness``.

    Attributes
    ----------
    taps : comparisons of each pixel, or of each step
    """

    taps: Taps = 32


@dataclass(frozen=True, slots=True)
class Pcss(Choice):
    """Average comparisons over a disc as wide as the penumbra from the light's radius and the casters' distance.

    Attributes
    ----------
    taps : taps of the search for casters, and of the filter
    """

    taps: Taps = 32


@dataclass(frozen=True, slots=True)
class Penumbra(Choice):
    """Like `Pcss`, with the search at half the width and height, and full-size comparisons where shadows are narrow.

    Casters far from the receiver and casters near it have penumbrae of separate widths.

    Attributes
    ----------
    taps : taps of the search, which then compares twice as many
    """

    taps: Taps = 16


@dataclass(frozen=True, slots=True)
class Vsm(Choice):
    """Variance shadow maps: blur a map of two moments of the depth over a box of half width ``softness``.

    Attributes
    ----------
    bleed : fractions of light up to this count as 0, which removes leaks where casters overlap, and narrows penumbrae
    """

    bleed: Bleed = 0.2


@dataclass(frozen=True, slots=True)
class Evsm4(Choice):
    """Like `Vsm`, for two exponential warps of the depth.

    Attributes
    ----------
    bleed : as in `Vsm`; there is less of it
    exponent : exponent of the warps; more leaks less, up to float32's limit
    """

    bleed: Bleed = 0.02
    exponent: Annotated[float, pg.Range(1, LARGEST_EXPONENT)] = 40.0


@dataclass(frozen=True, slots=True)
class Msm(Choice):
    """Like `Vsm`, for four moments of the depth.

    Attributes
    ----------
    bleed : as in `Vsm`; there is less of it
    format : format of the map of moments; "rgba16" has its optimized quantization
    """

    bleed: Bleed = 0.02
    format: Annotated[MomentFormat, Called("moment_format")] = "rgba32f"


@dataclass(frozen=True, slots=True)
class Auto(Choice):
    """`Penumbra`; or `Blur` if ``softness`` is given, the blur's width is "constant" or no light has a radius.

    Attributes
    ----------
    penumbra, blur : settings of the two
    """

    penumbra: Penumbra = field(default_factory=Penumbra)
    blur: Blur = field(default_factory=Blur)


#: Filters that blur maps of moments.
MomentFilter = Vsm | Evsm4 | Msm
#: Filters that search for casters as far as the light's extent requires.
SearchingFilter = Pcss | Penumbra
#: Filters that "auto" can choose.
DecidedFilter = Blur | Hard | Pcf | Disc | SearchingFilter | MomentFilter
ShadowFilter = Auto | DecidedFilter
#: Every filter by its word on the command line.
SHADOW_FILTERS: dict[str, type[Choice]] = {
    one.word(): one for one in (Blur, Hard, Pcf, Disc, Pcss, Penumbra, Vsm, Evsm4, Msm)
}
