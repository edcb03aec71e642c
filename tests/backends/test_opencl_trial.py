"""Programs over which a driver ends the process are compiled in another way: tried in a child first."""

from __future__ import annotations

import os
import signal
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import passgraph as pg
from passgraph.backends.opencl import OpenCLBackend, trial
from passgraph.backends.opencl.trial import CHECKED, Trial, trial_of
from tests.conftest import require

#: A child as trial_child.py is.  Text in a source says what it does: die (as LLVM does), hard (however it is compiled),
#: gone (by another's signal).  Each line of a file is a start.
CHILD = """
import json, os, signal, sys
open(sys.argv[1], "a").write("started\\n")
print("ready", flush=True)
for line in sys.stdin:
    source, options = json.loads(line)
    if "hard" in source or ("die" in source and "minsize" not in source):
        os.abort()
    if "gone" in source:
        os.kill(os.getpid(), signal.SIGKILL)
    print("compiled", flush=True)
"""
POSIX = pytest.mark.skipif(sys.platform == "win32", reason="signals do not end processes on Windows")


@pytest.fixture
def starts(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("PASSGRAPH_CACHE", str(tmp_path / "cache"))
    return tmp_path / "starts"


def tried(starts: Path) -> Trial:
    return Trial("a driver", [sys.executable, "-c", CHILD, str(starts)])


@POSIX
def test_a_program_that_ends_the_child_is_compiled_in_another_way(starts: Path) -> None:
    one = tried(starts)
    assert one.safe("fine", ["-a"]) == ("fine", ["-a"])
    source, options = one.safe("die", ["-a"])
    assert "minsize" in source and "die" in source and options == ["-a"]
    assert one.safe("hard", ["-a"]) == ("hard", ["-a", "-cl-opt-disable"])
    one.close()


@POSIX
def test_one_child_tries_all_programs_until_one_ends_it(starts: Path) -> None:
    one = tried(starts)
    for source in ("a", "b", "die", "c", "d"):
        one.safe(source, [])
    one.close()
    assert starts.read_text().splitlines() == ["started"] * 2


@POSIX
def test_the_way_is_kept_on_disk(starts: Path) -> None:
    one, another = tried(starts), Trial("a driver", ["/no/such/program"])
    found = [one.safe(source, []) for source in ("fine", "die", "hard")]
    one.close()
    assert [another.safe(source, []) for source in ("fine", "die", "hard")] == found


def test_of_another_driver_or_environment_nothing_is_known(starts: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    one = tried(starts)
    one.safe("fine", [])
    one.close()
    other = tried(starts)
    other.driver = "another"
    other.safe("fine", [])
    other.close()
    monkeypatch.setenv("POCL_WORK_GROUP_METHOD", "cbs")
    same = tried(starts)
    same.safe("fine", [])
    same.close()
    assert starts.read_text().splitlines() == ["started"] * 3


@POSIX
def test_a_child_that_something_else_ends_says_nothing(starts: Path) -> None:
    one = tried(starts)
    assert one.safe("gone", []) == ("gone", [])
    assert one.safe("gone", []) == ("gone", [])
    one.close()
    assert starts.read_text().splitlines() == ["started"] * 2, "nothing was kept of the first"


@pytest.mark.parametrize("command", [["/no/such/program"], [sys.executable, "-c", "raise SystemExit(1)"]])
def test_without_a_child_programs_are_compiled_as_they_are(starts: Path, command: list[str]) -> None:
    one = Trial("a driver", command)
    assert one.safe("die", ["-a"]) == ("die", ["-a"])
    one.close()


@POSIX
def test_an_interrupted_trial_leaves_no_answer_to_the_next(starts: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    one = tried(starts)
    one.safe("fine", [])
    child = one._child
    assert child is not None and child.stdout is not None

    def interrupted() -> Any:
        raise KeyboardInterrupt

    monkeypatch.setattr(child, "stdout", SimpleNamespace(readline=interrupted, close=child.stdout.close))
    with pytest.raises(KeyboardInterrupt):
        one.safe("another", [])
    assert child.poll() == -signal.SIGKILL
    assert "minsize" in one.safe("die", [])[0]
    one.close()


def test_a_child_ends_with_its_trial(starts: Path) -> None:
    one = tried(starts)
    one.safe("fine", [])
    child = one._child
    assert child is not None
    del one
    assert child.poll() is not None


@pytest.mark.parametrize(("version", "has"), [
    ("OpenCL 3.0 PoCL 6.0  Linux, Release, RELOC, SPIR-V, LLVM 18.1.8, SLEEF, DISTRO, POCL_DEBUG", True),
    ("OpenCL 3.0 PoCL 6.0  Linux, Release, RELOC, LLVM 17.0.6, SLEEF", False),
    ("OpenCL 3.0 PoCL 3.1+debian  Linux, None+Asserts, RELOC, SPIR, LLVM 15.0.6, SLEEF", False),
    ("OpenCL 3.0 PoCL 7.1  Linux, Release, RELOC, SPIR-V, LLVM 21.1.8", False),
    ("OpenCL 3.0 CUDA 12.4.89", False),
])  # fmt: skip
def test_drivers_with_the_check(version: str, has: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    platform = SimpleNamespace(version=version)
    device = SimpleNamespace(platform=platform, name="cpu")
    platform.get_devices = lambda: [device]
    assert bool(CHECKED.search(version)) is has
    assert (trial_of(device) is not None) is has
    monkeypatch.setattr(sys, "executable", "/opt/host/bin/krita")
    assert trial_of(device) is None, "it would start the host program"


@pytest.mark.opencl
def test_the_child_compiles_with_the_driver_that_is_here(starts: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    require("opencl")
    monkeypatch.setattr(trial, "CHECKED", trial.re.compile(""))
    asked = list[bool | None]()
    compiles = Trial._compiles
    monkeypatch.setattr(Trial, "_compiles", lambda *given: asked.append(compiles(*given)) or asked[-1])
    gray = "def gray(color: Image) -> vec4: return vec4(vec3(color[0, 0].r), 1.0)"
    picture = np.linspace(0, 1, 60, dtype=np.float32).reshape(3, 5, 4)
    with OpenCLBackend() as device, pg.compile(pg.kernel(source=gray)(pg.Input("frame")), backend=device) as program:
        result = np.asarray(program(frame=picture))
    np.testing.assert_array_equal(result[..., 0], picture[..., 0])
    assert asked and all(asked)
    assert len(os.listdir(starts.parent / "cache" / trial.PART)) == len(asked)
