"""Runs in a mutated tree: conformance cases on a backend until one does not pass; prints one line of JSON.

Reads JSON: ``backend``; ``first``, beginnings of names of cases to run before others; ``accepted``, names of the cases
that count (those that pass without a mistake); ``everything``, whether to go on to the others, effects apart: they take
long, and what only an effect catches is a hole in the other groups; ``list``, to run all of a group list and print the
names of those that pass; ``bounds``, a folder where what the oracle allows is kept from one run to the next.
"""

from __future__ import annotations

import hashlib
import json
import os
import pickle
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from passgraph.backends.base import Backend
from passgraph.backends.registry import open_backend
from passgraph.verify.conformance import GROUPS, Case, Verdict, cases, judge
from passgraph.verify.conformance.judging import Judge


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


def verdict(case: Case, backend: Backend, bounds: str) -> Verdict:
    """What the oracle allows is read from a file where an earlier run has left one: it takes most of the time."""
    if not bounds:
        return judge(case, [backend])[0]
    file = Path(bounds) / f"{hashlib.sha256(case.id.encode()).hexdigest()[:16]}-{backend.snaps}.pickle"
    try:
        made = Judge(case)
    except Exception:
        return judge(case, [backend])[0]  # it fails there too, and says why
    if file.exists():
        made.passes.found = pickle.loads(file.read_bytes())
        return made.verdict(backend)
    found = made.verdict(backend)
    part = file.with_suffix(f".{os.getpid()}")
    part.write_bytes(pickle.dumps(made.passes.found))
    part.replace(file)
    return found


def main(request: dict[str, Any]) -> dict[str, Any]:
    ran, passing = 0, []
    with open_backend(request["backend"]) as backend:
        for case in chosen(request):
            found = verdict(case, backend, request["bounds"])
            ran += 1
            if found.outcome == "passed":
                passing.append(case.id)
            # How much rounding decides is the case's matter, not the backend's.
            elif found.outcome != "vacuous" and not request.get("list"):
                return {"case": case.id, "outcome": found.outcome, "detail": str(found)[:600], "ran": ran}
    return {"passing": passing} if request.get("list") else {"case": "", "outcome": "", "detail": "", "ran": ran}


if __name__ == "__main__":
    print(json.dumps(main(json.load(sys.stdin))))
