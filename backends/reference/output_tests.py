"""Stencil and depth, fragment by fragment in the order of submission (rule 6 of docs/rasterisation.md)."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import NDArray

from passgraph.backends.reference.storage import Float32, Storage
from passgraph.graph.draw_state import DrawState, Stencil

Ints = NDArray[np.int64]
Lanes = NDArray[np.bool_]
Bytes = NDArray[np.int64]

COMPARE: dict[str, Callable[..., Lanes]] = {
    "never": lambda a, b: np.zeros(np.shape(b), np.bool_),
    "less": np.less,
    "equal": np.equal,
    "less_equal": np.less_equal,
    "greater": np.greater,
    "not_equal": np.not_equal,
    "greater_equal": np.greater_equal,
    "always": lambda a, b: np.ones(np.shape(b), np.bool_),
}

#: What a stencil operation makes of a stored byte.
OPERATIONS: dict[str, Callable[[Bytes, int], Bytes]] = {
    "keep": lambda old, reference: old,
    "zero": lambda old, reference: np.zeros_like(old),
    "replace": lambda old, reference: np.full_like(old, reference),
    "increment": lambda old, reference: np.minimum(old + 1, 255),
    "increment_wrap": lambda old, reference: (old + 1) & 0xFF,
    "decrement": lambda old, reference: np.maximum(old - 1, 0),
    "decrement_wrap": lambda old, reference: (old - 1) & 0xFF,
    "invert": lambda old, reference: ~old & 0xFF,
}


def layers(pixel: Ints) -> Iterator[Ints]:
    """Fragment numbers: the first of every pixel, then the second of every pixel that has one, and so on."""
    order = np.argsort(pixel, kind="stable")
    ordered = pixel[order]
    starts = np.ones(len(pixel), np.bool_)
    starts[1:] = ordered[1:] != ordered[:-1]
    place = np.arange(len(pixel))
    depth = place - np.maximum.accumulate(np.where(starts, place, 0))
    by_depth = order[np.argsort(depth, kind="stable")]
    counts = np.bincount(depth) if len(depth) else np.zeros(0, np.int64)
    yield from np.split(by_depth, np.cumsum(counts)[:-1]) if len(counts) else ()


def last_of_each(pixel: Ints) -> Ints:
    """The last fragment of every pixel, as fragment numbers in ascending order."""
    _, first_from_behind = np.unique(pixel[::-1], return_index=True)
    return np.sort(len(pixel) - 1 - first_from_behind)


def passing(storage: Storage | None, state: DrawState, pixel: Ints, depth: Float32) -> Lanes:
    """Which fragments pass both tests; depth and stencil of ``storage`` are updated on the way."""
    if storage is None:
        return np.ones(len(pixel), np.bool_)
    depths = storage.pixels.reshape(-1)
    stencils = None if storage.stencil is None else storage.stencil.reshape(-1)
    stencil = state.stencil if stencils is not None else None
    compare = COMPARE[state.depth_compare]
    if stencil is None and not state.depth_write:
        return compare(depth, depths[pixel])
    passed = np.zeros(len(pixel), np.bool_)
    for layer in layers(pixel):
        at = pixel[layer]
        nearer = compare(depth[layer], depths[at])
        if stencil is not None and stencils is not None:
            allowed = _stencil_test(stencil, stencils, at, nearer)
            nearer = nearer & allowed
        passed[layer] = nearer
        if state.depth_write:
            depths[at[nearer]] = depth[layer[nearer]]
    return passed


def allows(stencil: Stencil, held: Bytes) -> Lanes:
    """Whether the stencil test lets fragments pass where these bytes are held."""
    return COMPARE[stencil.compare](np.int64(stencil.reference & stencil.read_mask), held & stencil.read_mask)


def _stencil_test(stencil: Stencil, stencils: NDArray[np.uint8], at: Ints, nearer: Lanes) -> Lanes:
    old = stencils[at].astype(np.int64)
    allowed = allows(stencil, old)
    fail, depth_fail, both = (
        OPERATIONS[operation](old, stencil.reference)
        for operation in (stencil.fail, stencil.depth_fail, stencil.passed)
    )
    new = np.where(allowed, np.where(nearer, both, depth_fail), fail)
    stencils[at] = (old & ~stencil.write_mask) | (new & stencil.write_mask)
    return allowed
