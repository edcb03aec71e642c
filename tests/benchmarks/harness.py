"""What every benchmark shares: turns, medians, and a ratio with what is wanted of it."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import Any

Job = Callable[[], object]


@dataclass(frozen=True, slots=True)
class Ratio:
    """One figure and its target.

    Attributes
    ----------
    what : whose cost, and of what the figure is a share
    got : in ``unit``
    wanted : the most (the least, with ``at_least``); None where nothing is asked
    ms, other_ms : of one run; None where the figure is no ratio of times
    unit : "×", "s", "µs" or "%"
    """

    what: str
    got: float
    wanted: float | None
    ms: float | None = None
    other_ms: float | None = None
    unit: str = "×"
    at_least: bool = False

    @property
    def met(self) -> bool | None:
        if self.wanted is None:
            return None
        return self.got >= self.wanted if self.at_least else self.got <= self.wanted

    def plain(self) -> dict[str, Any]:
        """For JSON."""
        return asdict(self)


def seconds(job: Job, clock: Callable[[], float] = time.perf_counter) -> float:
    begin = clock()
    job()
    return clock() - begin


def interleaved(
    jobs: dict[str, Job], rounds: int, warm_up: int = 1, clock: Callable[[], float] = time.perf_counter
) -> dict[str, list[float]]:
    """Milliseconds of every run of each job, taken in turns so that the machine's drift meets all alike.

    Who begins changes from turn to turn: what a job leaves in the caches is the next one's gain or loss.
    ``clock=time.process_time`` counts the processor time of all threads, which other load hardly changes.
    """
    times: dict[str, list[float]] = {name: [] for name in jobs}
    order = list(jobs)
    for turn in range(warm_up + rounds):
        order = [*order[1:], order[0]]
        for name in order:
            spent = seconds(jobs[name], clock) * 1e3
            if turn >= warm_up:
                times[name].append(spent)
    return times


def ratio_of(what: str, ours: list[float], others: list[float], wanted: float | None, *, faster: bool = False) -> Ratio:
    """The median of the ratios of neighbours in time, which share whatever else the machine does.

    ``faster`` turns it over: how many times ours fits into the other's, of which ``wanted`` is the least.
    """
    pairs = [(b / a if faster else a / b) for a, b in zip(ours, others, strict=True)]
    mine, other = statistics.median(ours), statistics.median(others)
    return Ratio(what, statistics.median(pairs), wanted, mine, other, at_least=faster)
