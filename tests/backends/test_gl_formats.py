"""Storages of the gl backend: what goes in comes out, in every format."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

import passgraph as pg
from passgraph.backends.gl import GLBackend
from passgraph.errors import BackendError
from passgraph.formats import FORMATS, Format

pytestmark = pytest.mark.gl
SIZE = (5, 3)


@pytest.fixture(scope="module")
def backend() -> Iterator[GLBackend]:
    with GLBackend() as made:
        yield made


def picture(format_: Format) -> np.ndarray:
    """Every value different, and a value that each format holds."""
    values = np.random.default_rng(3).random((SIZE[1], SIZE[0], format_.channels), np.float32)
    if format_.number == "f2":
        return values.astype(np.float16).astype(np.float32)
    steps = np.float32(format_.steps)
    return np.rint(values * steps) / steps if steps else values


@pytest.mark.parametrize("name", FORMATS)
def test_a_picture_comes_back_as_it_went(backend: GLBackend, name: str) -> None:
    storage = backend.make(FORMATS[name], SIZE)
    backend.upload(storage, picture(FORMATS[name]))
    assert np.array_equal(backend.download(storage), picture(FORMATS[name]))
    backend.release(storage)


@pytest.mark.parametrize("name", FORMATS)
def test_a_new_storage_is_zero(backend: GLBackend, name: str) -> None:
    storage = backend.make(FORMATS[name], SIZE)
    assert not backend.download(storage).any()
    backend.release(storage)


@pytest.mark.parametrize("name", FORMATS)
def test_a_copy_holds_the_same(backend: GLBackend, name: str) -> None:
    source, destination = (backend.make(FORMATS[name], SIZE) for _ in range(2))
    backend.upload(source, picture(FORMATS[name]))
    backend.copy(source, destination)
    assert np.array_equal(backend.download(destination), picture(FORMATS[name]))
    backend.release(source)
    backend.release(destination)


# sRGB formats are decoded on the way, which is the kernel's work.
@pytest.mark.parametrize("name", [name for name, format_ in FORMATS.items() if not format_.srgb])
def test_kernels_read_what_was_uploaded(name: str) -> None:
    format_ = FORMATS[name]
    copy = pg.kernel(source="def copy(image: Image) -> vec4: return image[0, 0]")
    target = copy(pg.Input("image", format=name, size=SIZE), into=pg.target("copy", format="rgba32f"))
    with pg.compile(target, backend="gl") as program:
        got = program(image=picture(format_))["copy"]
    expected = np.broadcast_to(np.array([0, 0, 0, 1], np.float32), (*SIZE[::-1], 4)).copy()
    expected[..., : format_.channels] = picture(format_)
    np.testing.assert_allclose(got, expected, rtol=0, atol=6e-8 if format_.steps else 0)


def test_uploads_round_halves_to_even(backend: GLBackend) -> None:
    storage = backend.make(FORMATS["r16f"], (2, 1))
    backend.upload(storage, np.array([[[2049.0], [2051.0]]], np.float32))
    assert backend.download(storage).ravel().tolist() == [2048.0, 2052.0]


def test_uploads_into_unorm_clip_and_take_nan_as_zero(backend: GLBackend) -> None:
    storage = backend.make(FORMATS["r8"], (4, 1))
    backend.upload(storage, np.array([[[-1.0], [2.0], [np.nan], [np.inf]]], np.float32))
    assert backend.download(storage).ravel().tolist() == [0.0, 1.0, 0.0, 1.0]


def test_infinities_and_nan_survive_in_float(backend: GLBackend) -> None:
    storage = backend.make(FORMATS["rgba32f"], (1, 1))
    values = np.array([[[np.inf, -np.inf, np.nan, -0.0]]], np.float32)
    backend.upload(storage, values)
    assert np.array_equal(backend.download(storage).view(np.int32), values.view(np.int32))


def test_a_copy_between_formats_is_refused(backend: GLBackend) -> None:
    source, destination = backend.make(FORMATS["r8"], SIZE), backend.make(FORMATS["r16"], SIZE)
    with pytest.raises(BackendError, match=r"cannot copy r8 .* into r16"):
        backend.copy(source, destination)


def test_a_side_beyond_the_device_is_refused_before_it_is_allocated(backend: GLBackend) -> None:
    alive = set(backend.objects.alive)
    with pytest.raises(BackendError, match="too large: this device takes"):
        backend.make(FORMATS["rgba32f"], (backend.max_size + 1, 1))
    assert backend.objects.alive == alive


def test_a_picture_beyond_the_memory_is_refused_before_it_is_allocated(backend: GLBackend) -> None:
    with pytest.raises(BackendError, match="not enough memory for a rgba32f target"):
        backend.make(FORMATS["rgba32f"], (backend.max_size, backend.max_size))
