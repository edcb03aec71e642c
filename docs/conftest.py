"""Examples of the pages run in a folder of their own, where they may write pictures."""

from __future__ import annotations

from pathlib import Path

import pytest

#: Needs Sphinx, and holds no examples.
collect_ignore = ["conf.py"]


@pytest.fixture(autouse=True)
def working_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
