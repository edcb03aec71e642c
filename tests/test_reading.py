"""Files of others: what is no regular file is refused before it is opened, wherever passgraph reads one."""

from __future__ import annotations

import os
import socket
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import passgraph as pg
from passgraph.commands.golden import recorded_run
from passgraph.commands.own_file import graphs_of
from passgraph.effects.light2d import World2D
from passgraph.reading import check_regular, read_bytes, read_text
from passgraph.verify.fuzz.cases import load as load_case

READERS: dict[str, tuple[str, Callable[[Path], Any]]] = {
    "picture": ("a.png", pg.load),
    "scene": ("a.glb", pg.Scene.load),
    "world": ("a.json", World2D.load),
    "kernels": ("a.pgk", graphs_of),
    "module": ("a.py", graphs_of),
    "case": ("a.json", load_case),
    "manifest": ("manifest.json", lambda path: recorded_run(path.parent, "a")),
}


def _pipe(path: Path) -> None:
    os.mkfifo(path)


def _socket(path: Path) -> None:
    # the name of a socket may have some hundred bytes only
    here = os.getcwd()
    os.chdir(path.parent)
    try:
        with socket.socket(socket.AF_UNIX) as made:
            made.bind(path.name)
    finally:
        os.chdir(here)


def _zeros(path: Path) -> None:
    path.symlink_to("/dev/zero")


@pytest.mark.parametrize("make", [_pipe, _socket, _zeros], ids=["pipe", "socket", "device"])
@pytest.mark.parametrize("reader", READERS)
def test_what_never_ends_is_refused_unopened(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, reader: str, make: Callable[[Path], None]
) -> None:
    name, read = READERS[reader]
    make(tmp_path / name)

    def opened(path: Any, *arguments: Any) -> int:
        raise AssertionError(f"{path} was opened")

    monkeypatch.setattr(os, "open", opened)
    with pytest.raises(pg.InputError, match="is a device, a pipe or a socket; expected a"):
        read(tmp_path / name)


@pytest.mark.parametrize("reader", READERS)
def test_directories_are_refused(tmp_path: Path, reader: str) -> None:
    name, read = READERS[reader]
    (tmp_path / name).mkdir()
    with pytest.raises(pg.InputError, match="is a directory; expected a"):
        read(tmp_path / name)


def test_a_file_that_became_a_pipe_is_refused_and_not_waited_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "a"
    path.write_bytes(b"x")
    opened = os.open

    def changed(name: Any, *arguments: Any) -> int:
        path.unlink()
        os.mkfifo(path)
        return opened(name, *arguments)

    monkeypatch.setattr(os, "open", changed)
    with pytest.raises(pg.InputError, match="is a device, a pipe or a socket; expected a thing"):
        read_bytes(path, "a thing", 10)


def test_a_file_is_bounded_also_where_it_says_that_it_is_empty(tmp_path: Path) -> None:
    (tmp_path / "a").write_bytes(bytes(11))
    with pytest.raises(pg.InputError, match=r"has 11 bytes; expected at most 10; cut it"):
        read_bytes(tmp_path / "a", "a thing", 10, "cut it")
    assert read_bytes(tmp_path / "a", "a thing", 11) == bytes(11)
    with pytest.raises(pg.InputError, match=r"/proc/kallsyms: has \d+ bytes; expected at most 10"):
        read_bytes("/proc/kallsyms", "a thing", 10)


def test_missing_files_and_other_bytes_are_named(tmp_path: Path) -> None:
    for read in (lambda path: check_regular(path, "a thing"), lambda path: read_bytes(path, "a thing", 10)):
        with pytest.raises(pg.InputError, match=r"b: no such file; check the path \(the folder here is "):
            read(tmp_path / "b")
    (tmp_path / "c").write_bytes(b"ab\xff")
    with pytest.raises(pg.InputError, match=r"c: is not text in UTF-8 \(invalid start byte at byte 2\)"):
        read_text(tmp_path / "c", "a text", 10)
