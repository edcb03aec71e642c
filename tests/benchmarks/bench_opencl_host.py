"""Runs on a caller's queue and buffers against the same kernels enqueued by hand.

    python tests/benchmarks/bench_opencl_host.py

Both are the kernels that a run enqueues, with the same arguments, in the same queue; by hand nothing else is done.
Frames are enqueued one behind the other, and the queue is waited for after each batch.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np

import passgraph as pg
from passgraph.effects import black_and_white, gaussian_blur

sys.path.insert(0, str(Path(__file__).parent))
from harness import Job, Ratio, interleaved, ratio_of

SIZE = (1280, 720)
#: Milliseconds of a batch, about, and the most that a run may take in units of what is enqueued by hand.
BATCH_MS, WANTED = 40, 1.05


def jobs(effect: str, format_: str) -> tuple[dict[str, Job], Any]:
    """A batch of frames by hand, and by a program on the caller's buffers; and what to close."""
    import pyopencl as cl

    queue = cl.CommandQueue(cl.create_some_context(interactive=False))
    frame, into = pg.Input("frame"), pg.target("made", format_)
    gray = effect == "black and white"
    graph = black_and_white(frame, into=into) if gray else gaussian_blur(frame, 3.0, 7, into=into)
    host = pg.opencl.Host(queue)
    program = pg.compile(graph, backend=host)
    width, height = SIZE
    pixels = np.random.default_rng(1).random((height, width, 4), np.float32)
    number = np.dtype(pg.formats.FORMATS[format_].number)
    given = (pixels * 255).astype(number) if number.kind == "u" else pixels
    buffers = [cl.Buffer(queue.context, cl.mem_flags.READ_WRITE, given.nbytes) for _ in range(2)]
    cl.enqueue_copy(queue, buffers[0], given)
    source, sink = (host.buffer(buffer, SIZE, format_) for buffer in buffers)
    enqueued: list[tuple[Any, ...]] = []

    def run() -> None:
        program.run(frame=source, into={"made": sink})

    run()
    real = cl.enqueue_nd_range_kernel
    with patch.object(cl, "enqueue_nd_range_kernel", lambda *given: enqueued.append(given) or real(*given)):
        run()
    queue.finish()

    def by_hand() -> None:
        for given in enqueued:
            real(*given)

    def batch(one: Job, count: int) -> Job:
        def enqueue() -> None:
            for _ in range(count):
                one()
            queue.finish()

        return enqueue

    took = float(np.median(interleaved({"frame": batch(by_hand, 1)}, 5)["frame"]))
    count = max(1, round(BATCH_MS / took))
    return {"by hand": batch(by_hand, count), "host": batch(run, count)}, (program, host)


def ratios(rounds: int) -> list[Ratio]:
    found = []
    for format_ in ("rgba8", "rgba32f"):
        for effect in ("black and white", "15-tap blur"):
            made, (program, host) = jobs(effect, format_)
            times = interleaved(made, rounds, warm_up=3)
            what = f"{effect}, {format_}, on a caller's OpenCL queue / enqueued by hand"
            found.append(ratio_of(what, times["host"], times["by hand"], WANTED))
            program.close()
            host.close()
    return found


if __name__ == "__main__":
    for ratio in ratios(25):
        print(f"{ratio.got:.3f} × (≤ {WANTED}): {ratio.what}; batches of {ratio.ms:.1f} and {ratio.other_ms:.1f} ms")
