"""A caller's OpenCL queue: runs come in its order, and nothing waits for them."""

from __future__ import annotations

import threading
from typing import Any

import numpy as np
import pytest

import passgraph as pg
from passgraph.hosts.opencl import Host
from tests.backends.opencl_caller import HEIGHT, SIZE, WIDTH, cl, expected, from_device, photo, soft, to_device

pytestmark = pytest.mark.opencl


SCALE = "__kernel void scale(__global uchar* a, uchar by) { a[get_global_id(0)] = a[get_global_id(0)] * by; }"


# The caller's queue


def slow(queue: Any, value: int, array: Any) -> None:
    """Many commands, of which each reads what the last one wrote."""
    kernel = cl.Kernel(cl.Program(queue.context, SCALE).build(), "scale")
    wait = None
    for _ in range(50):
        kernel.set_args(array, np.uint8(value))
        wait = [cl.enqueue_nd_range_kernel(queue, kernel, (WIDTH * HEIGHT * 4,), None, wait_for=wait)]


@pytest.mark.parametrize("unordered", [False, True])
def test_runs_come_behind_what_is_enqueued_and_before_what_follows(context: Any, unordered: bool) -> None:
    kinds = cl.command_queue_properties
    queue = cl.CommandQueue(context, properties=kinds.OUT_OF_ORDER_EXEC_MODE_ENABLE if unordered else 0)
    base = photo()
    given, room, after = (to_device(queue, base) for _ in range(3))
    with Host(queue) as host, pg.compile(soft(), backend=host) as program:
        source, sink = host.buffer(given, SIZE, "rgba8"), host.buffer(room, SIZE, "rgba8")
        for _ in range(4):
            slow(queue, 3, given)
            program.run(frame=source, into={"soft": sink})
            copied = cl.enqueue_copy(queue, after, room)
            filled = cl.enqueue_fill_buffer(queue, room, np.uint8(1), 0, base.nbytes, wait_for=[copied])
            base, made = base * np.uint8(pow(3, 50, 256)), np.empty_like(base)
            cl.enqueue_copy(queue, made, after, wait_for=[filled])
            assert np.array_equal(made, expected(soft(), base))


@pytest.mark.parametrize("unordered", [False, True])
def test_a_run_does_not_wait_for_the_device(context: Any, unordered: bool) -> None:
    """The queue is held up by an event that happens only after the runs were asked for."""
    kinds = cl.command_queue_properties
    queue = cl.CommandQueue(context, properties=kinds.OUT_OF_ORDER_EXEC_MODE_ENABLE if unordered else 0)
    scaled = pg.kernel(source="def scaled(color: Image, by: float) -> vec4: return color[0, 0] * by")
    graph = scaled(pg.Input("frame"), pg.Value("by", float), into=pg.target("scaled", "rgba8"))
    base = photo()
    rooms = [to_device(queue, base) for _ in range(3)]
    with Host(queue) as host, pg.compile(graph, backend=host) as program:
        source = host.buffer(to_device(queue, base), SIZE, "rgba8")
        sinks = [host.buffer(room, SIZE, "rgba8") for room in rooms]
        program.run(frame=source, by=1.0, into={"scaled": sinks[0]})
        queue.finish()
        gate = cl.UserEvent(context)
        cl.enqueue_barrier(queue, wait_for=[gate])
        try:
            for number, sink in enumerate(sinks):
                program.run(frame=source, by=0.25 * (number + 1), into={"scaled": sink})
            done = host.event()
            assert done.command_execution_status != cl.command_execution_status.COMPLETE
        finally:
            gate.set_status(cl.command_execution_status.COMPLETE)
        done.wait()
        for number, room in enumerate(rooms):
            assert np.array_equal(from_device(queue, room, base), expected(graph, base, by=0.25 * (number + 1)))


def test_events_order_queues_of_the_callers(context: Any) -> None:
    base = photo()
    one, other = cl.CommandQueue(context), cl.CommandQueue(context)
    given, room = to_device(one, base), to_device(one, base)
    with Host(context) as host, pg.compile(soft(), backend=host) as program:
        gate = cl.UserEvent(context)
        filled = cl.enqueue_fill_buffer(other, given, np.uint8(7), 0, base.nbytes, wait_for=[gate])
        host.wait_for([filled])
        program.run(frame=host.buffer(given, SIZE, "rgba8"), into={"soft": host.buffer(room, SIZE, "rgba8")})
        read = np.empty_like(base)
        copied = cl.enqueue_copy(one, read, room, wait_for=[host.event()], is_blocking=False)
        gate.set_status(cl.command_execution_status.COMPLETE)
        copied.wait()
        assert np.array_equal(read, expected(soft(), np.full_like(base, 7)))
        with pytest.raises(pg.InputError, match=r"wait_for: each event must be a pyopencl.Event"):
            host.wait_for([7])


def test_arrays_of_another_queue_wait_and_are_waited_for(context: Any) -> None:
    from pyopencl import array

    ours, other = cl.CommandQueue(context), cl.CommandQueue(context)
    gate = cl.UserEvent(context)
    given = array.empty(other, (HEIGHT, WIDTH, 4), np.uint8)
    room = array.zeros(other, given.shape, np.uint8)
    cl.enqueue_barrier(other, wait_for=[gate])
    given.fill(7)
    with Host(ours) as host, pg.compile(soft(), backend=host) as program:
        program.run(frame=given, into={"soft": room})
        gate.set_status(cl.command_execution_status.COMPLETE)
        assert np.array_equal(room.get(), expected(soft(), np.full(given.shape, 7, np.uint8)))


def test_threads_share_a_host_and_the_queue(queue: Any, host: Host) -> None:
    base, failures = photo(), list[str]()
    wanted = expected(soft(), base)
    kernel = cl.Kernel(cl.Program(queue.context, SCALE).build(), "scale")
    own = to_device(queue, base)
    kernel.set_args(own, np.uint8(3))
    going = threading.Event()

    def runs() -> None:
        given, room = to_device(queue, base), to_device(queue, np.zeros_like(base))
        with pg.compile(soft(), backend=host) as program:
            going.wait()
            for _ in range(30):
                program.run(frame=host.buffer(given, SIZE, "rgba8"), into={"soft": host.buffer(room, SIZE, "rgba8")})
            if not np.array_equal(from_device(queue, room, base), wanted):
                failures.append("another result")

    threads = [threading.Thread(target=runs) for _ in range(3)]
    for thread in threads:
        thread.start()
    going.set()
    for _ in range(64):
        cl.enqueue_nd_range_kernel(queue, kernel, (base.size,), None)
    for thread in threads:
        thread.join()
    assert failures == []
    assert np.array_equal(from_device(queue, own, base), base * np.uint8(pow(3, 64, 256)))
