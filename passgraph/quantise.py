"""Convert floats in [0, 1] to integers of 8 and 16 bits."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from passgraph.errors import InputError

#: Values converted at a time, so that temporaries stay in a core's cache.
_AT_ONCE = 1 << 16


def quantised(values: NDArray[Any], dtype: np.dtype[Any], whose: str) -> NDArray[Any]:
    """Convert floats of any shape to uint8 or uint16: clip to [0, 1], round half to even.

    ``whose`` begins the message of the error.

    Raises
    ------
    InputError : for NaN, which has no integer value.

    >>> quantised(np.array([-1.0, 0.5, 2.0]), np.dtype(np.uint8), "three").tolist()
    [0, 128, 255]
    """
    flat = np.ascontiguousarray(values).reshape(-1)
    stored, most = np.empty(flat.shape, dtype), np.iinfo(dtype).max
    for first in range(0, flat.size, _AT_ONCE):
        part = flat[first : first + _AT_ONCE]
        with np.errstate(over="ignore"):  # a float64 beyond float32 becomes infinity, which is clipped
            scaled = np.clip(part, 0, 1).astype(np.float32, copy=False)
        if np.isnan(scaled.min()):
            check_no_nan(values, whose)
        scaled *= np.float32(most)
        stored[first : first + _AT_ONCE] = np.rint(scaled, out=scaled)
    return stored.reshape(values.shape)


def check_no_nan(pixels: NDArray[Any], whose: str) -> None:
    """Raise InputError with the position of the first NaN in a picture (h, w, channels)."""
    missing = np.isnan(pixels)
    if missing.any():
        row, column, channel = (int(i) for i in np.argwhere(np.atleast_3d(missing))[0])
        raise InputError(
            f"{whose}: {int(missing.sum())} of {pixels.size} values are NaN, the first in row {row},"
            f" column {column}, channel {channel}; save as .exr or .npy to look at them"
        )
