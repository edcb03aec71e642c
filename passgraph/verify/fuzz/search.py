"""Searching for a failing case and shrinking it, within a time, in batches whose seeds follow from one."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from time import monotonic

from hypothesis import HealthCheck, Phase, Verbosity, given
from hypothesis import seed as seeded
from hypothesis import settings as hypothesis_settings
from hypothesis.strategies import SearchStrategy

from passgraph.backends.base import Backend
from passgraph.verify.fuzz.cases import Case, Tally
from passgraph.verify.fuzz.outcomes import outcome
from passgraph.verify.fuzz.pictures import SIDE

#: Cases between two looks at the clock and the counts; a graph compiles many kernels.
BATCH = {"kernels": 40, "graphs": 8, "draws": 20, "variants": 40}
#: Longest that one failure is shrunk, in seconds; what is smallest then is kept.
SHRINK_SECONDS = 120.0


@dataclass(frozen=True)
class Failure:
    """The smallest case that was found, and what is wrong with it."""

    case: Case
    why: str


class _FoundError(Exception):
    """A case fails; hypothesis takes it as a failing example."""


def strategies(side: int = SIDE) -> dict[str, SearchStrategy[Case]]:
    """Kind of case → its generator, in the order in which they take turns; ``side`` is that of pictures of values."""
    from passgraph.verify.fuzz.draws import draws
    from passgraph.verify.fuzz.graphs import graphs
    from passgraph.verify.fuzz.kernels import kernels
    from passgraph.verify.fuzz.variants import variants

    return {"kernels": kernels(side=side), "graphs": graphs(), "draws": draws(), "variants": variants(side)}


def batch_seed(seed: int, number: int) -> int:
    """The seed of the batch of this number: apart for every seed that a user may give."""
    return (seed << 32) + number


def batch(
    strategy: SearchStrategy[Case],
    backends: Iterable[Backend],
    seed: int,
    tally: Tally,
    count: int,
    until: float = float("inf"),
) -> Failure | None:
    """Run some random cases; shrink the first that fails.

    Parameters
    ----------
    seed
        Decides which cases; one seed always gives the same.
    until
        On the clock of :func:`time.monotonic`: cases after it are not run any more.
    """
    opened = list(backends)
    verdicts: dict[str, str] = {}
    found: list[Failure] = []
    limit = [until]

    def verdict(case: Case) -> str:
        # Hypothesis runs failing cases again and wants the same verdict, after the time too.
        key = json.dumps(case, sort_keys=True)
        if key not in verdicts:
            verdicts[key] = "" if monotonic() > limit[0] else outcome(case, opened, tally)
        return verdicts[key]

    @seeded(seed)
    @hypothesis_settings(
        max_examples=count, deadline=None, database=None, print_blob=False, report_multiple_bugs=False,
        verbosity=Verbosity.quiet, phases=(Phase.generate, Phase.shrink), suppress_health_check=list(HealthCheck),
    )  # fmt: skip
    @given(strategy)
    def search(case: Case) -> None:
        why = verdict(case)
        if why:
            if not found:
                limit[0] = monotonic() + SHRINK_SECONDS
            found.append(Failure(case, why))
            raise _FoundError(why)

    run: Callable[[], None] = search
    try:
        run()
    except _FoundError:
        return found[-1]  # hypothesis ends with the smallest
    return None
