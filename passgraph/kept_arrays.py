"""Arrays that this package computes from a few numbers, in the disk cache: shipped pictures and meshes."""

from __future__ import annotations

import hashlib
import io
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from passgraph import disk_cache
from passgraph.signatures import wraps

Arrays = tuple[NDArray[Any], ...]


def kept(make: Callable[..., Arrays]) -> Callable[..., Arrays]:
    """Keep the results of a function in the disk cache, by its name and its arguments.

    It must depend on nothing else but files of this package. Its arguments are numbers and strings.

    >>> @kept
    ... def counted(count: int) -> Arrays:
    ...     return (np.arange(count),)
    >>> counted(3)[0].tolist(), counted(3)[0].tolist()
    ([0, 1, 2], [0, 1, 2])
    """

    @wraps(make)
    def recalled(*arguments: float | str) -> Arrays:
        stamp = disk_cache.package_stamp()
        if stamp is None:
            return make(*arguments)
        name = hashlib.sha256(f"{stamp} {make.__module__}.{make.__qualname__} {arguments!r}".encode()).hexdigest()
        arrays = _read(disk_cache.recall("arrays", name))
        if arrays is None:
            arrays = make(*arguments)
            file = io.BytesIO()
            for array in arrays:
                np.lib.format.write_array(file, array, allow_pickle=False)
            disk_cache.remember("arrays", name, file.getvalue())
        return arrays

    return recalled


def _read(data: bytes | None) -> Arrays | None:
    """Return the arrays of a file; None if there is none, or one with anything else."""
    if not data:
        return None
    file, arrays = io.BytesIO(data), []
    try:
        while file.tell() < len(data):
            arrays.append(np.lib.format.read_array(file, allow_pickle=False))
    except (ValueError, TypeError, SyntaxError, EOFError, MemoryError):
        return None
    return tuple(arrays)
