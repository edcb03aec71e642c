"""Values on the host: constants of the language, NumPy's scalars as parameters, results as arrays, names to find."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import passgraph as pg
from passgraph.effects import gaussian_blur


@pytest.mark.parametrize(
    ("made", "expected"),
    [
        (lambda: pg.vec2(np.array(3)), (3, 3)),
        (lambda: pg.vec2(np.float16(1), np.uint8(200)), (1.0, 200)),
        (lambda: pg.mat3(np.eye(3)), (1, 0, 0, 0, 1, 0, 0, 0, 1)),
        (lambda: pg.mat2([[1, 2], [3, 4]]), (1, 2, 3, 4)),
        (lambda: pg.bvec2(np.bool_(True), False), (True, False)),
    ],
)
def test_arrays_are_numbers(made: Any, expected: tuple[Any, ...]) -> None:
    assert made() == expected
    assert not any(isinstance(number, np.generic) for number in made())


@pytest.mark.parametrize(
    ("made", "message"),
    [
        (lambda: pg.mat3(None), "mat3 takes numbers, got None"),
        (lambda: pg.vec3("abc"), "vec3 takes numbers, got 'abc'"),
        (lambda: pg.vec3([1, 2, "x"]), "vec3 takes numbers, got 'x'"),
        (lambda: pg.vec3(1, 2), "vec3 takes 3 numbers, got 2"),
        (lambda: pg.uint(float("nan")), "a uint is a whole number from 0 to 4294967295, got nan"),
        (lambda: pg.uint("five"), "got 'five'"),  # type: ignore[arg-type]
        (lambda: pg.uint(-1), "got -1"),
    ],
)
def test_other_things_are_refused(made: Any, message: str) -> None:
    with pytest.raises(pg.PassgraphError, match=message.replace("(", r"\(")):
        made()


@pytest.mark.parametrize("radius", [np.uint8(200), np.int8(100), np.int64(3)])
def test_scalars_of_numpy_are_numbers(radius: Any) -> None:
    """A uint8 would wrap where an effect adds to it."""
    frame = pg.Input("frame", "rgba32f", (8, 4))
    picture = np.random.default_rng(1).random((4, 8, 4), np.float32)
    found = []
    for value in (radius, int(radius)):
        with pg.compile(gaussian_blur(frame, sigma_px=2.0, radius_px=value), "reference") as program:
            found.append(np.asarray(program(frame=picture)))
    assert np.array_equal(*found)


def test_a_half_is_no_half_inside_of_an_effect() -> None:
    frame = pg.Input("frame", "rgba32f", (8, 4))
    one, other = (gaussian_blur(frame, sigma_px=value) for value in (np.float16(2.7), float(np.float16(2.7))))
    picture = np.random.default_rng(1).random((4, 8, 4), np.float32)
    with pg.compile(one, "reference") as first, pg.compile(other, "reference") as second:
        assert np.array_equal(np.asarray(first(frame=picture)), np.asarray(second(frame=picture)))


def test_a_result_of_one_target_is_its_array() -> None:
    picture = np.ones((2, 3, 4), np.float32)
    assert np.asarray(pg.Result({"a": picture})) is picture
    assert np.array(pg.Result({"a": picture}), np.float64).dtype == np.float64
    with pytest.raises(pg.InputError, match=r"a result of 2 targets is no array; name one of them: .* a, b"):
        np.asarray(pg.Result({"a": picture, "b": picture}))


def test_names_that_are_loaded_later_are_listed() -> None:
    assert {"load", "save", "Scene", "frames", "tiled", "gl"} <= set(dir(pg))
    assert all(hasattr(pg, name) for name in dir(pg))


@pytest.mark.parametrize(
    ("name", "meant"),
    [("opengl", "gl"), ("glsl", "gl"), ("angle", "gles"), ("cl", "opencl"), ("wgpu", "webgpu"), ("cpu", "numpy")],
)
def test_a_backend_by_its_common_name_is_hinted_at(name: str, meant: str) -> None:
    frame = pg.kernel(source="def copy(c: Image) -> vec4: return c[0, 0]")(pg.Input("frame"))
    with pytest.raises(pg.BackendError, match=f"did you mean '{meant}'"):
        pg.compile(frame, name)
