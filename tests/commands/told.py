"""What a command line says, and how a refusal is looked at."""

from __future__ import annotations

from pathlib import Path

import pytest

from passgraph.commands.entry import run


class Outcome:
    """The status of a command line, and what it printed."""

    def __init__(self, capsys: pytest.CaptureFixture[str], *arguments: str) -> None:
        capsys.readouterr()
        self.status = run(list(arguments))
        self.out, self.err = capsys.readouterr()


def refused(capsys: pytest.CaptureFixture[str], *arguments: str) -> str:
    """The one line on stderr; nothing is printed or left behind."""
    before = sorted(Path.cwd().rglob("*"))
    outcome = Outcome(capsys, *arguments)
    assert outcome.status == 2, outcome.err
    assert outcome.out == ""
    assert outcome.err.count("\n") == 1
    assert outcome.err.startswith("passgraph: error: ")
    assert "Traceback" not in outcome.err
    assert sorted(Path.cwd().rglob("*")) == before
    return outcome.err
