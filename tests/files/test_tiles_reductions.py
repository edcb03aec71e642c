"""Reductions, histograms and percentiles of pictures that are cut: the bits of the whole, whatever the tiles."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import passgraph as pg
from passgraph.effects import auto_exposure, gaussian_blur, normalize
from tests.files.tile_graphs import picture, same, untiled

FRAME = picture(333, 210, 3) * 2.0 - 0.5
FRAME[7, 9, 1] = np.nan

KERNELS = """
def put_together(color: Image, low: Image, high: Image, middle: Image, counts: Image) -> vec4:
    a, b, c = low.texel(ivec2(0, 0)), high.texel(ivec2(0, 0)), middle.texel(ivec2(0, 0))
    return vec4((color[0, 0].rgb - a.rgb) / (b.rgb - a.rgb) + c.rgb, counts.texel(ivec2(3, 0)).r)

def away(color: Image, middle: Image) -> vec4:
    d = color[0, 0] - middle.texel(ivec2(0, 0))
    return d * d

def scored(color: Image, middle: Image, variance: Image) -> vec4:
    return (color[0, 0] - middle.texel(ivec2(0, 0))) / sqrt(variance.texel(ivec2(0, 0)) + vec4(1e-6))
"""


def kernel(name: str) -> Any:
    return pg.kernel(source=KERNELS, name=name)


def everything() -> pg.Target:
    frame = pg.Input("frame")
    soft = gaussian_blur(frame, 2.0, name="soft")
    low, high = pg.reduce(frame, "min"), pg.reduce(soft, "max")
    made: pg.Target = kernel("put_together")(frame, low, high, pg.reduce(soft, "sum"), pg.histogram(frame, 64))
    return made


def scores() -> pg.Target:
    """A reduction of what depends on a reduction: the standard deviation."""
    frame = pg.Input("frame")
    middle = pg.reduce(frame, "mean")
    squares = kernel("away")(frame, middle, into=pg.target("squares", "rgba32f"))
    made: pg.Target = kernel("scored")(frame, middle, pg.reduce(squares, "mean"))
    return made


def sent() -> pg.Target:
    return pg.from_data(pg.to_data({"made": everything()}))["made"]


GRAPHS: dict[str, Callable[[], pg.Target]] = {
    "everything": everything,
    "scores": scores,
    "sent": sent,
    "auto exposure": lambda: auto_exposure(pg.Input("frame")),
    "normalize": lambda: normalize(pg.Input("frame"), 2.0, 97.5),
}
#: One with NaN in it makes NaN of sums.
GIVEN = {"scores": np.nan_to_num(FRAME)}


def given(name: str) -> Any:
    return GIVEN.get(name, FRAME)


@pytest.fixture(scope="module")
def wholes() -> dict[str, Any]:
    found = {}
    for name, graph in GRAPHS.items():
        with pg.compile(graph(), non_finite="keep") as program:
            found[name] = next(iter(program(frame=given(name)).values()))
    return found


@pytest.mark.parametrize("name", GRAPHS)
@pytest.mark.parametrize("tile", [(64, 64), (100, 70), (333, 11), None], ids=str)
def test_tiles_do_not_change_the_result(name: str, tile: Any, wholes: dict[str, Any]) -> None:
    result = np.zeros_like(wholes[name])
    pg.tiled(GRAPHS[name](), given(name), result, tile=tile, non_finite="keep", progress=False)
    assert same(result, wholes[name])


@pytest.mark.parametrize("name", ["everything", "normalize"])
@pytest.mark.parametrize("chunks", [(50, 130), (64, 64), (210, 333)], ids=str)
def test_chunks_of_dask_do_not_change_the_result(name: str, chunks: Any, wholes: dict[str, Any]) -> None:
    dask_array = pytest.importorskip("dask.array")
    with pg.compile(GRAPHS[name](), non_finite="keep") as program:
        made = pg.map_blocks(program, dask_array.from_array(given(name), chunks=(*chunks, 3)))
    assert same(made.compute(scheduler="sync"), wholes[name])


def test_a_part_of_a_lazy_picture(wholes: dict[str, Any]) -> None:
    with pg.lazily_tiled(everything(), FRAME, tile=(90, 80), non_finite="keep") as lazy:
        assert same(lazy[20:150, 60:300], wholes["everything"][20:150, 60:300])


def test_numbers_are_those_of_numpy() -> None:
    """The truth that shares no code: a mean in float64, and counts."""
    frame, half = pg.Input("frame", "r32f"), "def half(n: Image, one: Image) -> float: return one.texel(ivec2(0, 0)).r"
    numbers = picture(500, 300, 1)
    for how, expected in (("mean", numbers.astype(np.float64).mean()), ("max", numbers.max()), ("min", numbers.min())):
        result = np.zeros((300, 500), np.float32)
        graph = pg.kernel(source=half)(frame, pg.reduce(frame, how))
        pg.tiled(graph, numbers, result, tile=(77, 99), progress=False)
        assert abs(result[0, 0] - expected) <= 60 * 2.0**-24
    counted = np.zeros((300, 500), np.float32)
    third = "def third(n: Image, c: Image) -> float: return c.texel(ivec2(2, 0)).r"
    pg.tiled(pg.kernel(source=third)(frame, pg.histogram(frame, 8, channel=0)), numbers, counted, progress=False)
    assert counted[0, 0] == np.histogram(numbers, 8, (0.0, 1.0))[0][2]


@pytest.mark.parametrize("percent", [0.0, 1.0, 37.5, 50.0, 99.0, 100.0])
def test_percentiles_are_those_of_numpy(percent: float) -> None:
    for seed, numbers in enumerate((picture(133, 90, 1) * 7 - 2, picture(133, 90, 1) ** 9, np.full((3, 4, 1), 2.5))):
        shown = untiled(pg.percentile(pg.Input("frame", "r32f"), percent), frame=numbers)[0, 0, 0]
        expected = np.percentile(numbers.astype(np.float32), percent, method="inverted_cdf")
        assert abs(shown - expected) <= np.ptp(numbers) * 2.0**-22, seed


def test_percent_is_checked_and_may_change_from_run_to_run() -> None:
    with pytest.raises(pg.GraphError, match="percent must be a number from 0 to 100, got 101"):
        pg.percentile(pg.Input("frame"), 101)
    share = pg.Value("share", default=50.0)
    with pg.compile(pg.percentile(pg.Input("frame", "r32f"), share)) as program:
        ramp = np.arange(101, dtype=np.float32)[None]
        found = [float(program(frame=ramp, share=by)["frame.percentile"][0, 0, 0]) for by in (0.0, 25.0, 100.0)]
    assert np.allclose(found, [0.0, 25.0, 100.0], atol=1e-4)


def test_rows_and_places_are_still_refused() -> None:
    frame = pg.Input("frame")
    look = "def look(color: Image, found: Image) -> vec4: return color[0, 0] + found.texel(ivec2(0, 0))"
    for one in (pg.reduce(frame, "max", axis="x"), pg.reduce(frame, "arg_max")):
        with pytest.raises(pg.GraphError, match="cannot be computed tile by tile"):
            pg.tiled(pg.kernel(source=look)(frame, one), FRAME, np.zeros((210, 333, 4)), progress=False)
