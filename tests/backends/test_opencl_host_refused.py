"""A caller's OpenCL: what cannot be a picture is refused before anything runs."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import passgraph as pg
from passgraph.hosts.opencl import Host
from tests.backends.opencl_caller import HEIGHT, SIZE, WIDTH, cl, expected, from_device, photo, soft, to_device

pytestmark = pytest.mark.opencl


# What is refused


def refusals(host: Host, queue: Any) -> dict[str, tuple[Callable[[], Any], str]]:
    context = queue.context
    exact = cl.Buffer(context, cl.mem_flags.READ_WRITE, WIDTH * HEIGHT * 4)

    def described(**options: Any) -> Callable[[], Any]:
        size, format_ = options.pop("size", SIZE), options.pop("format", "rgba8")
        return lambda: host.buffer(exact, size, format_, **options)

    return {
        "one byte more": (described(offset=1), r"take bytes 1 to 15,361, and the buffer has 15,360"),
        "one row more": (described(size=(WIDTH, HEIGHT + 1)), "and the buffer has 15,360"),
        "another format": (described(format="rgba16"), "take bytes 0 to 30,720"),
        "rows too far": (described(row_pitch=WIDTH * 4 + 1), "and the buffer has"),
        "rows that overlap": (described(row_pitch=WIDTH * 4 - 1), "overlap; a pixel of rgba8 needs 4 bytes"),
        "pixels that overlap": (described(size=(8, 8), pixel_pitch=3), "overlap; a pixel"),
        "far beyond 64 bits": (described(offset=1 << 70), "offset"),
        "an offset below": (described(offset=-4), "offset"),
        "half a number": (described(size=(8, 8), format="rgba32f", offset=6), "is 6 bytes, which is no multiple of 4"),
        "no format": (described(format="rgba7"), "there is no format"),
        "no size": (described(size=7), r"size must be \(width, height\)"),
        "no pixels": (described(size=(0, 4)), "each side"),
        "no order": (described(order="rg"), "lacks channels"),
        "a stencil": (described(format="depth32f_stencil8"), "stencil apart"),
        "no buffer": (lambda: host.buffer(photo(), SIZE, "rgba8"), "must be in a pyopencl.Buffer"),
        "no picture": (lambda: host.picture(exact), "does not say its size"),
        "numbers": (lambda: host.picture(photo()), "a picture is made of a pyopencl array or image"),
    }


@pytest.mark.parametrize("name", [
    "one byte more", "one row more", "another format", "rows too far", "rows that overlap", "pixels that overlap",
    "far beyond 64 bits", "an offset below", "half a number", "no format", "no size", "no pixels", "no order",
    "a stencil", "no buffer", "no picture", "numbers",
])  # fmt: skip
def test_what_does_not_lie_in_the_buffer_is_refused(host: Host, queue: Any, name: str) -> None:
    made, message = refusals(host, queue)[name]
    with pytest.raises(pg.PassgraphError, match=message):
        made()


def test_memory_of_another_context_is_refused_with_both_devices(host: Host, queue: Any) -> None:
    from pyopencl import array

    other = cl.Context(queue.context.devices)
    stranger = cl.CommandQueue(other)
    given = array.to_device(stranger, photo())
    message = r"is of another OpenCL context \(.+\) than the host's queue \(.+\); make it in that context"
    with pg.compile(soft(), backend=host) as program:
        with pytest.raises(pg.InputError, match=message):
            program.run(frame=given)
        with pytest.raises(pg.InputError, match=message):
            host.buffer(to_device(stranger, photo()), SIZE, "rgba8")
        with Host(stranger) as second, pytest.raises(pg.InputError, match="is of another OpenCL context; make it with"):
            program.run(frame=second.picture(given))


def test_memory_that_may_not_be_read_or_written(host: Host, queue: Any) -> None:
    locked, blind = (to_device(queue, photo(), flag) for flag in (cl.mem_flags.READ_ONLY, cl.mem_flags.WRITE_ONLY))
    room = host.buffer(to_device(queue, photo()), SIZE, "rgba8")
    with pg.compile(soft(), backend=host) as program:
        program.run(frame=host.buffer(locked, SIZE, "rgba8"), into={"soft": host.buffer(blind, SIZE, "rgba8")})
        assert np.array_equal(from_device(queue, blind, photo()), expected(soft(), photo()))
        with pytest.raises(pg.InputError, match=r"may not be written \(READ_ONLY\); make its memory READ_WRITE"):
            program.run(frame=photo(), into={"soft": host.buffer(locked, SIZE, "rgba8")})
        with pytest.raises(pg.InputError, match=r"may not be read \(WRITE_ONLY\)"):
            program.run(frame=host.buffer(blind, SIZE, "rgba8"), into={"soft": room})


def test_pictures_that_do_not_fit(host: Host, queue: Any) -> None:
    from pyopencl import array

    memory = to_device(queue, photo(4, np.float32))
    with pg.compile(soft(), backend=host) as program:
        for picture, message in (
            (host.buffer(memory, (8, 8), "rgba8"), "takes a picture of 160x24 pixels, got 8x8"),
            (host.buffer(memory, SIZE, "rg8"), r"has 4 channel\(s\); they must be as many"),
            (host.buffer(memory, SIZE, "rgba8_srgb"), "only one is sRGB-encoded"),
            (host.buffer(memory, SIZE, "rgba16"), "give the same numbers, or float32"),
        ):
            with pytest.raises(pg.InputError, match=message):
                program.run(frame=photo(), into={"soft": picture})
        for given, message in (
            (array.zeros(queue, (8, 8), np.int32), "holds numbers of no format"),
            (array.zeros(queue, (2, 8, 8, 4), np.uint8), "is no picture"),
            (memory, "does not say its size and format"),
        ):
            with pytest.raises(pg.InputError, match=message):
                program.run(frame=given)
    encoded = soft(frame=pg.Input("frame", "rgba8_srgb", SIZE))
    with pg.compile(encoded, backend=host) as program, pytest.raises(pg.InputError, match="declare the same format"):
        program.run(frame=host.buffer(memory, SIZE, "rgba8"))


def test_a_host_is_made_of_a_queue(queue: Any) -> None:
    with pytest.raises(pg.BackendError, match=r"a host is made of a pyopencl.CommandQueue or a pyopencl.Context, got"):
        Host("gpu")
