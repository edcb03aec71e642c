"""Output files: what may be replaced, and what is left behind."""

from __future__ import annotations

import os
import signal
import socket
import stat
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

import passgraph as pg
from passgraph import interrupts, writing
from passgraph.writing import NewFile, write_text
from tests.writers import WRITERS, picture_of

PICTURE = picture_of(1)


def make_fifo(path: Path) -> None:
    os.mkfifo(path)


def make_socket(path: Path) -> None:
    home = Path.cwd()
    os.chdir(path.parent)  # names of sockets are short
    try:
        with socket.socket(socket.AF_UNIX) as made:
            made.bind(path.name)
    finally:
        os.chdir(home)


@pytest.mark.parametrize("linked", [False, True], ids=["itself", "a link"])
@pytest.mark.parametrize("make", [make_fifo, make_socket], ids=["fifo", "socket"])
@pytest.mark.parametrize("name", WRITERS)
def test_only_regular_files_are_replaced(tmp_path: Path, name: str, make: Callable[[Path], None], linked: bool) -> None:
    special = tmp_path / ("special" if linked else name)
    make(special)
    if linked:
        (tmp_path / name).symlink_to(special)
    kind = stat.S_IFMT(special.lstat().st_mode)
    with pytest.raises(pg.InputError, match=r"is a device, a FIFO or a socket; expected the name of a file"):
        WRITERS[name](tmp_path / name, PICTURE)
    assert stat.S_IFMT(special.lstat().st_mode) == kind
    assert len(list(tmp_path.iterdir())) == 1 + linked


def test_devices_are_not_replaced(tmp_path: Path) -> None:
    (tmp_path / "link.png").symlink_to("/dev/null")
    with pytest.raises(pg.InputError, match="is a device"):
        pg.save(tmp_path / "link.png", PICTURE)
    assert stat.S_ISCHR(Path("/dev/null").stat().st_mode)


@pytest.mark.parametrize("name", WRITERS)
def test_links_stay_links(tmp_path: Path, name: str) -> None:
    (tmp_path / "there").mkdir()
    (tmp_path / name).symlink_to(tmp_path / "there" / name)
    WRITERS[name](tmp_path / name, PICTURE)
    assert (tmp_path / name).is_symlink()
    assert [path.name for path in (tmp_path / "there").iterdir()] == [name]


@pytest.mark.parametrize("name", WRITERS)
@pytest.mark.parametrize("whole_folder", [False, True], ids=["file", "folder"])
def test_no_link_leads_out_of_a_folder_of_everyones(tmp_path: Path, name: str, whole_folder: bool) -> None:
    (tmp_path / "mine").mkdir()
    (tmp_path / "open").mkdir()
    (tmp_path / "open").chmod(0o1777)
    link = tmp_path / "open" / ("folder" if whole_folder else name)
    link.symlink_to(tmp_path / "mine" if whole_folder else tmp_path / "mine" / name)
    with pytest.raises(pg.InputError, match="is a symbolic link in a folder where every user may make one"):
        WRITERS[name](link / name if whole_folder else link, PICTURE)
    assert not list((tmp_path / "mine").iterdir())
    write_text(tmp_path / "open" / "plain.txt", "")
    (tmp_path / "open" / "inside").symlink_to("plain.txt")
    write_text(tmp_path / "open" / "inside", "it stays in that folder")
    assert (tmp_path / "open" / "plain.txt").read_text() == "it stays in that folder"


def test_what_takes_the_name_during_the_work_stays(tmp_path: Path) -> None:
    with NewFile(tmp_path / "a.txt") as made:
        made.temporary.write_text("")
        os.mkfifo(tmp_path / "a.txt")
        with pytest.raises(pg.InputError, match="is a device"):
            made.complete()
    assert [path.name for path in tmp_path.iterdir()] == ["a.txt"]
    assert (tmp_path / "a.txt").is_fifo()


def test_files_of_dead_processes_are_swept(tmp_path: Path) -> None:
    child = subprocess.run([sys.executable, "-c", "import os; print(os.getpid())"], stdout=subprocess.PIPE, check=True)
    dead, alive = int(child.stdout), os.getppid()
    here, other = writing._machine(), "00000000"
    stale, stale_folder = (f".passgraph-{here}-{dead}-{'a' * 12}{end}" for end in (".png", ".zarr"))
    kept = {
        f".passgraph-{here}-{alive}-{'a' * 12}.png", f".passgraph-{other}-{dead}-{'a' * 12}.png",
        f".passgraph-old-{'a' * 12}.zarr", f".passgraph-{here}-{dead}-{'a' * 12}.png.mine",
    }  # fmt: skip
    for name in [stale, *kept]:
        (tmp_path / name).touch()
    (tmp_path / stale_folder).mkdir()
    (tmp_path / stale_folder / "0").touch()
    pg.save(tmp_path / "a.png", PICTURE)
    assert {path.name for path in tmp_path.iterdir()} == kept | {"a.png"}


SLOW = """
import os, time
from pathlib import Path
from passgraph.commands import entry
from passgraph.writing import NewFile
def work(*_, **__):
    file = NewFile(Path("a.txt"))
    file.temporary.touch()
    print("ready", flush=True)
    time.sleep(60)
entry.group.main = work
entry.main([])
"""


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL], ids=lambda n: n.name)
def test_signals_leave_nothing_behind(tmp_path: Path, number: signal.Signals) -> None:
    with subprocess.Popen(
        [sys.executable, "-c", SLOW], cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout is not None and process.stderr is not None
        assert process.stdout.readline() == "ready\n"
        process.send_signal(number)
        assert process.wait(60) == (-9 if number == signal.SIGKILL else 128 + number)
        told = process.stderr.read()
    if number == signal.SIGKILL:
        assert len(list(tmp_path.iterdir())) == 1
        writing._swept.discard(tmp_path)
        write_text(tmp_path / "b.txt", "")  # the next one who writes there
        (tmp_path / "b.txt").unlink()
    else:
        assert told.strip() == f"passgraph: {'interrupted' if number == signal.SIGINT else 'terminated'}"
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("delay_ms", range(0, 300, 25))
def test_ctrl_c_during_imports_is_quiet(tmp_path: Path, delay_ms: int) -> None:
    # What comes before the first import of passgraph is Python's own; NumPy is the first of the long ones.
    start = (
        "import sys; sys.argv[0] = 'passgraph'; print('x', flush=True)\n"
        "class Wait:\n"
        "    def find_spec(self, name, *_):\n"
        "        if name == 'numpy': print('numpy', flush=True)\n"
        "sys.meta_path.insert(0, Wait())\n"
        "from passgraph.commands import main; main(['apply', 'gaussian-blur', '--help'])"
    )
    with subprocess.Popen(
        [sys.executable, "-c", start], cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout is not None and process.stderr is not None
        assert process.stdout.readline() == "x\n"
        assert process.stdout.readline() == "numpy\n"
        time.sleep(delay_ms / 1000)
        process.send_signal(signal.SIGINT)
        process.stdout.read()
        told = process.stderr.read()
        assert process.wait(60) in (0, 130)
    assert told.strip() in ("", "passgraph: interrupted")


def test_the_host_keeps_its_handlers() -> None:
    text = (
        "import signal, sys; before = signal.getsignal(2), signal.getsignal(15), sys.unraisablehook\n"
        "import passgraph, passgraph.commands\n"
        "assert before == (signal.getsignal(2), signal.getsignal(15), sys.unraisablehook)"
    )
    subprocess.run([sys.executable, "-c", text], check=True)


@pytest.mark.parametrize(
    ("argv", "started", "expected"),
    [
        (["/usr/bin/passgraph", "apply", "-m"], ["python", "/usr/bin/passgraph", "apply", "-m"], True),
        (["-m"], ["python", "-X", "dev", "-m", "passgraph", "apply"], True),
        (["-m"], ["python", "-m", "pytest", "-m", "passgraph"], False),
        (["tool.py", "passgraph"], ["python", "tool.py", "passgraph"], False),
        (["-c"], ["python", "-c", "import passgraph"], False),
        ([], ["host"], False),
    ],
)
def test_only_the_command_is_the_command(
    monkeypatch: pytest.MonkeyPatch, argv: list[str], started: list[str], expected: bool
) -> None:
    monkeypatch.setattr(sys, "argv", argv)
    monkeypatch.setattr(sys, "orig_argv", started)
    assert interrupts.is_command() is expected
    if not argv:
        monkeypatch.delattr(sys, "argv")  # as in a program that embeds Python
        assert not interrupts.is_command()
