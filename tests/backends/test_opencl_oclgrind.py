"""Generated kernels under oclgrind, a simulator that sees reads outside of buffers and races."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.conftest import oclgrind

pytestmark = pytest.mark.opencl
ROOT = Path(__file__).resolve().parents[2]

RANDOM = """
import sys
from passgraph.backends.registry import open_backend
from passgraph.verify.fuzz import search
from passgraph.verify.fuzz.cases import Tally

seed, counts = 3, (("kernels", 4), ("draws", 3))
with open_backend("opencl") as backend:
    assert "Oclgrind" in backend.device.platform.name, backend.device.platform.name
    for kind, count in counts:
        tally = Tally()
        failure = search.batch(search.strategies(16)[kind], [backend], seed, tally, count)
        assert tally.verdicts["opencl"] > count // 2
        print(tally)
        if failure is not None:
            sys.exit(f"{failure.why}\\n{failure.case}")
"""


#: File → which of its tests are run there.
CHOSEN = {
    "cross/test_pixel_meanings": "opencl and (border_rule and (130 or size0) or halves or pythons or breaks)",
    "cross/test_draw_meanings": "opencl and (shared_edges or near_plane or guard or holds or discarded or blending)",
    "backends/test_opencl_tiles": "work_groups or images",
}


def test_kernels_stay_inside_their_buffers_and_do_not_race(tmp_path: Path) -> None:
    """The tests of those files pass there too, and the simulator has nothing to say."""
    chosen = " or ".join(f"({Path(file).stem} and ({words}))" for file, words in CHOSEN.items())
    files = [f"tests/{file}.py" for file in CHOSEN]
    assert_clean(["-m", "pytest", "-q", "-n", "0", "-p", "no:cacheprovider", "-k", chosen, *files], tmp_path)


def test_random_kernels_and_draws_stay_inside_and_do_not_race(tmp_path: Path) -> None:
    """Small pictures: the simulator interprets every instruction."""
    assert_clean(["-c", RANDOM], tmp_path)


def test_counting_stays_inside_and_does_not_race(tmp_path: Path) -> None:
    """By one work-item a row or by groups, of what is no bin's number too."""
    chosen = ["-k", "whatever and opencl and -count", "tests/cross/test_histograms.py"]
    assert_clean(["-m", "pytest", "-q", "-p", "no:cacheprovider", *chosen], tmp_path)


def assert_clean(arguments: list[str], tmp_path: Path) -> None:
    """Python ends well under the simulator, which has nothing to say."""
    log = tmp_path / "oclgrind.log"
    result = subprocess.run(
        [*oclgrind(log), sys.executable, *arguments],
        cwd=ROOT,
        env={**os.environ, "PYTHONPATH": str(ROOT), "PYTEST_ADDOPTS": ""},
        capture_output=True,
        text=True,
        check=False,
    )
    assert result.returncode == 0, (result.stdout + result.stderr)[-4000:]
    assert log.read_text() == ""
