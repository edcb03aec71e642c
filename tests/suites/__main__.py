"""Run the suites of others: ``python -m tests.suites --backend numpy [--write]``; see `tests.suites.test_suites`."""

from __future__ import annotations

import argparse
import json

from tests.suites.judgment import numbers_of
from tests.suites.runs import NUMBERS, SUITES, judged


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m tests.suites", description=__doc__)
    parser.add_argument("--backend", default="numpy")
    parser.add_argument("--suite", choices=sorted(SUITES), action="append")
    parser.add_argument("--write", action="store_true", help=f"keep the numbers in {NUMBERS.name}")
    parser.add_argument("--names", action="store_true", help="print each case that is not right")
    given = parser.parse_args()
    kept = json.loads(NUMBERS.read_text()) if NUMBERS.exists() else {}
    for suite in given.suite or sorted(SUITES):
        judgments = judged(suite, given.backend)
        if judgments is None:
            print(f"{suite}: {SUITES[suite].variable} does not name a checkout; left out")
            continue
        kept.setdefault(suite, {})[given.backend] = numbers = numbers_of(judgments)
        print(suite, given.backend, json.dumps(numbers, indent=1))
        if given.names:
            for name, judgment in judgments.items():
                if judgment.verdict != "right":
                    print(f"{judgment.verdict}: {name}: {judgment.reason}")
    if given.write:
        NUMBERS.write_text(json.dumps(kept, indent=1, sort_keys=True) + "\n")


if __name__ == "__main__":
    main()
