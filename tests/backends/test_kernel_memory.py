"""A process that compiles, runs and closes ever new kernels does not grow."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from tests.conftest import require

pytestmark = pytest.mark.skipif(not Path("/proc/self/statm").exists(), reason="it reads /proc/self/statm")

#: The first kernels fill caches of fixed size.  What malloc keeps for later is given back before memory is read; the
#: least of three is taken, as PoCL may still hold 50 MB of its compiler.
MEASURE = """
import ctypes, gc, mmap, sys
import numpy as np, passgraph as pg

def resident():
    gc.collect()
    ctypes.CDLL(None).malloc_trim(0)
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * mmap.PAGESIZE

def kernels(count):
    for _ in range(count):
        numbers.append(len(numbers))
        kernel = pg.kernel(source=f"def scaled(color: Image) -> vec4: return color[0, 0] * {numbers[-1]}.5")
        with pg.compile(kernel(pg.Input("frame")), backend=backend) as program:
            assert program(frame=picture)["scaled"][0, 0, 0] == numbers[-1] + 0.5

def least():
    found = [resident()]
    for _ in range(2):
        kernels(1)
        found.append(resident())
    return min(found)

picture, numbers = np.ones((9, 7, 4), np.float32), []
backend, warm, count = sys.argv[1], int(sys.argv[2]), int(sys.argv[3])
kernels(warm)
before = least()
kernels(count - 2)
print((least() - before) / count)
"""


def bytes_of_a_kernel(backend: str, warm: int, count: int, cache: Path, monkeypatch: pytest.MonkeyPatch) -> float:
    """Return how much a new process grows with each kernel that it compiles, runs once and closes."""
    require(backend)
    monkeypatch.setenv("PASSGRAPH_CACHE", str(cache))
    # Else each thread of a driver has memory of its own that malloc keeps: 4 MB with webgpu, or 20 on a busy machine,
    # however many kernels there are.
    monkeypatch.setenv("MALLOC_ARENA_MAX", "1")
    command = [sys.executable, "-c", MEASURE, backend, str(warm), str(count)]
    made = subprocess.run(command, capture_output=True, text=True, timeout=3600, check=False)
    assert made.returncode == 0, made.stderr
    return float(made.stdout)


@pytest.mark.parametrize(("backend", "count"), [("numpy", 400), ("gl", 150)])
def test_hundreds_of_kernels_leave_no_memory(
    backend: str, count: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert bytes_of_a_kernel(backend, 200, count, tmp_path, monkeypatch) < 8 << 10


@pytest.mark.slow
@pytest.mark.parametrize(
    ("backend", "warm", "count", "most"),
    [
        ("numpy", 600, 3000, 3 << 10),  # LLVM's pass builder leaves 1.5 kB of each compilation (llvmlite 0.50)
        ("gl", 600, 3000, 6 << 10),  # Mesa 22.3 keeps 0.1 kB of each, between pages that it has freed
        ("webgpu", 600, 3000, 2 << 10),
        # Half a second each.  PoCL 3.1 never unloads a kernel's library (25 kB, 4 maps); 7.1 keeps the last 128.
        ("opencl", 50, 100, 80 << 10),
    ],
)
def test_thousands_of_kernels_leave_no_memory(
    backend: str, warm: int, count: int, most: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert bytes_of_a_kernel(backend, warm, count, tmp_path, monkeypatch) < most
