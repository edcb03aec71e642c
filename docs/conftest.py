"""Examples of the pages run in a folder of their own, where they may write pictures."""

from __future__ import annotations

from pathlib import Path

import pytest

#: The settings need Sphinx. Scripts of the gallery have a test of their own, and copies in the built gallery.
collect_ignore = ["conf.py", "examples", "gallery"]


@pytest.fixture(autouse=True)
def working_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
