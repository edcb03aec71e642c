"""Calling a kernel on targets has the type of what it declares to return."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

import passgraph as pg
from tests import typed_calls as calls

root = Path(__file__).resolve().parent.parent


@pytest.mark.slow
def test_mypy_knows_what_calls_give(tmp_path: Path) -> None:
    """All is right in one file, a line is wrong in the other; mypy reads the package once for both.

    With the settings of every other run, so that it finds what those have kept and leaves it to them.
    """
    right, wrong = root / "tests/typed_calls.py", tmp_path / "wrong.py"
    wrong.write_text(right.read_text().replace("tuple[pg.Target, pg.Target])", "Any)"))
    checked = [sys.executable, "-m", "mypy", "--config-file", "pyproject.toml"]
    told = subprocess.run([*checked, str(right), str(wrong)], cwd=root, capture_output=True, text=True, check=False)
    first, last = told.stdout.splitlines()
    assert "wrong.py:" in first and 'Expression is of type "tuple[Target, Target]", not "Any"' in first
    assert last == "Found 1 error in 1 file (checked 2 source files)"


def test_calls_give_what_mypy_was_told() -> None:
    for kernel in (calls.one, calls.number, calls.of_known_size):
        assert isinstance(kernel(calls.frame), pg.Target)
    for several, count in ((calls.two, 2), (calls.three, 3), (calls.fields, 2)):
        made = several(calls.frame)
        assert isinstance(made, tuple)
        assert len(made) == count
