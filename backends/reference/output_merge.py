"""Colours into targets: masks, blending, rounding to the format (rule 7 of docs/rasterisation.md)."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from passgraph.backends.base import quantised
from passgraph.backends.reference.output_tests import layers
from passgraph.backends.reference.storage import Storage, stored
from passgraph.draw_state import Blend

Ints = NDArray[np.int64]
Float64 = NDArray[np.float64]

#: Factor → its value from source colour, source alpha, destination colour, destination alpha.
FACTORS: dict[str, Callable[[Float64, Float64, Float64, Float64], Any]] = {
    "zero": lambda s, sa, d, da: 0.0,
    "one": lambda s, sa, d, da: 1.0,
    "source_color": lambda s, sa, d, da: s,
    "one_minus_source_color": lambda s, sa, d, da: 1.0 - s,
    "destination_color": lambda s, sa, d, da: d,
    "one_minus_destination_color": lambda s, sa, d, da: 1.0 - d,
    "source_alpha": lambda s, sa, d, da: sa,
    "one_minus_source_alpha": lambda s, sa, d, da: 1.0 - sa,
    "destination_alpha": lambda s, sa, d, da: da,
    "one_minus_destination_alpha": lambda s, sa, d, da: 1.0 - da,
}


def write(storage: Storage, pixel: Ints, colours: Float64, mask: tuple[bool, ...], blend: Blend | None) -> None:
    """Colours (n, channels) of fragments in the order of submission; without a blend, one a pixel."""
    if blend is None:
        _put(storage, pixel, stored(storage.format, colours), mask)
        return
    if storage.format.kind.startswith("unorm"):
        colours = np.where(np.isnan(colours), 0.0, np.clip(colours, 0.0, 1.0))
    for layer in layers(pixel):
        old = storage.flat[pixel[layer]].astype(np.float64)
        _put(storage, pixel[layer], quantised(blended(blend, colours[layer], old), storage.format), mask)


def _put(storage: Storage, pixel: Ints, values: NDArray[np.float32], mask: tuple[bool, ...]) -> None:
    for channel in range(storage.format.channels):
        if mask[channel]:
            storage.flat[pixel, channel] = values[:, channel]


def blended(blend: Blend, source: Float64, destination: Float64) -> Float64:
    """Both (n, channels); alpha is the fourth channel, and 1 where there is none."""
    ones = np.ones((len(source), 1))
    source_alpha = source[:, 3:] if source.shape[1] == 4 else ones
    destination_alpha = destination[:, 3:] if destination.shape[1] == 4 else ones
    colour = (blend.source, blend.destination, blend.equation)
    parts = [_equation(colour, source[:, :3], source_alpha, destination[:, :3], destination_alpha)]
    if source.shape[1] == 4:
        parts.append(_equation(blend.alpha_terms, source_alpha, source_alpha, destination_alpha, destination_alpha))
    return np.concatenate(parts, axis=1)


def _equation(terms: tuple[str, str, str], s: Float64, sa: Float64, d: Float64, da: Float64) -> Float64:
    source_factor, destination_factor, equation = terms
    if equation == "min":  # as in OpenGL, min and max use no factors
        return np.where(d < s, d, s)
    if equation == "max":
        return np.where(s < d, d, s)
    one, other = s * FACTORS[source_factor](s, sa, d, da), d * FACTORS[destination_factor](s, sa, d, da)
    if equation == "add":
        return np.asarray(one + other)
    return np.asarray(one - other if equation == "subtract" else other - one)
