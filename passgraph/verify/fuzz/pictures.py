"""Pictures of values for fuzzed passes: one run evaluates a kernel at thousands of them, as compiling costs most."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Picture = NDArray[np.float32]

SIDE = 64
#: Values with meanings of their own: zeros, ones, halves that rounding ties on, denormals, range ends, NaN.
SPECIAL = np.array([
    0.0, -0.0, 1.0, -1.0, 0.5, 1.5, 2.5, -3.75, 7.0, 31.0, 1e-40, -1e-40, 1.17549435e-38, 1e-20, 1e20, 3e38, -3e38,
    8388609.0, 2147483648.0, -2147483648.0, np.inf, -np.inf, np.nan,
], np.float32)  # fmt: skip


def values(seed: int, size: tuple[int, int], special: bool = True) -> Picture:
    """(height, width, 4), mostly in [-2, 2]; a few rows on steps of 1/8, and of special values where wanted."""
    random = np.random.default_rng(seed)
    width, height = size
    made = random.uniform(-2, 2, (height, width, 4)).astype(np.float32)
    made[::5] = np.round(made[::5] * 8) / 8
    if special:
        # Every eighth row, beside each other in all combinations; the rest stays what ranges promise.
        rows = made[3::8]
        rows[...] = random.choice(SPECIAL, rows.shape)
    return made


def unit(seed: int, size: tuple[int, int], channels: int = 4) -> Picture:
    """(height, width, channels) in [0, 1)."""
    return np.random.default_rng(seed).random((size[1], size[0], channels)).astype(np.float32)
