"""Writes docs/machines.md from docs/machines.json, what tests/machines.sh saw on each system, and docs/wheels.json.

    python docs/machines.py

tests/machines.sh calls it in its root with --extras, which lists the extras of pyproject.toml, and --without-wheel,
which lists the packages that it leaves out for this Python; with --row NAME FILE it puts a row into docs/machines.json.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
import tomllib
from collections.abc import Iterator
from datetime import date
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from packaging.requirements import Requirement

DOCS = Path(__file__).resolve().parent
ROWS, WHEELS, PAGE = DOCS / "machines.json", DOCS / "wheels.json", DOCS / "machines.md"
#: Installed by the second command.
OF_DEVELOPERS = "dev"
#: What the page shows of a row, and the name of it there.
SHOWN = {
    "Python": "python", "Mesa (`gl`, `webgpu`)": "mesa", "PoCL (`opencl`)": "pocl", "Chromium": "chromium",
    "install, render a picture": "first command", "tests": "second command",
    "options of `tests/run.sh`": "options",
    "conformance of `numpy`": "conform numpy", "of `gl`": "conform gl", "of `opencl`": "conform opencl",
    "of `webgpu`": "conform webgpu", "videos": "video", "`passgraph view` in Chromium": "viewer",
    "extras that do not install": "extras", "packages left out": "without a wheel", "tried on": "date",
}  # fmt: skip
HEAD = """# Supported systems

`bash tests/machines.sh NAME` tries one system and writes its column; `python docs/machines.py` writes this page.

Each system is a fresh Debian with its own Python and drivers. passgraph is installed as the README
says, and both of its commands run there. Then the [conformance suite](conformance.md) (`--quick`) runs on each
backend, a video is written and read, the viewer is opened in Chromium, and each extra is installed, without a compiler.

"""
TAIL = """
- **Packages left out** have no wheel for that Python. Without `flip-evaluator` the viewer and `passgraph bench` have
  no FLIP.
- Each change is tested on Debian 12 with Python 3.11, and the language, plans and videos on a second Python, if there
  is one.
- OpenGL and Vulkan are Mesa's llvmpipe and lavapipe, which run on the CPU. [On a graphics card](gpu.md) has others.
- Python 3.15 (3.15.0 in Debian testing, tried by hand in November 2026): passgraph and its extras but those below
  install, and each of the four backends renders the shipped picture with the same bits as on Debian 12.
- macOS and Windows are not tested: [what holds there](limits.md).

## Packages without a wheel

Each cell lists the versions of Python on which an extra does not install without a compiler, of {pythons}. Other extras
install on all of them. `python -m tests.wheels` asks the package registry.

"""


def options() -> dict[str, list[Requirement]]:
    """The extras of pyproject.toml and what they require."""
    from packaging.requirements import Requirement  # in the root only: Python may be bare here

    project = tomllib.loads((DOCS.parent / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    return {name: [Requirement(line) for line in lines] for name, lines in project["optional-dependencies"].items()}


def left_out() -> list[Requirement]:
    """What a marker leaves out on this Python: packages, and extras of passgraph."""
    asked = (one for requirements in options().values() for one in requirements)
    return [one for one in asked if one.marker is not None and not one.marker.evaluate()]


def without_wheel() -> Iterator[str]:
    """Names of the packages left out; failed if one has a wheel by now."""
    for name in sorted({one.name for one in left_out()} - {"passgraph"}):
        with tempfile.TemporaryDirectory() as folder:
            command = [sys.executable, "-m", "pip", "download", "--no-deps", "--only-binary=:all:", "-d", folder, name]
            has_wheel = subprocess.run(command, capture_output=True, check=False).returncode == 0
        yield f"{name} (failed: has a wheel now)" if has_wheel else name


def row(results: str) -> dict[str, str]:
    """A row of the file, from lines of a key, a tab and a value."""
    values = dict(line.split("\t", 1) for line in results.splitlines())
    extras = {key.removeprefix("extra "): values.pop(key) for key in list(values) if key.startswith("extra ")}
    failed = [name for name, value in extras.items() if value != "passed"]
    if extras:
        values["extras"] = ", ".join(failed) or f"none of {len(extras)}"
    return {**values, "date": date.today().isoformat()}


def page(rows: dict[str, dict[str, str]]) -> str:
    lines = ["| | " + " | ".join(one["system"] for one in rows.values()) + " |", "|---" * (len(rows) + 1) + "|"]
    for name, key in SHOWN.items():
        lines.append(f"| {name} | " + " | ".join(one.get(key) or "not tried" for one in rows.values()) + " |")
    return HEAD + "\n".join(lines) + "\n" + wheels_table(json.loads(WHEELS.read_text(encoding="utf-8")))


def wheels_table(asked: dict[str, Any]) -> str:
    """The end of the page, with a table of what tests/wheels.py found."""
    missing: dict[str, dict[str, dict[str, list[str]]]] = asked["missing"]
    rows = [[f"| {name} " for name in ("Extra", "lacks", *missing)], ["|---"] * (2 + len(missing))]
    pythons = list(next(iter(missing.values())))
    for extra in sorted({*asked["extras"]} - {"all"}, key=lambda name: (name != "passgraph", name)):
        lacks = sorted({one for found in missing.values() for gaps in found.values() for one in gaps.get(extra, [])})
        cells = []
        for found in missing.values():
            without = [python for python in pythons if extra in found[python]]
            cells.append("each" if without == pythons else ", ".join(without) or "–")
        if lacks:
            named = "passgraph itself" if extra == "passgraph" else f"`{extra}`"
            rows.append([f"| {one} " for one in (named, ", ".join(lacks), *cells)])
    return TAIL.format(pythons=f"{pythons[0]} to {pythons[-1]}") + "".join("".join(row) + "|\n" for row in rows)


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--extras", action="store_true")
    parser.add_argument("--without-wheel", action="store_true")
    parser.add_argument("--row", nargs=2, metavar=("NAME", "FILE"))
    given = parser.parse_args()
    if given.extras:
        print(*sorted(options().keys() - {OF_DEVELOPERS} - {extra for one in left_out() for extra in one.extras}))
    elif given.without_wheel:
        print(", ".join(without_wheel()) or "none")
    else:
        rows = json.loads(ROWS.read_text(encoding="utf-8")) if ROWS.exists() else {}
        if given.row:
            name, file = given.row
            rows = dict(sorted({**rows, name: row(Path(file).read_text(encoding="utf-8"))}.items()))
            ROWS.write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")
        PAGE.write_text(page(rows), encoding="utf-8")


if __name__ == "__main__":
    main()
