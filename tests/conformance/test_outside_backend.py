"""A backend from another package is found by its entry point and passes the conformance suite unchanged."""

from __future__ import annotations

import ast
import json
import os
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PACKAGE = ROOT / "tests" / "outside_backend"
MODULE = PACKAGE / "passgraph_plainpy.py"
PAGE = ROOT / "docs" / "backends.md"
MAX_LINES = 360


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """The environment of a process in which the package is installed.

    What an installer would write is written here: the module's folder on the path, and its entry points as metadata.
    That needs neither a network nor a build.
    """
    project = tomllib.loads((PACKAGE / "pyproject.toml").read_text())["project"]
    site = tmp_path_factory.mktemp("site")
    metadata = site / f"{project['name'].replace('-', '_')}-{project['version']}.dist-info"
    metadata.mkdir()
    (metadata / "METADATA").write_text(
        f"Metadata-Version: 2.1\nName: {project['name']}\nVersion: {project['version']}\n"
    )
    lines = []
    for group, entries in project["entry-points"].items():
        lines += [f"[{group}]", *(f"{name} = {target}" for name, target in entries.items())]
    (metadata / "entry_points.txt").write_text("\n".join(lines) + "\n")
    (site / MODULE.name).symlink_to(MODULE)
    return {**os.environ, "PYTHONPATH": os.pathsep.join([str(ROOT), str(site)])}


def passgraph(environment: dict[str, str], *arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-W", "error", "-m", "passgraph", *arguments]
    return subprocess.run(command, capture_output=True, text=True, env=environment, check=False)


def test_it_is_listed_beside_those_that_are_built_in(installed: dict[str, str]) -> None:
    listed = passgraph(installed, "backends")
    assert listed.returncode == 0, listed.stderr
    assert "plainpy" in listed.stdout and "CPU, plain NumPy" in listed.stdout


@pytest.mark.parametrize(
    "group", [pytest.param((), marks=pytest.mark.slow), ("--group", "draws")], ids=["whole", "draws"]
)
def test_it_passes_the_conformance_suite(installed: dict[str, str], tmp_path: Path, group: tuple[str, ...]) -> None:
    report = str(tmp_path / "report.json")
    made = passgraph(installed, "conform", "--backend", "plainpy", "--quick", *group, "--json", report)
    assert made.returncode == 0, made.stdout + made.stderr
    assert json.loads((tmp_path / "report.json").read_text())["backend"] == "plainpy"


def contract() -> set[str]:
    """The modules that docs/backends.md allows a backend to import, by its table."""
    rows = PAGE.read_text().partition("| module | for |\n|---|---|\n")[2].partition("\n\n")[0].splitlines()
    return {name for row in rows for name in re.findall(r"`([\w.]+)`", row.split("|")[1])}


def test_it_imports_the_contract_only() -> None:
    allowed = contract()
    used = set()
    for node in ast.walk(ast.parse(MODULE.read_text())):
        if isinstance(node, ast.Import):
            used |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            module = str(node.module)
            submodules = {f"{module}.{alias.name}" for alias in node.names} & allowed
            used |= submodules or {module}
    assert {name for name in used if name.startswith("passgraph")} <= allowed


def test_it_is_short() -> None:
    assert len(MODULE.read_text().splitlines()) <= MAX_LINES
