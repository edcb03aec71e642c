"""Writes docs/conformance.md: the suite on every backend that is here, mutants and fuzzing as recorded.

    python docs/conformance.py [--full] [--reports FOLDER]

Fates of mutants are those in docs/mutants.json, which ``python -m tests.mutation.run --json docs/mutants.json`` writes;
what random cases found is told in docs/conformance.json.  Intel's OpenCL is run where its library is in this
interpreter's ``lib`` or in the folder that PASSGRAPH_INTEL_OPENCL names.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
from collections import Counter
from datetime import date
from pathlib import Path
from typing import Any

DOCS = Path(__file__).resolve().parent
sys.path.insert(0, str(DOCS.parent))

from tests.mutation.places import places

PAGE, MUTANTS, RECORDS = DOCS / "conformance.md", DOCS / "mutants.json", DOCS / "conformance.json"
INTEL = "libintelocl.so"
#: Row of the table → backend.
ROWS = {"numpy": "numpy", "gl": "gl", "opencl (PoCL)": "opencl", "opencl (Intel)": "opencl", "webgpu": "webgpu",
        "webgpu (Chromium)": "webgpu:chromium"}  # fmt: skip
#: Part of the sources → beginnings of the paths that belong to it; the first that fits.
PARTS = {
    "functions written in the kernel language": (
        "passgraph/language/prelude",
        "passgraph/graph/reductions.py",
        "effects/",
    ),
    "spelling of operations, lowering, printing": (
        "passgraph/language/",
        "backends/printing.py",
        "backends/shader_printing.py",
        "backends/foreseen.py",
        "passgraph/quantise.py",
    ),
    "schedule and execution": ("passgraph/plan/", "passgraph/run/"),
    "reference": ("backends/reference/",),
    "gl": ("backends/gl/",),
    "opencl": ("backends/opencl/",),
    "webgpu": ("backends/webgpu/",),
    "numpy": ("backends/numpy/",),
}
HEAD = """# Conformance: what backends are held to

`python docs/conformance.py` writes this page. Run it again when a backend or the suite has changed.

A backend conforms if every value of every target of every pass lies within its bounds. There is no tolerance to raise.

- **Bounds.** The reference backend runs every pass over float64 intervals (`passgraph/verify/oracle/`). Each
  operation is widened by its bound in the [table of operations](kernels.md), and each stored value by its format.
- **Ambiguous pixels.** Rounding may turn a decision: a comparison, a floor, whether a pixel is covered, a depth
  test. Both ways are then run. A pixel whose outcomes lie apart is *ambiguous*.
- **Vacuous cases.** A case is *vacuous* if its targets are too ambiguous, or if the bounds say too little of their
  values. It does not pass.
- **Each pass alone.** A pass gets the reference's pictures, so a verdict is about that pass.
- [`passgraph check`](check.md) asks more of your own graphs: NaN in the place of numbers fails, even if bounds
  allow it.

OpenGL leaves to the driver which grid corners are rounded to, and how attributes are interpolated from unrounded
corners. On `gl` a corner may be anywhere within 1/256 pixel. Elsewhere [rule 2](rasterization.md) gives its place.

```sh
passgraph conform --backend gl --report gl.html    # the suite, with pictures of what diverges
passgraph check my_effect.py                       # your own kernels and graphs on every backend
passgraph fuzz --minutes 10                        # random kernels, graphs, draws and rewritings
pytest --passgraph-backend NAME                    # the suite as tests, for a backend of yours
```
"""


NOTES = """Intel's compiler goes wrong on what follows the absolute value of the least int, which OpenCL C
defines; PoCL does not. Chromium's software device, SwiftShader, places corners of triangles on a grid of 1/16 pixel,
so bounds of draws are wide there and most such cases decide nothing. It stores infinity as NaN in halves, and lacks
the feature that blending into `rgba16` takes.
"""


def intel_environment(folder: Path) -> dict[str, str] | None:
    """Variables with which a process sees Intel's runtime alone; None where it is not installed."""
    places = [os.environ.get("PASSGRAPH_INTEL_OPENCL", ""), str(Path(sys.prefix) / "lib")]
    library = next((Path(place) / INTEL for place in places if place and (Path(place) / INTEL).exists()), None)
    if library is None:
        return None
    vendors = folder / "vendors"
    vendors.mkdir(exist_ok=True)
    (vendors / "intel.icd").write_text(f"{library}\n")
    libraries = os.pathsep.join(part for part in (str(library.parent), os.environ.get("LD_LIBRARY_PATH", "")) if part)
    return {"OCL_ICD_VENDORS": str(vendors), "OPENCL_VENDOR_PATH": str(vendors), "LD_LIBRARY_PATH": libraries}


def suite(row: str, full: bool, folder: Path) -> dict[str, Any] | None:
    """The report of one row, run where it is not in the folder yet; None where its device is not here."""
    environment = intel_environment(folder) if "Intel" in row else {}
    if environment is None:
        return None
    name = "".join(letter if letter.isalnum() else "-" for letter in row).strip("-")
    file, page = folder / f"{name}.json", folder / f"{name}.html"
    if not file.exists():
        command = [sys.executable, "-m", "passgraph", "conform", "--backend", ROWS[row], "--json", str(file)]
        command += ["--report", str(page), *([] if full else ["--quick"])]
        subprocess.run(command, check=False, env={**os.environ, **environment})
    report: dict[str, Any] | None = json.loads(file.read_text(encoding="utf-8")) if file.exists() else None
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


def mutant_text(rows: list[dict[str, Any]]) -> str:
    """How many mistakes were caught, part by part, and which were not."""
    current = [row for row in rows if row["outcome"] != "stale" and places(row["function"], row["old"])]
    mattering = [row for row in current if not row["harmless"]]
    caught = Counter(_part(row) for row in mattering if row["outcome"])
    planted = Counter(_part(row) for row in mattering)
    harmless = Counter(_part(row) for row in current if row["harmless"])
    lines = [
        f"{len(current)} mistakes (operations, rounding, borders, coverage rules, draw states, uploads, schedule)",
        "were planted, one at a time, one in each module that the suite runs through: `python -m tests.mutation.run",
        "--json docs/mutants.json`. `python -m tests.mutation.sample backends/gl --conform gl` plants random ones.",
        "", "| part | mistakes | caught | harmless by design |", "|---|--:|--:|--:|",
    ]  # fmt: skip
    lines += [f"| {part} | {planted[part]} | {caught[part]} | {harmless[part]} |" for part in PARTS]
    share = caught.total() / max(1, planted.total())
    lines.append(f"| all | {planted.total()} | {caught.total()} ({share:.1%}) | {harmless.total()} |")
    outdated = len(rows) - len(current)
    if outdated:
        lines += ["", f"{outdated} more are out of date: the text that they change is no longer there."]
    missed = [row for row in mattering if not row["outcome"]]
    lines += ["", "Not caught: " + ("none." if not missed else "")]
    lines += [
        f"- `{row['function']}`, judged on {row['backend']}: {_shown(row['old'])} → {_shown(row['new'])}"
        for row in missed
    ]
    wrong = [row for row in current if row["harmless"] and row["outcome"]]
    lines += [f"- said to be harmless, yet caught: `{row['function']}`: {_shown(row['old'])}" for row in wrong]
    return "\n".join(lines)


def _part(row: dict[str, Any]) -> str:
    (place,) = places(row["function"], row["old"])
    return next(part for part, heads in PARTS.items() if place.file.startswith(heads))


def _shown(text: str) -> str:
    line = " ".join(text.split())
    return f"`{line}`" if line else "nothing"


def _faults(row: str, report: dict[str, Any]) -> list[str]:
    """Lines of the cases that did not pass; vacuous ones are counted by group."""
    vacuous = Counter(c["case"].split("/")[0] for c in report["cases"] if c["outcome"] == "vacuous")
    lines = [
        f"- {row}: {c['case']}: {c['outcome']}" for c in report["cases"] if c["outcome"] not in ("passed", "vacuous")
    ]
    counts = ", ".join(f"{count} of {group}" for group, count in vacuous.items())
    return [*lines, *([f"- {row}: {vacuous.total()} vacuous: {counts}"] if vacuous else [])]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--full", action="store_true", help="slow cases too")
    parser.add_argument("--reports", type=Path, help="keep reports there; those that are there are not run again")
    options = parser.parse_args()
    reports = {}
    with tempfile.TemporaryDirectory() as folder:
        kept = options.reports or Path(folder)
        kept.mkdir(parents=True, exist_ok=True)
        for row in ROWS:
            report = suite(row, options.full, kept)
            if report is None:
                print(f"{row}: not here, left out", file=sys.stderr)
            else:
                reports[row] = report
    cases = "every case" if options.full else "a quick run: cases that are near others left out"
    taken = f"Here {cases}; seconds on two busy cores; taken {date.today()}."
    faults = [fault for row, report in reports.items() for fault in _faults(row, report)]
    parts = [HEAD, f"## The suite\n\n{taken} For a card, see [On a graphics card](gpu.md).\n\n{suite_table(reports)}\n"]
    parts += ["\n".join(["Not passed:", "", *faults, "", NOTES])] if faults else []
    parts.append("## The check can fail\n\n" + mutant_text(json.loads(MUTANTS.read_text(encoding="utf-8"))) + "\n")
    parts.append("## Chance\n\n" + json.loads(RECORDS.read_text(encoding="utf-8"))["fuzz"] + "\n")
    PAGE.write_text("\n".join(parts), encoding="utf-8")


if __name__ == "__main__":
    main()
