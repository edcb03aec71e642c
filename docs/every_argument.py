"""Measure functions over all float32 arguments: ``python docs/every_argument.py BACKEND NAME…``.

Takes minutes for each function.  Results are kept in docs/every_argument.json, from which docs/native_math.py writes a
table; a test checks the arguments of the largest errors with mpmath.
"""

from __future__ import annotations

import json
import sys
import time
from datetime import date
from pathlib import Path

from passgraph.backends.registry import open_backend
from passgraph.verify.every_argument import EveryError, measure_every

RECORDS = Path(__file__).with_suffix(".json")


def main(name: str, functions: list[str]) -> None:
    with open_backend(name) as backend:
        for function in functions:
            begin, found = time.perf_counter(), EveryError(function, "exact", "")
            for found in measure_every(backend, function):
                pass
            record = {
                "largest": found.worst, "at": found.worst_at, "outside": found.outside, "promised": found.promised,
                "minutes": round((time.perf_counter() - begin) / 60, 1), "date": str(date.today()),
            }  # fmt: skip
            records = json.loads(RECORDS.read_text(encoding="utf-8")) if RECORDS.exists() else {}
            records.setdefault(function, {})[name] = record
            RECORDS.write_text(json.dumps(records, indent=1) + "\n", encoding="utf-8")
            print(name, found, flush=True)


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2:])
