"""Wrong use of the command line: every option of every command with values that do not fit, and streams that are shut.

What comes out is one line on stderr and status 2 (or an answer, where a value fits after all): never a traceback,
never "unforeseen", and no file that is half written or blank.
"""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import click
import pytest

from passgraph.commands.entry import COMMANDS, STATUS, group, run

#: What a command is given that it stops early and cheaply, after its options were read.
GIVEN = {
    "render": ["nowhere.glb", "-o", "out.png"],
    "apply": ["bloom", "nowhere.png", "-o", "out.png"],
    "compare": ["nowhere.png", "-e", "bloom"],
    "conform": ["-b", "numpy", "-g", "nothing"],
    "check": ["nowhere.txt"],
    "inspect": ["nowhere.png", "-e", "bloom", "--at", "0,0"],
    "backends": [],
    "fuzz": ["--seconds", "0"],
    "probe": ["-b", "numpy"],
    "bench": ["nowhere.glb", "-o", "folder/that/is/not/here"],
    "plan": ["nowhere.glb", "-e", "soft-shadow"],
    "view": ["bloom", "nowhere.png", "--no-open"],
    "export": ["bloom", "nowhere.png", "--web", "out"],
}
VALUES = [
    "", "x", "-1", "0", "nan", "inf", "1e999", "²", "0x10", "99999999999999999999", "x" * 5000, "/", "/nowhere/x.png",
    "\udcff.png", "16x16x16", "²x²", "null", "null:1", "numpy:²", "numpy:-1", "gl:²", "gl:99", "opencl:99999999999",
    "a=b", "=", "frame=", "out.bmp",
]  # fmt: skip


@pytest.fixture(autouse=True)
def in_a_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("PASSGRAPH_TRACEBACK", raising=False)


def options(name: str) -> Iterator[tuple[str, int]]:
    """Each option of a command that takes values, and how many it takes; parameters of effects too."""
    with click.Context(group) as context:
        found = group.get_command(context, name)
        assert found is not None
        if isinstance(found, click.Group):
            found = found.get_command(context, "bloom")
            assert found is not None
        for option in found.get_params(context):
            if isinstance(option, click.Option) and not option.is_flag:
                yield option.opts[0], option.nargs


@pytest.mark.sampled
@pytest.mark.parametrize("name", COMMANDS)
def test_options_refuse_what_does_not_fit(name: str, capfd: pytest.CaptureFixture[str]) -> None:
    for option, count in options(name):
        for value in VALUES:
            use = [name, *GIVEN[name], option, *[value] * count]
            if name == "fuzz" and option in ("--seconds", "--replay"):
                continue  # a number of seconds is one
            status = run(use)
            error = capfd.readouterr().err
            assert status in (0, 1, 2), use
            assert "unforeseen" not in error and "Traceback" not in error, (use, error)
            if status == 2:
                assert error.startswith("passgraph: error: ") and error.count("\n") == 1, (use, error)
            written = [path for path in Path.cwd().rglob("out*") if path.is_file()]
            assert not written or (status == 0 and option == "--json"), use
            for path in written:
                path.unlink()


@pytest.mark.parametrize(
    "command",
    [
        ["render", "-o", "out.png"],
        ["apply", "bloom", "in.png", "-o", "out.png"],
        ["compare", "-e", "soft-shadow"],
        ["conform"],
        ["check", "kernels.txt"],
        ["fuzz"],
        ["bench"],
    ],
    ids=lambda command: command[0],
)
@pytest.mark.parametrize("name", ["null", "null:3"])
def test_the_null_backend_makes_no_pictures(command: list[str], name: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run([*command, "-b", name]) == 2
    assert "backend null runs nothing and makes no pictures; use numpy, gl" in capsys.readouterr().err
    assert not list(Path.cwd().iterdir())


def test_nor_where_the_environment_names_it(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PASSGRAPH_BACKEND", "null")
    assert run(["render", "-o", "out.png", "--size", "16x16", "--map-size", "16"]) == 2
    assert "backend null runs nothing and makes no pictures" in capsys.readouterr().err
    assert not list(Path.cwd().iterdir())


@pytest.mark.parametrize(
    ("file", "text", "status", "words"),
    [
        ("a.txt", b"def k(c: Image) -> vec4: return c[0, 0]  # \xff", 2, "a.txt: is not text in UTF-8 (invalid start"),
        ("a.py", b"x = '\xff'", 2, "a.py: fails when run: SyntaxError"),
        ("a.py", b"import sys; sys.exit(3)", 2, "a.py: ends the process when it is run (sys.exit(3)); take that out"),
        ("a.py", b"exit()", 2, "a.py: ends the process when it is run (sys.exit()); take that out"),
        ("a.py", b"raise SystemExit('done')", 2, "a.py: ends the process when it is run (sys.exit('done'))"),
        ("a.py", b"raise KeyboardInterrupt", 130, "interrupted while a.py was run"),
        ("a.py", b"outputs = 3", 2, "a.py: outputs must be a target, several, or a mapping, got int"),
        ("a.py", b"outputs = {'a': 3}", 2, "compile takes targets that passes returned, got 3"),
        ("a.py", b"outputs = {3: 3}", 2, "the name of an output must be a name (a printable string, not empty), got 3"),
    ],
)  # fmt: skip
def test_files_that_cannot_be_checked(
    file: str, text: bytes, status: int, words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    Path(file).write_bytes(text)
    assert run(["check", file]) == status
    assert words in capsys.readouterr().err


# The process itself


def passgraph(shell: str) -> tuple[int, str]:
    """Status and stderr of a command line in bash; ``$P`` stands for the command."""
    environment = {**os.environ, "P": f"{sys.executable} -m passgraph"}
    done = subprocess.run(["bash", "-c", shell], capture_output=True, env=environment, check=False)
    return done.returncode, done.stderr.decode(errors="replace")


@pytest.mark.sampled
@pytest.mark.parametrize(
    ("shell", "status", "words"),
    [
        ("$P backends >&-", 0, ""),
        ("$P plan -e tone-map nowhere.png >&-", 2, "passgraph: error: nowhere.png: no such file"),
        ("$P plan -e tone-map nowhere.png >&- 2>&- <&-", 2, ""),
        ("$P --version <&-", 0, ""),
        ("PYTHONIOENCODING=ascii $P plan -e soft-shadow", 0, ""),
        ("$P plan -e soft-shadow --svg $'\\xff.svg'; rm $'\\xff.svg'", 0, ""),
        ("$P --version > /dev/full", 2, "passgraph: error: [Errno 28] No space left on device\n"),
        ("$P plan -e soft-shadow > /dev/full", 2, "passgraph: error: [Errno 28] No space left on device\n"),
        # bash waits for the reader, which is gone before anything is written
        ("{ $P plan -e soft-shadow; echo $? >&2; } | true", 0, "141\n"),
        ("{ $P backends; echo $? >&2; } | true", 0, "141\n"),
    ],
)
def test_streams_that_are_shut(shell: str, status: int, words: str) -> None:
    returned, error = passgraph(shell)
    assert (returned, error[: len(words)] if words else error) == (status, words)
    assert "Traceback" not in error and "Exception ignored" not in error


def test_help_tells_every_exit_status(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["--help"]) == 0
    shown = " ".join(capsys.readouterr().out.split())
    for number, meaning in STATUS.items():
        assert f"{number} {meaning}" in shown
