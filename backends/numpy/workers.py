"""Threads that share the rows or tiles of a pass.  Compiled code holds no GIL, so they really run side by side."""

from __future__ import annotations

import itertools
import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor, wait

#: Environment variable with the number of threads; default: one a core that this process may use.
THREADS_VARIABLE = "PASSGRAPH_THREADS"


def thread_count() -> int:
    given = os.environ.get(THREADS_VARIABLE, "")
    if given.isdigit() and int(given) > 0:
        return int(given)
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


class Workers:
    """A pool that hands out numbered pieces of work, dynamically: whoever is free takes the next."""

    def __init__(self, count: int | None = None) -> None:
        self.count = count or thread_count()
        self._pool = ThreadPoolExecutor(self.count - 1, "passgraph") if self.count > 1 else None

    def each(self, function: Callable[[int], None], pieces: int) -> None:
        """``function(0)`` … ``function(pieces - 1)``; returns when all are done, raises what one raised."""
        if self._pool is None or pieces <= 1:
            for piece in range(pieces):
                function(piece)
            return
        numbers = itertools.count()

        def take() -> None:
            while (piece := next(numbers)) < pieces:
                function(piece)

        others = [self._pool.submit(take) for _ in range(min(self.count, pieces) - 1)]
        take()
        wait(others)
        for other in others:
            other.result()

    def close(self) -> None:
        if self._pool is not None:
            self._pool.shutdown(wait=True)
            self._pool = None
