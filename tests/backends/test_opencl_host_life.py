"""A caller's OpenCL: what is ours goes, what is theirs stays as it was."""

from __future__ import annotations

import gc
import mmap
import os
import re
import subprocess
import sys
import time
import tracemalloc
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import passgraph as pg
from passgraph.formats import FORMATS
from passgraph.hosts.opencl import Host
from tests.backends.opencl_caller import SIZE, cl, expected, from_device, photo, soft, to_device
from tests.conftest import require

pytestmark = pytest.mark.opencl

#: PoCL 7 loses the last command of a buffer, with its queue, when another command uses the buffer after a sub-buffer of
#: it (lib/CL/pocl_util.c, `last_updater`).  About one in ten thousand such commands ends the process there.
LOSES_COMMANDS = re.compile(r"PoCL 7\.")


# What is left


def references(queue: Any, *memory: Any) -> list[int]:
    """Of the context, the queue and memory, after a command of the caller's: drivers keep the last one of each.

    0 of a queue that the driver loses.
    """
    gc.collect()
    for one in memory:
        cl.enqueue_fill_buffer(queue, one, np.uint8(7), 0, one.size)
    queue.finish()
    queues = 0 if LOSES_COMMANDS.search(queue.device.platform.version) else queue.reference_count
    return [queue.context.reference_count, queues, *(one.reference_count for one in memory)]


def becomes(expected: list[int], queue: Any, *memory: Any) -> bool:
    """Whether the counts come to that: drivers let go of what a command used a moment after it is done."""
    for _ in range(100):
        if references(queue, *memory) == expected:
            return True
        time.sleep(0.02)
    return False


@pytest.mark.parametrize("closed", ["program", "host", "nothing"])
def test_nothing_of_ours_stays_in_the_context(context: Any, queue: Any, closed: str) -> None:
    from pyopencl import array

    given, room, held = array.to_device(queue, photo()), array.to_device(queue, photo()), to_device(queue, photo())
    before = references(queue, given.base_data, room.base_data, held)
    host = Host(queue)
    program = pg.compile(soft(), backend=host)
    for offset in range(0, 12, 4):
        small = host.buffer(held, (80, 20), "rgba8", offset=offset)
        program.run(frame=given, into={"soft": room})
        program.run(frame=small, into={"soft": host.buffer(held, (80, 20), "rgba8", offset=8000)})
    assert references(queue, given.base_data, room.base_data, held) != before
    del small
    if closed == "program":
        program.close()
        host.close()
    elif closed == "host":
        host.close()
    del program, host
    assert becomes(before, queue, given.base_data, room.base_data, held)
    assert (given.get() == 7).all()


def test_memory_that_the_caller_releases_stays_until_the_picture_goes(queue: Any, host: Host) -> None:
    base = photo()
    given, room = to_device(queue, base), to_device(queue, base)
    picture = host.buffer(given, SIZE, "rgba8")
    with pg.compile(soft(), backend=host) as program:
        program.run(frame=picture, into={"soft": host.buffer(room, SIZE, "rgba8")})
        given.release()
        program.run(frame=picture, into={"soft": host.buffer(room, SIZE, "rgba8")})
    assert np.array_equal(from_device(queue, room, base), expected(soft(), base))


def test_a_run_that_fails_gives_everything_back(queue: Any, host: Host) -> None:
    given, room = to_device(queue, photo()), to_device(queue, photo())

    def failing(_: float) -> float:
        raise ZeroDivisionError

    scaled = pg.kernel(source="def scaled(color: Image, by: float) -> vec4: return color[0, 0] * by")
    graph = scaled(pg.Input("frame"), pg.Value("by", float).map(failing), into=pg.target("scaled", "rgba8"))
    with pg.compile(graph, backend=host) as program:
        for _ in range(3):
            with pytest.raises(ZeroDivisionError):
                program.run(
                    frame=host.buffer(given, SIZE, "rgba8"), by=1.0, into={"scaled": host.buffer(room, SIZE, "rgba8")}
                )
        gc.collect()
        known, _, copies, written = host.borrowed.counts
        assert host._depth == copies == written == 0 and known <= 2
    assert given.reference_count == 1 == room.reference_count


def resident_bytes() -> int:
    return int(Path("/proc/self/statm").read_text().split()[1]) * mmap.PAGESIZE


@pytest.mark.skipif(not Path("/proc/self/statm").exists(), reason="memory of a process is told by /proc")
def test_ten_thousand_frames_leave_nothing_behind(queue: Any, host: Host) -> None:
    from pyopencl import array

    if LOSES_COMMANDS.search(queue.device.platform.version):
        pytest.skip("this driver loses commands on parts of a buffer, and ends the process over one")
    size = (16, 8)
    ring = [array.to_device(queue, photo(size=size)) for _ in range(3)]
    room = to_device(queue, photo(size=(16, 32)))

    def frames(count: int) -> None:
        for number in range(count):
            into = host.buffer(room, size, "rgba8", offset=number % 3 * 64)
            program.run(frame=ring[number % 3], into={"soft": into})
        queue.finish()

    def held() -> list[int]:
        gc.collect()
        return [len(host.alive), queue.context.reference_count, room.reference_count, *host.borrowed.counts]

    with pg.compile(soft(), backend=host) as program:
        frames(1_000)
        tracemalloc.start()
        frames(50)
        before, traced, resident = held(), tracemalloc.get_traced_memory()[0], resident_bytes()
        frames(500)
        gc.collect()
        grown = tracemalloc.get_traced_memory()[0] - traced
        tracemalloc.stop()
        frames(8_450)
        assert held() == before
        assert host.borrowed.counts[1:] == (3, 0, 0)
        assert grown < 20_000  # bytes of Python
        assert resident_bytes() - resident < 4 << 20


def test_closed_hosts_say_so(queue: Any) -> None:
    host = Host(queue)
    picture = host.buffer(to_device(queue, photo()), SIZE, "rgba8")
    program = pg.compile(soft(), backend=host)
    host.close()
    host.close()
    with pytest.raises(pg.BackendError, match="this opencl backend was closed"):
        program.run(frame=picture)
    with pytest.raises(pg.BackendError, match="this opencl backend was closed"):
        host.event()
    assert FORMATS["rgba8"] is picture.format


MANY_DEVICES = """
import numpy as np, pyopencl as cl, passgraph as pg
devices = [d for p in cl.get_platforms() if "Portable" in p.name for d in p.get_devices()]
if len(devices) < 2:
    raise SystemExit(f"{len(devices)} devices of PoCL")
context = cl.Context(devices)
kernel = pg.kernel(source="def twice(c: Image) -> vec4: return c[0, 0] * 2.0")
for device in devices:
    queue = cl.CommandQueue(context, device)
    pixels = np.full((2, 200, 4), 3, np.uint8)
    given = cl.Buffer(context, cl.mem_flags.COPY_HOST_PTR, hostbuf=pixels)
    twice = kernel(pg.Input("f"), into=pg.target("t", "rgba8"))
    with pg.opencl.Host(queue) as host, pg.compile(twice, host) as program:
        picture = host.buffer(given, (200, 2), "rgba8", order="bgra")
        program.run(f=picture, into={"t": picture})
        made = np.empty_like(pixels)
        cl.enqueue_copy(queue, made, given)
        assert (made == 6).all() and host.device == device
"""


def test_a_context_of_several_devices() -> None:
    """PoCL makes two of one processor; the queue says which is meant."""
    require("opencl")
    environment = {**os.environ, "POCL_DEVICES": "pthread basic", "PYTHONPATH": str(Path(__file__).parents[2])}
    ran = subprocess.run(
        [sys.executable, "-c", MANY_DEVICES], env=environment, capture_output=True, text=True, check=False
    )
    if "devices of PoCL" in ran.stderr:
        pytest.skip("PoCL is not here, or makes one device of a processor")
    assert ran.returncode == 0, ran.stderr[-2000:]


def test_a_forked_process_leaves_the_callers_queue_alone(queue: Any, host: Host) -> None:
    with pg.compile(soft(), backend=host) as program:
        program.run(frame=photo())
        child = os.fork()
        if child == 0:
            try:
                program.run(frame=photo())
            except pg.BackendError as error:
                program.close()
                host.close()
                os._exit(0 if "forked" in str(error) else 1)
            os._exit(2)
        assert os.waitpid(child, 0)[1] == 0
        assert program(frame=photo())["soft"].any()
