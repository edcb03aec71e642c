"""Percentage-closer soft shadows: the casters' distance determines the width of the filter."""

# mypy: disable-error-code="no-any-return"
# Values of the kernel language are Any to Python's type checkers.
from __future__ import annotations

from typing import Any

import passgraph as pg
from passgraph.effects.shadows.nearest_casters import search_reach
from passgraph.effects.shadows.shadow_filters import (
    FilterFrame,
    at_offset,
    caster_at,
    mean_of,
    reach_of,
    receiver_at,
    vogel_disc,
)
from passgraph.effects.shadows.shadow_map import NOTHING
from passgraph.effects.surfaces.views import LightFrame
from passgraph.language import Image, vec3


def pcss(taps: int) -> Any:
    """Return the lookup of "pcss"; the search and the filter have ``taps`` taps each."""
    places: Any = vogel_disc(taps)

    @pg.function
    def percentage_closer(
        map: Image,
        nearest: Image,
        light: LightFrame,
        position: vec3,
        surface: vec3,
        lift: float,
        by: FilterFrame,
        kind: int,
        face: int,
    ) -> float:
        """Compare over a disc as large as the penumbra from the light's size and the casters' mean depth.

        Source: R. Fernando, "Percentage-Closer Soft Shadows", 2005. Deviation: the search is as wide as the casters
        around the receiver require, see `passgraph.effects.shadows.nearest_casters`.
        """
        receiver = receiver_at(map, light, position, surface, lift, kind)
        if receiver.share >= 0.0:
            return receiver.share
        search = search_reach(map, nearest, light, receiver, kind)
        total = 0.0
        count = 0.0
        for i in range(taps):
            caster = caster_at(map, receiver, at_offset(receiver, places[i] * search), kind, face)
            if caster < NOTHING:
                total += caster
                count += 1.0
        if count == 0.0:
            return 1.0
        reach = reach_of(light, receiver, total / count, kind)
        lit = 0.0
        for i in range(taps):
            lit += (
                1.0 if caster_at(map, receiver, at_offset(receiver, places[i] * reach), kind, face) >= NOTHING else 0.0
            )
        return mean_of(lit, taps)

    return percentage_closer
