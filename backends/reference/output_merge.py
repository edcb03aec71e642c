"""Colours into targets: masks, blending, rounding to the format (rule 7 of docs/rasterisation.md)."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from passgraph.backends.base import quantised
from passgraph.backends.reference.interpreter import Interpreter, StageValues
from passgraph.backends.reference.number_domain import NumberDomain
from passgraph.backends.reference.output_tests import layers
from passgraph.backends.reference.storage import Storage, stored
from passgraph.formats import Format
from passgraph.graph.draw_state import Blend
from passgraph.plan.blending import blend_kernel

Ints = NDArray[np.int64]
Float64 = NDArray[np.float64]


def write(storage: Storage, pixel: Ints, colours: Float64, mask: tuple[bool, ...], blend: Blend | None) -> None:
    """Colours (n, channels) of fragments in the order of submission; without a blend, one a pixel."""
    if blend is None:
        _put(storage, pixel, stored(storage.format, colours), mask)
        return
    for layer in layers(pixel):
        new = blended(blend, storage.format, colours[layer], storage.flat[pixel[layer]].astype(np.float64))
        _put(storage, pixel[layer], quantised(new, storage.format), mask)


def _put(storage: Storage, pixel: Ints, values: NDArray[np.float32], mask: tuple[bool, ...]) -> None:
    for channel in range(storage.format.channels):
        if mask[channel]:
            storage.flat[pixel, channel] = values[:, channel]


def blended(blend: Blend, format_: Format, source: Float64, destination: Float64) -> Float64:
    """Both (n, channels), and the result, which is not quantised yet."""
    program = blend_kernel(blend, format_)
    around = StageValues({"source": filled(source), "destination": filled(destination)})
    results, _ = Interpreter(program, NumberDomain(), around).run()
    (result,) = results.values()
    return np.broadcast_to(result.reshape(len(result), source.shape[1]), source.shape)


def filled(values: NDArray[Any]) -> NDArray[Any]:
    """(n, channels) as four channels; nothing hangs on those that a format lacks."""
    return np.pad(values, ((0, 0), (0, 4 - values.shape[1])))
