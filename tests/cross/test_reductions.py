"""Reductions against NumPy, in float64 and whole numbers."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import passgraph as pg
from passgraph.backends.base import Backend
from passgraph.srgb import srgb_to_linear

Picture = NDArray[Any]
SIZES = ((1, 1), (13, 1), (1, 70), (16384, 1), (129, 66))
AXES = {None: (0, 1), "x": 1, "y": 0}


def noise(size: tuple[int, int], channels: int = 4) -> Picture:
    """Of both signs, with many equal numbers."""
    random = np.random.default_rng(size[0])
    return (random.integers(-40, 40, (size[1], size[0], channels)) / 8).astype(np.float32)


def reduced(picture: Picture, *wanted: tuple[str, Any], format_: str = "rgba32f") -> dict[Any, Picture]:
    """What each of some reductions gives, by its word and axis."""
    frame = pg.Input("frame", format_)
    outputs = {f"{how} {axis}": pg.reduce(frame, how, axis=axis, name=f"{how} {axis}") for how, axis in wanted}
    with pg.compile(outputs, non_finite="keep") as program:
        made = program(frame=picture)
    return {key: made[f"{key[0]} {key[1]}"] for key in wanted}


@pytest.mark.sampled
@pytest.mark.parametrize("size", SIZES, ids=str)
def test_numbers_are_those_of_numpy(size: tuple[int, int]) -> None:
    picture = noise(size)
    exact = picture.astype(np.float64)
    found = reduced(picture, *((how, axis) for how in ("sum", "mean", "min", "max") for axis in AXES))
    for (how, axis), made in found.items():
        expected = getattr(exact, how)(AXES[axis], keepdims=True)
        assert made.shape == expected.shape
        # eighths: every sum is exact
        room = 2.0**-22 * abs(expected) if how == "mean" else 0.0
        assert (abs(made - expected) <= room).all(), (how, axis)


@pytest.mark.sampled
@pytest.mark.parametrize("size", SIZES, ids=str)
@pytest.mark.parametrize(("how", "numpy_way"), [("arg_min", np.argmin), ("arg_max", np.argmax)])
def test_places_are_the_first_of_numpy(size: tuple[int, int], how: str, numpy_way: Callable[..., Any]) -> None:
    picture = noise(size)
    red, (width, height) = picture[..., 0], size
    found = reduced(picture, *((how, axis) for axis in AXES))
    anywhere = int(numpy_way(red))
    assert found[how, None].tolist() == [[[anywhere % width, anywhere // width]]]
    rows = np.stack([numpy_way(red, axis=1), np.arange(height)], -1)
    assert np.array_equal(found[how, "x"][:, 0], rows)
    columns = np.stack([np.arange(width), numpy_way(red, axis=0)], -1)
    assert np.array_equal(found[how, "y"][0], columns)


def test_a_sum_is_within_its_bound() -> None:
    """Numbers that cancel, of sizes far apart."""
    random = np.random.default_rng(3)
    picture = (random.standard_normal((301, 517, 4)) * 10.0 ** random.integers(-6, 6, (301, 517, 4))).astype(np.float32)
    exact = picture.astype(np.float64)
    for axis, made in ((axis, made) for (_, axis), made in reduced(picture, *(("sum", axis) for axis in AXES)).items()):
        bound = 50 * 2.0**-24 * abs(exact).sum(AXES[axis], keepdims=True)
        assert (abs(made - exact.sum(AXES[axis], keepdims=True)) <= bound).all(), axis


def hard_sums() -> dict[str, Picture]:
    """What sums in float32 one after another lose: noise on a large constant, and numbers that nearly cancel."""
    random = np.random.default_rng(12)
    noise = random.random((301, 517), np.float32)
    apart = (random.standard_normal(301 * 517 - 1) * 10.0 ** random.integers(-8, 8, 301 * 517 - 1)).astype(np.float32)
    half = np.concatenate([apart[: len(apart) // 2], -apart[: len(apart) // 2], [np.float32(1e-3)]])
    return {
        "noise on a constant": np.float32(4096) + noise,
        "one small among many": np.where(noise > noise.max() * 0.999999, np.float32(1e7), np.float32(1e-3)),
        "cancelling": random.permutation(half).reshape(301, 517),
    }


@pytest.mark.sampled
@pytest.mark.parametrize("case", hard_sums())
def test_hard_sums_are_near_exact_ones(backend: Backend, case: str) -> None:
    """Against sums that are rounded once; and every backend rounds alike."""
    picture = hard_sums()[case]
    with pg.compile(pg.reduce(pg.Input("frame", "r32f"), "sum"), backend=backend) as program:
        made = float(program(frame=picture[..., None])["frame.sum"][0, 0, 0])
    with pg.compile(pg.reduce(pg.Input("frame", "r32f"), "sum"), backend="numpy") as program:
        assert made == float(program(frame=picture[..., None])["frame.sum"][0, 0, 0])
    numbers = picture.ravel().tolist()
    error, magnitudes = abs(made - math.fsum(numbers)), math.fsum(map(abs, numbers))
    assert error <= 50 * 2.0**-24 * magnitudes
    one_by_one = np.cumsum(picture.ravel(), dtype=np.float32)[-1]
    # Trees lose a tenth of what a sum one after another does, or nothing to speak of.
    assert error <= max(0.1 * abs(float(one_by_one) - math.fsum(numbers)), 2.0**-24 * magnitudes)


def test_nan_is_neither_least_nor_largest() -> None:
    picture = noise((20, 9), 1)
    picture[0, 0] = picture[4, 7] = picture[8] = np.nan
    wanted = (("min", None), ("max", "x"), ("arg_max", None), ("arg_min", "x"), ("sum", "x"))
    found = reduced(picture, *wanted, format_="r32f")
    assert found["min", None][0, 0, 0] == np.nanmin(picture)
    assert np.array_equal(found["max", "x"][:, 0, 0], [*np.nanmax(picture[:8, :, 0], 1), -np.inf])
    best = int(np.nanargmax(picture))
    assert found["arg_max", None][0, 0].tolist() == [best % 20, best // 20]
    assert found["arg_min", "x"][8, 0].tolist() == [-1, -1]
    assert np.isnan(found["sum", "x"][:, 0, 0]).tolist() == np.isnan(picture).any(1)[:, 0].tolist()


def test_infinities_have_places() -> None:
    picture = np.full((3, 5, 1), -np.inf, np.float32)
    assert reduced(picture, ("arg_max", None), format_="r32f")["arg_max", None][0, 0].tolist() == [0, 0]
    picture[2, 3] = np.inf
    assert reduced(picture, ("arg_max", None), format_="r32f")["arg_max", None][0, 0].tolist() == [3, 2]


@pytest.mark.parametrize(
    ("format_", "bits", "steps"), [("rgb8", np.uint8, 255), ("rg16", np.uint16, 65535), ("rgb8_srgb", np.uint8, 255)]
)
def test_stored_numbers_are_decoded_first(format_: str, bits: type, steps: int) -> None:
    """Channels that the picture lacks are 0, 0, 1, counted with every texel and none beyond."""
    random, channels = np.random.default_rng(5), 2 if format_ == "rg16" else 3
    picture = random.integers(0, steps + 1, (37, 50, channels)).astype(bits)
    values = picture / steps
    if format_.endswith("srgb"):
        values = srgb_to_linear(values)
    expected = np.zeros(4)
    expected[:channels], expected[3] = values.sum((0, 1)), 37 * 50
    found = reduced(picture, ("sum", None), ("max", None), format_=format_)
    assert np.allclose(found["sum", None][0, 0], expected, rtol=3e-6, atol=0)
    assert np.allclose(found["max", None][0, 0, :channels], values.max((0, 1)), rtol=3e-6, atol=0)


@pytest.mark.parametrize("channels", [1, 2, 3])
def test_a_target_takes_the_first_channels(channels: int) -> None:
    picture = noise((9, 9))
    into = pg.target("kept", f"{'rgb'[:channels]}32f")
    with pg.compile(pg.reduce(pg.Input("frame"), "mean", into=into)) as program:
        assert np.allclose(program(frame=picture)["kept"][0, 0], picture.mean((0, 1))[:channels], atol=1e-6)


def test_a_kernel_reads_what_is_reduced() -> None:
    """A static picture over its largest number; and last run's picture is one to reduce."""
    scaled = pg.kernel(source="def scaled(a: Image, top: Image) -> vec4: return a[0, 0] / top.texel(ivec2(0, 0)).r")
    table, spec = pg.Input("table", "rgba32f", (5, 4), static=True), pg.target("kept", "rgba32f")
    kept = scaled(table, pg.reduce(table, "max"), into=spec)
    late = pg.reduce(pg.previous(spec), "sum", name="late")
    picture = abs(noise((5, 4))) + 1
    with pg.compile([kept, late]) as program:
        first, second = program(table=picture), program(table=picture)
        levels = [step for step in program.plan.steps if step.name.startswith("table.max")]
    assert len(levels) == 5
    assert all(step.static for step in levels)
    expected = picture / picture[..., 0].max()
    assert np.allclose(first["kept"], expected, rtol=1e-6)
    assert (first["late"] == 0).all()
    assert np.allclose(second["late"], expected.sum((0, 1)), rtol=1e-6)


# Around them


def test_graphs_of_reductions_travel() -> None:
    frame = pg.Input("frame", "rgba32f")
    outputs = {"sum": pg.reduce(frame, "sum", axis="x"), "counts": pg.histogram(frame, 8)}
    picture = noise((30, 20))
    with pg.compile(outputs) as here, pg.compile(pg.from_data(pg.to_data(outputs))) as there:
        one, other = here(frame=picture), there(frame=picture)
    assert all(np.array_equal(one[name], other[name]) for name in outputs)


def test_what_hangs_on_a_whole_picture_is_not_tiled() -> None:
    over = pg.kernel(source="def over(a: Image, top: Image) -> vec4: return a[0, 0] / top.texel(ivec2(0, 0))")
    frame = pg.Input("frame")
    made = over(frame, pg.reduce(frame, "max", axis="x"), into=pg.target("over", "rgba32f"))
    picture = noise((40, 20))
    with pytest.raises(pg.GraphError) as caught:
        pg.tiled(made, picture, np.zeros_like(picture), tile=(8, 8), progress=False)
    assert "pass 'frame.max 1' reduces 'frame' (40x20) to 1x20 pixels" in str(caught.value)
    assert "compute the reduction apart" in str(caught.value)


FRAME = pg.Input("frame")


@pytest.mark.parametrize(
    ("call", "text"),
    [
        (lambda: pg.reduce(FRAME, "median"), "how cannot be 'median'; it is one of sum, mean, min, max"),  # type: ignore[arg-type]
        (lambda: pg.reduce(FRAME, "sum", axis="z"), "axis cannot be 'z'; it is one of x, y"),  # type: ignore[arg-type]
        (lambda: pg.reduce(FRAME, "sum", channel=1), "channel is for 'arg_min' and 'arg_max', and 'sum' gives every"),
        (lambda: pg.reduce(FRAME, "arg_min", channel=4), "channel must be 0, 1, 2, 3 or 'luma', got 4"),  # type: ignore[arg-type]
        (lambda: pg.reduce(pg.target("t"), "sum"), "target 't' is declared but not written"),  # type: ignore[arg-type]
        (lambda: pg.reduce(3, "sum"), "image must be a target that a pass returned, or pg.Input(...), got 3"),  # type: ignore[arg-type]
        (
            lambda: pg.reduce(FRAME, "sum", into=pg.target("t", "rgba32f", (1, 1))),
            "target 't' is declared with a size, but its size comes from the reduced picture; "
            "leave size, scale and like out",
        ),
        (lambda: pg.reduce(FRAME, "sum", into=FRAME), "give a new pg.target(...), not a handle"),  # type: ignore[arg-type]
        (lambda: pg.reduce(FRAME, "arg_min", into=pg.target("t", "rgba32f")), "use a format such as rg32f"),
        (lambda: pg.histogram(FRAME, 2049), "bins must be a whole number from 1 to 2048, got 2049"),
        (lambda: pg.histogram(FRAME, low=1.0), "low must be below high, got 1.0 and 1.0"),
        (lambda: pg.histogram(FRAME, low=-3e38, high=3e38), "as float32, got -3e+38 and 3e+38"),
        (lambda: pg.histogram(FRAME, low=0.0, high=4e-40), "high - low must be from 1e-34 to 3.4e+38 as float32"),
        (lambda: pg.histogram(FRAME, low=1.0, high=1.0 + 1e-9), "as float32, got 1.0 and 1.000000001"),
        (lambda: pg.histogram(FRAME, low=float("nan")), "low must be a finite number within float32"),
        (lambda: pg.histogram(FRAME, into=pg.target("t")), "use a format such as r32f"),
    ],
)
def test_wrong_arguments_are_told(call: Callable[[], object], text: str) -> None:
    with pytest.raises(pg.GraphError) as caught:
        call()
    assert text in str(caught.value)
