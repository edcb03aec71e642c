"""Memory that begins where a cache line does and may be read a little beyond its end."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import DTypeLike, NDArray

#: Bytes of a cache line, and of the widest vectors: loads that straddle two lines take twice as long.
LINE = 64
#: Numbers behind the last one that may be read: the last vector of a row loads whole ones.
ROOM = 128
#: Bytes that the processor protects together: what lies behind an array in its last page may be read.
PAGE = 4096


def aligned_zeros(count: int, dtype: DTypeLike = np.float32) -> NDArray[Any]:
    """``count`` zeros from the start of a cache line."""
    kind = np.dtype(dtype)
    size = count * kind.itemsize
    whole = np.zeros(size + LINE + ROOM * kind.itemsize, np.uint8)
    first = -whole.ctypes.data % LINE
    return whole[first : first + size].view(kind)


def rest_of_page(end: int) -> int:
    """Bytes from an address to the end of its page; none where a page begins there."""
    return -end % PAGE
