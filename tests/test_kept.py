"""What processes leave each other: whole files, in a folder that is the user's alone."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from passgraph import kept
from passgraph.errors import BackendError


def test_damaged_files_are_as_if_missing(tmp_path: Path) -> None:
    path = tmp_path / "code.o"
    assert kept.kept(path) is None
    path.write_bytes(b"\0" * 40)
    assert kept.kept(path) is None
    kept.keep(path, b"machine code")
    assert kept.kept(path) == b"machine code"
    path.write_bytes(path.read_bytes()[:-1])
    assert kept.kept(path) is None
    assert [entry.name for entry in tmp_path.iterdir()] == ["code.o"]  # no half-written file beside it


def test_what_is_remembered_comes_back(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PASSGRAPH_CACHE", str(tmp_path))
    assert kept.recall("orders", "one") is None
    kept.remember("orders", "one", b"0 1 2")
    assert kept.recall("orders", "one") == b"0 1 2"


def test_without_a_folder_nothing_is_kept_and_nothing_fails(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "taken").write_text("a file where the folder should be")
    monkeypatch.setenv("PASSGRAPH_CACHE", str(tmp_path / "taken"))
    kept.remember("orders", "one", b"0 1 2")
    assert kept.recall("orders", "one") is None
    with pytest.raises(BackendError, match=r"cannot be made.*PASSGRAPH_CACHE"):
        kept.cache_folder("orders")


def test_files_that_others_could_have_written_are_not_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PASSGRAPH_CACHE", str(tmp_path))
    kept.remember("orders", "one", b"0 1 2")
    (tmp_path / "orders").chmod(0o777)
    assert kept.recall("orders", "one") is None


def test_a_folder_that_is_too_full_loses_what_was_written_first(tmp_path: Path) -> None:
    for number in range(6):
        (tmp_path / str(number)).write_bytes(b"x" * 100)
        os.utime(tmp_path / str(number), (number, number))
    kept.prune(tmp_path, 600)
    assert len(list(tmp_path.iterdir())) == 6
    kept.prune(tmp_path, 599)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["4", "5"]
