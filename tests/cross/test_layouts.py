"""Arrays of any layout go to devices and come back as a plain copy would, bit for bit, and stay the caller's."""

from __future__ import annotations

import weakref
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
import pytest
from numpy.lib.stride_tricks import as_strided
from numpy.typing import NDArray

import passgraph as pg
from passgraph.backends.base import Backend, numbers_of, values_of
from passgraph.backends.registry import open_backend
from passgraph.formats import FORMATS, Format
from passgraph.quantise import convert
from tests.conftest import DEVICES, require
from tests.corners import placed
from tests.outside_backend.passgraph_plainpy import PlainBackend

Array = NDArray[Any]
#: One pixel; rows of bytes that no alignment fits; more than one block of work and more than a line of either.
SIZES = ((5, 3), (67, 33), (1, 1), (3, 5))
#: Layouts of arrays that may be written, and those that only inputs have.
ROOM = ("plain", "wide rows", "padded rows", "rows up", "mirrored", "every other", "columns first", "of more channels",
        "channels back", "off by one number", "off by one byte")  # fmt: skip
GIVEN = (*ROOM, "read-only", "one row again", "big-endian")


def laid(shape: tuple[int, int, int], dtype: Any, layout: str, rng: np.random.Generator) -> tuple[Array, Array]:
    """An array to be filled, and the bytes that it lies in."""
    (height, width, channels), dtype = shape, np.dtype(dtype)
    if layout in ("wide rows", "padded rows", "off by one byte", "off by one number"):
        pixel, item = channels * dtype.itemsize, dtype.itemsize
        more = {"wide rows": 3 * pixel, "padded rows": int(rng.integers(1, 9)) * item}.get(layout, 0)
        first = {"off by one byte": 1, "off by one number": item}.get(layout, 0)
        memory = np.full(first + height * (width * pixel + more), 0xA5, np.uint8)
        flat = memory[first : first + memory[first:].size // item * item].view(dtype)
        return as_strided(flat, shape, (width * pixel + more, pixel, item)), memory
    whole = {
        "every other": (2 * height, 2 * width, channels),
        "columns first": (width, height, channels),
        "of more channels": (height, width, channels + 1),
        "one row again": (1, width, channels),
    }.get(layout, shape)
    made = np.empty(whole, dtype.newbyteorder(">") if layout == "big-endian" else dtype)
    memory = made.reshape(-1).view(np.uint8)
    memory[:] = 0xA5
    views: dict[str, Callable[[Array], Array]] = {
        "rows up": lambda a: a[::-1],
        "mirrored": lambda a: a[:, ::-1],
        "channels back": lambda a: a[..., ::-1],
        "every other": lambda a: a[::2, 1::2],
        "columns first": lambda a: a.transpose(1, 0, 2),
        "of more channels": lambda a: a[..., :channels],
    }
    return views.get(layout, lambda a: a)(made), memory


def given_as(picture: Array, layout: str, rng: np.random.Generator) -> Array:
    """An input of this layout with the content of a picture (its first row again and again, where rows are one)."""
    view, _ = laid(picture.shape, picture.dtype, layout, rng)
    np.copyto(view, picture[: view.shape[0]])
    if layout == "read-only":
        view.flags.writeable = False
    return np.broadcast_to(view, picture.shape) if layout == "one row again" else view


def numbers(format_: Format, size: tuple[int, int], rng: np.random.Generator) -> Array:
    """Any number that a format holds, but NaN, whose bits are nobody's promise; depths from 0 to 1."""
    dtype = np.dtype(format_.number)
    if format_.is_depth:
        return rng.random((*size[::-1], 1), np.float32)
    made = rng.integers(0, 256, (*size[::-1], format_.channels * dtype.itemsize), np.uint8).view(dtype)
    return np.where(np.isnan(made), dtype.type(0), made) if dtype.kind == "f" else made


def bits(array: Array) -> Array:
    return np.ascontiguousarray(array).view(f"u{array.dtype.itemsize}")


#: The last two know no way of their own.
BACKENDS = (*DEVICES, "reference", "outside")


@contextmanager
def opened(name: str) -> Iterator[Backend]:
    if name == "outside":
        yield PlainBackend()
        return
    if name in DEVICES:
        require(name)
    with open_backend(name) as backend:
        yield backend


@pytest.fixture(scope="module", params=BACKENDS)
def device(request: pytest.FixtureRequest) -> Iterator[Backend]:
    """Every device, the reference, and a backend from elsewhere."""
    with opened(request.param) as backend:
        yield backend


@pytest.fixture(scope="module", params=[*BACKENDS, "gl always", "opencl always"])
def converter(request: pytest.FixtureRequest) -> Iterator[Backend]:
    """The same; the last two convert on the device what they would on the host, for being small."""
    name, *always = request.param.split()
    with pytest.MonkeyPatch.context() as patched, opened(name) as backend:
        if always:
            patched.setattr(f"passgraph.backends.{name}.transfers.SMALL", 0)
        yield backend


@pytest.mark.sampled
@pytest.mark.parametrize("name", FORMATS)
def test_what_goes_in_comes_out_in_every_layout(name: str, converter: Backend) -> None:
    """Numbers in and out, and values in and out; bytes beside the array stay as they are."""
    format_, rng = FORMATS[name], np.random.default_rng(7)
    for size in SIZES:
        storage = converter.make(format_, size)
        for layout in GIVEN:
            held = numbers(format_, size, rng)
            given = given_as(held, layout, rng)
            converter.upload_stored(storage, given, format_)
            held = held[:1].repeat(size[1], 0) if layout == "one row again" else held
            np.testing.assert_array_equal(bits(converter.download(storage)), bits(values_of(held, format_)), layout)
            for dtype in (format_.number, np.float32):
                wanted = held if dtype == format_.number else values_of(held, format_)
                where = str(rng.choice(ROOM))
                seed = int(rng.integers(1 << 30))
                room, memory = laid(held.shape, dtype, where, np.random.default_rng(seed))
                converter.download_into(storage, room, format_)
                expected, expected_memory = laid(held.shape, dtype, where, np.random.default_rng(seed))
                np.copyto(expected, wanted)
                np.testing.assert_array_equal(memory, expected_memory, f"{layout} → {where}, {dtype}")
            if format_.is_depth or layout == "one row again":
                continue
            values = rng.random((*size[::-1], format_.channels), np.float32) * np.float32(1.25) - np.float32(0.125)
            converter.upload(storage, given_as(values, layout, rng))
            expected = values_of(numbers_of(values, format_), format_)
            np.testing.assert_array_equal(converter.download(storage), expected, layout)
        converter.release(storage)


def between(format_: Format) -> NDArray[np.float32]:
    """Values midway between two that a format holds, their neighbours, and what is beyond."""
    if format_.steps:
        midway = (np.arange(format_.steps, dtype=np.float32) + np.float32(0.5)) / np.float32(format_.steps)
    else:
        halves = np.arange(0x7C00, dtype=np.uint16).view(np.float16).astype(np.float32)
        midway = np.append((halves[:-1] + halves[1:]) / 2, np.float32(65520))
    near = [np.nextafter(midway, np.float32(-np.inf)), midway, np.nextafter(midway, np.float32(np.inf))]
    beyond = np.array([np.inf, 1e30, 2.0, 1.0, 0.0, 1e-30], np.float32)
    made = np.concatenate([*near, beyond])
    return np.concatenate([made, -made])


@pytest.mark.sampled
@pytest.mark.parametrize("name", ["r8", "rgba8", "r16", "rgb16", "rgba16", "r16f", "rgb16f", "rgba16f", "rgba8_srgb"])
def test_values_become_the_nearest_numbers(name: str, device: Backend) -> None:
    """Halves to even, beyond the range its end, NaN the lowest; as many values as devices convert themselves."""
    format_ = FORMATS[name]
    values = between(format_)
    values = np.append(values, [np.nan] * (not format_.steps or 1)).astype(np.float32)
    height = -(-max(values.size, 1 << 15) // (64 * format_.channels))
    picture = np.resize(values, (height, 64, format_.channels))
    storage = device.make(format_, (64, height))
    for layout in ("plain", "rows up", "wide rows"):
        device.upload(storage, given_as(picture, layout, np.random.default_rng(1)))
        got = np.empty(picture.shape, format_.number)
        device.download_into(storage, got, format_)
        expected = numbers_of(picture, format_)
        if not format_.steps:
            np.testing.assert_array_equal(np.isnan(got), np.isnan(expected))
            got, expected = np.nan_to_num(got, nan=0.0, posinf=np.inf), np.nan_to_num(expected, nan=0.0, posinf=np.inf)
        np.testing.assert_array_equal(got, expected)
    device.release(storage)


@pytest.mark.parametrize("name", ["r8", "rgba8", "r16", "rgb16", "r16f", "rgba16f"])
def test_every_number_becomes_its_value(name: str, device: Backend) -> None:
    """All that a channel can hold: no driver's own rounding takes part."""
    format_ = FORMATS[name]
    every = np.arange(1 << format_.bits, dtype=f"u{format_.bits // 8}").view(format_.number)
    picture = np.resize(every, (1024, 64, format_.channels))
    storage = device.make(format_, (64, 1024))
    device.upload_stored(storage, picture, format_)
    got, expected = device.download(storage), values_of(picture, format_)
    finite = ~np.isnan(expected)
    np.testing.assert_array_equal(np.isnan(got), ~finite)
    np.testing.assert_array_equal(bits(got)[finite], bits(expected)[finite])
    device.release(storage)


# Programs

COPY = pg.kernel(source="def copy(picture: Image) -> vec4: return picture[0, 0]")
BOTH = pg.kernel(source="def both(one: Image, other: Image) -> vec4: return one[0, 0] * 0.25 + other[0, 0] * 0.5")


COLORS = [format_ for format_ in FORMATS.values() if not format_.is_depth and not format_.srgb]


@pytest.mark.parametrize("held", COLORS, ids=lambda format_: format_.name)
def test_the_host_converts_between_all_formats(held: Format) -> None:
    """The nearest number of the value in float32; alpha that is missing is 1, other channels stay as they are."""
    rng = np.random.default_rng(11)
    given = given_as(numbers(held, SIZES[1], rng), "mirrored", rng)
    values = given / np.float32(held.steps) if held.steps else given.astype(np.float32)
    for wanted in COLORS:
        channels = min(held.channels, wanted.channels)
        expected = np.ones((*given.shape[:2], wanted.channels), np.float32)
        expected[..., :channels] = values[..., :channels]
        with np.errstate(over="ignore"):
            if wanted.steps:
                expected = np.rint(np.clip(expected, 0, 1) * np.float32(wanted.steps))
            room, memory = laid(expected.shape, wanted.number, "padded rows", np.random.default_rng(12))
            whole, expected_memory = laid(expected.shape, wanted.number, "padded rows", np.random.default_rng(12))
            whole[...] = expected
        if held.number == wanted.number:  # as they are, bit for bit
            whole[..., :channels] = given[..., :channels]
        convert(given, held, room, wanted)
        np.testing.assert_array_equal(memory, expected_memory, wanted.name)


@pytest.mark.sampled
@pytest.mark.parametrize("name", ["rgba8", "rgba16f", "rgba32f"])
def test_programs_read_and_write_arrays_of_any_layout(name: str, device: Backend) -> None:
    format_, rng = FORMATS[name], np.random.default_rng(11)
    with pg.compile(COPY(pg.Input("frame"), into=pg.target("out", name)), backend=device, non_finite="keep") as program:
        for layout in (*GIVEN, *GIVEN):
            size = SIZES[rng.integers(2)]
            held = np.ascontiguousarray(rng.random((*size[::-1], 4)) * (format_.steps or 9), dtype=format_.number)
            given = given_as(held, layout, rng)
            held = np.ascontiguousarray(given, dtype=format_.number)
            where, dtype = str(rng.choice(ROOM)), (format_.number, np.float32)[rng.integers(2)]
            seed = int(rng.integers(1 << 30))
            room, memory = laid(held.shape, dtype, where, np.random.default_rng(seed))
            result = program(into={"out": room}, frame=given)["out"]
            assert result is room or result.base is room
            expected, expected_memory = laid(held.shape, dtype, where, np.random.default_rng(seed))
            np.copyto(expected, held if dtype == format_.number else values_of(held, format_))
            np.testing.assert_array_equal(memory, expected_memory, f"{layout} → {where}, {dtype}, {size}")
            np.testing.assert_array_equal(given, held)


@pytest.mark.parametrize("results", ["float32", "stored"])
@pytest.mark.parametrize("given", [False, True], ids=["fresh", "given"])
@pytest.mark.parametrize("name", ["rgba8", "rgba32f"])
def test_a_later_run_changes_no_result_handed_out_before(name: str, given: bool, results: Any, device: Backend) -> None:
    graph = {"out": COPY(pg.Input("frame"), into=pg.target("out", name))}
    graph["again"] = COPY(graph["out"], into=pg.target("again", name))
    rng, kept = np.random.default_rng(5), []
    with pg.compile(graph, backend=device, results=results) as program:
        for run in range(4):
            frame = rng.integers(0, 256, (33, 67, 4), np.uint8)
            room = {"out": np.empty(frame.shape, FORMATS[name].number)} if given and run % 2 else {}
            kept += [(array, array.copy()) for array in program(into=room, frame=frame).values()]
            kept.append((frame, frame.copy()))
            kept += [(array, array.copy()) for array in program.read().values()]
        for array, copy in kept:
            np.testing.assert_array_equal(array, copy)
        arrays = [array for array, _ in kept]
        if not given:
            assert not any(np.shares_memory(a, b) for k, a in enumerate(arrays) for b in arrays[:k])
    for array, copy in kept:
        np.testing.assert_array_equal(array, copy)


def test_one_array_may_be_several_inputs(device: Backend) -> None:
    """The same, or parts of one that overlap."""
    whole = np.random.default_rng(2).random((8, 6, 4), np.float32)
    target = BOTH(pg.Input("one"), pg.Input("other"), into=pg.target("both", "rgba32f"))
    with pg.compile(target, backend=device) as program:
        for one, other in ((whole, whole), (whole[:6], whole[2:]), (whole[1:7], whole[1:7].view())):
            got = program(one=one, other=other)["both"]
            np.testing.assert_array_equal(got, one * np.float32(0.25) + other * np.float32(0.5))


KERNELS = placed("""
def paint(corner: Corner, picture: Image) -> vec4:
    return picture.texel(pixel())
""")
FRAME = pg.Input("frame")
PLACE, PAINT = (pg.vertex(source=KERNELS, name="place"), pg.fragment(source=KERNELS, name="paint"))


def shown(into: Any = None) -> pg.Target:
    """A draw over the upper left half, or over everything, that shows its input."""
    corners = [[-1, 1, 0], [3, 1, 0], [-1, -3, 0]] if into is None else [[-1, 1, 0], [1, 1, 0], [-1, -1, 0]]
    mesh, into = pg.Mesh.make(corners, [[0, 1, 2]]), into or pg.target("out", "rgba8")
    made: pg.Target = pg.draw(mesh, vertex=PLACE, fragment=PAINT, into=into, picture=FRAME)
    return made


def copied() -> pg.Target:
    made: pg.Target = COPY(FRAME, into=pg.target("out", "rgba8"))
    return made


@pytest.mark.parametrize("graph", [copied, shown])
def test_nothing_of_an_input_or_of_room_is_kept(graph: Callable[[], pg.Target], device: Backend) -> None:
    with pg.compile(graph(), backend=device) as program:
        frame, room = np.full((33, 67, 4), 7, np.uint8), np.empty((33, 67, 4), np.uint8)
        program.run(into={"out": room}, frame=frame)
        gone = weakref.ref(frame), weakref.ref(room)
        assert room.min() == room.max() == 7
        del frame
        assert gone[0]() is None
        program(frame=np.full((33, 67, 4), 8, np.uint8))
        del room
        assert gone[1]() is None


def test_what_is_drawn_over_is_there_in_a_given_array(device: Backend) -> None:
    """Nothing of what the array held before shows through."""
    under = pg.kernel(source="def under(frame: Image) -> vec4: return 1.0 - frame[0, 0]")
    frame = np.random.default_rng(4).integers(0, 256, (33, 67, 4), np.uint8)
    first = under(FRAME, into=pg.target("under", "rgba8"))
    with pg.compile({"out": shown(first)}, backend=device, results="stored") as program:
        fresh = program(frame=frame)["out"]
        room = np.full(frame.shape, 99, np.uint8)
        np.testing.assert_array_equal(program(into={"out": room}, frame=frame)["out"], fresh)
    covered = (fresh == frame).all(axis=2)
    assert covered.any()
    np.testing.assert_array_equal(fresh[~covered], 255 - frame[~covered])
