"""Map the choice of a shadow filter to its kernel function."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

from passgraph.effects.shadows.pcss import pcss
from passgraph.effects.shadows.shadow_choice import Blur, DecidedFilter, Disc, Evsm4, Hard, Msm, Pcf, Pcss, Vsm
from passgraph.effects.shadows.shadow_filters import bilinear, disc, square
from passgraph.effects.shadows.shadow_moments import (
    exponential_bound,
    lookup_by,
    moment_bound,
    moment_bound_16,
    variance_bound,
)


@lru_cache(maxsize=64)
def lookup(filter_: DecidedFilter) -> Any:
    """Return the kernel function of a filter: the fraction of the light that arrives, 0 to 1."""
    match filter_:
        case Blur():
            return bilinear
        case Hard():
            return square(1)
        case Pcf(size):
            return square(size)
        case Disc(taps):
            return disc(taps)
        case Pcss(taps):
            return pcss(taps)
        case Vsm():
            return lookup_by(variance_bound)
        case Evsm4():
            return lookup_by(exponential_bound)
        case Msm(format=format):
            return lookup_by(moment_bound if format == "rgba32f" else moment_bound_16)
        case _:
            raise AssertionError(f"{filter_} has a pass of its own")
