"""What a whole call costs, from the caller's array to the caller's array, against the same by hand.

    python tests/benchmarks/bench_frames.py [runs]

Black and white at 1920 x 1080: bytes in, and bytes, bytes in a given array, or float32 out.  By hand: a texture
written, one triangle, the framebuffer read (moderngl, in the same context); memory mapped and written, one kernel,
memory mapped and read (pyopencl, in the same queue).  Medians of interleaved runs; the ratio is that of neighbours in
time.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import moderngl
import numpy as np

import passgraph as pg
from passgraph.backends.base import Backend
from passgraph.backends.gl import GLBackend
from passgraph.backends.opencl import OpenCLBackend

sys.path.insert(0, str(Path(__file__).parent))
from bench_gl import BLACK_AND_WHITE, BLACK_AND_WHITE_GLSL, FULLSCREEN_GLSL, SIZE, WEIGHTS
from harness import Ratio, interleaved, ratio_of

SHAPE = (SIZE[1], SIZE[0], 4)
#: The most that a whole call may take in units of the one by hand.
WANTED = 1.1
#: What the result is → as what, and whether in an array that is there already.
RESULTS = {"rgba8 out": (np.uint8, False), "rgba8 into=": (np.uint8, True), "float32 out": (np.float32, False)}
#: A run of pixels in each work-item, as PoCL wants it (passgraph/backends/opencl/pixel.py).
RUN = 128
BLACK_AND_WHITE_CL = f"""
__kernel void black_and_white(__global const uchar* restrict in, __global NUMBER* restrict out, float4 weights)
{{
    int first = (get_global_id(1) * {SIZE[0]} + get_global_id(0) * {RUN}) * 4;
    for (int i = first; i < first + {RUN} * 4; i += 4) {{
        float y = in[i] / 255.0f * weights.x + in[i + 1] / 255.0f * weights.y + in[i + 2] / 255.0f * weights.z;
        NUMBER gray = STORED(y);
        out[i] = gray; out[i + 1] = gray; out[i + 2] = gray; out[i + 3] = KEPT(in[i + 3]);
    }}
}}
"""
STORING = {
    np.uint8: ["-DNUMBER=uchar", "-DSTORED(x)=convert_uchar_sat_rte((x)*255.0f)", "-DKEPT(x)=(x)"],
    np.float32: ["-DNUMBER=float", "-DSTORED(x)=(rint(clamp(x,0.0f,1.0f)*255.0f)/255.0f)", "-DKEPT(x)=((x)/255.0f)"],
}

Call = Callable[[np.ndarray[Any, Any], Any, Any], Any]


def gl_by_hand(backend: GLBackend) -> Call:
    """What turns a frame into a result of a type, in an array where one is given."""
    with backend.context:
        context = moderngl.create_context(context=backend.context.native)
        read, written = context.texture(SIZE, 4), context.texture(SIZE, 4)
        read.filter = (moderngl.NEAREST, moderngl.NEAREST)
        program = context.program(vertex_shader=FULLSCREEN_GLSL, fragment_shader=BLACK_AND_WHITE_GLSL)
        program["weights"] = WEIGHTS
        framebuffer, triangle = context.framebuffer([written]), context.vertex_array(program, [])

    def call(frame: Any, kind: Any, room: Any) -> Any:
        made = np.empty(SHAPE, kind) if room is None else room
        with backend.context:
            read.write(frame)
            framebuffer.use()
            read.use(0)
            triangle.render(moderngl.TRIANGLES, vertices=3)
            framebuffer.read_into(made, components=4, dtype="f1" if kind is np.uint8 else "f4")
        return made

    return call


def opencl_by_hand(backend: OpenCLBackend) -> Call:
    cl, queue = backend.cl, backend.queue
    flags, pixels = cl.mem_flags.READ_WRITE, SIZE[0] * SIZE[1]
    frames = cl.Buffer(backend.context, flags, 4 * pixels)
    kernels, results = {}, {}
    for kind, options in STORING.items():
        built = cl.Program(backend.context, BLACK_AND_WHITE_CL).build([*backend.programs.options, *options])
        results[kind] = cl.Buffer(backend.context, flags, 4 * pixels * np.dtype(kind).itemsize)
        kernels[kind] = cl.Kernel(built, "black_and_white")
        kernels[kind].set_args(frames, results[kind], cl.cltypes.make_float4(*WEIGHTS, 0))

    def call(frame: Any, kind: Any, room: Any) -> Any:
        made = np.empty(SHAPE, kind) if room is None else room
        mapped, _ = cl.enqueue_map_buffer(queue, frames, cl.map_flags.WRITE_INVALIDATE_REGION, 0, SHAPE, np.uint8)
        np.copyto(mapped, frame)
        mapped.base.release(queue)
        cl.enqueue_nd_range_kernel(queue, kernels[kind], (SIZE[0] // RUN, SIZE[1]), (SIZE[0] // RUN, 4))
        mapped, _ = cl.enqueue_map_buffer(queue, results[kind], cl.map_flags.READ, 0, SHAPE, np.dtype(kind))
        np.copyto(made, mapped)
        mapped.base.release(queue)
        queue.finish()
        return made

    return call


def ours(backend: Backend) -> Call:
    output = pg.kernel(source=BLACK_AND_WHITE)(pg.Input("color"), WEIGHTS, into=pg.target("out", "rgba8"))
    stored, values = (pg.compile(output, backend=backend, results=kind) for kind in ("stored", "float32"))

    def call(frame: Any, kind: Any, room: Any) -> Any:
        program = stored if kind is np.uint8 else values
        return program(into=None if room is None else {"out": room}, color=frame)["out"]

    return call


def ratios(runs: int = 41) -> list[Ratio]:
    """A whole call of each device over the same by hand, for each kind of result."""
    found = []
    frame = np.random.default_rng(1).integers(0, 256, SHAPE, np.uint8)
    hands: dict[type[Any], Callable[[Any], Call]] = {GLBackend: gl_by_hand, OpenCLBackend: opencl_by_hand}
    for opened, by_hand in hands.items():
        with opened() as backend:
            mine, hand = ours(backend), by_hand(backend)
            for what, (kind, given) in RESULTS.items():
                room = np.empty(SHAPE, kind) if given else None
                made = mine(frame, kind, room).copy()
                difference = float(np.abs(made.astype(np.float64) - hand(frame, kind, room)).max())
                jobs = {"ours": partial(mine, frame, kind, room), "hand": partial(hand, frame, kind, room)}
                times = interleaved(jobs, runs, 3)
                ratio = ratio_of(f"{backend.name}, {what} / by hand", times["ours"], times["hand"], WANTED)
                print(
                    f"{backend.name}, {what}: {ratio.ms:.2f} ms, by hand {ratio.other_ms:.2f} ms, "
                    f"ratio {ratio.got:.3f}, largest difference {difference:.1e}"
                )
                found.append(ratio)
    return found


if __name__ == "__main__":
    ratios(int(sys.argv[1]) if len(sys.argv) > 1 else 41)
