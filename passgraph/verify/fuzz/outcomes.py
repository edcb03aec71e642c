"""What becomes of a case of any kind: made, run and judged."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any, Protocol

import numpy as np

from passgraph.backends.base import Backend
from passgraph.errors import GraphError, InputError, KernelError
from passgraph.verify.fuzz import draws, graphs, variants
from passgraph.verify.fuzz.cases import Case, Tally, kernel_outcome, output_of


class Judge(Protocol):
    """Runs a case on backends; why it fails, or empty."""

    def __call__(self, case: Case, made: Any, backends: list[Backend], tally: Tally, /) -> str: ...


#: Kind → what makes its graphs, what judges them.
KINDS: dict[str, tuple[Callable[[Case], Any], Judge]] = {
    "kernel": (lambda case: output_of(case, case["text"]), kernel_outcome),
    "variant": (variants.pair_of, variants.variant_outcome),
    "graph": (graphs.grown, graphs.graph_outcome),
    "draw": (draws.drawn, draws.draw_outcome),
}


def outcome(case: Case, backends: Iterable[Backend], tally: Tally | None = None) -> str:
    """Why a case fails, in a line; empty where every backend gives what it may.

    Raises
    ------
    InputError
        For data that is no case.
    """
    tally = tally if tally is not None else Tally()
    if case.get("kind") not in KINDS:
        raise InputError(f"a case is of kind {', '.join(KINDS)}, got {case.get('kind')!r}")
    make, judge = KINDS[case["kind"]]
    tally.cases[case["kind"]] += 1
    try:
        made = make(case)
    except (KernelError, GraphError):
        tally.refused += 1
        return ""
    except (KeyError, TypeError, ValueError, IndexError, AttributeError) as error:
        raise InputError(f"the {case['kind']} case cannot be read: {type(error).__name__} {error}") from error
    with np.errstate(all="ignore"):
        try:
            return judge(case, made, list(backends), tally)
        except Exception as error:
            # Whatever is raised after the language's own checks is a failure as any other.
            return f"raised {type(error).__name__}: {' '.join(str(error).split())}"
