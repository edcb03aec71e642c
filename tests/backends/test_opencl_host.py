"""A caller's OpenCL: their memory is read and written where it lies, and nothing else is touched."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import passgraph as pg
from passgraph.cached import Recent
from passgraph.hosts.opencl import Host
from tests.backends.opencl_caller import HEIGHT, SIZE, SOFT, WIDTH, cl, expected, from_device, photo, soft, to_device
from tests.hostile.guard import guarded_copy, guarded_zeros

pytestmark = pytest.mark.opencl


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


@pytest.mark.sampled
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


@pytest.mark.parametrize("is_part", [False, True])
def test_kernels_are_the_same_wherever_a_picture_begins(queue: Any, host: Host, is_part: bool) -> None:
    base = photo(size=(WIDTH, 4 * HEIGHT))
    whole = to_device(queue, base)
    memory = whole.get_sub_region(host.alignment, base.nbytes - host.alignment) if is_part else whole
    room = host.buffer(to_device(queue, photo()), SIZE, "rgba8")
    with pg.compile(soft(), backend=host) as program:
        program.run(frame=host.buffer(memory, SIZE, "rgba8"), into={"soft": room})
        built = len(host.programs.built)
        for number in range(1, 20):
            program.run(frame=host.buffer(memory, SIZE, "rgba8", offset=host.alignment * number), into={"soft": room})
        assert len(host.programs.built) == built
    start = host.alignment * (19 + is_part)
    view = base.reshape(-1)[start : start + WIDTH * HEIGHT * 4].reshape(HEIGHT, WIDTH, 4)
    assert np.array_equal(from_device(queue, room.memory, photo()), expected(soft(), view))


def test_of_layouts_that_come_and_go_the_last_ones_are_kept() -> None:
    recent = Recent[int, str](3)
    for number in (0, 1, 2, 1, 3, 4):
        recent[number] = str(number)
    assert recent == {2: "2", 3: "3", 4: "4"}


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
