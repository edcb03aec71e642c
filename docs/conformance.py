"""Writes docs/conformance.md: the suite on every backend that is here, mutants and fuzzing as recorded.

    python docs/conformance.py [--full] [--mutants FILE.json] [--fuzz "TEXT"]

``--mutants`` takes what ``python -m tests.mutation.run --json`` wrote.  Without it that section is kept as it is.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

PAGE = Path(__file__).with_name("conformance.md")
RECORDS = Path(__file__).with_name("conformance.json")
HEAD = """# Conformance: what backends are held to

Written by `python docs/conformance.py`; run it again where a backend or the suite has changed.

The reference backend runs every pass over float64 intervals (`passgraph/oracle/`): each operation is widened by the
bound in the [table of operations](kernels.md), each stored value by its format. Where rounding may turn a decision (a
comparison, a floor, whether a pixel is covered, a depth test) both ways are run; a pixel whose outcomes then lie apart
is *ambiguous*. A backend conforms when every value of every target of every pass lies within; there is no tolerance to
raise. Each pass is given the reference's pictures, so that a verdict is on that pass alone. A case whose targets are
too ambiguous, or of whose values the bounds say too little, is *vacuous* and does not pass.

OpenGL leaves the grid that corners are rounded to, and how attributes are interpolated from unrounded corners, to the
driver: on `gl` a corner may be anywhere within 1/256 pixel, elsewhere it is where
[rasterisation.md](rasterisation.md) says.

```sh
passgraph conform --backend gl --report gl.html    # the suite, with pictures of what diverges
passgraph check my_effect.py                       # your own kernels and graphs on every backend
passgraph fuzz --minutes 10                        # random kernels, graphs, draws and rewritings
pytest --passgraph-backend NAME                    # the suite as tests, for a backend of yours
```
"""


def suite(backend: str, full: bool) -> dict[str, Any] | None:
    """The JSON report of one backend; None where it is not here."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "report.json"
        command = [sys.executable, "-m", "passgraph", "conform", "--backend", backend, "--json", str(file)]
        done = subprocess.run(command if full else [*command, "--quick"], check=False)
        if done.returncode not in (0, 1) or not file.exists():
            return None
        report: dict[str, Any] = json.loads(file.read_text(encoding="utf-8"))
        return report


def suite_table(reports: dict[str, dict[str, Any]]) -> str:
    lines = [
        "| backend | group | cases | passed | most ambiguous | mean ambiguous | least told | seconds |",
        "|---|---|--:|--:|--:|--:|--:|--:|",
    ]
    for backend, report in reports.items():
        by_group: dict[str, list[dict[str, Any]]] = {}
        for case in report["cases"]:
            by_group.setdefault(case["case"].partition("/")[0], []).append(case)
        for group, cases in by_group.items():
            ambiguous = [case["ambiguous"] for case in cases]
            passed = sum(case["outcome"] == "passed" for case in cases)
            lines.append(
                f"| {backend} | {group} | {len(cases)} | {passed} | {max(ambiguous):.2%} | "
                f"{sum(ambiguous) / len(cases):.2%} | {min(case['told'] for case in cases):.1%} | "
                f"{sum(case['seconds'] for case in cases):.0f} |"
            )
    return "\n".join(lines)


def mutant_table(rows: list[dict[str, Any]]) -> str:
    lines = ["| part | planted | caught | harmless by design |", "|---|--:|--:|--:|"]
    for part in sorted({row["file"] for row in rows}):
        of_part = [row for row in rows if row["file"] == part]
        caught = sum(row["caught"] for row in of_part)
        lines.append(f"| `{part}` | {len(of_part)} | {caught} | {sum(bool(row['harmless']) for row in of_part)} |")
    return "\n".join(lines)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--full", action="store_true", help="slow cases too")
    parser.add_argument("--mutants", type=Path, help="JSON of tests.mutation.run")
    parser.add_argument("--fuzz", help="a sentence on what was run and found")
    options = parser.parse_args()
    records = json.loads(RECORDS.read_text(encoding="utf-8")) if RECORDS.exists() else {}
    reports = {}
    for backend in ("numpy", "gl", "opencl"):
        report = suite(backend, options.full)
        if report is None:
            print(f"{backend}: not here, left out", file=sys.stderr)
        else:
            reports[backend] = report
    if options.mutants:
        records["mutants"] = mutant_table(json.loads(options.mutants.read_text(encoding="utf-8")))
    if options.fuzz:
        records["fuzz"] = options.fuzz
    RECORDS.write_text(json.dumps(records, indent=1) + "\n", encoding="utf-8")
    cases = "every case" if options.full else "a quick run: cases that are near others left out"
    parts = [HEAD, f"## The suite\n\nHere {cases}.\n\n{suite_table(reports)}\n"]
    parts.append("## The check can fail\n\n" + records.get("mutants", "Not recorded.") + "\n")
    parts.append("## Chance\n\n" + records.get("fuzz", "Not recorded.") + "\n")
    PAGE.write_text("\n".join(parts), encoding="utf-8")


if __name__ == "__main__":
    main()
