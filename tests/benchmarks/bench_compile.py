"""How long a graph takes to compile: the first ever, a new one later, and one that was compiled by another process.

    python tests/benchmarks/bench_compile.py [MODEL ...]

A soft shadow of the shipped scene and of models, and a shader of 15,000 instructions (tests/shaders/inks.glsl).
Medians of five processes each.  The first draw after installing also compiles the fixed part of the numpy rasteriser,
which stays on disk for all.
"""

from __future__ import annotations

import os
import shutil
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from tests.corners import placed

KERNELS = placed("""
def paint(corner: Corner) -> vec4:
    return vec4(1.0)
""")
PRIME = """
import sys
import passgraph as pg
text = sys.argv[1]
mesh = pg.Mesh.make([[-1, -1, 0], [1, -1, 0], [0, 1, 0]], [[0, 1, 2]])
place, paint = pg.vertex(source=text, name="place"), pg.fragment(source=text, name="paint")
with pg.compile(pg.draw(mesh, vertex=place, fragment=paint, into=pg.target("out")), size=(8, 8)) as program:
    program()
"""
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
SHADER = """
import sys, time
import numpy as np
import passgraph as pg
effect = pg.load_shader(sys.argv[2])
begin = time.perf_counter()
frame = pg.Input("picture", "rgba32f", (640, 360))
program = pg.compile(effect(frame, extent=(640.0, 360.0), pitch=4.0, mark=1), backend=sys.argv[1], size=(640, 360))
program(picture=np.zeros((360, 640, 4), np.float32))   # PoCL compiles at the first run
print(time.perf_counter() - begin)
program.close()
"""


ROUNDS = 5
INKS = Path(__file__).resolve().parents[1] / "shaders" / "inks.glsl"


def run(script: str, arguments: list[str], cache: str) -> str:
    # The caches of graphics drivers lie in the same folder, and Python keeps its own code as it does for users.
    environment = {**os.environ, "PASSGRAPH_CACHE": f"{cache}/passgraph", "XDG_CACHE_HOME": cache}
    environment.pop("PYTHONDONTWRITEBYTECODE", None)
    command = [sys.executable, "-c", script, *arguments]
    return subprocess.run(command, env=environment, capture_output=True, text=True, check=True).stdout


def measure(script: str, backend: str, file: str | None) -> tuple[float, float, float]:
    """Seconds of the first compilation ever, of a new graph's, and of one that another process compiled."""
    arguments = [backend, *([file] if file else [])]
    with tempfile.TemporaryDirectory() as cache:
        first = float(run(script, arguments, cache))
    cold, warm = [], []
    with tempfile.TemporaryDirectory() as primed:
        run(PRIME, [KERNELS], primed)
        for _ in range(ROUNDS):
            with tempfile.TemporaryDirectory() as folder:
                cache = shutil.copytree(primed, f"{folder}/cache")
                cold.append(float(run(script, arguments, cache)))
                warm.append(float(run(script, arguments, cache)))
    return first, statistics.median(cold), statistics.median(warm)


def main() -> None:
    for script, file in ((SCRIPT, None), *((SCRIPT, model) for model in sys.argv[1:]), (SHADER, str(INKS))):
        for backend in ("numpy", "gl", "opencl"):
            first, cold, warm = measure(script, backend, file)
            name = os.path.basename(file) if file else "shipped scene"
            print(f"{name:24} {backend:7} first {first:5.2f} s   cold {cold:5.2f} s   warm {warm:6.3f} s")


if __name__ == "__main__":
    main()
