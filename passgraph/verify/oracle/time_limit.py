"""Time limit of computing bounds, and its progress."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import numpy as np
from numpy.typing import NDArray

Ints = NDArray[np.int64]

#: Lanes per run.
BATCH = 1 << 15


def batches(count: int) -> Iterator[Ints]:
    """Yield every lane once, in batches that are each spread over all lanes.

    >>> [len(lanes) for lanes in batches(4000)], [len(lanes) for lanes in batches(80000)]
    ([4000], [26667, 26667, 26666])
    """
    parts = -(-count // BATCH)
    for first in range(parts):
        yield np.arange(first, count, parts)


class TimeLimit:
    """The time for computing bounds, over all passes of a graph.

    Parameters
    ----------
    most_seconds
        Time limit in seconds, less the reference's own time; None: no limit.
    report
        Called with a pass, the number of its finished lanes, and the number of all its lanes.
    clock
        Returns seconds, from any origin.

    Attributes
    ----------
    untried : lanes of the current pass without bounds, or with bounds of only some paths, because of the limit
    """

    def __init__(
        self,
        most_seconds: float | None = None,
        report: Callable[[str, int, int], None] = lambda *_: None,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self.most_seconds, self.clock = most_seconds, clock
        self.untried = 0
        self._report = report
        self._pass, self._spent, self._since = "", 0.0, clock()

    def begin(self, name: str) -> None:
        """Begin a pass."""
        self._pass, self.untried, self._since = name, 0, self.clock()

    def report(self, done: int, count: int) -> None:
        """Report the number of finished lanes; more have begun."""
        self._report(self._pass, done, count)

    def end(self) -> int:
        """End a pass; return how many of its lanes were not tried."""
        self._spent += self.clock() - self._since
        return self.untried

    @contextmanager
    def spent(self) -> Iterator[None]:
        """Measure the time spent inside; started work is finished."""
        start = self.clock()
        try:
            yield
        finally:
            self._spent += self.clock() - start

    @property
    def left_s(self) -> float:
        """Return the seconds left."""
        if self.most_seconds is None:
            return np.inf
        return self.most_seconds - self._spent - (self.clock() - self._since)

    @property
    def is_over(self) -> bool:
        return self.left_s <= 0.0
