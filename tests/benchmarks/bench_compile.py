"""How long a graph takes to compile: cold, and in a second process that finds compiled code on disk.

    python tests/benchmarks/bench_compile.py [MODEL ...]

The fixed part of the rasteriser is compiled once after installation; the first column shows it on top.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile

SCRIPT = """
import sys, time
import passgraph as pg
from passgraph.effects import soft_shadow
scene = pg.Scene.load(sys.argv[2]) if len(sys.argv) > 2 else pg.Scene.shipped()
begin = time.perf_counter()
program = pg.compile(soft_shadow(scene), backend=sys.argv[1], size=(640, 360))
print(time.perf_counter() - begin)
program.close()
"""


def seconds(backend: str, model: str | None, cache: str) -> float:
    environment = {**os.environ, "PASSGRAPH_CACHE": cache, "NUMBA_CACHE_DIR": cache}
    command = [sys.executable, "-c", SCRIPT, backend, *([model] if model else [])]
    return float(subprocess.run(command, env=environment, capture_output=True, text=True, check=True).stdout)


def main() -> None:
    models: list[str | None] = [None, *sys.argv[1:]]
    for model in models:
        for backend in ("numpy", "gl", "opencl"):
            with tempfile.TemporaryDirectory() as cache:
                times = [seconds(backend, model, cache) for _ in range(3)]
            name = os.path.basename(model) if model else "shipped scene"
            print(f"{name:24} {backend:7} cold {times[0]:5.2f} s   warm {min(times[1:]):5.2f} s")


if __name__ == "__main__":
    main()
