"""The choice of a shadow filter, and the kernel function that it stands for."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Literal

import passgraph as pg
from passgraph.effects.pcss import pcss
from passgraph.effects.shadow_filters import bilinear, disc, square
from passgraph.effects.shadow_moments import (
    LARGEST_EXPONENT,
    exponential_bound,
    lookup_by,
    moment_bound,
    moment_bound_16,
    variance_bound,
)

ShadowFilter = Literal["blur", "hard", "pcf", "disc", "pcss", "penumbra", "vsm", "evsm4", "msm"]
SHADOW_FILTERS: tuple[ShadowFilter, ...] = ("blur", "hard", "pcf", "disc", "pcss", "penumbra", "vsm", "evsm4", "msm")
#: Those that blur maps of moments.
MOMENT_FILTERS: tuple[ShadowFilter, ...] = ("vsm", "evsm4", "msm")
MomentFormat = Literal["rgba32f", "rgba16"]
MOMENT_FORMATS: tuple[MomentFormat, ...] = ("rgba32f", "rgba16")
#: Comparisons where no number is given; "penumbra" has fewer, as it looks for the casters that matter.
TAPS = {"penumbra": 16}
MORE_TAPS = 32
#: Where none is given: what is left of common leaks, at little cost to penumbrae.
BLEED = {"vsm": 0.2}
LESSER_BLEED = 0.02


@dataclass(frozen=True)
class FilterChoice:
    """A shadow filter with its settings, see `passgraph.effects.soft_shadow.soft_shadow`."""

    name: ShadowFilter = "blur"
    pcf_size: int = 5
    taps: int | None = None
    bleed: float | None = None
    exponent: float = 40.0
    moment_format: MomentFormat = "rgba32f"

    def __post_init__(self) -> None:
        if self.name not in SHADOW_FILTERS:
            known = ", ".join(SHADOW_FILTERS)
            raise pg.GraphError(f"soft_shadow: shadow_filter cannot be {self.name!r}; it is one of {known}")
        if not 1 <= self.pcf_size <= 15 or self.pcf_size % 2 == 0:
            raise pg.GraphError(f"soft_shadow: pcf_size must be odd, 1 to 15, got {self.pcf_size!r}")
        if self.taps is not None and not 1 <= self.taps <= 128:
            raise pg.GraphError(f"soft_shadow: taps must be 1 to 128, got {self.taps!r}")
        if self.bleed is not None and not 0.0 <= self.bleed <= 0.9:
            raise pg.GraphError(f"soft_shadow: bleed must be 0 to 0.9, got {self.bleed!r}")
        if not 1.0 <= self.exponent <= LARGEST_EXPONENT:
            raise pg.GraphError(f"soft_shadow: exponent must be 1 to {LARGEST_EXPONENT:g}, got {self.exponent!r}")
        if self.moment_format not in MOMENT_FORMATS:
            known = ", ".join(MOMENT_FORMATS)
            raise pg.GraphError(f"soft_shadow: moment_format cannot be {self.moment_format!r}; it is one of {known}")

    @property
    def blurs_maps(self) -> bool:
        return self.name in MOMENT_FILTERS

    @property
    def searches(self) -> bool:
        """Whether it looks for casters as far as the light's extent asks."""
        return self.name in ("pcss", "penumbra")

    @property
    def taps_or_default(self) -> int:
        return TAPS.get(self.name, MORE_TAPS) if self.taps is None else self.taps

    @property
    def bleed_or_default(self) -> float:
        return BLEED.get(self.name, LESSER_BLEED) if self.bleed is None else self.bleed


@lru_cache(maxsize=64)
def lookup(of: FilterChoice) -> Any:
    """The kernel function of a filter: the share of the light that arrives, 0 to 1."""
    if of.blurs_maps:
        four = moment_bound if of.moment_format == "rgba32f" else moment_bound_16
        return lookup_by({"vsm": variance_bound, "evsm4": exponential_bound, "msm": four}[of.name])
    if of.name == "blur":
        return bilinear
    if of.name == "disc":
        return disc(of.taps_or_default)
    if of.name == "pcss":
        return pcss(of.taps_or_default)
    return square(1 if of.name == "hard" else of.pcf_size)
