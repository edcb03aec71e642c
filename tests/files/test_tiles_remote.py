"""Tiles on a cluster of processes: the same bits as here, each tile once, whatever becomes of workers."""

from __future__ import annotations

import os
import signal
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tifffile
import zarr

import passgraph as pg
from passgraph.tiles.tile_run import Job
from tests.files.tile_graphs import GRAPHS, frame, inputs, kernel, picture, same, untiled

SIZE = (61, 45)
GIVEN = picture(*SIZE)


def test_tiles_of_a_cluster_are_the_whole_bit_for_bit(client: Any) -> None:
    graph, given = GRAPHS["deep"]("mirror"), inputs(*SIZE)
    expected = untiled(graph, **given)
    result, seen = np.full_like(expected, np.nan), list[tuple[int, int]]()
    grid = pg.tiled(
        graph, given["frame"], result, tile=(20, 16), client=client, progress=lambda *told: seen.append(told)
    )
    assert same(result, expected)
    assert seen == [(number, len(grid)) for number in range(1, len(grid) + 1)], "each tile once"


@pytest.mark.parametrize("kind", ["tif", "zarr"])
def test_workers_read_files_that_they_see(kind: str, client: Any, tmp_path: Path, monkeypatch: Any) -> None:
    given = (GIVEN * 255).astype(np.uint8)
    source, sink = tmp_path / f"in.{kind}", tmp_path / f"out.{kind}"
    if kind == "tif":
        tifffile.imwrite(source, given, photometric="rgb", tile=(16, 16))
    else:
        zarr.create_array(store=str(source), data=given, chunks=(16, 16, 4))
    graph = GRAPHS["blur"]("clamp")
    read = "passgraph.tiles.tiff.TiffSource.read" if kind == "tif" else "passgraph.tiles.sources.ArraySource.read"
    with monkeypatch.context() as patch:
        patch.setattr(read, lambda *_: pytest.fail("it was read here"))
        pg.tiled(graph, source, sink, tile=(16, 16), client=client, dtype="float32", progress=False)
    made = tifffile.imread(sink) if kind == "tif" else zarr.open(str(sink), mode="r")[:]
    assert same(made, untiled(graph, frame=given))


def test_files_that_a_worker_sees_differently_are_sent(client: Any, tmp_path: Path, monkeypatch: Any) -> None:
    from passgraph.tiles.remote_windows import Named

    tifffile.imwrite(tmp_path / "in.tif", GIVEN, photometric="rgb")
    monkeypatch.setattr(Named, "from_path", staticmethod(lambda path: Named("/elsewhere/in.tif", 1, 1)))
    result = np.empty_like(GIVEN)
    pg.tiled(GRAPHS["blur"]("clamp"), tmp_path / "in.tif", result, tile=(20, 16), client=client, progress=False)
    assert same(result, untiled(GRAPHS["blur"]("clamp"), frame=GIVEN))


def test_tables_and_values_go_with_them(client: Any) -> None:
    table = picture(8, 1, seed=3)
    color = frame()
    graph = kernel("unsharp")(kernel("looked_up")(color, pg.Input("table")), color, pg.Value("amount", float))
    result = np.empty_like(GIVEN)
    given = {"frame": GIVEN, "table": table}
    pg.tiled(graph, given, result, tile=(20, 16), values={"amount": 0.5}, client=client, progress=False)
    with pg.compile(graph) as program:
        assert same(result, next(iter(program(**given, amount=0.5).values())))


def test_a_worker_killed_in_the_middle_costs_no_tile(client: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    pids, written, seen = list(client.run(os.getpid).values()), list[Any](), list[int]()
    write = Job.write
    monkeypatch.setattr(Job, "write", lambda job, tile, results: written.append(tile.core) or write(job, tile, results))

    def progress(done: int, _: int) -> None:
        seen.append(done)
        if done == 5:
            os.kill(pids[0], signal.SIGKILL)

    result = np.full_like(GIVEN, np.nan)
    grid = pg.tiled(GRAPHS["deep"]("clamp"), GIVEN, result, tile=(6, 5), client=client, progress=progress)
    assert same(result, untiled(GRAPHS["deep"]("clamp"), frame=GIVEN))
    assert len(written) == len(set(written)) == len(grid) == seen[-1] == len(seen)
    client.wait_for_workers(2)


@pytest.mark.slow
def test_a_worker_that_joins_later_takes_part(cluster: Any, client: Any) -> None:
    before = set(client.scheduler_info(n_workers=-1)["workers"])

    def progress(done: int, _: int) -> None:
        if done == 3:
            cluster.scale(3)
            client.wait_for_workers(3)

    result = np.full_like(GIVEN, np.nan)
    pg.tiled(GRAPHS["deep"]("clamp"), GIVEN, result, tile=(6, 5), client=client, progress=progress)
    assert same(result, untiled(GRAPHS["deep"]("clamp"), frame=GIVEN))
    made = client.run(lambda dask_worker: "passgraph-windows" in dask_worker.plugins)
    assert [made[address] for address in set(made) - before] == [True]


def test_a_tile_that_fails_leaves_no_file(client: Any, tmp_path: Path) -> None:
    spoilt = GIVEN.copy()
    spoilt[44, 60, 0] = np.nan
    with pytest.raises(pg.InputError, match=r"input 'frame'.*NaN.*counted in a tile that begins at column"):
        pg.tiled(GRAPHS["blur"]("clamp"), spoilt, tmp_path / "out.tif", tile=(20, 16), client=client, progress=False)
    assert list(tmp_path.iterdir()) == []


def test_what_is_no_client_or_does_not_travel_is_refused(client: Any, tmp_path: Path) -> None:
    graph, out = GRAPHS["blur"]("clamp"), np.empty_like(GIVEN)
    with pytest.raises(pg.InputError, match=r"client must be a distributed.Client .*, got str"):
        pg.tiled(graph, GIVEN, out, client="tcp://host:8786")  # type: ignore[arg-type]
    vignette = kernel("vignette")(frame(), pg.Value("amount", float))
    with pytest.raises(pg.InputError, match="value 'amount' must be numbers"):
        pg.tiled(vignette, GIVEN, tmp_path / "out.tif", values={"amount": abs}, client=client, progress=False)
    with pytest.raises(pg.GraphError, match="Python function"):
        pg.tiled(kernel("vignette")(frame(), pg.Value("k", float).map(abs)), GIVEN, out, client=client, progress=False)
    assert list(tmp_path.iterdir()) == []
