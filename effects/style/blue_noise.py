"""Blue noise: thresholds without low frequencies, so that a dither shows neither patterns nor clumps from afar.

Source: R. Ulichney, "The void-and-cluster method for dither array generation", Proc. SPIE 1913, 1993.
"""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray

#: Side of the repeated square in pixels.
SIDE = 64
#: Standard deviation in pixels of the filter that finds clusters and voids, as in the paper.
SIGMA = 1.5
#: Fraction of pixels in the first pattern.
FIRST = 0.1


class _Energy:
    """The density of dots around each pixel of a square, which repeats in both directions."""

    def __init__(self) -> None:
        away = np.minimum(np.arange(SIDE), SIDE - np.arange(SIDE)) ** 2.0
        row = np.exp(-away / (2.0 * SIGMA**2))
        self._bump = np.tile(np.outer(row, row), (2, 2))
        self.sum = np.zeros((SIDE, SIDE))
        self.dots = np.zeros((SIDE, SIDE), np.bool_)

    def set(self, pixel: int, dot: bool) -> None:
        y, x = divmod(pixel, SIDE)
        bump = self._bump[SIDE - y : 2 * SIDE - y, SIDE - x : 2 * SIDE - x]
        self.sum += bump if dot else -bump
        self.dots[y, x] = dot

    def tightest_cluster(self) -> int:
        return int(np.argmax(np.where(self.dots, self.sum, -np.inf)))

    def largest_void(self) -> int:
        return int(np.argmin(np.where(self.dots, np.inf, self.sum)))


@cache
def thresholds() -> NDArray[np.float32]:
    """Return the thresholds, (`SIDE`, `SIDE`, 1) float32: each of (rank + 0.5) / `SIDE`² once.

    >>> levels = thresholds()
    >>> levels.shape, len(np.unique(levels)), float(levels.mean())
    ((64, 64, 1), 4096, 0.5)
    """
    energy = _Energy()
    count = int(FIRST * SIDE**2)
    for pixel in np.random.default_rng(0).permutation(SIDE**2)[:count]:
        energy.set(int(pixel), True)
    while True:  # each move makes the pattern more even, so it ends
        cluster = energy.tightest_cluster()
        energy.set(cluster, False)
        void = energy.largest_void()
        energy.set(void, True)
        if void == cluster:
            break
    ranks = np.zeros(SIDE**2, np.int64)
    first = np.flatnonzero(energy.dots)
    for rank in range(count - 1, -1, -1):
        cluster = energy.tightest_cluster()
        energy.set(cluster, False)
        ranks[cluster] = rank
    for pixel in first:
        energy.set(int(pixel), True)
    for rank in range(count, SIDE**2):
        void = energy.largest_void()
        energy.set(void, True)
        ranks[void] = rank
    return ((ranks + 0.5) / SIDE**2).astype(np.float32).reshape(SIDE, SIDE, 1)
