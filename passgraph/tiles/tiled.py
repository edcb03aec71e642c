"""Pictures larger than memory: any graph whose passes read at bounded offsets, tile by tile, bit for bit the same."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from contextlib import ExitStack, closing
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from passgraph import arguments
from passgraph.errors import InputError
from passgraph.image_formats import Metadata
from passgraph.pictures import metadata_of
from passgraph.plan.data import Options, Plan
from passgraph.run.finite_checks import NonFinite
from passgraph.tiles.grid import Grid
from passgraph.tiles.job import Wanted, blocks_room, prepared
from passgraph.tiles.sinks import Sink, planned_sink
from passgraph.tiles.sources import Source
from passgraph.tiles.tile_run import Advance, Graph, Job, Progress, report_progress, run_tiles

if TYPE_CHECKING:
    from distributed import Client

    from passgraph.backends.base import Backend


def tiled(
    graph: Graph,
    source: object = None,
    sink: object = None,
    memory: int | str = "1 GB",
    *,
    values: Mapping[str, object] | None = None,
    dtype: object = None,
    tile: tuple[int, int] | None = None,
    size: tuple[int, int] | None = None,
    backend: str | Backend | None = None,
    options: Options | None = None,
    non_finite: NonFinite = "error",
    progress: Progress = None,
    client: Client | None = None,
) -> Grid:
    """Compute pictures that are larger than memory, tile by tile; the results are those of the whole, bit for bit.

    Each tile is read with as much around it as the graph's passes reach together, computed, and written without it.
    Kernels see the whole picture's coordinates and sizes.  While a tile is computed, the next one is read and the last
    one written.

    Parameters
    ----------
    graph
        What `passgraph.compile` takes, or a program, whose backend, options and changed parameters then hold.
    source
        The input: the path of a TIFF or OpenEXR file (``shot.exr:diffuse`` for a layer) or Zarr array, or an array
        (NumPy, memory map, Zarr, HDF5, dask …), (h, w) or (h, w, 1 to 4); of several inputs a mapping by name.  Inputs
        of another size than the results are read whole.
    sink
        Where the result goes: a path that ends in .tif, .tiff, .exr or .zarr, or an array that takes
        ``array[rows, columns] = numbers``; of several results a mapping by name.  A TIFF file keeps the color profile
        and resolution of a TIFF input, and has no alpha where the input has none and the result is opaque.  Files and
        stores appear under their name when they are whole; an older one stays until then.  Into 8 and 16 bits go values
        from 0 to 1.
    memory
        Bytes that pictures, decoded blocks and compiled passes may take beside what the process holds already, such as
        ``"1 GB"`` or ``512 << 20``; tiles are as large as is good within it.
    values
        Run values by name.
    dtype
        What new files hold; left out, what the target's format does.
    tile
        (width, height) that each tile writes, in place of what ``memory`` decides.
    size
        (width, height) of results that take no input's size.
    backend, options, non_finite
        As `passgraph.compile`; ``reference``, which runs kernels as written, is refused.
    progress
        A function called with (tiles done, of all) after each tile; left out, a bar on a terminal; False: neither.
    client
        A ``distributed.Client``: tiles are read and computed by its workers, each on the backend of this name, and
        written here as they come; see docs/clusters.md.  ``memory`` is then what each worker may take.

    Returns
    -------
    How the picture was cut, and the bytes counted.

    Raises
    ------
    GraphError
        Where a graph cannot be computed in tiles: draws, `passgraph.previous`, reads at computed places
        (``image.sample``, ``image.texel``), passes of another size; the message names the pass.
    InputError
        For a source or sink that does not fit, a broken file, a full disk, and too little memory.

    Examples
    --------
    >>> import passgraph as pg
    >>> from passgraph.effects.filters.blur import gaussian_blur
    >>> soft = gaussian_blur(pg.Input("frame"), sigma_px=2.0, radius_px=7)
    >>> picture, result = np.ones((64, 96, 4), np.float32), np.zeros((64, 96, 4), np.float32)
    >>> grid = tiled(soft, picture, result, tile=(32, 32), progress=False)
    >>> len(grid), grid.window, bool(abs(result - 1.0).max() < 1e-6)
    (6, (46, 46), True)
    """
    wanted = Wanted(graph, source, memory, values, tile, size, backend, options, non_finite)
    with ExitStack() as stack:
        job = prepared(wanted, lambda plan, sources: _sinks(plan, sink, dtype, sources, source), stack)
        run = _runner(job, client, memory, stack)
        for each in job.sinks.values():
            stack.callback(each.abandon)
            each.open()
        with report_progress(progress, len(job.grid)) as advance:
            run(advance)
        for each in job.sinks.values():
            each.finish()
    return job.grid


def _runner(job: Job, client: Client | None, memory: int | str, stack: ExitStack) -> Callable[[Advance], None]:
    """Return the function that computes every tile of a job: here, or on the workers of a cluster."""
    if client is None:
        windows = stack.enter_context(closing(job.windows()))
        return lambda advance: run_tiles(job, windows, advance)
    from passgraph.files.remote import check_unchanged, checked_client
    from passgraph.tiles.remote_tiles import run_tiles_on

    checked_client(client)
    check_unchanged(job.bound.overrides)
    return lambda advance: run_tiles_on(client, job, blocks_room(memory), advance)


def _notes(sources: Mapping[str, Source], given: object) -> Metadata:
    """Return what a result keeps of the first input: color profile, resolution, and whether it has alpha."""
    name, source = next(iter(sources.items()), ("", None))
    picture = given.get(name) if isinstance(given, Mapping) else given
    found = metadata_of(Path(picture)) if isinstance(picture, (str, os.PathLike)) else Metadata()
    return replace(found, opaque=source is not None and source.shape[2] in (1, 3))


def _sinks(plan: Plan, given: object, dtype: object, sources: Mapping[str, Source], made_of: object) -> dict[str, Sink]:
    names = list(plan.outputs)
    if not isinstance(given, Mapping):
        if len(names) != 1:
            raise InputError(f"the graph has the results {', '.join(names)}; give sink as a mapping by name")
        given = {names[0]: given}
    strangers = [name for name in given if not arguments.among(name, names)]
    if strangers or len(given) != len(names):
        got = arguments.shown(strangers[0]) if strangers else ", ".join(map(repr, given)) or "none"
        raise InputError(f"sink must name each result ({', '.join(names)}) and nothing else, got {got}")
    found, notes = {}, _notes(sources, made_of)
    for name, resource in plan.outputs.items():
        info = plan.resources[resource]
        shape = info.size[1], info.size[0], info.format.channels
        found[name] = planned_sink(given[name], shape, info.format, dtype, f"sink of {name!r}", notes)
        _check_apart(given[name], sources, f"sink of {name!r}")
    return found


def _check_apart(sink: object, sources: Mapping[str, Source], what: str) -> None:
    """Tiles read around what others have written: an array may not be both."""
    for source in sources.values():
        array = getattr(getattr(source, "source", source), "array", None)
        both = isinstance(array, np.ndarray) and isinstance(sink, np.ndarray) and np.may_share_memory(array, sink)
        if array is not None and (array is sink or both):
            raise InputError(f"{what} is the array of {source.name} too; write into another one")
