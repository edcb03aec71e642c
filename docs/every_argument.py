"""Measure functions over all float32 arguments: ``python docs/every_argument.py [BACKEND NAME…]``.

Takes minutes for each function.  Results are kept in docs/every_argument.json, and written as a table into
docs/native-math.md.  A test checks the arguments of the largest errors with mpmath.
"""

from __future__ import annotations

import json
import sys
import time
from datetime import date
from pathlib import Path

from passgraph.backends.registry import open_backend
from passgraph.verify.every_argument import measure_every

RECORDS = Path(__file__).with_suffix(".json")
PAGE = RECORDS.with_name("native-math.md")
BEGIN, END = "<!-- docs/every_argument.py writes this table -->", "<!-- end of the table -->"


def table() -> str:
    lines = [
        "| function | backend | largest error, ULP | at | promised | minutes | date |",
        "|---|---|---:|---:|---|---:|---|",
    ]
    for function, records in json.loads(RECORDS.read_text(encoding="utf-8")).items():
        for name, one in sorted(records.items(), reverse=True):
            figures = f"{one['largest']:.3f} | {one['at']:.9g} | {one['promised']} | {one['minutes']} | {one['date']}"
            lines.append(f"| `{function}` | `{name}` | {figures} |")
    return "\n".join(lines)


def write_page() -> None:
    head, _, rest = PAGE.read_text(encoding="utf-8").partition(BEGIN)
    PAGE.write_text(f"{head}{BEGIN}\n\n{table()}\n\n{END}{rest.partition(END)[2]}", encoding="utf-8")


def main(name: str, functions: list[str]) -> None:
    with open_backend(name) as backend:
        for function in functions:
            begin = time.perf_counter()
            *_, found = measure_every(backend, function)
            record = {
                "largest": found.worst, "at": found.worst_at, "outside": found.outside, "promised": found.promised,
                "minutes": round((time.perf_counter() - begin) / 60, 1), "date": str(date.today()),
            }  # fmt: skip
            records = json.loads(RECORDS.read_text(encoding="utf-8")) if RECORDS.exists() else {}
            records.setdefault(function, {})[name] = record
            RECORDS.write_text(json.dumps(records, indent=1) + "\n", encoding="utf-8")
            print(name, found, flush=True)


if __name__ == "__main__":
    if len(sys.argv) > 2:
        main(sys.argv[1], sys.argv[2:])
    write_page()
