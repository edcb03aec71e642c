"""Results as arrays: parts computed when they are asked for, bit for bit those of the whole."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import dask.array
import numpy as np
import pytest
import tifffile

import passgraph as pg
from passgraph.tiles.lazy_array import LazyPicture
from tests.files.tile_graphs import GRAPHS, frame, kernel, picture, same, untiled

SIZE = (61, 45)
GIVEN = picture(*SIZE)


@pytest.fixture
def lazy() -> Iterator[LazyPicture]:
    with pg.lazily_tiled(GRAPHS["deep"]("mirror"), GIVEN, tile=(20, 16)) as made:
        yield made


@pytest.fixture(scope="module")
def whole() -> Any:
    return untiled(GRAPHS["deep"]("mirror"), frame=GIVEN)


@pytest.mark.parametrize(
    "key",
    [
        ..., 3, (3, 4), (3, 4, 2), (-1, -1), (slice(5, 40), slice(18, 23)), (slice(None), 7, slice(1, 3)),
        (..., 0), (slice(2, 30, 7), slice(None, None, 3)), (slice(9, 9), slice(None)), (slice(40, 99),),
    ],
    ids=str,
)  # fmt: skip
def test_parts_are_those_of_the_whole(key: Any, lazy: LazyPicture, whole: Any) -> None:
    assert same(lazy[key], whole[key])


@pytest.mark.parametrize("key", [45, (0, 61), (0, 0, 4), -46, "x", slice(None, None, -1), (0, 0.5), None])
def test_places_that_are_none(key: Any, lazy: LazyPicture) -> None:
    with pytest.raises(IndexError, match="a picture takes places from 0 to"):
        lazy[key]


def test_too_many_places(lazy: LazyPicture) -> None:
    with pytest.raises(pg.InputError, match=r"a picture takes \[rows, columns, channels\]"):
        lazy[0, 0, 0, 0]


def test_dask_computes_it_chunk_by_chunk(lazy: LazyPicture, whole: Any) -> None:
    array = dask.array.from_array(lazy, chunks=lazy.chunks)
    assert array.shape == (45, 61, 4)
    assert same((array * 2.0).compute(scheduler="threads"), whole * np.float32(2.0))


def test_threads_wait_for_each_other(lazy: LazyPicture, whole: Any) -> None:
    with ThreadPoolExecutor(4) as pool:
        rows = list(pool.map(lambda y: lazy[y], range(SIZE[1])))
    assert same(np.stack(rows), whole)


def test_a_chunk_takes_one_tile(lazy: LazyPicture, monkeypatch: pytest.MonkeyPatch) -> None:
    seen, job = [], type(lazy._job)
    compute = job.compute
    monkeypatch.setattr(job, "compute", lambda self, *given: seen.append(given) or compute(self, *given))
    lazy[16:32, 20:40]
    assert len(seen) == 1
    lazy[15:32, 20:41]
    assert len(seen) == 5


def test_it_closes_its_file(tmp_path: Path) -> None:
    tifffile.imwrite(tmp_path / "in.tif", GIVEN, photometric="rgb", tile=(16, 16))
    made = pg.lazily_tiled(GRAPHS["sobel"]("zero"), tmp_path / "in.tif", tile=(20, 16))
    assert same(made[:], untiled(GRAPHS["sobel"]("zero"), frame=GIVEN))
    made.close()
    made.close()
    with pytest.raises(pg.InputError, match="this picture is closed; call lazily_tiled again"):
        made[0]


def test_one_result_at_a_time() -> None:
    first = kernel("sobel")(frame(), into=pg.target("first", "rgba32f"))
    second = kernel("vignette")(first, 0.5, into=pg.target("second", "rgba32f"))
    with pytest.raises(pg.InputError, match="the graph has the results first, second; ask for one of them"):
        pg.lazily_tiled([first, second], GIVEN)
