"""Search for a failing case and shrink it within a time limit, in batches with seeds derived from one seed."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable
from contextlib import suppress
from dataclasses import dataclass
from time import monotonic
from typing import Any, Protocol

import numpy as np
from hypothesis import HealthCheck, Phase, Verbosity, given
from hypothesis import seed as seeded
from hypothesis import settings as hypothesis_settings
from hypothesis.strategies import SearchStrategy

from passgraph.backends.base import Backend
from passgraph.errors import GraphError, InputError, KernelError
from passgraph.verify.fuzz import random_draws, random_graphs, variants
from passgraph.verify.fuzz.cases import Case, Tally, inputs_of, kernel_outcome, output_of
from passgraph.verify.fuzz.random_kernels import SIDE
from passgraph.verify.oracle.pass_bounds import Passes


class Judge(Protocol):
    """Runs a case on backends and returns why it fails, or an empty string."""

    def __call__(self, case: Case, graph: Any, backends: list[Backend], tally: Tally, /) -> str: ...


#: Kind → a function that builds its graphs, and its judge.
KINDS: dict[str, tuple[Callable[[Case], Any], Judge]] = {
    "kernel": (lambda case: output_of(case, case["text"]), kernel_outcome),
    "variant": (variants.pair_of, variants.variant_outcome),
    "graph": (random_graphs.grown, random_graphs.graph_outcome),
    "draw": (random_draws.drawn, random_draws.draw_outcome),
}


def outcome(case: Case, backends: Iterable[Backend], tally: Tally | None = None) -> str:
    """Return why a case fails, in a line; empty if every backend is within bounds.

    Raises
    ------
    InputError
        If the data is not a case.
    """
    tally = tally if tally is not None else Tally()
    if case.get("kind") not in KINDS:
        raise InputError(f"a case is of kind {', '.join(KINDS)}, got {case.get('kind')!r}")
    make, judge = KINDS[case["kind"]]
    tally.cases[case["kind"]] += 1
    try:
        graph = make(case)
    except (KernelError, GraphError):
        tally.refused += 1
        return ""
    except (KeyError, TypeError, ValueError, IndexError, AttributeError) as error:
        raise InputError(f"the {case['kind']} case cannot be read: {type(error).__name__} {error}") from error
    with np.errstate(all="ignore"):
        try:
            return judge(case, graph, list(backends), tally)
        except Exception as error:
            # Any exception after the language's own checks is a failure.
            return f"raised {type(error).__name__}: {' '.join(str(error).split())}"


def passes_of(case: Case) -> Passes | None:
    """Return the graph of a case with its inputs, for `passgraph.verify.reproduction`; None for a draw."""
    if case["kind"] in ("kernel", "variant"):
        out = output_of(case, case["other" if case["kind"] == "variant" else "text"])
        return Passes({"out": out}, None, [inputs_of(case, out)])
    if case["kind"] == "graph":
        outputs = random_graphs.grown(case)
        return Passes(outputs, None, [random_graphs.needed_inputs(outputs)])
    return None


#: Cases between two checks of time and counts; a graph compiles many kernels.
BATCH = {"kernels": 40, "native": 40, "graphs": 8, "draws": 20, "variants": 40}
#: Time limit in seconds for shrinking a failure; the smallest case so far is kept.
SHRINK_SECONDS = 120.0


@dataclass(frozen=True)
class Failure:
    """The smallest failing case, and the reason."""

    case: Case
    why: str


class _FoundError(Exception):
    """Signals a failing example to hypothesis."""


def strategies(side: int = SIDE) -> dict[str, SearchStrategy[Case]]:
    """Return kind of case → its generator, in the order of turns; ``side`` is the side of input pictures.

    ``native``: kernels that call their device's own functions.
    """
    from passgraph.verify.fuzz.random_draws import draws
    from passgraph.verify.fuzz.random_graphs import graphs
    from passgraph.verify.fuzz.random_kernels import kernels
    from passgraph.verify.fuzz.variants import variants

    native = kernels(side=side).map(lambda case: {**case, "math": "native"})
    kinds = {"graphs": graphs(), "draws": draws(), "variants": variants(side)}
    return {"kernels": kernels(side=side), "native": native, **kinds}


def batch_seed(seed: int, number: int) -> int:
    """Return the seed of a batch, distinct for every user seed."""
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
        Determines the cases; the same seed gives the same cases.
    until
        Deadline on the clock of :func:`time.monotonic`; later cases are skipped.
    """
    opened = list(backends)
    verdicts: dict[str, str] = {}
    failures: list[Failure] = []
    limit = [until]

    def verdict(case: Case) -> str:
        # Hypothesis reruns failing cases and expects the same verdict, even after the deadline.
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
            if not failures:
                limit[0] = monotonic() + SHRINK_SECONDS
            failures.append(Failure(case, why))
            raise _FoundError(why)

    run: Callable[[], None] = search
    try:
        run()
    except _FoundError:
        smallest = failures[-1]  # hypothesis ends with the smallest
        return _explained(without_dead_lines(smallest, verdict), opened)
    return None


def without_dead_lines(failure: Failure, verdict: Callable[[Case], str]) -> Failure:
    """Return a failing kernel without the lines, and blocks, that it fails without; other cases as they are."""
    if failure.case["kind"] != "kernel":
        return failure  # the two texts of a variant must stay the same function
    number = 0
    while number < len(lines := failure.case["text"].splitlines()):
        depth = _depth(lines[number])
        end = next((k for k in range(number + 1, len(lines)) if _depth(lines[k]) <= depth), len(lines))
        shorter = {**failure.case, "text": "\n".join([*lines[:number], *lines[end:], ""])}
        why = verdict(shorter)
        if why:
            failure, number = Failure(shorter, why), 0  # what it read may be dead now
        else:
            number += 1
    return failure


def _depth(line: str) -> int:
    return len(line) - len(line.lstrip())


def _explained(failure: Failure, backends: Iterable[Backend]) -> Failure:
    """Add the likely mistake to the reason of a failure, if its picture shows one."""
    from passgraph.verify.conformance.judging import explain

    passes = passes_of(failure.case)
    for backend in backends if passes is not None else ():
        assert passes is not None
        with suppress(Exception):  # a backend that raised does so again
            if cause := explain(passes, backend):
                return Failure(failure.case, f"{failure.why}. {cause}")
    return failure
