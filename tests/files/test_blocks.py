"""Programs over dask arrays: bit for bit the whole picture, whatever the chunks, and only strips of neighbours move."""

from __future__ import annotations

import os
import signal
from typing import Any

import dask
import dask.array
import numpy as np
import pytest

import passgraph as pg
from passgraph.effects import gaussian_blur
from passgraph.tiles.remote_windows import MOST_WINDOWS, WINDOWS
from tests.files.tile_graphs import GRAPHS, frame, inputs, kernel, picture, same, untiled

SIZE = (41, 29)
#: Regular, smaller than the reach, of every length, one chunk, one row and one column each, empty ones among them.
CHUNKS = {
    "regular": ((10, 10, 9), (16, 16, 9)),
    "smaller than the reach": ((3,) * 9 + (2,), (5,) * 8 + (1,)),
    "uneven": ((1, 17, 2, 9), (30, 1, 1, 9)),
    "one": ((29,), (41,)),
    "rows": ((1,) * 29, (41,)),
    "with empty ones": ((0, 20, 9), (20, 0, 21)),
}


def chunked(array: Any, chunks: Any) -> Any:
    return dask.array.from_array(array, chunks=(*chunks, -1)[: array.ndim])


def computed(array: Any) -> Any:
    with dask.config.set(scheduler="threads"):
        return array.compute()


@pytest.mark.sampled
@pytest.mark.parametrize("chunks", CHUNKS.values(), ids=CHUNKS)
@pytest.mark.parametrize("name", ["deep", "blur", "depth-aware blur", "black and white"])
def test_chunks_are_the_whole_bit_for_bit(name: str, chunks: Any) -> None:
    graph, given = GRAPHS[name]("mirror"), inputs(*SIZE)
    with pg.compile(graph) as program:
        brought = {each: chunked(given[each], chunks) for each in program.inputs}
        made = pg.map_blocks(program, **brought)
        assert same(computed(made), untiled(graph, **given))
    assert made.chunks[:2] == tuple(tuple(count for count in axis if count) for axis in chunks)


@pytest.mark.parametrize("size", [(1, 1), (1, 9), (9, 1), (3, 3)])
def test_pictures_smaller_than_the_reach(size: tuple[int, int]) -> None:
    given = picture(*size)
    with pg.compile(GRAPHS["deep"]("zero")) as program:
        made = pg.map_blocks(program, dask.array.from_array(given, chunks=(2, 2, 4)))
        assert same(computed(made), untiled(GRAPHS["deep"]("zero"), frame=given))


def test_a_border_that_repeats_needs_whole_rows() -> None:
    given = picture(*SIZE)
    with pg.compile(GRAPHS["blur"]("repeat")) as program:
        made = pg.map_blocks(program, chunked(given, CHUNKS["regular"]))
        assert same(computed(made), untiled(GRAPHS["blur"]("repeat"), frame=given))


def test_inputs_have_chunks_of_their_own_and_tables_come_whole() -> None:
    table = picture(8, 1, seed=3)
    graph = kernel("looked_up")(frame(), pg.Input("table"))
    given = picture(*SIZE)
    with pg.compile(graph) as program:
        made = pg.map_blocks(
            program, chunked(given, CHUNKS["uneven"]), table=dask.array.from_array(table, chunks=(1, 3, 4))
        )
        assert same(computed(made), untiled(graph, frame=given, table=table))
    depth_aware, both = GRAPHS["depth-aware blur"]("clamp"), inputs(*SIZE)
    with pg.compile(depth_aware) as program:
        made = pg.map_blocks(
            program, frame=chunked(both["frame"], CHUNKS["regular"]), depth=chunked(both["depth"], CHUNKS["uneven"])
        )
        assert same(computed(made), untiled(depth_aware, **both))


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.float16, np.float64])
def test_types_and_planes(dtype: Any) -> None:
    plane = (picture(*SIZE, 1)[:, :, 0] * (255 if np.dtype(dtype).kind == "u" else 1)).astype(dtype)
    graph = kernel("one")(frame(), into=pg.target("soft", "r16f"))
    with pg.compile(graph, results="stored") as program:
        made = pg.map_blocks(program, chunked(plane, CHUNKS["uneven"]))
        assert made.dtype == np.float16 and made.shape == (29, 41, 1)
        assert same(computed(made), program(frame=plane)["soft"])


def test_chunks_along_the_channels_are_joined() -> None:
    given = picture(*SIZE)
    with pg.compile(GRAPHS["sobel"]("clamp")) as program:
        made = pg.map_blocks(program, dask.array.from_array(given, chunks=(16, 16, 1)))
        assert same(computed(made), untiled(GRAPHS["sobel"]("clamp"), frame=given))


def test_values_are_those_of_the_call() -> None:
    color = frame()
    graph = kernel("unsharp")(color, gaussian_blur(color, 1.0), pg.Value("amount", float))
    given = picture(*SIZE)
    with pg.compile(graph) as program:
        lazy = [pg.map_blocks(program, chunked(given, CHUNKS["regular"]), amount=amount) for amount in (0.25, 2.0)]
        assert lazy[0].name != lazy[1].name
        for amount, made in zip((0.25, 2.0), lazy, strict=True):
            assert same(computed(made), untiled_with(graph, given, amount=amount))


def untiled_with(graph: Any, given: Any, **values: float) -> Any:
    with pg.compile(graph) as program:
        return next(iter(program(frame=given, **values).values()))


def test_one_program_after_another_and_dasks_own_operations_between() -> None:
    given = picture(*SIZE)
    with pg.compile(GRAPHS["blur"]("clamp")) as soft, pg.compile(GRAPHS["sobel"]("clamp")) as edges:
        made = pg.map_blocks(edges, pg.map_blocks(soft, chunked(given, CHUNKS["regular"])) * np.float32(0.5))
        half = untiled(GRAPHS["blur"]("clamp"), frame=given) * np.float32(0.5)
        assert same(computed(made), untiled(GRAPHS["sobel"]("clamp"), frame=half))


# Lazily


def counting(shape: tuple[int, int, int], chunks: Any, seen: list[Any]) -> Any:
    def load(block_info: Any = None) -> Any:
        seen.append(block_info[None]["chunk-location"][:2])
        return np.zeros(block_info[None]["chunk-shape"], np.float32)

    return dask.array.map_blocks(load, chunks=chunks, dtype=np.float32, meta=np.empty((0, 0, 0), np.float32))


def test_a_chunk_loads_its_neighbours_alone_and_each_once() -> None:
    seen: list[Any] = []
    array = counting((90, 90, 4), ((30,) * 3, (30,) * 3, (4,)), seen)
    with pg.compile(GRAPHS["blur"]("clamp")) as program:
        made = pg.map_blocks(program, array)
        assert seen == [], "nothing is computed before it is asked for"
        computed(made[0:10, 0:10])
        assert sorted(seen) == [(0, 0), (0, 1), (1, 0), (1, 1)]
        seen.clear()
        computed(made)
    assert sorted(seen) == sorted((i, j) for i in range(3) for j in range(3))


def test_what_is_cut_from_neighbours_is_as_wide_as_the_reach() -> None:
    given = dask.array.zeros((90, 90, 4), chunks=(30, 30, 4), dtype=np.float32)
    with pg.compile(GRAPHS["blur"]("clamp")) as program:  # which reaches 7 pixels
        made = pg.map_blocks(program, given)
    layer = made.dask.layers[made.name]
    strips = [key for key in layer if isinstance(key, tuple) and key[0].startswith("passgraph-strip")]
    cut = {(key[4] - key[3], key[6] - key[5]) for key in strips}
    assert {(7, 30), (30, 7), (7, 7)} <= cut
    # At the picture's edge windows are moved inward, so that all are of one shape.
    assert sum((key[4] - key[3]) * (key[6] - key[5]) for key in strips) == 9 * (44 * 44 - 30 * 30)
    assert max(max(each) for each in cut) == 30


def test_a_pass_that_reads_one_pixel_copies_nothing() -> None:
    given = dask.array.zeros((90, 90, 4), chunks=(30, 30, 4), dtype=np.float32)
    with pg.compile(GRAPHS["black and white"]("clamp")) as program:
        made = pg.map_blocks(program, given)
    assert not [key for key in made.dask.layers[made.name] if "strip" in str(key)]


# On a cluster


def test_workers_compile_each_shape_once_and_keep_it(client: Any) -> None:
    given = picture(96, 96)
    expected = untiled(GRAPHS["deep"]("clamp"), frame=given)
    with pg.compile(GRAPHS["deep"]("clamp")) as program:
        for _ in range(2):
            made = pg.map_blocks(program, dask.array.from_array(given, chunks=(24, 24, 4)))
            assert same(client.compute(made).result(), expected)
    counted = client.run(lambda dask_worker: dask_worker.plugins["passgraph-windows"].compiled)
    assert WINDOWS == "passgraph-windows"
    assert all(1 <= count <= 4 for count in counted.values()), counted
    kept = client.run(lambda dask_worker: len(dask_worker.plugins["passgraph-windows"].kept))
    assert all(count <= MOST_WINDOWS for count in kept.values())


def test_a_worker_killed_in_the_middle_costs_no_chunk(client: Any) -> None:
    given = picture(96, 96)
    with pg.compile(GRAPHS["deep"]("clamp")) as program:
        made = pg.map_blocks(program, dask.array.from_array(given, chunks=(8, 8, 4)))
        future = client.compute(made)
        os.kill(next(iter(client.run(os.getpid).values())), signal.SIGKILL)
        assert same(future.result(), untiled(GRAPHS["deep"]("clamp"), frame=given))
    client.wait_for_workers(2)


def test_numbers_that_are_none_are_told_with_their_place(client: Any) -> None:
    given = picture(64, 64)
    given[40, 50, 1] = np.nan
    with pg.compile(GRAPHS["blur"]("clamp")) as program:
        made = pg.map_blocks(program, dask.array.from_array(given, chunks=(32, 32, 4)))
        with pytest.raises(pg.InputError, match=r"input 'frame'.*NaN.*\(counted in a tile that begins at column"):
            client.compute(made).result()


# What is refused


def test_several_results() -> None:
    color = frame()
    both = [kernel("sobel")(color, into=pg.target("a", "rgba32f")), gaussian_blur(color, 1.0)]
    with pg.compile(both) as program, pytest.raises(pg.InputError, match="the results a, gaussian_blur; compile it"):
        pg.map_blocks(program, dask.array.zeros((8, 8, 4)))


def test_chunks_of_unknown_sizes() -> None:
    array = dask.array.from_array(np.arange(12.0).reshape(3, 4), chunks=2)
    with pg.compile(GRAPHS["sobel"]("clamp")) as program, pytest.raises(pg.InputError, match="compute_chunk_sizes"):
        pg.map_blocks(program, array[array[:, 0] > 1])


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({}, "input 'frame' is missing; call map_blocks"),
        ({"frame": dask.array.zeros((8, 8, 5))}, r"must have the shape \(h, w\)"),
        ({"frame": dask.array.zeros((0, 8, 4))}, "at least one pixel"),
        ({"frame": dask.array.zeros((8, 8, 4), dtype=np.int64)}, "dtype int64; give uint8"),
        ({"frame": "there.tif"}, "input 'frame'"),
        ({"frame": dask.array.zeros((8, 8, 4)), "amount": abs}, "value 'amount' must be numbers"),
    ],
)
def test_what_does_not_fit(given: dict[str, Any], message: str) -> None:
    graph = kernel("vignette")(frame(), pg.Value("amount", float))
    with pg.compile(graph) as program, pytest.raises(pg.InputError, match=message):
        pg.map_blocks(program, **given)


def test_what_cannot_be_cut_or_travel() -> None:
    shape = dask.array.zeros((8, 8, 4))
    into = pg.target("trail", "rgba32f")
    trail = pg.kernel(source="def trail(a: Image, b: Image) -> vec4: return mix(a[0, 0], b[0, 0], 0.5)")
    with pg.compile(trail(frame(), pg.previous(into), into=into)) as program, pytest.raises(pg.GraphError):
        pg.map_blocks(program, shape)
    mapped = kernel("vignette")(frame(), pg.Value("amount", float).map(abs))
    with pg.compile(mapped) as program, pytest.raises(pg.GraphError, match="Python function"):
        pg.map_blocks(program, shape, amount=1.0)
    with pg.compile(kernel("vignette")(pg.Input("frame", "rgba32f", (8, 8)), 0.5)) as program:
        program.set("vignette", "amount", 0.25)
        with pytest.raises(pg.InputError, match=r"program.set changed cannot be serialized"):
            pg.map_blocks(program, shape)
    with pytest.raises(pg.GraphError, match="this program is closed"):
        pg.map_blocks(program, shape)
