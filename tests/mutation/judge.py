"""Runs in a mutated tree: conformance cases on a backend until one does not pass; prints one line of JSON.

Reads JSON: ``backend``; ``first``, beginnings of names of cases to run before others; ``accepted``, names of the cases
that count (those that pass without a mistake); ``everything``, whether to go on to the others, effects apart: they take
long, and what only an effect catches is a hole in the other groups; ``list``, to run all of a group list and print the
names of those that pass.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from typing import Any

from passgraph.backends.registry import open_backend
from passgraph.conformance import GROUPS, Case, cases, judge


def chosen(request: dict[str, Any]) -> Iterator[Case]:
    """Cases in the order in which they are to run."""
    accepted = set(request["accepted"])
    first = tuple(request["first"])
    named = {name.split("/")[0] for name in first}
    groups = [name for name in GROUPS if name in named or (request["everything"] and name != "effects")]
    known = [case for case in cases(groups) if not accepted or case.id in accepted]
    yield from (case for case in known if case.id.startswith(first))
    if request["everything"]:
        yield from (case for case in known if case.quick and not case.id.startswith(first))


def main(request: dict[str, Any]) -> dict[str, Any]:
    ran, passing = 0, []
    with open_backend(request["backend"]) as backend:
        for case in chosen(request):
            (verdict,) = judge(case, [backend])
            ran += 1
            if verdict.outcome == "passed":
                passing.append(case.id)
            # How much rounding decides is the case's matter, not the backend's.
            elif verdict.outcome != "vacuous" and not request.get("list"):
                return {"case": case.id, "outcome": verdict.outcome, "detail": str(verdict)[:600], "ran": ran}
    return {"passing": passing} if request.get("list") else {"case": "", "outcome": "", "detail": "", "ran": ran}


if __name__ == "__main__":
    print(json.dumps(main(json.load(sys.stdin))))
