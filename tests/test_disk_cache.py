"""What processes leave each other: whole files, in a folder that is the user's alone."""

from __future__ import annotations

import errno
import hashlib
import os
import shutil
import signal
import subprocess
import sys
import threading
import warnings
from pathlib import Path
from typing import Any

import pytest

from passgraph import disk_cache
from passgraph.errors import BackendError

AS_ROOT = pytest.mark.skipif(not hasattr(os, "getuid") or os.getuid() != 0, reason="only root gives files away")
STRANGER = 54321


@pytest.fixture(autouse=True)
def base(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    made = tmp_path / "outer" / "cache"
    monkeypatch.setenv("PASSGRAPH_CACHE", str(made))
    monkeypatch.setattr(disk_cache, "_said", set())
    monkeypatch.setattr(disk_cache, "_pruned", set())
    return made


def refused(match: str) -> None:
    """Nothing is read or written, and one warning says why."""
    disk_cache._said.clear()
    with pytest.warns(UserWarning, match=match) as seen:
        found = used()
    assert found is None
    assert len(seen) == 1


def used() -> bytes | None:
    found = disk_cache.recall("code", "one")
    disk_cache.remember("code", "one", b"more")
    disk_cache.remember("code", "two", b"more")
    return found


def test_what_is_remembered_comes_back(base: Path) -> None:
    assert disk_cache.recall("code", "one") is None
    disk_cache.remember("code", "one", b"0 1 2")
    assert disk_cache.recall("code", "one") == b"0 1 2"
    assert [entry.name for entry in (base / "code").iterdir()] == ["one"]  # no half-written file beside it
    assert (base / "code").stat().st_mode & 0o777 == 0o700
    assert (base / "code" / "one").stat().st_mode & 0o777 == 0o600


def test_damaged_files_are_as_if_missing(base: Path) -> None:
    disk_cache.remember("code", "one", b"machine code")
    path = base / "code" / "one"
    whole = path.read_bytes()
    for damaged in (whole[:-1], b"", b"\0" * 40, hashlib.sha256(b"other").digest() + b"other"):
        path.write_bytes(damaged)
        assert disk_cache.recall("code", "one") is None
    path.write_bytes(whole)
    assert disk_cache.recall("code", "one") == b"machine code"


def test_a_sealed_file_under_another_name_is_refused(base: Path) -> None:
    disk_cache.remember("code", "one", b"one")
    disk_cache.remember("code", "two", b"two")
    disk_cache.remember("programs", "two", b"of another kind")
    shutil.copy(base / "code" / "one", base / "code" / "two")
    assert disk_cache.recall("code", "two") is None
    shutil.copy(base / "programs" / "two", base / "code" / "two")
    assert disk_cache.recall("code", "two") is None


@pytest.mark.parametrize("mode", [0o777, 0o770])
def test_a_folder_that_others_may_write_to_is_not_used(mode: int, base: Path) -> None:
    disk_cache.remember("code", "one", b"0 1 2")
    (base / "code").chmod(mode)
    refused(r"cache folder .*code belongs to another user or others may write to it; .*chmod 700")


def test_folders_on_the_way_are_looked_at_too(base: Path) -> None:
    disk_cache.remember("code", "one", b"0 1 2")
    for way in (base, base.parent):
        way.chmod(0o777)
        refused(rf"the folder {way} on the way to the cache folder belongs to another user or others may write")
        # The sticky bit keeps others from renaming what is not theirs, as in /tmp.
        way.chmod(0o1777)
        assert disk_cache.recall("code", "one") == b"0 1 2"
        way.chmod(0o700)


@AS_ROOT
def test_folders_and_files_of_somebody_else_are_not_used(base: Path) -> None:
    disk_cache.remember("code", "one", b"0 1 2")
    for way in (base.parent, base, base / "code"):
        os.chown(way, STRANGER, -1)
        refused("belongs to another user")
        os.chown(way, 0, -1)
    os.chown(base / "code" / "one", STRANGER, -1)
    assert disk_cache.recall("code", "one") is None


def test_links_are_followed_where_the_user_has_laid_them(base: Path, tmp_path: Path) -> None:
    """Home folders often lie behind one; each folder that it leads through counts as any other."""
    real = tmp_path / "real" / "deep"
    real.mkdir(parents=True)
    base.parent.mkdir()
    base.symlink_to(real)
    disk_cache.remember("code", "one", b"0 1 2")
    assert disk_cache.recall("code", "one") == b"0 1 2"
    assert (real / "code" / "one").exists()
    (tmp_path / "real").chmod(0o777)
    refused("on the way to the cache folder")
    (tmp_path / "real").chmod(0o700)
    base.unlink()
    base.symlink_to("../outer/cache")
    refused("more than 40 links")


@AS_ROOT
def test_links_of_somebody_else_are_not_followed(base: Path, tmp_path: Path) -> None:
    disk_cache.remember("code", "one", b"0 1 2")
    base.rename(tmp_path / "moved")
    base.symlink_to(tmp_path / "moved")
    os.chown(base, STRANGER, -1, follow_symlinks=False)
    refused("the link 'cache' on the way to the cache folder belongs to another user")


def test_files_that_are_links_or_pipes_are_not_read(base: Path, tmp_path: Path) -> None:
    disk_cache.remember("code", "one", b"0 1 2")
    (base / "code" / "one").rename(tmp_path / "elsewhere")
    (base / "code" / "one").symlink_to(tmp_path / "elsewhere")
    with pytest.warns(UserWarning, match="cannot use its disk cache"):
        assert disk_cache.recall("code", "one") is None
    (base / "code" / "one").unlink()
    os.mkfifo(base / "code" / "one")
    assert disk_cache.recall("code", "one") is None


def test_exchanging_folders_meanwhile_never_brings_the_other_ones_files(base: Path, tmp_path: Path) -> None:
    """The attack: somebody who may write to the parent puts another folder in the place of the one looked at."""
    evil = tmp_path / "evil"
    (evil / "code").mkdir(parents=True)
    disk_cache.remember("code", "one", b"ours")
    data = b"theirs"
    (evil / "code" / "one").write_bytes(disk_cache._seal("code", "one", data) + data)
    (evil / "code").chmod(0o777)  # what gives a stranger's folder away; as root it may have another owner too
    if os.getuid() == 0:
        os.chown(evil / "code", STRANGER, -1)
    stop = threading.Event()

    def swap() -> None:
        while not stop.is_set():
            base.rename(tmp_path / "aside")
            evil.rename(base)
            base.rename(evil)
            (tmp_path / "aside").rename(base)

    swapping = threading.Thread(target=swap)
    swapping.start()
    seen: set[bytes | None] = set()
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            for _ in range(3000):
                seen.add(disk_cache.recall("code", "one"))
    finally:
        stop.set()
        swapping.join()
    assert data not in seen
    assert b"ours" in seen


def test_what_was_opened_is_what_is_read(base: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The same exchange at the worst moment: between looking at the folder and opening the file."""
    disk_cache.remember("code", "one", b"ours")
    before = disk_cache._check_own

    def exchanged(status: os.stat_result, way: str) -> None:
        before(status, way)
        base.rename(tmp_path / "aside")
        (base / "code").mkdir(parents=True)
        (base / "code" / "one").write_bytes(disk_cache._seal("code", "one", b"theirs") + b"theirs")

    monkeypatch.setattr(disk_cache, "_check_own", exchanged)
    assert disk_cache.recall("code", "one") == b"ours"
    monkeypatch.setattr(disk_cache, "_check_own", before)
    shutil.rmtree(base)
    (tmp_path / "aside").rename(base)
    monkeypatch.setattr(disk_cache, "_check_own", exchanged)
    disk_cache.remember("code", "two", b"written")
    assert (tmp_path / "aside" / "code" / "two").exists() and not (base / "code" / "two").exists()


def failing(number: int) -> Any:
    def call(*_: object, **__: object) -> None:
        raise OSError(number, os.strerror(number))

    return call


@pytest.mark.parametrize("number", [errno.ENOSPC, errno.EDQUOT, errno.EIO])
def test_a_full_disk_is_said_once_and_leaves_nothing(number: int, base: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    class Full:
        """A file that takes nothing."""

        def __init__(self, handle: int) -> None:
            self.handle = handle

        def __enter__(self) -> Full:
            return self

        def __exit__(self, *_: object) -> None:
            os.close(self.handle)

        write = staticmethod(failing(number))

    disk_cache.remember("code", "one", b"before")
    with monkeypatch.context() as patch:
        patch.setattr(disk_cache, "recall", lambda *_: None)
        patch.setattr(disk_cache.os, "fdopen", lambda handle, *_: Full(handle))
        with pytest.warns(UserWarning, match=os.strerror(number)) as seen:
            used()
    assert len(seen) == 1
    assert [entry.name for entry in (base / "code").iterdir()] == ["one"]
    assert disk_cache.recall("code", "one") == b"before"


@pytest.mark.parametrize("number", [errno.EROFS, errno.EACCES])
def test_a_folder_that_cannot_be_made(number: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(disk_cache.os, "mkdir", failing(number))
    assert disk_cache.recall("code", "one") is None
    refused(rf"cannot be made or opened \(.*{os.strerror(number)}.*PASSGRAPH_CACHE")


def test_a_file_where_the_folder_should_be(base: Path) -> None:
    base.parent.mkdir()
    base.write_text("a file where the folder should be")
    refused("cannot be made or opened")
    with (
        pytest.raises(BackendError, match=r"cannot be made or opened.*PASSGRAPH_CACHE"),
        disk_cache.cache_folder("programs"),
    ):
        pass


def test_without_a_home(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("PASSGRAPH_CACHE")
    monkeypatch.delenv("XDG_CACHE_HOME", raising=False)

    def nobody() -> Path:
        raise RuntimeError("Could not determine home directory.")

    monkeypatch.setattr(disk_cache.Path, "home", nobody)
    refused("there is no home folder for the cache .*PASSGRAPH_CACHE")


SCRIPT = """
import passgraph as pg, numpy as np
kernel = pg.kernel(source="def half(color: Image) -> vec4: return color[1, 0] * 0.5")
with pg.compile(kernel(pg.Input("frame")), backend="numpy") as program:
    print(program(frame=np.ones((4, 4, 4), np.float32))["half"].sum())
"""


def test_a_program_runs_where_nothing_can_be_kept(tmp_path: Path) -> None:
    """Orders, programs and machine code alike: one warning for all."""
    (tmp_path / "taken").write_text("")
    environment = {**os.environ, "PASSGRAPH_CACHE": str(tmp_path / "taken")}
    made = subprocess.run(
        [sys.executable, "-c", SCRIPT], env=environment, capture_output=True, text=True, check=True, timeout=120
    )
    assert made.stdout.split() == ["32.0"]
    assert made.stderr.count("passgraph cannot use its disk cache, so each process compiles again") == 1


def test_a_folder_that_is_too_full_loses_what_was_written_first(tmp_path: Path) -> None:
    folder = tmp_path / "full"
    folder.mkdir()
    for number in range(6):
        (folder / str(number)).write_bytes(b"x" * 100)
        os.utime(folder / str(number), (number, number))
    opened = os.open(folder, os.O_RDONLY)
    try:
        disk_cache.prune(folder, opened, 600)
        assert len(list(folder.iterdir())) == 6
        disk_cache.prune(folder, opened, 599)
    finally:
        os.close(opened)
    assert sorted(path.name for path in folder.iterdir()) == ["4", "5"]


def test_a_killed_process_leaves_the_old_file() -> None:
    disk_cache.remember("programs", "one", b"old")
    child = os.fork()
    if child == 0:
        os.replace = lambda *_, **__: os.kill(os.getpid(), signal.SIGKILL)  # type: ignore[assignment]
        disk_cache.remember("programs", "one", b"new")
        os._exit(0)
    assert os.WIFSIGNALED(os.waitpid(child, 0)[1])
    assert disk_cache.recall("programs", "one") == b"old"
    (left,) = (path for path in disk_cache.cache_path("programs").iterdir() if path.name != "one")
    disk_cache.prune(left.parent)
    assert left.exists()  # another process may be writing it
    os.utime(left, (0, 0))
    disk_cache.prune(left.parent)
    assert not left.exists()
    assert disk_cache.recall("programs", "one") == b"old"
