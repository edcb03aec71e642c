"""Generated OpenCL C against the same kernels written by hand: python tests/benchmarks/bench_opencl.py

Both run in this process on the same buffers, alternately; medians.  Ratios above 1.1 exit with status 1.
"""

from __future__ import annotations

import statistics
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np

import passgraph as pg
from passgraph import Array, Image, dot, mat4, vec3, vec4
from passgraph.backends.opencl import OpenCLBackend
from passgraph.scene.teapot import teapot_mesh

sys.path.insert(0, str(Path(__file__).parent))
from harness import Ratio, interleaved, ratio_of

WIDTH, HEIGHT = 1920, 1080
ROUNDS = 25
#: The most that a generated kernel may take in units of the one written by hand: what is wanted, and what fails.
WANTED, LIMIT = 1.05, 1.1

BY_HAND = """
#pragma OPENCL FP_CONTRACT OFF
#define PICTURES __global const float4* restrict in, __global float4* restrict out

__kernel void black_and_white(PICTURES, float4 weights)
{
    int i = get_global_id(1) * WIDTH + get_global_id(0);
    float4 c = in[i];
    float y = c.x * weights.x + c.y * weights.y + c.z * weights.z;
    out[i] = (float4)(y, y, y, c.w);
}

__kernel void across(PICTURES, __constant float* restrict weights)
{
    int x = get_global_id(0), row = get_global_id(1) * WIDTH;
    float4 total = 0.0f;
    for (int i = 0; i < 15; ++i) { total += in[row + clamp(x + i - 7, 0, WIDTH - 1)] * weights[i]; }
    out[row + x] = total;
}

__kernel void down(PICTURES, __constant float* restrict weights)
{
    int x = get_global_id(0), y = get_global_id(1);
    float4 total = 0.0f;
    for (int i = 0; i < 15; ++i) { total += in[clamp(y + i - 7, 0, HEIGHT - 1) * WIDTH + x] * weights[i]; }
    out[y * WIDTH + x] = total;
}
"""


@pg.kernel
def black_and_white(color: Image, weights: vec3 = (0.2126, 0.7152, 0.0722)) -> vec4:  # type: ignore[assignment]
    c = color[0, 0]
    y = dot(c.rgb, weights)
    return vec4(y, y, y, c.a)


@pg.kernel
def across(color: Image, weights: Array[float, 15]) -> vec4:  # type: ignore[valid-type]
    total = vec4(0.0)
    for i in range(15):
        total += color[i - 7, 0] * weights[i]
    return total


@pg.kernel
def down(color: Image, weights: Array[float, 15]) -> vec4:  # type: ignore[valid-type]
    total = vec4(0.0)
    for i in range(15):
        total += color[0, i - 7] * weights[i]
    return total


@pg.struct
class Surface:
    position: vec4
    normal: vec3


@pg.vertex
def place(vertex: pg.Vertex, matrix: mat4) -> Surface:
    return Surface(matrix * vec4(vertex.position, 1.0), vertex.normal)


@pg.fragment
def lambert(surface: Surface) -> vec4:
    return vec4(vec3(max(dot(pg.normalize(surface.normal), vec3(0.0, 0.6, 0.8)), 0.0)), 1.0)


def pixel_ratios(device: OpenCLBackend, rounds: int = ROUNDS) -> list[Ratio]:
    """Generated over hand-written, for each kernel."""
    cl, queue = device.cl, device.queue
    built = cl.Program(device.context, BY_HAND).build(
        [f"-DWIDTH={WIDTH}", f"-DHEIGHT={HEIGHT}", *device.programs.options]
    )
    taps = np.exp(-(np.linspace(-2, 2, 15) ** 2)).astype(np.float32)
    taps /= taps.sum()
    frame = pg.Input("frame", "rgba32f", (WIDTH, HEIGHT), static=True)
    found = []
    picture = np.random.default_rng(0).random((HEIGHT, WIDTH, 4), np.float32)
    for name, kernel, values in (
        ("black_and_white", black_and_white, {}),
        ("across", across, {"weights": taps}),
        ("down", down, {"weights": taps}),
    ):
        target = kernel(frame, into=pg.target(name, "rgba32f"), **values)
        options = pg.Options(static=False)
        with pg.compile(target, backend=device, options=options) as program:
            program.run(frame=picture)  # which lends no array for the result
            execution = program._execution
            assert execution is not None
            device.upload(execution.storages.memories[0], picture)  # the run read it where it lay
            buffers = [storage.buffer for storage in execution.storages.memories]
            flags = cl.mem_flags.READ_ONLY | cl.mem_flags.COPY_HOST_PTR
            weights = (
                np.array([(0.2126, 0.7152, 0.0722, 0)], np.float32)
                if name == "black_and_white"
                else cl.Buffer(device.context, flags, hostbuf=taps)
            )
            written = cl.Kernel(built, name)
            written.set_args(*buffers, weights)
            step = execution.units[0].execute

            def by_hand(written: object = written) -> None:
                cl.enqueue_nd_range_kernel(queue, written, (WIDTH, HEIGHT), None)
                queue.finish()

            def generated(step: Callable[[dict[object, object]], None] = step) -> None:
                step({})
                queue.finish()

            ours = program.read()[name]
            by_hand()
            difference = float(np.abs(program.read()[name] - ours).max())
            # A pass at the speed of memory is short and feels what else runs: take more of it.
            turns = 6 * rounds if name == "black_and_white" else rounds
            times = interleaved({"hand": by_hand, "ours": generated}, turns)
        ratio = ratio_of(f"{name}, opencl / written by hand", times["ours"], times["hand"], WANTED)
        print(f"{name:16} by hand {ratio.other_ms:7.2f} ms   generated {ratio.ms:7.2f} ms   ratio {ratio.got:.2f}"
              f"   largest difference {difference:.1e}")  # fmt: skip
        found.append(ratio)
    return found


def draw_times(device: OpenCLBackend) -> None:
    """A teapot at 1280x720, one work-item a tile and one work-item a pixel."""
    mesh = teapot_mesh(33)
    size = 1280, 720
    near, far, cotangent = 0.1, 100.0, 1 / np.tan(0.4)
    matrix = np.array([
        [cotangent * size[1] / size[0], 0, 0, 0],
        [0, cotangent, 0, -1.5 * cotangent],
        [0, 0, (far + near) / (near - far), 2 * far * near / (near - far) - 8 * (far + near) / (near - far)],
        [0, 0, -1, 8],
    ])  # fmt: skip
    kept = device.is_cpu
    for serial in (True, False):
        device.is_cpu = serial
        drawn = pg.draw(
            mesh, vertex=place, fragment=lambert, into=pg.target("color", "rgba16f", size), cull="back",
            depth=pg.target("depth", "depth32f", size), values={"matrix": matrix},
        )  # fmt: skip
        with pg.compile(drawn, backend=device, options=pg.Options(static=False)) as program:
            program()

            def run(program: pg.Program = program) -> None:
                program.run()
                device.finish()

            spent = statistics.median(interleaved({"draw": run}, ROUNDS)["draw"])
        how = "one work-item a tile" if serial else "one work-item a pixel"
        print(f"{len(mesh.triangles):,} triangles at {size[0]}x{size[1]}, {how}: {spent:.2f} ms")
    device.is_cpu = kept


def ratios(rounds: int = ROUNDS) -> list[Ratio]:
    with OpenCLBackend() as device:
        return pixel_ratios(device, rounds)


def main() -> int:
    with OpenCLBackend(sys.argv[1] if len(sys.argv) > 1 else None) as device:
        print(device.device.name.strip())
        found = pixel_ratios(device)
        draw_times(device)
    return int(any(ratio.got > LIMIT for ratio in found))


if __name__ == "__main__":
    sys.exit(main())
