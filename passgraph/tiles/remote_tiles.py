"""Tiles on other machines: workers read and compute, and what is ready is written here, each tile once."""

from __future__ import annotations

from itertools import islice
from typing import Any, cast

from passgraph.files.remote import digest_and_text, lost_reported, threads_for, travelling_values
from passgraph.serialize import to_data
from passgraph.tiles.grid import Tile
from passgraph.tiles.tile_run import Advance, Job, Pictures


def run_tiles_on(client: Any, job: Job, room: int, advance: Advance) -> None:
    """Every tile of a job by the workers of a cluster; ``room`` bytes hold decoded blocks of files in each of them.

    Raises
    ------
    SchedulerLostError
        Where the scheduler goes away; what sinks have then is not whole.
    """
    _Run(client, job, room).all(advance)


class _Run:
    """Tiles under way."""

    def __init__(self, client: Any, job: Job, room: int) -> None:
        from distributed import as_completed

        from passgraph.files.worker import Named, same
        from passgraph.tiles import remote_windows as worker

        self.client, self.job, self._worker = client, job, worker
        values = travelling_values(job.values, "tiled")
        graph = digest_and_text(to_data(job.bound.outputs), job.bound.settings())
        shapes = {name: (source.shape, source.dtype.str) for name, source in job.sources.items()}
        shapes |= {name: (picture.shape, picture.dtype.str) for name, picture in job.whole.items()}
        # As results of tasks they are sent to a worker once, and made again where a worker is lost that held them.
        self.told = client.submit(same, worker.Told(*graph, shapes, values, room=room), pure=False)
        self.whole = client.submit(same, dict(job.whole), pure=False)
        self.files = {name: Named.of(path) for name, path in job.paths.items() if name in job.sources}
        self.done: Any = cast("Any", as_completed)(loop=client.loop)
        self.tiles: dict[Any, Tile] = {}

    def all(self, advance: Advance) -> None:
        waiting = iter(self.job.grid)
        try:
            with lost_reported(self.client, "a tile", "nothing took its name; run again"):
                for tile in islice(waiting, threads_for(self.client)):
                    self._ask(tile)
                while self.tiles:
                    future = next(self.done)
                    tile, results = self.tiles.pop(future), future.result()
                    if results is None:  # that worker does not see the files
                        self._ask(tile, read_here=True)
                        continue
                    future.release()
                    self._write(tile, results)
                    advance()
                    for following in islice(waiting, 1):
                        self._ask(following)
        finally:
            if self.tiles:
                self.client.cancel(list(self.tiles))

    def _ask(self, tile: Tile, *, read_here: bool = False) -> None:
        pictures: dict[str, Any] = {
            name: (None if read_here else self.files.get(name)) or source.read(tile.window)
            for name, source in self.job.sources.items()
        }
        future = self.client.submit(self._worker.computed, self.told, tile, pictures, self.whole, pure=False)
        self.tiles[future] = tile
        self.done.add(future)

    def _write(self, tile: Tile, results: Pictures) -> None:
        self.job.write(Tile(tile.core, tile.core), results)
