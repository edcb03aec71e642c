"""Generated kernels under oclgrind, a simulator that sees reads outside of buffers and races."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.conftest import expected_devices

pytestmark = pytest.mark.opencl
ROOT = Path(__file__).resolve().parents[2]


@pytest.mark.parametrize(
    ("file", "chosen"),
    [
        ("pixels", "border_rule and (130 or size0) or halves or pythons or breaks"),
        ("draws", "shared_edges or near_plane or guard"),
        ("outputs", "stencil_counts or several or discarded or blends"),
        ("tiles", "work_groups or images"),
    ],
)
def test_kernels_stay_inside_their_buffers_and_do_not_race(file: str, chosen: str, tmp_path: Path) -> None:
    """The tests of those files pass there too, and the simulator has nothing to say."""
    oclgrind = shutil.which("oclgrind")
    if oclgrind is None:
        if "opencl" in expected_devices():
            pytest.fail("oclgrind is expected where OpenCL is: apt-get install oclgrind", pytrace=False)
        pytest.skip("oclgrind is not here: apt-get install oclgrind")
    log = tmp_path / "oclgrind.log"
    tests = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "-k", chosen]
    result = subprocess.run(
        [oclgrind, "--data-races", "--log", str(log), *tests, f"tests/backends/test_opencl_{file}.py"],
        cwd=ROOT,
        env={**os.environ, "PYTHONPATH": str(ROOT), "PYTEST_ADDOPTS": ""},
        capture_output=True,
        text=True,
        check=False,
    )
    assert result.returncode == 0, result.stdout[-4000:]
    assert log.read_text() == ""
