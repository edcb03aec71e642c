"""A graph's result as a lazy array: parts are computed when they are indexed, by dask, Zarr or a viewer."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import ExitStack, closing
from types import EllipsisType
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from passgraph import arguments
from passgraph.errors import InputError
from passgraph.image_files import paste
from passgraph.plan.data import Options, Plan
from passgraph.run.finite_checks import NonFinite
from passgraph.tiles.grid import Grid, Numbers, Part, Source
from passgraph.tiles.job import TileRequest, prepared
from passgraph.tiles.sinks import Sink
from passgraph.tiles.tile_run import Graph, Job, Windows

if TYPE_CHECKING:
    from passgraph.backends.base import Backend


Key: TypeAlias = "int | slice | EllipsisType | tuple[int | slice | EllipsisType, ...]"


def lazily_tiled(
    graph: Graph,
    source: object = None,
    memory: int | str = "1 GB",
    *,
    values: Mapping[str, object] | None = None,
    tile: tuple[int, int] | None = None,
    size: tuple[int, int] | None = None,
    backend: str | Backend | None = None,
    options: Options | None = None,
    non_finite: NonFinite = "error",
) -> LazyPicture:
    """Return the result of a graph as a lazy array: parts are computed when they are indexed.

    Arguments and errors are those of `passgraph.tiled`. Nothing is cached: a part that is read twice is computed twice.
    Thread-safe: parts are computed one at a time, with all cores.

    Examples
    --------
    >>> import passgraph as pg
    >>> from passgraph.effects.filters.blur import gaussian_blur
    >>> soft = gaussian_blur(pg.Input("frame"), sigma_px=2.0, radius_px=7)
    >>> with lazily_tiled(soft, np.ones((64, 96, 4), np.float32), tile=(32, 32)) as picture:
    ...     picture.shape, picture.chunks, bool(abs(picture[10:20, 40, 0] - 1.0).max() < 1e-6)
    ((64, 96, 4), (32, 32, 4), True)
    """
    with ExitStack() as stack:
        request = TileRequest(graph, source, memory, values, tile, size, backend, options, non_finite)
        job = prepared(request, _no_sinks, stack)
        windows = stack.enter_context(closing(job.windows()))
        name, resource = next(iter(job.plan.outputs.items()))
        shape = job.grid.size[1], job.grid.size[0], job.plan.resources[resource].format.channels
        return LazyPicture(job, windows, name, shape, stack.pop_all())


def _no_sinks(plan: Plan, _: Mapping[str, Source]) -> dict[str, Sink]:
    if len(plan.outputs) != 1:
        raise InputError(f"the graph has the results {', '.join(plan.outputs)}; ask for one of them")
    return {name: Sink() for name in plan.outputs}


class LazyPicture:
    """A lazy picture, (height, width, channels) float32, returned by :func:`lazily_tiled`.

    Index it as ``picture[rows, columns, channels]``. It holds its sources, pictures and compiled passes until
    :meth:`close`; it is also a context manager.
    """

    ndim = 3
    dtype: np.dtype[Any] = np.dtype(np.float32)

    def __init__(
        self, job: Job, windows: Windows, name: str, shape: tuple[int, int, int], resources: ExitStack
    ) -> None:
        self._job, self._windows, self._name, self._resources = job, windows, name, resources
        self.shape = shape
        self._closed = False

    @property
    def grid(self) -> Grid:
        """The tiling of the picture."""
        return self._job.grid

    @property
    def chunks(self) -> tuple[int, int, int]:
        """(height, width, channels) of a tile's core; parts along these are computed with the least overlap."""
        across, down = self.grid.core
        return down, across, self.shape[2]

    def __getitem__(self, key: Key) -> Numbers:
        rows, columns, channels = self._places(key)
        spans = [range(place, place + 1) if isinstance(place, int) else place for place in (rows, columns)]
        part = self._part((spans[0].start, spans[0].stop, spans[1].start, spans[1].stop))
        picked = tuple(0 if isinstance(place, int) else slice(None, None, place.step) for place in (rows, columns))
        last = channels if isinstance(channels, int) else slice(channels.start, channels.stop, channels.step)
        return part[(*picked, last)]

    def _places(self, key: Key) -> list[int | range]:
        """Return the index or the range of a key along each axis."""
        indices = list(key) if isinstance(key, tuple) else [key]
        if ... in indices:
            at = indices.index(...)
            indices[at : at + 1] = [slice(None)] * (4 - len(indices))
        indices += [slice(None)] * (3 - len(indices))
        if len(indices) != 3:
            raise InputError(f"a picture takes [rows, columns, channels], got {arguments.shown(key)}")
        return [self._place(index, length) for index, length in zip(indices, self.shape, strict=True)]

    def _place(self, index: object, length: int) -> int | range:
        if isinstance(index, slice) and index.step in (None, *range(1, length + 1)):
            return range(*index.indices(length))
        if isinstance(index, (int, np.integer)) and -length <= index < length:
            return int(index) % length
        expected = f"places from 0 to {length - 1}, and slices of them with steps from 1"
        raise IndexError(f"a picture takes {expected}, got {arguments.shown(index)}")

    def _part(self, part: Part) -> Numbers:
        top, bottom, left, right = part
        joined = np.empty((max(0, bottom - top), max(0, right - left), self.shape[2]), np.float32)
        if not joined.size:
            return joined
        with self._job.bound.backend.turn:
            if self._closed:
                raise InputError("this picture is closed; call lazily_tiled again")
            for tile in self.grid.touching(part):
                pictures = self._job.admitted(self._windows, tile)
                result: Numbers = self._job.compute(self._windows, tile, pictures)[self._name]
                (y, _, x, _), (y0, y1, x0, x1) = tile.window, tile.core
                paste(joined, (top, left), result[y0 - y : y1 - y, x0 - x : x1 - x], (y0, x0))
        return joined

    def close(self) -> None:
        """Release the resources; idempotent."""
        with self._job.bound.backend.turn:
            self._closed = True
            self._resources.close()

    def __enter__(self) -> LazyPicture:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
