"""Run the suites of others: ``python -m tests.suites [--backend gl] [--write]``; see `tests.suites.test_suites`."""

from __future__ import annotations

import argparse
import json
import os

from tests.suites.judgment import numbers_of
from tests.suites.runs import BACKENDS, NUMBERS, SUITES, judged, sample_of


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m tests.suites", description=__doc__)
    parser.add_argument("--backend", choices=BACKENDS, action="append", help="default: all of them")
    parser.add_argument("--suite", choices=sorted(SUITES), action="append")
    parser.add_argument("--write", action="store_true", help=f"keep the numbers in {NUMBERS.name}")
    parser.add_argument("--names", action="store_true", help="print each case that is not right")
    given = parser.parse_args()
    # Thousands of shaders that draw a pixel each: what compilers optimize takes longer than what it saves.
    os.environ.setdefault("GALLIVM_PERF", "nopt")
    os.environ.setdefault("POCL_EXTRA_BUILD_FLAGS", "-cl-opt-disable")
    kept = json.loads(NUMBERS.read_text()) if NUMBERS.exists() else {}
    for suite in given.suite or sorted(SUITES):
        backends = given.backend or BACKENDS if SUITES[suite].runs else SUITES[suite].backends
        by_backend = judged(suite, backends)
        if by_backend is None:
            print(f"{suite}: {SUITES[suite].variable} does not name a checkout; left out")
            continue
        for backend, judgments in by_backend.items():
            numbers = numbers_of(judgments, sample_of(backend))
            kept.setdefault(suite, {})[backend] = numbers
            print(suite, backend, json.dumps(numbers, indent=1))
            if given.names:
                for name, judgment in judgments.items():
                    if judgment.verdict != "right":
                        print(f"{judgment.verdict}: {name}: {judgment.reason}")
    if given.write:
        NUMBERS.write_text(json.dumps(kept, indent=1, sort_keys=True) + "\n")


if __name__ == "__main__":
    main()
