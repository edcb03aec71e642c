"""How pictures reach devices: without a copy where the device is the processor, and with nothing left behind."""

from __future__ import annotations

import ctypes
from collections import Counter
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

import passgraph as pg
from passgraph.backends.gl import GLBackend
from passgraph.backends.gl.textures import gl_format_of
from passgraph.backends.opencl import OpenCLBackend
from passgraph.errors import InputError
from passgraph.formats import FORMATS, padded
from passgraph.quantise import numbers_of, values_of
from tests.backends.test_uploads import CountedFunctions
from tests.conftest import require
from tests.corners import placed

SIZE = (67, 33)
COPY = pg.kernel(source="def copy(picture: Image) -> vec4: return picture[0, 0]")
PLACES = placed("""
def paint(corner: Corner, picture: Image) -> vec4:
    return picture.texel(pixel())
""")


def picture(seed: int = 1) -> Any:
    return np.random.default_rng(seed).integers(0, 256, (SIZE[1], SIZE[0], 4), np.uint8)


def copied() -> pg.Target:
    made: pg.Target = COPY(pg.Input("frame"), into=pg.target("out", "rgba8"))
    return made


def drawn() -> pg.Target:
    """A draw over everything that shows its input."""
    mesh = pg.Mesh.make([[-1, -1, 0], [3, -1, 0], [-1, 3, 0]], [[0, 1, 2]])
    place, paint = pg.vertex(source=PLACES, name="place"), pg.fragment(source=PLACES, name="paint")
    made: pg.Target = pg.draw(
        mesh, vertex=place, fragment=paint, into=pg.target("out", "rgba8"), picture=pg.Input("frame")
    )
    return made


@pytest.fixture(scope="module")
def gl() -> Iterator[GLBackend]:
    require("gl")
    with GLBackend() as backend:
        yield backend


class CountedCL:
    """pyopencl, of which it counts what is called."""

    def __init__(self, inner: Any) -> None:
        self.inner, self.calls = inner, Counter[str]()

    def __getattr__(self, name: str) -> Any:
        self.calls[name] += 1
        return getattr(self.inner, name)


@pytest.fixture
def opencl() -> Iterator[OpenCLBackend]:
    require("opencl")
    with OpenCLBackend() as backend:
        backend.cl = CountedCL(backend.cl)
        yield backend


# OpenCL


@pytest.mark.opencl
@pytest.mark.parametrize("graph", [copied, drawn])
def test_a_processor_reads_and_writes_the_callers_memory(graph: Any, opencl: OpenCLBackend) -> None:
    """Nothing is copied; afterwards the device has let go of both."""
    frame, room = picture(), np.empty((SIZE[1], SIZE[0], 4), np.uint8)
    with pg.compile(graph(), backend=opencl) as program:
        program(into={"out": room}, frame=frame)
        alive = len(opencl.alive)
        room[:] = 0
        opencl.cl.calls.clear()
        program(into={"out": room}, frame=frame)
        calls = opencl.cl.calls
        assert calls["Buffer"] == 2
        # A draw reads how many triangles there are.
        assert calls["enqueue_copy"] == (0 if graph is copied else 4)
        assert len(opencl.alive) == alive
    np.testing.assert_array_equal(room, frame)


@pytest.mark.opencl
def test_what_was_lent_is_given_back_when_a_run_fails(opencl: OpenCLBackend, monkeypatch: pytest.MonkeyPatch) -> None:
    from passgraph.backends.opencl.pixel import PixelPassRunner

    with pg.compile(copied(), backend=opencl) as program:
        program(frame=picture())
        alive = len(opencl.alive)
        with monkeypatch.context() as patched:
            patched.setattr(PixelPassRunner, "__call__", lambda *_: 1 / 0)
            with pytest.raises(ZeroDivisionError):
                program(frame=picture())
        assert len(opencl.alive) == alive
        assert opencl.borrowed_arrays is None
        np.testing.assert_array_equal(
            program(into={"out": np.empty_like(picture())}, frame=picture(2))["out"], picture(2)
        )


@pytest.mark.opencl
def test_nothing_is_adopted_outside_of_a_run(opencl: OpenCLBackend) -> None:
    """Nobody would give it back."""
    assert opencl.adopt(picture(), FORMATS["rgba8"]) is None
    with opencl.running():
        assert opencl.adopt(picture(), FORMATS["rgba8"]) is not None
        assert opencl.adopt(picture()[:, ::-1], FORMATS["rgba8"]) is None
        assert opencl.adopt(picture(), FORMATS["rgba32f"]) is None
        assert opencl.adopt("picture", FORMATS["rgba8"]) is None


@pytest.mark.opencl
def test_one_memory_is_adopted_once_in_a_run(opencl: OpenCLBackend) -> None:
    """The same picture is the same storage; of two buffers over one memory OpenCL promises nothing."""
    frame = picture()
    with opencl.running():
        held = opencl.adopt(frame, FORMATS["rgba8"])
        assert opencl.adopt(frame.view(), FORMATS["rgba8"]) is held
        for other in (frame[:20], frame[20:], frame.reshape(SIZE[0], SIZE[1], 4)):
            assert opencl.adopt(other, FORMATS["rgba8"]) is None
        assert opencl.adopt(picture(), FORMATS["rgba8"]) is not held


@pytest.mark.opencl
def test_a_run_inside_a_run_gives_back_its_own(opencl: OpenCLBackend) -> None:
    frame, other = picture(), picture(2)
    with opencl.running():
        held = opencl.adopt(frame, FORMATS["rgba8"])
        with opencl.running():
            inner = opencl.adopt(other, FORMATS["rgba8"])
        assert inner.released
        assert not held.released
        np.testing.assert_array_equal(opencl.download(held) * 255, frame)
    assert held.released


@pytest.mark.opencl
def test_other_devices_get_copies(opencl: OpenCLBackend, monkeypatch: pytest.MonkeyPatch) -> None:
    """As on graphics cards: no memory is shared, and conversions go through memory of the device."""
    opencl.is_cpu = False
    monkeypatch.setattr("passgraph.backends.opencl.transfers.SMALL", 0)
    with pg.compile(copied(), backend=opencl) as program:
        frame = picture()
        np.testing.assert_array_equal(program(frame=frame)["out"], frame / np.float32(255))
        room = np.zeros((2 * SIZE[1], SIZE[0], 4), np.float32)
        program(into={"out": room[::2]}, frame=frame)
        np.testing.assert_array_equal(room[::2], frame / np.float32(255))
        assert not room[1::2].any()
        storage = opencl.make(FORMATS["rgba8"], SIZE)
        opencl.upload(storage, frame / np.float32(255))
        np.testing.assert_array_equal(opencl.download(storage), frame / np.float32(255))


# OpenGL


@pytest.mark.gl
def test_a_picture_of_bytes_is_handed_over_where_it_lies(gl: GLBackend) -> None:
    """One call a transfer, with the caller's addresses; no pass converts anything."""
    frame, room = picture(), np.empty((SIZE[1], SIZE[0] + 5, 4), np.uint8)[:, 2:-3]
    given: dict[str, Any] = {}

    class Watched(CountedFunctions):
        def __getattr__(self, name: str) -> Any:
            called = super().__getattr__(name)
            if name in ("TexSubImage2D", "GetTexImage"):
                return lambda *arguments: (given.update({name: arguments[-1]}), called(*arguments))
            return called

    with pg.compile(copied(), backend=gl) as program:
        program(into={"out": room}, frame=frame)
        counted = Watched(gl.context.gl)
        gl.context.gl = counted  # type: ignore[assignment]
        program(into={"out": room}, frame=frame)
        gl.context.gl = counted.inner
    assert given == {"TexSubImage2D": frame.ctypes.data, "GetTexImage": room.ctypes.data}
    assert (counted.calls["TexSubImage2D"], counted.calls["GetTexImage"], counted.calls["DrawArrays"]) == (1, 1, 1)
    np.testing.assert_array_equal(room, frame)


@pytest.mark.gl
def test_transfers_leave_pixel_storage_as_opengl_begins(gl: GLBackend) -> None:
    """Others in the same context find what they expect: alignment 4, no row lengths, no buffers, no texture."""
    storage = gl.make(FORMATS["rgb8"], (5, 3))
    wide = np.zeros((3, 9, 3), np.uint8)[:, 1:6]
    gl.upload_stored(storage, wide, storage.format)
    gl.download_into(storage, wide, storage.format)
    gl.upload(storage, np.zeros((3, 5, 3), np.float32))
    expected = {0xCF5: 4, 0xD05: 4, 0xCF2: 0, 0xD02: 0, 0x8069: 0, 0x88ED: 0, 0x88EF: 0}
    with gl.context as functions:
        for what, value in expected.items():
            held = ctypes.c_int(-1)
            functions.GetIntegerv(what, ctypes.byref(held))
            assert held.value == value, hex(what)


@pytest.mark.gl
def test_conversions_keep_one_texture(gl: GLBackend, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("passgraph.backends.gl.transfers.SMALL", 0)
    counts = set()
    for side in (5, 9, 5, 7):
        storage = gl.make(FORMATS["rgba8"], (side, side))
        gl.upload(storage, np.ones((side, side, 4), np.float32))
        gl.release(storage)
        counts.add(sum(kind == "Texture" for kind, _ in gl.objects.alive))
    assert len(counts) == 1


@pytest.mark.parametrize("name", ["gl", "opencl"])
def test_an_array_of_another_shape_is_refused(name: str, request: pytest.FixtureRequest) -> None:
    backend = request.getfixturevalue(name)
    storage = backend.make(FORMATS["rgba8"], SIZE)
    for refused in (backend.upload_stored, backend.download_into):
        with pytest.raises(
            InputError, match=r"shape \(2, 2, 4\) .* rgba8 of 67x33 pixels; expected shape \(33, 67, 4\)"
        ):
            refused(storage, np.zeros((2, 2, 4), np.uint8), storage.format)
    backend.release(storage)


@pytest.mark.gl
@pytest.mark.parametrize("name", ["rgb8", "rgb16", "rgb16f", "rgb32f"])
@pytest.mark.parametrize("small", [0, 1 << 14], ids=["a pass", "the host"])
def test_three_channels_are_stored_as_four_where_a_driver_needs_it(
    name: str, small: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The caller's pixels stay three numbers wide, and the alpha behind them is 1."""
    require("gl")
    monkeypatch.setattr("passgraph.backends.gl.transfers.SMALL", small)
    format_ = FORMATS[name]
    values = np.random.default_rng(6).random((SIZE[1], SIZE[0] + 1, 3), np.float32)[:, 1:]
    held = numbers_of(values, format_)
    with GLBackend() as backend:
        backend._gl_formats[format_] = gl_format_of(padded(format_))
        storage = backend.make(format_, SIZE)
        sends = (
            lambda: backend.upload(storage, values),
            lambda: backend.upload_stored(storage, held, format_),
        )
        for send in sends:
            send()
            got = np.zeros((SIZE[1], SIZE[0] + 3, 3), format_.number)
            backend.download_into(storage, got[:, 2:-1], format_)
            np.testing.assert_array_equal(got[:, 2:-1], held)
            assert not got[:, :2].any()
            assert not got[:, -1:].any()
            np.testing.assert_array_equal(backend.download(storage), values_of(held, format_))
        whole = COPY(pg.Input("frame", name), into=pg.target("out", "rgba32f"))
        with pg.compile(whole, backend=backend) as program:
            assert (program(frame=held)["out"][..., 3] == 1.0).all()
