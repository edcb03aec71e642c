"""Host pictures as the whole steps that unorm formats store, for backends whose devices hold bytes and shorts."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from passgraph.backends.base import FloatBlock

#: What 1.0 is stored as.
UNORM_ONE = {"unorm8": 255, "unorm16": 65535}
_TYPES: dict[str, Any] = {"unorm8": np.uint8, "unorm16": np.uint16}
#: Values taken at once: what is between two steps of the work stays in the processor's cache.
CHUNK = 1 << 14


def steps_of(picture: FloatBlock, kind: str) -> NDArray[Any]:
    """Numbers from 0 to 1 as steps of ``"unorm8"`` or ``"unorm16"``, halves to the even one; NaN is 0.

    >>> steps_of(np.array([0.0, 0.5 / 255, 1.5 / 255, 7.0, np.nan, -np.inf], np.float32), "unorm8")
    array([  0,   0,   2, 255,   0,   0], dtype=uint8)
    """
    made = np.empty(picture.shape, _TYPES[kind])
    values, steps = picture.reshape(-1), made.reshape(-1)
    room = np.empty(min(CHUNK, values.size), np.float32)
    # beside arrays: beside a scalar NumPy takes four times as long for fmax and fmin
    zeros, ones = np.zeros_like(room), np.ones_like(room)
    for start in range(0, values.size, CHUNK):
        given = values[start : start + CHUNK]
        part = room[: given.size]
        np.fmax(given, zeros[: given.size], out=part)
        np.fmin(part, ones[: given.size], out=part)
        np.multiply(part, np.float32(UNORM_ONE[kind]), out=part)
        np.rint(part, out=part)
        np.copyto(steps[start : start + CHUNK], part, casting="unsafe")
    return made
