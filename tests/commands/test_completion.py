"""Completion with the Tab key: what shells ask for, and bash itself."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

COMMAND = Path(sys.executable).with_name("passgraph")


def asked(shell: str, **variables: str) -> str:
    """Return what the command prints when a shell asks; it must end well and say nothing else."""
    environment = {**os.environ, "_PASSGRAPH_COMPLETE": shell, **variables}
    result = subprocess.run([COMMAND], env=environment, capture_output=True, text=True, timeout=60, check=False)
    assert (result.returncode, result.stderr) == (0, "")
    return result.stdout


@pytest.mark.parametrize("shell", ["bash_source", "zsh_source", "fish_source"])
def test_shells_get_their_script(shell: str) -> None:
    assert f"_PASSGRAPH_COMPLETE={shell.split('_')[0]}_complete" in asked(shell)


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        ("passgraph app", ["plain,apply"]),
        ("passgraph apply bloo", ["plain,bloom"]),
        ("passgraph apply bloom --inten", ["plain,--intensity"]),
        ("passgraph apply mine.g", ["file,mine.g"]),
        ("passgraph apply bloom photo.p", ["file,photo.p"]),
        ("passgraph apply bloom --backend open", ["plain,opencl"]),
        ("passgraph view vignet", ["plain,vignette"]),
        ("passgraph export --effect vignet", ["plain,vignette"]),
        ("passgraph render scene.g", ["file,scene.g"]),
        ("passgraph check mine.p", ["file,mine.p"]),
    ],
)
def test_names_complete(words: str, expected: list[str]) -> None:
    printed = asked("bash_complete", COMP_WORDS=words, COMP_CWORD=str(len(words.split()) - 1))
    assert printed.split() == expected


@pytest.mark.skipif(shutil.which("bash") is None, reason="bash is not here")
def test_bash_completes() -> None:
    """The script of the command in a bash of its own: the words that its function gives back."""
    text = f"""
    eval "$(_PASSGRAPH_COMPLETE=bash_source {COMMAND})"
    COMP_WORDS=({COMMAND} apply vignet); COMP_CWORD=2
    _passgraph_completion {COMMAND}
    echo "${{COMPREPLY[@]}}"
    """
    result = subprocess.run(["bash", "-c", text], capture_output=True, text=True, timeout=60, check=False)
    assert (result.stdout.strip(), result.stderr) == ("vignette", "")
