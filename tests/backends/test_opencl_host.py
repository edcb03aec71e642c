"""A caller's OpenCL: their memory is read and written where it lies, in their queue, and nothing else is touched."""

from __future__ import annotations

import gc
import mmap
import threading
import tracemalloc
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import passgraph as pg
from passgraph.backends.opencl.host import Host
from passgraph.formats import FORMATS
from tests.conftest import require
from tests.hostile.guard import guarded_copy, guarded_zeros

cl = pytest.importorskip("pyopencl")
pytestmark = pytest.mark.opencl

SIZE = (160, 24)  # rows longer than a run of pixels on CPUs
WIDTH, HEIGHT = SIZE
SCALE = "__kernel void scale(__global uchar* a, uchar by) { a[get_global_id(0)] = a[get_global_id(0)] * by; }"


@pytest.fixture
def context() -> Any:
    require("opencl")
    return cl.create_some_context(interactive=False)


@pytest.fixture
def queue(context: Any) -> Any:
    return cl.CommandQueue(context)


@pytest.fixture
def host(queue: Any) -> Iterator[Host]:
    with Host(queue) as made:
        yield made


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


# Where memory lies


def buffers(number: int) -> dict[str, tuple[dict[str, Any], Callable[[Any], Any]]]:
    """Options of `Host.buffer`, and the picture as a view of an array that is what the whole buffer holds."""
    row = WIDTH * 4

    def rows(base: Any, start: int, pitch: int, pixel: int = 4) -> Any:
        flat = base.reshape(-1)[start:]
        strides = (pitch * number, pixel * number, number)
        return np.lib.stride_tricks.as_strided(flat, (HEIGHT, WIDTH, 4), strides)

    return {
        "plain": ({}, lambda base: rows(base, 0, row)),
        "behind others": ({"offset": 5 * number}, lambda base: rows(base, 5, row)),
        "behind many others": ({"offset": 4099 * number}, lambda base: rows(base, 4099, row)),
        "rows apart": ({"row_pitch": (row + 3) * number}, lambda base: rows(base, 0, row + 3)),
        "pixels apart": ({"pixel_pitch": 7 * number}, lambda base: rows(base, 0, WIDTH * 7, 7)),
        "from the bottom up": ({"origin": "bottom"}, lambda base: rows(base, 0, row)[::-1]),
        "in another order": ({"order": "bgra"}, lambda base: rows(base, 0, row)[..., [2, 1, 0, 3]]),
        "all of it": (
            {"offset": 3 * number, "row_pitch": (row * 2 + 1) * number, "origin": "bottom", "order": "argb"},
            lambda base: rows(base, 3, row * 2 + 1)[::-1][..., [1, 2, 3, 0]],
        ),
    }


@pytest.mark.parametrize(
    ("layout", "dtype"),
    [*((name, np.uint8) for name in buffers(1)), ("all of it", np.float16), ("all of it", np.float32)],
)
def test_buffers_are_read_and_written_in_any_layout(queue: Any, host: Host, layout: str, dtype: Any) -> None:
    format_ = {"u1": "rgba8", "f2": "rgba16f", "f4": "rgba32f"}[np.dtype(dtype).str[1:]]
    base = photo(4, dtype, (WIDTH, 3 * HEIGHT))
    options, view = buffers(base.itemsize)[layout]
    given, around = to_device(queue, base), to_device(queue, np.zeros_like(base))
    with pg.compile(soft(format_), backend=host) as program:
        into = {"soft": host.buffer(around, SIZE, format_, **options)}
        program.run(frame=host.buffer(given, SIZE, format_, **options), into=into)
        told = program.explain()
    assert "input 'frame': read in place" in told and "output 'soft': written in place" in told
    made, wanted = from_device(queue, around, base), expected(soft(format_), np.ascontiguousarray(view(base)))
    assert np.array_equal(view(made), wanted)
    assert np.array_equal(from_device(queue, given, base), base)
    # Nothing around the picture was written: as many numbers differ from 0 as the picture has.
    assert np.count_nonzero(made) == np.count_nonzero(wanted)


def test_three_channels_in_pixels_of_four_leave_the_fourth(queue: Any, host: Host) -> None:
    base = photo()
    given, around = to_device(queue, base), to_device(queue, np.full_like(base, 99))
    with pg.compile(soft("rgb8"), backend=host) as program:
        program.run(
            frame=host.buffer(given, SIZE, "rgb8", order="bgra"),
            into={"soft": host.buffer(around, SIZE, "rgb8", order="rgba")},
        )
    made = from_device(queue, around, base)
    assert np.array_equal(made[..., :3], expected(soft("rgb8"), np.ascontiguousarray(base[..., 2::-1])))
    assert (made[..., 3] == 99).all()


VIEWS: dict[str, Callable[[Any], Any]] = {
    "a part": lambda base: base[5 : 5 + HEIGHT, 7 : 7 + WIDTH],
    "from the bottom up": lambda base: base[:HEIGHT, :WIDTH][::-1],
    "from right to left": lambda base: base[:HEIGHT, :WIDTH][:, ::-1],
    "every second row and column": lambda base: base[: 2 * HEIGHT : 2, : 2 * WIDTH : 2],
    "channels in reverse": lambda base: base[:HEIGHT, :WIDTH][:, :, ::-1],
}


@pytest.mark.parametrize("name", VIEWS)
def test_arrays_of_pyopencl_with_any_strides(queue: Any, host: Host, name: str) -> None:
    from pyopencl import array

    base = photo(size=(2 * WIDTH, 2 * HEIGHT))
    given, around = array.to_device(queue, base), array.to_device(queue, np.full_like(base, 99))
    with pg.compile(soft(), backend=host) as program:
        program.run(frame=VIEWS[name](given), into={"soft": VIEWS[name](around)})
        assert program.explain().count("in place") == 2
    made = around.get()
    assert np.array_equal(VIEWS[name](made), expected(soft(), np.ascontiguousarray(VIEWS[name](base))))
    VIEWS[name](made)[...] = 99
    assert (made == 99).all()


@pytest.mark.parametrize("channels", [1, 2, 3])
def test_arrays_of_few_channels_and_planes(queue: Any, host: Host, channels: int) -> None:
    from pyopencl import array

    base = photo(channels, np.float32)
    given = array.to_device(queue, base[:, :, 0] if channels == 1 else base)
    planes = array.to_device(queue, np.zeros((4, HEIGHT, WIDTH), np.float32))
    with pg.compile(soft("rgba32f"), backend=host) as program:
        program.run(frame=given, into={"soft": planes.transpose((1, 2, 0))})
    assert np.array_equal(planes.get().transpose(1, 2, 0), expected(soft("rgba32f"), base))


def test_parts_of_buffers_of_the_caller(queue: Any, host: Host) -> None:
    """OpenCL makes no part of a part: a picture in one is taken from the whole."""
    base = photo(size=(WIDTH, 2 * HEIGHT))
    parent = to_device(queue, base)
    begin = 1024
    part = parent.get_sub_region(begin, base.nbytes - begin)
    room = to_device(queue, np.zeros_like(base)).get_sub_region(begin, base.nbytes - begin)
    with pg.compile(soft(), backend=host) as program:
        for offset in (0, 12, 8192):
            into = host.buffer(room, SIZE, "rgba8", offset=offset)
            program.run(frame=host.buffer(part, SIZE, "rgba8", offset=offset), into={"soft": into})
            start = begin + offset
            view = base.reshape(-1)[start : start + WIDTH * HEIGHT * 4].reshape(HEIGHT, WIDTH, 4)
            held = np.empty(base.nbytes - begin, np.uint8)
            cl.enqueue_copy(queue, held, room)
            assert np.array_equal(held[offset : offset + view.size].reshape(view.shape), expected(soft(), view))


@pytest.mark.parametrize("width", [5, 1021])
def test_nothing_beyond_the_callers_memory_is_touched(queue: Any, host: Host, width: int) -> None:
    """Both lie before a page that nobody may touch: on processors a wider load or store ends the process."""
    given, room = guarded_copy(photo(size=(width, 16))), guarded_zeros((16, width, 4), np.uint8)
    flags = cl.mem_flags.READ_WRITE | cl.mem_flags.USE_HOST_PTR
    memory = [cl.Buffer(queue.context, flags, hostbuf=array) for array in (given, room)]
    with pg.compile(soft(), backend=host) as program:
        source, sink = (host.buffer(buffer, (width, 16), "rgba8") for buffer in memory)
        program.run(frame=source, into={"soft": sink})
    assert np.array_equal(from_device(queue, memory[1], np.array(room)), expected(soft(), np.array(given)))


# What cannot be in place


def test_formats_that_differ_are_converted_on_the_device(queue: Any, host: Host) -> None:
    base = photo(3)
    graph = soft(frame=pg.Input("frame", "rgba16f", SIZE))
    wide = to_device(queue, np.zeros((HEIGHT, WIDTH, 4), np.float32))
    given = host.buffer(to_device(queue, base), SIZE, "rgb8")
    with pg.compile(graph, backend=host) as program:
        program.run(frame=given, into={"soft": host.buffer(wide, SIZE, "rgba32f")})
        assert "moved to rgba16f" in program.explain() and "moved into rgba32f" in program.explain()
    opaque = np.dstack([base, np.full((HEIGHT, WIDTH), 255, np.uint8)])
    with pg.compile(graph, backend="opencl") as program:
        wanted = program(frame=opaque)["soft"]
    assert np.array_equal(from_device(queue, wide, wanted), wanted)


def test_a_picture_may_be_input_and_output_at_once(queue: Any, host: Host) -> None:
    base = photo()
    memory = to_device(queue, base)
    picture = host.buffer(memory, SIZE, "rgba8")
    with pg.compile(soft(), backend=host) as program:
        program.run(frame=picture, into={"soft": picture})
    assert np.array_equal(from_device(queue, memory, base), expected(soft(), base))


def test_pictures_that_overlap_in_part_are_kept_apart(queue: Any, host: Host) -> None:
    base = photo(size=(WIDTH, 2 * HEIGHT))
    memory, step = to_device(queue, base), 3 * WIDTH * 4
    with pg.compile(soft(), backend=host) as program:
        moved = host.buffer(memory, SIZE, "rgba8", offset=step)
        program.run(frame=host.buffer(memory, SIZE, "rgba8"), into={"soft": moved})
        assert "'frame': moved to" in program.explain() and "'soft': written in place" in program.explain()
    made = from_device(queue, memory, base)
    assert np.array_equal(made[3 : 3 + HEIGHT], expected(soft(), base[:HEIGHT]))


def test_pictures_side_by_side_in_one_buffer_do_not_overlap(queue: Any, host: Host) -> None:
    base = photo(size=(2 * WIDTH, HEIGHT))
    memory, pitch = to_device(queue, base), 2 * WIDTH * 4
    with pg.compile(soft(), backend=host) as program:
        right = host.buffer(memory, SIZE, "rgba8", row_pitch=pitch, offset=WIDTH * 4)
        program.run(frame=host.buffer(memory, SIZE, "rgba8", row_pitch=pitch), into={"soft": right})
        assert program.explain().count("in place") == 2
    made = from_device(queue, memory, base)
    assert np.array_equal(made[:, WIDTH:], expected(soft(), np.ascontiguousarray(base[:, :WIDTH])))
    assert np.array_equal(made[:, :WIDTH], base[:, :WIDTH])


def test_two_outputs_in_one_place_are_refused(queue: Any, host: Host) -> None:
    frame = pg.Input("frame")
    both = [SOFT(frame, into=pg.target(name, "rgba8")) for name in "ab"]
    array = np.zeros((HEIGHT + 1, WIDTH, 4), np.uint8)
    flags = cl.mem_flags.READ_WRITE | cl.mem_flags.USE_HOST_PTR
    one, other = (cl.Buffer(queue.context, flags, hostbuf=array) for _ in range(2))
    part = one.get_sub_region(0, array.nbytes)
    with pg.compile(both, backend=host) as program:
        for second in (one, part, other):
            into = {"a": host.buffer(one, SIZE, "rgba8"), "b": host.buffer(second, SIZE, "rgba8", offset=WIDTH * 4)}
            with pytest.raises(pg.InputError, match=r"into= gives rgba8 picture of 160x24 .* for two outputs"):
                program.run(frame=photo(), into=into)


def test_history_static_inputs_observers_and_checks(queue: Any, host: Host) -> None:
    from pyopencl import array

    base, into = photo(4, np.float32), pg.target("trail", "rgba32f")
    trail = pg.kernel(source="def trail(a: Image, b: Image) -> vec4: return mix(a[0, 0], b[0, 0], 0.5)")
    given, room = array.to_device(queue, base), array.zeros(queue, base.shape, np.float32)
    with pg.compile(trail(pg.Input("frame"), pg.previous(into), into=into), backend=host) as program:
        for share in (0.5, 0.75):
            program.run(frame=given, into={"trail": room})
            assert np.allclose(room.get(), base * share)
    with pg.compile(soft("rgba32f"), backend=host, check_finite=True) as program:
        seen: list[str] = []
        program.run(lambda step, _: seen.append(step.name), frame=given, into={"soft": room})
        assert seen == ["soft"]
        assert np.array_equal(room.get(), expected(soft("rgba32f"), base))
    static = soft("rgba32f", pg.Input("frame", static=True))
    with pg.compile(static, backend=host) as program:
        for _ in range(2):
            assert np.array_equal(program(frame=given)["soft"], expected(soft("rgba32f"), base))


def test_draws_go_into_the_callers_memory_and_read_it(queue: Any, host: Host) -> None:
    from tests.backends.opencl_scene import triangle_over

    base = photo(size=(64, 48))
    graph = triangle_over(pg.Input("frame"))
    color, depth = np.zeros((48, 70, 4), np.uint8), np.zeros((48, 64, 1), np.float32)
    room, far = to_device(queue, color), to_device(queue, depth)
    with pg.compile(graph, backend=host, size=(64, 48)) as program:
        program.run(
            frame=host.buffer(to_device(queue, base), (64, 48), "rgba8"),
            into={
                "color": host.buffer(room, (64, 48), "rgba8", row_pitch=280, order="bgra"),
                "color_depth": host.buffer(far, (64, 48), "depth32f", origin="bottom"),
            },
        )
        assert "output 'color': written in place" in program.explain()
    with pg.compile(graph, backend="opencl", size=(64, 48), results="stored") as program:
        wanted = program(frame=base)
    assert np.array_equal(from_device(queue, room, color)[:, :64][..., [2, 1, 0, 3]], wanted["color"])
    assert np.array_equal(from_device(queue, far, depth)[::-1], wanted["color_depth"])


# Images


@pytest.mark.parametrize("order", ["RGBA", "BGRA"])
def test_images_cost_one_copy_on_the_device(queue: Any, host: Host, order: str) -> None:
    def image(pixels: Any) -> Any:
        format_ = cl.ImageFormat(getattr(cl.channel_order, order), cl.channel_type.UNORM_INT8)
        flags = cl.mem_flags.READ_WRITE | cl.mem_flags.COPY_HOST_PTR
        return cl.create_image(queue.context, flags, format_, shape=SIZE, hostbuf=pixels)

    base = photo()
    given, room = image(base), image(np.zeros_like(base))
    turned = [0, 1, 2, 3] if order == "RGBA" else [2, 1, 0, 3]
    with pg.compile(soft(), backend=host) as program:
        for _ in range(2):
            program.run(frame=given, into={"soft": room})
            made = np.empty_like(base)
            cl.enqueue_copy(queue, made, room, origin=(0, 0), region=SIZE)
            wanted = expected(soft(), np.ascontiguousarray(base[..., turned]))
            assert np.array_equal(made[..., turned], wanted)
        program.run(frame=given, into={"soft": given})  # which is read first
        cl.enqueue_copy(queue, made, given, origin=(0, 0), region=SIZE)
        assert np.array_equal(made[..., turned], wanted)


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
        "no buffer": (lambda: host.buffer(photo(), SIZE, "rgba8"), "must lie in a pyopencl.Buffer"),
        "no picture": (lambda: host.picture(exact), "does not say of what size"),
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
            (memory, "does not say of what size and format it is"),
        ):
            with pytest.raises(pg.InputError, match=message):
                program.run(frame=given)
    encoded = soft(frame=pg.Input("frame", "rgba8_srgb", SIZE))
    with pg.compile(encoded, backend=host) as program, pytest.raises(pg.InputError, match="declare the same format"):
        program.run(frame=host.buffer(memory, SIZE, "rgba8"))


def test_a_host_is_made_of_a_queue(queue: Any) -> None:
    with pytest.raises(pg.BackendError, match=r"a host is made of a pyopencl.CommandQueue or a pyopencl.Context, got"):
        Host("gpu")


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


# What is left


def references(queue: Any, *memory: Any) -> list[int]:
    """Of the context, the queue and memory, after a command of the caller's: drivers keep the last one of each."""
    gc.collect()
    for one in memory:
        cl.enqueue_fill_buffer(queue, one, np.uint8(7), 0, one.size)
    queue.finish()
    return [queue.context.reference_count, queue.reference_count, *(one.reference_count for one in memory)]


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
    assert references(queue, given.base_data, room.base_data, held) == before
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
