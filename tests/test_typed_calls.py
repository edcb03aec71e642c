"""Calling a kernel on targets has the type of what it declares to return."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import passgraph as pg
from tests import typed_calls as calls

root = Path(__file__).resolve().parent.parent


def mypy(path: Path) -> str:
    checked = [sys.executable, "-m", "mypy", "--config-file", "pyproject.toml", "--follow-imports", "silent", str(path)]
    return subprocess.run(checked, cwd=root, capture_output=True, text=True, check=False).stdout


def test_mypy_knows_what_calls_give(tmp_path: Path) -> None:
    assert mypy(root / "tests/typed_calls.py") == "Success: no issues found in 1 source file\n"
    text = (root / "tests/typed_calls.py").read_text()
    wrong = tmp_path / "wrong.py"
    wrong.write_text(text.replace("tuple[pg.Target, pg.Target])", "Any)"))
    assert 'Expression is of type "tuple[Target, Target]", not "Any"' in mypy(wrong)


def test_calls_give_what_mypy_was_told() -> None:
    for kernel in (calls.one, calls.number, calls.of_known_size):
        assert isinstance(kernel(calls.frame), pg.Target)
    for several, count in ((calls.two, 2), (calls.three, 3), (calls.fields, 2)):
        made = several(calls.frame)
        assert isinstance(made, tuple)
        assert len(made) == count
