"""Time limit of the search for bounds, and its progress."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import numpy as np
from numpy.typing import NDArray

Ints = NDArray[np.int64]

#: Lanes run at once.
BATCH = 1 << 15


def batches(count: int) -> Iterator[Ints]:
    """All lanes once, each batch spread over all.

    >>> [len(lanes) for lanes in batches(4000)], [len(lanes) for lanes in batches(80000)]
    ([4000], [26667, 26667, 26666])
    """
    parts = -(-count // BATCH)
    for first in range(parts):
        yield np.arange(first, count, parts)


class TimeLimit:
    """The time that bounds may take, over all passes of a graph.

    Parameters
    ----------
    most_seconds
        Look for bounds no longer than this, less what the reference itself takes; None: as long as it takes.
    report
        Called with a pass, how many of its lanes are done, and how many it has.
    clock
        Seconds, from anywhere.

    Attributes
    ----------
    untried : lanes of the present pass of which time was left for no bounds, or not for all of their paths
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
        """Bounds of a pass are looked for."""
        self._pass, self.untried, self._since = name, 0, self.clock()

    def report(self, done: int, count: int) -> None:
        """So many lanes of the pass are done, and more are begun."""
        self._report(self._pass, done, count)

    def end(self) -> int:
        """End a pixel; return how many of its lanes were not tried."""
        self._spent += self.clock() - self._since
        return self.untried

    @contextmanager
    def spent(self) -> Iterator[None]:
        """Measure the time spent inside; work that has begun is finished."""
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
