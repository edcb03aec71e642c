"""Each writer when a disk is full, files cannot be opened, or its process is killed: the old file, or the new one."""

from __future__ import annotations

import errno
import json
import os
import resource
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import passgraph as pg
from passgraph import image_writing, writing
from passgraph.image_formats import WRITABLE
from passgraph.pictures import encode_png
from tests.writers import ALL, WRITERS, limited, picture_of

Problems = dict[str, str]


def problems(fault: str, folder: Path, *before: str) -> Problems:
    """Run all writers under a fault in a process of their own; return what is wrong by writer."""
    folder.mkdir(exist_ok=True)
    command = [*before, sys.executable, "-W", "ignore", "-m", "tests.writers", fault, os.fspath(folder)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        try:
            told, errors = process.communicate(timeout=600)
        except subprocess.TimeoutExpired:  # a writer that never returns is the first one that is missing
            process.kill()
            told, errors = process.communicate()
    found = dict(json.loads(line) for line in told.splitlines())
    missing = [name for name in (WRITERS if fault.startswith("SIG") else ALL) if name not in found]
    return found | dict.fromkeys(missing, f"the process ended with {process.returncode} {errors[-500:]}")


@pytest.fixture(scope="module", params=["full", "few_files"])
def fault(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Problems:
    return problems(request.param, tmp_path_factory.mktemp(request.param) / "files")


@pytest.fixture(scope="module", params=["SIGKILL", "SIGTERM", "SIGINT"])
def killed(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Problems:
    return problems(request.param, tmp_path_factory.mktemp(request.param) / "files")


@pytest.mark.parametrize("name", ALL)
def test_a_file_that_cannot_be_written_is_the_old_one(fault: Problems, name: str) -> None:
    assert fault[name] == ""


@pytest.mark.parametrize("name", WRITERS)
def test_a_file_of_a_killed_process_is_the_old_one(killed: Problems, name: str) -> None:
    assert killed[name] == ""


def test_a_full_file_system(tmp_path: Path) -> None:
    mounted = [
        "unshare",
        "--mount",
        "sh",
        "-c",
        'mount -t tmpfs -o size=8m tmpfs "$0" && exec "$@"',
        os.fspath(tmp_path),
    ]
    if not shutil.which("unshare") or subprocess.run([*mounted, "true"], capture_output=True).returncode:
        pytest.skip("no right to mount a tmpfs; the limit on a file's size stands for it")
    assert problems("full_tmpfs", tmp_path, *mounted) == dict.fromkeys(ALL, "")


def test_the_file_of_a_folder_that_fails_is_named(tmp_path: Path) -> None:
    contents = {"a.bin": bytes(10), "b.bin": bytes(1000), "c.json": b"{}"}
    with limited(resource.RLIMIT_FSIZE, 500), pytest.raises(pg.InputError, match=r"b\.bin: cannot be written \(File"):
        writing.write_files(tmp_path, contents)
    assert not list(tmp_path.iterdir())
    writing.write_files(tmp_path, contents)
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == contents


def test_a_picture_of_an_export_that_cannot_be_encoded_is_named() -> None:
    pixels = np.zeros((48, 64, 4), np.uint8)
    with (
        limited(resource.RLIMIT_FSIZE, 500),
        pytest.raises(pg.InputError, match=r"frame\.png: cannot be written \(File"),
    ):
        encode_png(Path("frame.png"), pixels)
    assert encode_png(Path("frame.png"), pixels)[:4] == b"\x89PNG"


# Systems without files in memory


def without_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delattr(os, "memfd_create")


@pytest.mark.parametrize("suffix", [suffix for suffix in WRITABLE if suffix != ".npy"])
def test_without_memory_files_what_is_on_the_disk_is_checked(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, suffix: str
) -> None:
    picture = picture_of(1)[..., : 1 if suffix == ".pgm" else 3]
    pg.save(tmp_path / f"memory{suffix}", picture)
    without_memory(monkeypatch)
    pg.save(tmp_path / f"disk{suffix}", picture)
    assert (tmp_path / f"disk{suffix}").stat().st_size == (tmp_path / f"memory{suffix}").stat().st_size

    encode = image_writing._encode

    def cut(file: Path, path: Path, *others: object) -> None:
        encode(file, path, *others)  # type: ignore[arg-type]
        # Readers of some formats need no last byte.
        os.truncate(path, path.stat().st_size - (3000 if suffix in (".tga", ".jxl", ".dpx") else 1))

    monkeypatch.setattr(image_writing, "_encode", cut)
    with pytest.raises(pg.InputError, match=r"disk.*: cannot be written \(the file is not complete on the disk\)"):
        pg.save(tmp_path / f"disk{suffix}", picture)
    assert (tmp_path / f"disk{suffix}").stat().st_size == (tmp_path / f"memory{suffix}").stat().st_size


def test_without_memory_files_a_full_disk_is_found_before(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    without_memory(monkeypatch)
    monkeypatch.setattr(shutil, "disk_usage", lambda path: shutil._ntuple_diskusage(100, 99, 1))  # type: ignore[attr-defined]
    with pytest.raises(pg.InputError, match=r"a\.jpg: cannot be written \(No space left on device\)"):
        pg.save(tmp_path / "a.jpg", picture_of(1)[..., :3])
    assert not list(tmp_path.iterdir())


def test_errors_of_the_system_in_messages_of_the_library(tmp_path: Path) -> None:
    with pytest.raises(OSError, match="Too many open files") as caught:
        image_writing.check_system_error(f'Could not open "x" ({os.strerror(errno.EMFILE)})', tmp_path / "a.png")
    assert (caught.value.errno, caught.value.filename) == (errno.EMFILE, os.fspath(tmp_path / "a.png"))
    image_writing.check_system_error("libpng: wrong", tmp_path / "a.png")


# Forks


@pytest.mark.parametrize("suffix", sorted(WRITABLE))
def test_forked_children_write_files(tmp_path: Path, suffix: str) -> None:
    """The parent has written one before; a pool of threads that it began would not exist in the child."""
    code = f"""
import os, sys
import numpy as np
import OpenImageIO, passgraph as pg
picture = np.random.default_rng(0).random((700, 700{", 3" if suffix != ".pgm" else ""}), np.float32)
threads = OpenImageIO.get_int_attribute("exr_threads")
pg.save("parent{suffix}", picture)
assert OpenImageIO.get_int_attribute("exr_threads") == threads
pg.load("parent{suffix}")
child = os.fork()
if child == 0:
    pg.save("child{suffix}", picture)
    os._exit(0)
sys.exit(os.waitpid(child, 0)[1])
"""
    subprocess.run([sys.executable, "-c", code], cwd=tmp_path, check=True, timeout=60)
    assert (tmp_path / f"child{suffix}").stat().st_size == (tmp_path / f"parent{suffix}").stat().st_size


# Temporary folders


def test_folders_of_killed_processes_are_removed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    code = "import os; from passgraph.writing import temporary_folder; f = temporary_folder(); os.kill(os.getpid(), 9)"
    subprocess.run([sys.executable, "-c", code], env={**os.environ, "TMPDIR": os.fspath(tmp_path)})
    assert len(list(tmp_path.iterdir())) == 1
    monkeypatch.setattr("tempfile.tempdir", os.fspath(tmp_path))
    with writing.temporary_folder() as folder:
        assert [path.name for path in tmp_path.iterdir()] == [Path(folder).name]
    assert not list(tmp_path.iterdir())
