"""The opencl backend on a second, independent implementation: Intel's CPU runtime, beside PoCL.

It comes from PyPI (intel-opencl-rt with intel-cmplr-lib-rt).  A process of its own finds it through a folder with one
``.icd`` file, so that other tests keep the devices that the system lists.
"""

from __future__ import annotations

import os
import platform
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = [pytest.mark.opencl, pytest.mark.slow]
ROOT = Path(__file__).resolve().parents[2]
LIBRARY = "libintelocl.so"
#: Environment variable with the folder of the library, where it is not in the one of this interpreter.
FOLDER_VARIABLE = "PASSGRAPH_INTEL_OPENCL"

FUZZ = """
import sys
from pathlib import Path
from passgraph.backends.registry import open_backend
from passgraph.verify.fuzz import search
from passgraph.verify.fuzz.cases import Tally, load
from passgraph.verify.fuzz.search import outcome

with open_backend("opencl") as backend:
    assert "Intel" in backend.device.platform.name, backend.device.platform.name
    for kind, count in (("kernels", 6), ("draws", 3), ("graphs", 2)):
        tally = Tally()
        failure = search.batch(search.strategies()[kind], [backend], 2, tally, count)
        print(tally)
        if failure is not None:
            sys.exit(f"{failure.why}\\n{failure.case}")
    for path in sorted(Path("tests/fuzz/regressions").glob("*.json")):
        why = outcome(load(path), [backend], Tally())
        if why:
            sys.exit(f"{why}\\n{path}")
"""


@pytest.fixture(scope="module")
def environment(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """Variables with which a process sees Intel's runtime and nothing else; skips where it is not installed."""
    places = [os.environ.get(FOLDER_VARIABLE, ""), str(Path(sys.prefix) / "lib")]
    folder = next((Path(place) for place in places if place and (Path(place) / LIBRARY).exists()), None)
    if folder is None:
        pytest.skip(f"Intel's OpenCL runtime is not here: pip install intel-opencl-rt intel-cmplr-lib-rt "
                    f"(x86-64 only, this is {platform.machine()})")  # fmt: skip
    vendors = tmp_path_factory.mktemp("vendors")
    (vendors / "intel.icd").write_text(f"{folder / LIBRARY}\n")
    libraries = os.pathsep.join(part for part in (str(folder), os.environ.get("LD_LIBRARY_PATH", "")) if part)
    return {
        **os.environ,
        "OCL_ICD_VENDORS": str(vendors),
        "OPENCL_VENDOR_PATH": str(vendors),
        "LD_LIBRARY_PATH": libraries,
        "PYTHONPATH": str(ROOT),
        "PYTEST_ADDOPTS": "",
        "PASSGRAPH_EXPECT": "opencl",
    }


def run(arguments: list[str], environment: dict[str, str]) -> str:
    """What a Python process prints; it must end well."""
    result = subprocess.run(
        [sys.executable, *arguments], cwd=ROOT, env=environment, capture_output=True, text=True, check=False
    )
    assert result.returncode == 0, (result.stdout + result.stderr)[-4000:]
    return result.stdout


def test_the_runtime_is_the_one_that_is_meant(environment: dict[str, str]) -> None:
    listed = run(["-c", "import pyopencl as cl; print(*(p.name for p in cl.get_platforms()), sep='\\n')"], environment)
    assert listed.splitlines() == ["Intel(R) OpenCL"]


#: File → which of its tests are run there.
CHOSEN = {
    "cross/test_pixel_meanings.py": "opencl and (border_rule or halves or pythons or breaks)",
    "cross/test_draw_meanings.py": "opencl and (shared_edges or near_plane or guard or stencil or discarded)",
    "cross/test_far_positions.py": "opencl",
    "language/test_powers.py": "opencl",
    "cross/test_literal_operands.py": "opencl",
    "cross/test_layouts.py": "opencl and not (rg or host)",
    "backends/test_opencl_host.py": "buffers or arrays or images or overlap or draws",
    "backends/test_opencl_host_queue.py": "wait or runs",
    "backends/test_opencl_host_life.py": "stays",
    "backends/test_transfers.py": "opencl or processor or lent or adopted or inside",
}


def test_what_holds_on_other_devices_holds_there(environment: dict[str, str]) -> None:
    """In one process: each compiles what it needs of the runtime anew."""
    chosen = " or ".join(f"({Path(file).stem} and ({words}))" for file, words in CHOSEN.items())
    files = [f"tests/{file}" for file in CHOSEN]
    run(["-m", "pytest", "-q", "-n", "0", "-p", "no:cacheprovider", "-k", chosen, *files], environment)


def test_random_cases_are_within_bounds_there(environment: dict[str, str]) -> None:
    assert "opencl" in run(["-c", FUZZ], environment)
