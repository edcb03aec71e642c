"""A tracer that needs no package beyond numba: float64, all threads, a hierarchy of boxes."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
from numpy.typing import NDArray

from passgraph.truth import bvh_build, bvh_walk
from passgraph.truth.rays import ENDLESS, Float64, Int32

#: Rays that one thread takes at a time.
RAYS = 1 << 14


class BvhTracer:
    """Boxes split by the surface area heuristic, and Woop's test, which lets no ray through an edge."""

    name = "bvh"
    # float64 has 1e-16, and products of differences of coordinates stay far below this
    rounding = 1e-9

    def __init__(self, corners: Float64) -> None:
        self._tree = bvh_build.build(corners)
        self._corners = np.ascontiguousarray(corners[self._tree[3]])

    def closest(self, origins: Float64, directions: Float64) -> Int32:
        """See `Tracer.closest`."""
        found = np.empty(len(origins), np.int32)
        lengths = np.full(len(origins), ENDLESS)
        self._each(bvh_walk.closest, origins, directions, lengths, found)
        return found

    def blocked(self, origins: Float64, directions: Float64, lengths: Float64) -> NDArray[np.bool_]:
        """See `Tracer.blocked`."""
        found = np.empty(len(origins), np.bool_)
        self._each(bvh_walk.blocked, origins, directions, np.asarray(lengths, np.float64), found)
        return found

    def _each(self, walk: Callable[..., None], *rays: NDArray[Any]) -> None:
        """Run over blocks of rays in threads; the compiled walks hold no lock."""
        arrays = [np.ascontiguousarray(array) for array in rays[:-1]] + [rays[-1]]
        starts = range(0, len(arrays[0]), RAYS)

        def block(start: int) -> None:
            walk(*self._tree, self._corners, *(array[start : start + RAYS] for array in arrays))

        with ThreadPoolExecutor(os.cpu_count()) as pool:
            list(pool.map(block, starts))
