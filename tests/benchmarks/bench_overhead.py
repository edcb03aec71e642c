"""What a pass costs besides its pixels: the host's time, from graphs of many passes over one small picture.

    python tests/benchmarks/bench_overhead.py

Time of a run with many passes less that of a run with one, over the number of passes more; a run ends when the
device has finished.  Passes are not fused, and each has a parameter that changes from run to run.

Beside gl stands what the driver alone takes for the same passes, each no more than a framebuffer, a texture, a uniform
and a draw: llvmpipe wakes its threads and waits for them wherever a pass reads what the last one wrote.
"""

from __future__ import annotations

import statistics
import sys
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import moderngl
import numpy as np

import passgraph as pg

sys.path.insert(0, str(Path(__file__).parent))
from harness import Job, Ratio, interleaved

#: Pixels of the picture: a single texel, so that a pass has next to nothing to compute.
SIZE = (1, 1)
FEW, MANY = 1, 41
#: Microseconds a pass on the host.
WANTED = 30.0
EGL: dict[str, Any] = {"backend": "egl"} if sys.platform == "linux" else {}
CORNERS = """#version 330 core
void main() { gl_Position = vec4(vec2(gl_VertexID & 1, gl_VertexID >> 1) * 4.0 - 1.0, 0.0, 1.0); }
"""
TIMES = """#version 330 core
uniform sampler2D image; uniform float by; out vec4 result;
void main() { result = texelFetch(image, ivec2(gl_FragCoord.xy), 0) * by; }
"""
STEP = pg.kernel(source="def step(c: Image, by: float) -> vec4: return c[0, 0] * by")


def program(passes: int, backend: str, size: tuple[int, int] = SIZE) -> pg.Program:
    """A chain of passes, none of them fused."""
    target: pg.Input | pg.Target = pg.Input("frame", "rgba32f", size, static=True)
    by = pg.Value("by", float)
    for number in range(passes):
        target = STEP(target, by, into=pg.target(f"step{number}", "rgba32f"))
    return pg.compile(target, backend=backend, options=pg.Options(fuse=False))


def runs(made: pg.Program, size: tuple[int, int] = SIZE) -> Job:
    """One run with another value each time."""
    picture = np.ones((size[1], size[0], 4), np.float32)
    values = iter(range(1 << 30))

    def run() -> None:
        made.run(frame=picture, by=1.0 + 1e-6 * next(values))
        made.finish()

    return run


def bare(passes: int, context: Any) -> Job:
    """The same passes by hand, as few calls as OpenGL allows."""
    step = context.program(vertex_shader=CORNERS, fragment_shader=TIMES)
    triangle = context.vertex_array(step, [])
    places = [context.texture(SIZE, 4, dtype="f4") for _ in range(2)]
    framebuffers = [context.framebuffer([place]) for place in places]
    values = iter(range(1 << 30))

    def run() -> None:
        by = 1.0 + 1e-6 * next(values)
        for number in range(passes):
            framebuffers[number & 1].use()
            places[1 - (number & 1)].use(0)
            step["by"] = by
            triangle.render(vertices=3)
        context.finish()

    return run


def each_us(few: list[float], many: list[float]) -> float:
    """Microseconds of one pass, from milliseconds of few and of many."""
    return statistics.median(1e3 * (b - a) / (MANY - FEW) for a, b in zip(few, many, strict=True))


def ratios(rounds: int = 41) -> list[Ratio]:
    found = []
    for backend in ("numpy", "gl", "opencl"):
        with ExitStack() as stack:
            few, many = (stack.enter_context(program(passes, backend)) for passes in (FEW, MANY))
            jobs = {"few": runs(few), "many": runs(many)}
            if backend == "gl":
                context = moderngl.create_context(standalone=True, **EGL)
                stack.callback(context.release)
                jobs |= {"driver, few": bare(FEW, context), "driver, many": bare(MANY, context)}
            times = interleaved(jobs, rounds, warm_up=3)
        each = each_us(times["few"], times["many"])
        what = f"a pass of one pixel, {backend}"
        wanted: float | None = WANTED
        if backend == "gl":
            # Nobody's passes take less than the driver does.
            alone = each_us(times["driver, few"], times["driver, many"])
            found.append(Ratio(f"{what}, less the driver's own", each - alone, WANTED, unit="µs"))
            what, wanted = f"{what}, with the driver's own", None
        found.append(Ratio(what, each, wanted, unit="µs"))
    for ratio in found:
        print(f"{ratio.what:50}{ratio.got:7.1f} µs")
    return found


if __name__ == "__main__":
    ratios()
