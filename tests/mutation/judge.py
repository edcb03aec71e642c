"""Runs in a mutated tree: conformance cases on a backend until one does not pass; prints one line of JSON.

Reads JSON: ``backend``; ``first``, beginnings of names of cases to run before others; ``accepted``, names of the cases
that count (those that pass without a mistake); ``everything``, whether to go on to the others, effects apart: they take
long, and what only an effect catches is a hole in the other groups; ``list``, to run all of a group list and print the
names of those that pass; ``anew``, whether to ask the oracle anew, and not to read what the first run of each case
left in the cache folder.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from typing import Any

from passgraph.backends.base import Backend
from passgraph.backends.registry import open_backend
from passgraph.verify.conformance import GROUPS, Case, Verdict, cases, judge
from passgraph.verify.conformance.judging import Judge
from passgraph.verify.oracle.kept import Kept


def chosen(request: dict[str, Any]) -> Iterator[Case]:
    """Cases in the order in which they are to run."""
    accepted = set(request["accepted"])
    first = tuple(request["first"])
    named = {name.split("/")[0] for name in first}
    groups = [name for name in GROUPS if name in named or (request["everything"] and name != "effects")]
    # A whole group is named for its short run.
    exactly = tuple(name for name in first if not name.endswith("/"))
    known = [
        case for case in cases(groups)
        if (not accepted or case.id in accepted) and (case.quick or case.id.startswith(exactly))
    ]  # fmt: skip
    # As they are named: the one that is most likely to catch is the first.
    ranked = [(next((n for n, name in enumerate(first) if case.id.startswith(name)), None), case) for case in known]
    yield from (case for _, case in sorted((row for row in ranked if row[0] is not None), key=lambda row: row[0]))
    if request["everything"]:
        yield from (case for rank, case in ranked if rank is None)


def verdict(case: Case, backend: Backend, anew: bool) -> Verdict:
    """By the bounds that a tree without a mistake left, see :class:`Kept`."""
    try:
        made = Judge(case, Kept() if anew else Kept(on_disk=True, case=f"{case.id}, {backend.corner_px}"))
    except Exception:
        return judge(case, [backend])[0]  # it fails there too, and says why
    return made.verdict(backend)


def main(request: dict[str, Any]) -> dict[str, Any]:
    ran, passing = 0, []
    with open_backend(request["backend"]) as backend:
        for case in chosen(request):
            found = verdict(case, backend, request["anew"])
            ran += 1
            if found.outcome == "passed":
                passing.append(case.id)
            # How much rounding decides is the case's matter, not the backend's.
            elif found.outcome != "vacuous" and not request.get("list"):
                return {"case": case.id, "outcome": found.outcome, "detail": str(found)[:600], "ran": ran}
    return {"passing": passing} if request.get("list") else {"case": "", "outcome": "", "detail": "", "ran": ran}


if __name__ == "__main__":
    print(json.dumps(main(json.load(sys.stdin))))
