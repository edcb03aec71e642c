"""How long a graph takes to compile: the first ever, a new one later, and one that was compiled by another process.

    python tests/benchmarks/bench_compile.py [MODEL ...]

The first draw after installing also compiles the fixed part of the numpy rasteriser, which stays on disk for all.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile

PRIME = """
import passgraph as pg
text = '''
class Corner:
    position: vec4

def place(vertex: Vertex) -> Corner:
    return Corner(vec4(vertex.position, 1.0))

def paint(corner: Corner) -> vec4:
    return vec4(1.0)
'''
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


def run(script: str, arguments: list[str], cache: str) -> str:
    environment = {**os.environ, "PASSGRAPH_CACHE": cache, "NUMBA_CACHE_DIR": cache}
    command = [sys.executable, "-c", script, *arguments]
    return subprocess.run(command, env=environment, capture_output=True, text=True, check=True).stdout


def main() -> None:
    models: list[str | None] = [None, *sys.argv[1:]]
    for model in models:
        for backend in ("numpy", "gl", "opencl"):
            arguments = [backend, *([model] if model else [])]
            with tempfile.TemporaryDirectory() as cache:
                first = float(run(SCRIPT, arguments, cache))
            with tempfile.TemporaryDirectory() as cache:
                run(PRIME, [], cache)
                cold, *warm = (float(run(SCRIPT, arguments, cache)) for _ in range(3))
            name = os.path.basename(model) if model else "shipped scene"
            print(f"{name:24} {backend:7} first {first:5.2f} s   cold {cold:5.2f} s   warm {min(warm):5.2f} s")


if __name__ == "__main__":
    main()
