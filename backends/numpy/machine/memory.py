"""Memory that begins where a cache line does."""

from __future__ import annotations

import numpy as np

from passgraph.backends.base import FloatBlock

#: Bytes of a cache line, and of the widest vectors: loads that straddle two lines take twice as long.
LINE = 64
#: Numbers behind the last one that may be read: the last vector of a row loads whole ones.
ROOM = 128


def aligned_zeros(count: int) -> FloatBlock:
    """``count`` float32 zeros from the start of a cache line."""
    whole = np.zeros(count + LINE // 4 + ROOM, np.float32)
    first = -whole.ctypes.data % LINE // 4
    return whole[first : first + count]
