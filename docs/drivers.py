"""Writes docs/drivers.md from the facts of drivers in passgraph/assets/drivers.

    passgraph probe --backend gl --json facts.json
    passgraph conform --backend gl --quick --json exact.json
    python docs/drivers.py [--add NAME facts.json] [--conformance NAME REPORT.json ...]

``--add`` keeps the facts of a driver, without what is of one machine alone: its kernel, and paths in variables.
``--conformance`` puts the counts of reports of the suite, in exact and native math, into the file of a driver.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections import Counter
from dataclasses import replace
from pathlib import Path

DOCS = Path(__file__).resolve().parent
sys.path.insert(0, str(DOCS.parent))

from passgraph.verify.probes.kept import SHIPPED, Results, load, shipped
from passgraph.verify.probes.probe import Language
from passgraph.verify.probes.table import PROBES, conforms

PAGE, MACHINES = DOCS / "drivers.md", DOCS / "machines.json"
#: Key of a row of docs/machines.json → the driver whose conformance it has.
OF_SYSTEMS = {"conform gl": "mesa-{mesa}-llvmpipe", "conform webgpu": "mesa-{mesa}-lavapipe",
              "conform opencl": "pocl-{pocl}", "conform numpy": "numpy"}  # fmt: skip
TITLES: dict[Language, str] = {"glsl": "OpenGL", "wgsl": "WebGPU", "opencl": "OpenCL"}
HEAD = """# What drivers do

Specifications leave much to drivers: whether `a * b + c` is rounded once, what NaN becomes, how a color is rounded
to a byte. This page shows what drivers do, by measurement. `python docs/drivers.py` writes it from kept results.

Is it your driver? This measures yours in less than a minute, and prints what differs from the nearest driver of this
page:

```sh
passgraph probe --backend gl
```

`--json FILE.json` keeps the facts. Results of other drivers are welcome: `python docs/drivers.py --add NAME FILE.json`
adds them.

- Each row is a small shader or kernel in `passgraph/verify/probes/`. None is made by passgraph's kernel language.
- **✗** marks what the specification does not allow.
- "–" means that the language lacks it.
- softpipe ends the process in one row of "Integers". It is not measured there; probes run in processes of their own.
- Cards of NVIDIA were tried once ([On a graphics card](gpu.md)), before there were probes.
- The column of NumPy has the same expressions on the processor, in float32 and int32.
"""

OUTCOMES = """The columns "exact" and "native" count cases of the [conformance suite](conformance.md) (`--quick`):
within their bounds / outside / undecided / ended by an error, such as a feature that the device lacks. Where a
count has words, it is that of [the whole run on that system](machines.md).
"""


def add(name: str, file: Path) -> None:
    """Keep the facts of a driver."""
    results, known = load(file), shipped().get(name)
    conditions = dict(results.conditions)
    conditions["system"] = conditions["system"].split(", ")[0]
    conditions["variables"] = {key: value for key, value in conditions["variables"].items() if "/" not in value}
    counts = known.conformance if known is not None else {}
    kept = replace(results, conditions=conditions, conformance=counts)
    (SHIPPED / f"{name}.json").write_text(kept.as_text(), encoding="utf-8")


def conformance(name: str, reports: list[Path]) -> None:
    """Put the counts of the suite into the file of a driver."""
    results = load(SHIPPED / f"{name}.json")
    counts = dict(results.conformance)
    for path in reports:
        report = json.loads(path.read_text(encoding="utf-8"))
        counts[report["options"]["math"]] = dict(Counter(case["outcome"] for case in report["cases"]))
    (SHIPPED / f"{name}.json").write_text(replace(results, conformance=counts).as_text(), encoding="utf-8")


def _outcomes(results: Results, math: str) -> str:
    counts = results.conformance.get(math)
    if counts is None:
        return "not run"
    kinds = ("passed",), ("diverged", "flaky"), ("vacuous", "undecided"), ("failed",)
    return " / ".join(str(sum(counts.get(name, 0) for name in names)) for names in kinds)


def _whole_run(name: str, systems: dict[str, dict[str, str]]) -> str:
    """Return what docs/machines.json has of a driver."""
    found = [row[key] for row in systems.values() for key, driver in OF_SYSTEMS.items() if name == driver.format(**row)]
    return found[0] if found else "not run"


def drivers_table(known: dict[str, Results]) -> str:
    lines = [
        "| driver | device | version | system | exact | native | measured |", "|---|---|---|---|---|---|---|",
    ]  # fmt: skip
    systems = json.loads(MACHINES.read_text(encoding="utf-8"))
    for row in systems.values():
        row["mesa"], row["pocl"] = (".".join(row[key].split(".")[:2]) for key in ("mesa", "pocl"))
    for name, one in known.items():
        device = one.device
        exact = _outcomes(one, "exact") if one.conformance.get("exact") else _whole_run(name, systems)
        system, variables = one.conditions["system"], one.conditions["variables"]
        chosen = "".join(f", `{key}={value}`" for key, value in variables.items() if key in CHOOSING)
        lines.append(
            f"| {name} | `{one.backend}`{chosen}: {device['name']} | {device['driver']} {device['version']} | "
            f"{system} | {exact} | {_outcomes(one, 'native')} | {one.conditions['date'][:10]} |"
        )
    return "\n".join(lines)


#: Environment variables that choose a driver.
CHOOSING = ("GALLIUM_DRIVER", "WGPU_BACKEND_TYPE")


def facts_table(language: Language, known: dict[str, Results]) -> str:
    columns = {name: one for name, one in known.items() if one.language == language}
    reference = {name: one for name, one in known.items() if one.language == "numpy"}
    heads = [*columns, *reference]
    text = []
    for part in dict.fromkeys(probe.part for probe in PROBES.values()):
        probes = [probe for probe in PROBES.values() if probe.part == part and language in probe.measure]
        if not probes:
            continue
        text += [f"### {part}\n", f"| | specification | {' | '.join(heads)} |", "|---" * (len(heads) + 2) + "|"]
        for probe in probes:
            said = probe.said.get(language)
            cells = [_cell(probe.name, one) for one in {**columns, **reference}.values()]
            spec = f"{said.text} ({said.section})" if said else ""
            text.append("| " + " | ".join(_escaped(cell) for cell in (probe.asks, spec, *cells)) + " |")
        text.append("")
    return "\n".join(text)


def _cell(name: str, results: Results) -> str:
    fact = results.facts.get(name, "–")
    return fact if conforms(name, results.language, fact) or fact == "–" else f"✗ {fact}"


def _escaped(text: str) -> str:
    return text.replace("|", "\\|").replace("*", "\\*") if "`" not in text else text.replace("|", "\\|")


def page(known: dict[str, Results]) -> str:
    parts = [HEAD, "## Drivers\n", OUTCOMES, drivers_table(known), ""]
    for language, title in TITLES.items():
        parts += [f"## {title}\n", facts_table(language, known)]
    return "\n".join(parts)


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--conformance", nargs="+", metavar=("NAME", "REPORT.json"))
    parser.add_argument("--add", nargs=2, metavar=("NAME", "facts.json"))
    given = parser.parse_args()
    if given.add:
        add(given.add[0], Path(given.add[1]))
    if given.conformance:
        name, *reports = given.conformance
        conformance(name, [Path(one) for one in reports])
    PAGE.write_text(page(shipped()), encoding="utf-8")


if __name__ == "__main__":
    main()
