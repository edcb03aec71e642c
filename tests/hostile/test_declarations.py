"""A few random declarations on each backend; thousands by ``python -m tests.hostile.declarations``."""

from __future__ import annotations

import subprocess
import sys
from collections import Counter
from pathlib import Path

import pytest

from tests.conftest import oclgrind
from tests.hostile.declarations import failures

ROOT = Path(__file__).resolve().parents[2]


def assert_held(seeds: range, backend: str, run_every: int, runs: int) -> None:
    tally: Counter[str] = Counter()
    assert list(failures(iter(seeds), backend, run_every, tally)) == []
    assert tally["compiled"] >= 0.8 * len(seeds)
    assert tally["run"] >= runs


def test_uniforms_are_read_inside_what_is_declared() -> None:
    """Each value comes from the uniform that the text names, and numpy's memory ends where it is declared to end."""
    assert_held(range(400), "numpy", 40, 8)


@pytest.mark.webgpu
def test_uniforms_are_read_inside_what_is_declared_on_webgpu() -> None:
    assert_held(range(400, 406), "webgpu", 1, 4)


@pytest.mark.opencl
def test_uniforms_are_read_inside_what_is_declared_on_opencl(tmp_path: Path) -> None:
    """The simulator sees each read outside of a buffer."""
    log = tmp_path / "oclgrind.log"
    command = "tests.hostile.declarations", "--backend", "opencl", "--count", "6", "--run-every", "1", "--seed", "500"
    child = subprocess.run([*oclgrind(log), sys.executable, "-m", *command], cwd=ROOT, capture_output=True, text=True)
    assert child.returncode == 0, child.stdout + child.stderr
    assert "0 wrong" in child.stdout
    assert log.read_text() == ""
