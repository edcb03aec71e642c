"""A caller of OpenCL, for tests of hosts: their memory, and what a graph makes of it."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import passgraph as pg

cl = pytest.importorskip("pyopencl")

SIZE = (160, 24)  # rows longer than a run of pixels on CPUs
WIDTH, HEIGHT = SIZE


def photo(channels: int = 4, dtype: Any = np.uint8, size: tuple[int, int] = SIZE) -> Any:
    top = 1 if np.dtype(dtype).kind == "f" else np.iinfo(dtype).max
    return (np.random.default_rng(5).random((size[1], size[0], channels)) * top).astype(dtype)


#: Reads around each pixel, and compiles in little time.
SOFT = pg.kernel(
    source="""
def soft(color: Image) -> vec4:
    return color[0, 0] * 0.25 + color[-2, 1] * 0.25 + color[1, -3] * 0.5
"""
)


def soft(format: str = "rgba8", frame: pg.Target | None = None) -> pg.Target:
    made: pg.Target = SOFT(frame or pg.Input("frame"), into=pg.target("soft", format))
    return made


def expected(graph: pg.Target, given: Any, **values: Any) -> Any:
    """What another backend makes of it: weights are powers of two, so that sums round alike."""
    with pg.compile(graph, results="stored") as program:
        return next(iter(program(frame=given, **values).values()))


def to_device(queue: Any, array: Any, flags: Any = None) -> Any:
    flags = cl.mem_flags.READ_WRITE if flags is None else flags
    return cl.Buffer(queue.context, flags | cl.mem_flags.COPY_HOST_PTR, hostbuf=np.ascontiguousarray(array))


def from_device(queue: Any, buffer: Any, like: Any) -> Any:
    made = np.empty_like(like)
    cl.enqueue_copy(queue, made, buffer)
    return made
