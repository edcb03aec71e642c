"""Hostile kernels in the suite: a few of each backend; thousands by ``python -m tests.hostile.kernels``."""

from __future__ import annotations

import signal
import sys
from pathlib import Path

import pytest

from tests.conftest import oclgrind
from tests.hostile import kernels


def assert_held(tally: kernels.Tally, least: int) -> None:
    assert not tally.failures, str(tally)
    assert tally.cases >= least, str(tally)


def test_hostile_kernels_stay_between_the_guards() -> None:
    assert_held(kernels.run(range(20, 36), "numpy", runs=1), 40)


@pytest.mark.slow
def test_many_hostile_kernels_stay_between_the_guards() -> None:
    assert_held(kernels.run(range(100, 200), "numpy"), 600)


@pytest.mark.gl
def test_hostile_kernels_end_on_gl() -> None:
    assert_held(kernels.run(range(40, 46), "gl", runs=1), 15)


@pytest.mark.opencl
def test_hostile_kernels_end_on_opencl() -> None:
    assert_held(kernels.run(range(50, 52), "opencl", runs=1), 4)


@pytest.mark.slow
@pytest.mark.opencl
def test_hostile_kernels_stay_inside_their_buffers(tmp_path: Path) -> None:
    """The simulator interprets every instruction, and has nothing to say."""
    log = tmp_path / "oclgrind.log"
    tally = kernels.run(range(60, 70), "opencl", runs=1, wrapper=oclgrind(log))
    assert_held(tally, 20)
    assert log.read_text() == ""


# The runner itself


def test_a_crash_names_its_seed_and_the_rest_still_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    told = {20: "exit status -11", 21: ""}
    batches = []

    def child(seeds: range, *_: object) -> tuple[list[dict[str, object]], str, str]:
        batches.append(list(seeds))
        if seeds.start == 20:
            return [{"begin": 20}], told[20], "segmentation fault"
        return [{"end": seed, "cases": 2, "refused": ""} for seed in seeds], "", ""

    monkeypatch.setattr(kernels, "_child_told", child)
    tally = kernels.run(range(20, 24), "numpy")
    assert tally.failures == ["--seed 20 --backend numpy: exit status -11\nsegmentation fault"]
    assert batches == [[20, 21, 22, 23], [21, 22, 23]]
    assert (tally.kernels, tally.cases) == (3, 6)


def test_a_child_that_goes_on_too_long_is_ended() -> None:
    forever = (sys.executable, "-c", "import time\nwhile True: time.sleep(1)")
    _, status, _ = kernels._child_told(range(1), "numpy", 1, 1.0, forever)
    assert status == "still running after 1.0 s"


def test_a_child_that_computes_too_long_is_ended() -> None:
    """By the time that it had a core: on a busy machine nobody is ended for waiting."""
    text = "from tests.hostile import kernels\nkernels.compute_at_most(0.0)\nwhile True: pass"
    _, status, _ = kernels._child_told(range(1), "numpy", 1, 600.0, (sys.executable, "-c", text))
    assert status == f"exit status {-signal.SIGXCPU}"


def test_a_child_that_dies_tells_how() -> None:
    crash = (sys.executable, "-c", "import ctypes; ctypes.string_at(0)")
    _, status, _ = kernels._child_told(range(1), "numpy", 1, 60.0, crash)
    assert status == "exit status -11"


def test_texts_reach_what_they_are_meant_to() -> None:
    """Of a hundred: far and chosen offsets, huge loops, long arrays at computed indices, depth, extremes."""
    texts = [str(kernels.Text(seed)) for seed in range(100)]
    for words in ("2147483647", "-2147483648", "] * 1024", "if v.x > 0.5 else", "bits_from_float", "sample(", "texel("):
        assert sum(words in text for text in texts) >= 5, words
    assert sum("for i" in text for text in texts) >= 20
    assert max(len(text.splitlines()) for text in texts) > 500
    assert str(kernels.Text(7)) == str(kernels.Text(7))
