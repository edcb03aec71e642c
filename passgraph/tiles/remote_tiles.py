"""Compute tiles on the workers of dask.distributed; the caller writes each result once."""

from __future__ import annotations

from itertools import islice
from typing import Any, cast

from passgraph.files.remote import cluster_errors, digest_and_text, serializable_values, threads_for
from passgraph.serialize import to_data
from passgraph.tiles.grid import Tile
from passgraph.tiles.tile_run import Advance, Job


class ClusterRun:
    """A run of a job on a cluster, with the tiles in flight; each worker keeps ``cache_bytes`` of decoded blocks."""

    def __init__(self, client: Any, job: Job, cache_bytes: int) -> None:
        from distributed import as_completed

        from passgraph.files.worker import Named, identity
        from passgraph.tiles import remote_windows as worker

        self.client, self.job, self._worker = client, job, worker
        values = serializable_values(job.values, "tiled")
        graph = digest_and_text(to_data(job.bound.outputs), job.bound.settings())
        shapes = {name: (source.shape, source.dtype.str) for name, source in job.sources.items()}
        shapes |= {name: (picture.shape, picture.dtype.str) for name, picture in job.uncut.items()}
        # The results of tasks are sent to each worker once, and recomputed if the worker that holds them is lost.
        shared = worker.SharedData(*graph, shapes, values, cache_bytes=cache_bytes)
        self.shared = client.submit(identity, shared, pure=False)
        self.uncut = client.submit(identity, dict(job.uncut), pure=False)
        self.files = {name: Named.from_path(path) for name, path in job.paths.items() if name in job.sources}
        self.done: Any = cast("Any", as_completed)(loop=client.loop)
        self.tiles: dict[Any, Tile] = {}

    def all(self, advance: Advance) -> None:
        """Compute and write all tiles; raise SchedulerLostError if the scheduler is lost, with incomplete sinks."""
        waiting = iter(self.job.grid)
        try:
            with cluster_errors(self.client, "a tile", "nothing took its name; run again"):
                for tile in islice(waiting, threads_for(self.client)):
                    self._submit(tile)
                while self.tiles:
                    future = next(self.done)
                    tile, results = self.tiles.pop(future), future.result()
                    if results is None:  # the worker does not see the same files
                        self._submit(tile, read_here=True)
                        continue
                    future.release()
                    self.job.write(Tile(tile.core, tile.core), results)
                    advance()
                    for following in islice(waiting, 1):
                        self._submit(following)
        finally:
            if self.tiles:
                self.client.cancel(list(self.tiles))

    def _submit(self, tile: Tile, *, read_here: bool = False) -> None:
        pictures: dict[str, Any] = {
            name: (None if read_here else self.files.get(name)) or source.read(tile.window)
            for name, source in self.job.sources.items()
        }
        future = self.client.submit(self._worker.computed, self.shared, tile, pictures, self.uncut, pure=False)
        self.tiles[future] = tile
        self.done.add(future)
