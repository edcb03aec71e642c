"""Ask the package registry for which systems and Python versions wheels of every dependency exist.

    python -m tests.wheels [OUTPUT]

For each system and Python version, it resolves each extra's packages with pip, as `pip install` would, and follows
their dependencies. Nothing is installed. It writes docs/wheels.json: by system, Python version and extra, the packages
that have no wheel there. It takes some minutes, and needs pip 23 or later and the network.
"""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
import tempfile
import tomllib
from collections.abc import Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).parents[1]
PYTHONS = ("3.11", "3.12", "3.13", "3.14", "3.15")
#: System → the platform tags that its pip accepts, and the environment that markers of requirements see (PEP 508).
#: A system accepts wheels of earlier releases: macOS 14 and Windows 10 are the oldest that are still maintained, and
#: manylinux_2_36 is the C library of Debian 12.
SYSTEMS: dict[str, tuple[list[str], dict[str, str]]] = {
    "Linux x86_64": (
        [f"manylinux_2_{minor}_x86_64" for minor in range(36, 4, -1)] + ["manylinux2014_x86_64"],
        {"sys_platform": "linux", "platform_system": "Linux", "platform_machine": "x86_64", "os_name": "posix"},
    ),
    "Linux aarch64": (
        [f"manylinux_2_{minor}_aarch64" for minor in range(36, 16, -1)] + ["manylinux2014_aarch64"],
        {"sys_platform": "linux", "platform_system": "Linux", "platform_machine": "aarch64", "os_name": "posix"},
    ),
    "macOS arm64": (
        [f"macosx_{major}_0_{chip}" for major in range(14, 10, -1) for chip in ("arm64", "universal2")],
        {"sys_platform": "darwin", "platform_system": "Darwin", "platform_machine": "arm64", "os_name": "posix"},
    ),
    "macOS x86_64": (
        [f"macosx_{release}_{chip}" for release in ("14_0", "13_0", "12_0", "11_0", "10_15", "10_13", "10_12", "10_9")
         for chip in ("x86_64", "universal2", "intel")],
        {"sys_platform": "darwin", "platform_system": "Darwin", "platform_machine": "x86_64", "os_name": "posix"},
    ),
    "Windows x86_64": (
        ["win_amd64"],
        {"sys_platform": "win32", "platform_system": "Windows", "platform_machine": "AMD64", "os_name": "nt"},
    ),
}  # fmt: skip


class Target:
    """One system with one Python version."""

    def __init__(self, system: str, python: str) -> None:
        tags, environment = SYSTEMS[system]
        self.environment = {
            **environment,
            "python_version": python,
            "python_full_version": f"{python}.0",
            "implementation_name": "cpython",
            "platform_python_implementation": "CPython",
        }
        self.options = [f"--platform={tag}" for tag in tags] + [f"--python-version={python}"]

    def missing(self, requirements: Iterable[Requirement]) -> dict[str, set[str]]:
        """Return what each of these requirements needs that has no wheel: by its own name, the names of packages."""
        needs: dict[str, set[str]] = {}  # by package with extras
        without: set[str] = set()
        asked = {self.key(one): one for one in requirements}
        found: dict[str, Requirement] = {}
        while asked:
            found |= asked
            metadata = self._resolved(list(asked.values()), without)
            following: dict[str, Requirement] = {}
            for key, one in asked.items():
                needed = [Requirement(text) for text in metadata.get(canonicalize_name(one.name), [])]
                kept = list(self.applying(needed, one.extras))
                needs[key] = {self.key(each) for each in kept}
                following |= {self.key(each): each for each in kept}
            asked = {key: one for key, one in following.items() if key not in found}
        return {key: self._reached(key, needs) & without for key in found}

    def applying(self, requirements: Iterable[Requirement], extras: Iterable[str] = ()) -> Iterator[Requirement]:
        """Yield the requirements whose markers hold on this system, with these extras."""
        for one in requirements:
            if one.marker is None or any(one.marker.evaluate({**self.environment, "extra": e}) for e in ("", *extras)):
                yield one

    @staticmethod
    def key(one: Requirement) -> str:
        extras = f"[{','.join(sorted(one.extras))}]" if one.extras else ""
        return canonicalize_name(one.name) + extras

    @staticmethod
    def _reached(key: str, needs: dict[str, set[str]]) -> set[str]:
        seen, ahead = set(), [key]
        while ahead:
            one = ahead.pop()
            if one not in seen:
                seen.add(one)
                ahead += needs.get(one, ())
        return {one.partition("[")[0] for one in seen}

    def _resolved(self, requirements: list[Requirement], without: set[str]) -> dict[str, list[str]]:
        """Return the requirements of each package, of its newest version with a wheel; add others to ``without``."""
        with tempfile.TemporaryDirectory() as folder:
            report = Path(folder) / "report.json"
            while True:
                asked = [
                    f"{one.name}{one.specifier}" for one in requirements if canonicalize_name(one.name) not in without
                ]
                if not asked:
                    return {}
                done = _pip(
                    "--no-deps", "--target", folder, "--report", str(report), *self.options, *sorted(set(asked))
                )
                if done.returncode == 0:
                    break
                absent = re.search(r"No matching distribution found for ([\w.-]+?)(?=[<>=!~;\s]|$)", done.stderr)
                if absent is None:
                    raise SystemExit(f"pip failed:\n{done.stderr}")
                without.add(canonicalize_name(absent[1].rstrip(".")))
            installed: list[Any] = json.loads(report.read_text())["install"]
        return {
            canonicalize_name(one["metadata"]["name"]): one["metadata"].get("requires_dist", []) for one in installed
        }


def _pip(*arguments: str) -> subprocess.CompletedProcess[str]:
    """Run ``pip install --dry-run`` with wheels only, without this machine's settings, such as folders of wheels."""
    environment = {**os.environ, "PIP_CONFIG_FILE": os.devnull}
    for name in ("PIP_FIND_LINKS", "PIP_EXTRA_INDEX_URL", "PIP_CONSTRAINT"):
        environment.pop(name, None)
    command = [
        sys.executable,
        "-m",
        "pip",
        "install",
        "--quiet",
        "--dry-run",
        "--ignore-installed",
        "--only-binary=:all:",
    ]
    return subprocess.run([*command, *arguments], capture_output=True, text=True, check=False, env=environment)


def extras() -> dict[str, list[Requirement]]:
    """Return the requirements of the package alone (``passgraph``) and of each extra for users, without nesting."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    texts: dict[str, list[str]] = {"": project["dependencies"], **project["optional-dependencies"]}
    parsed = {name: [Requirement(text) for text in those] for name, those in texts.items()}

    def flat(name: str) -> Iterator[Requirement]:
        for one in parsed[name]:
            if canonicalize_name(one.name) != project["name"]:
                yield one
            else:
                for extra in one.extras:
                    for inner in flat(extra):
                        if one.marker is not None:
                            both = f"({one.marker}) and ({inner.marker})" if inner.marker else str(one.marker)
                            inner = Requirement(f"{inner.name}{inner.specifier}; {both}")
                        yield inner

    return {name or project["name"]: list(flat(name)) for name in parsed if name not in ("dev", "docs")}


def row(target: Target, wanted: dict[str, list[Requirement]]) -> dict[str, list[str]]:
    """Return, by extra, the packages that have no wheel on a system; extras without a gap are left out."""
    each = {name: list(target.applying(those)) for name, those in wanted.items()}
    missing = target.missing(one for those in each.values() for one in those)
    gaps = {name: set().union(*(missing[target.key(one)] for one in those)) for name, those in each.items()}
    return {name: sorted(packages) for name, packages in gaps.items() if packages}


def main(output: Path) -> None:
    wanted = extras()
    targets = [(system, python) for system in SYSTEMS for python in PYTHONS]
    with ThreadPoolExecutor(4) as pool:
        rows = list(pool.map(lambda each: row(Target(*each), wanted), targets))
    missing: dict[str, dict[str, dict[str, list[str]]]] = {system: {} for system in SYSTEMS}
    for (system, python), gaps in zip(targets, rows, strict=True):
        missing[system][python] = gaps
        print(system, python, gaps or "all")
    output.write_text(json.dumps({"extras": sorted(wanted), "missing": missing}, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "docs" / "wheels.json")
