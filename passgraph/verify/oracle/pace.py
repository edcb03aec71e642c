"""How long the reference and its bounds take: estimated from a sample of the pixels, told while it lasts, limited on
request."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import numpy as np
from numpy.typing import NDArray

Ints = NDArray[np.int64]

#: Lanes of the sample, spread over all, that come first where there are many: enough to meet each of a kernel's
#: loops and branches that one pixel in a hundred takes.
SAMPLE = 1024
#: Lanes run at once.
BATCH = 1 << 15
#: What an estimate is multiplied with to be an upper one: other work on the machine, branches that no sample took.
MARGIN = 1.5


def batches(count: int) -> Iterator[Ints]:
    """All lanes once: a sample first where there are many, then the rest, each batch spread over all.

    >>> [len(lanes) for lanes in batches(4000)], [len(lanes) for lanes in batches(80000)]
    ([4000], [1024, 26326, 26325, 26325])
    """
    every = np.arange(count)
    if count > 4 * SAMPLE:
        sample = every[: SAMPLE * (count // SAMPLE) : count // SAMPLE]
        yield sample
        every = np.delete(every, sample)
    parts = -(-len(every) // BATCH)
    for first in range(parts):
        yield every[first::parts]


class Pace:
    """The time that is taken, over all passes of a graph.

    Parameters
    ----------
    most_seconds
        Look for bounds no longer than this, less what the reference itself takes; None: as long as it takes.
    say
        Called with how far a pass is, and how long the rest of it may take.
    clock
        Seconds, from anywhere.

    Attributes
    ----------
    untried : lanes of the present pass of which time was left for no bounds, or not for all of their paths
    """

    def __init__(
        self,
        most_seconds: float | None = None,
        say: Callable[[str], None] = lambda _: None,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self.most_seconds, self.say, self.clock = most_seconds, say, clock
        self.untried = 0
        self._what, self._spent, self._since = "", 0.0, clock()
        #: Of the present pass, each run's rows and seconds, and the lanes of each batch.
        self._runs: list[tuple[int, float]] = []
        self._batches: list[int] = []

    def begin(self, what: str) -> None:
        """Bounds of a pass are looked for."""
        self._what, self.untried, self._since = what, 0, self.clock()
        self._runs, self._batches = [], []

    def end(self) -> int:
        """How many of its lanes were not tried."""
        self._spent += self.clock() - self._since
        return self.untried

    @contextmanager
    def spent(self) -> Iterator[None]:
        """What is done within counts, and is done to its end."""
        start = self.clock()
        try:
            yield
        finally:
            self._spent += self.clock() - start

    @property
    def left_s(self) -> float:
        """What may still be spent."""
        if self.most_seconds is None:
            return np.inf
        return self.most_seconds - self._spent - (self.clock() - self._since)

    @property
    def over(self) -> bool:
        return self.left_s <= 0.0

    def batch(self, lanes: int) -> None:
        """A batch of so many lanes begins."""
        self._batches.append(lanes)

    def ran(self, rows: int, seconds: float) -> None:
        """Some lanes of the batch were run along a path of each, or along several."""
        self._runs.append((rows, seconds))

    def tell(self, done: int, count: int) -> None:
        """So many lanes of all that were asked for are through."""
        if done < count:
            rest_s = self.rest_s(count - done)
            limit = f", {max(self.left_s, 0.0):.0f} s are left" if rest_s > self.left_s else ""
            self.say(f"bounds of {self._what}: {done / count:.0%} done, up to {told_s(rest_s)} more{limit}")

    def rest_s(self, lanes: int) -> float:
        """An upper estimate of what more lanes of the pass take.

        A run takes some time at any rate, and some more for each of its rows; the rest has as many rows a lane, and
        its batches as many runs, as what is done.
        """
        rows, seconds = np.array(self._runs, np.float64).T
        for_each = float(seconds.sum() / rows.sum())
        at_any_rate = 0.0
        if np.ptp(rows) > 0.0:
            slope = float(np.cov(rows, seconds, bias=True)[0, 1] / rows.var())
            if 0.0 < slope < for_each:
                for_each, at_any_rate = slope, float(seconds.mean() - slope * rows.mean())
        runs = -(-lanes // BATCH) * len(rows) / len(self._batches)
        return MARGIN * (for_each * float(rows.sum()) / sum(self._batches) * lanes + at_any_rate * runs)


def told_s(seconds: float) -> str:
    """
    >>> told_s(0.2), told_s(75.0), told_s(400.0)
    ('1 s', '75 s', '7 min')
    """
    return f"{max(round(seconds), 1)} s" if seconds < 120.0 else f"{round(seconds / 60.0)} min"
