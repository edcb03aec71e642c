"""Compute pictures larger than memory tile by tile, for graphs whose passes read at bounded offsets."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from contextlib import ExitStack, closing
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from passgraph import arguments
from passgraph.color_tags import ColorSpace, Recoded
from passgraph.errors import InputError
from passgraph.image_formats import Metadata
from passgraph.pictures import metadata_of
from passgraph.plan.data import Options, Plan
from passgraph.run.finite_checks import NonFinite
from passgraph.tiles.grid import Grid, Source
from passgraph.tiles.job import TileRequest, block_cache_bytes, prepared
from passgraph.tiles.sinks import Sink, planned_sink
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
    color: ColorSpace | Recoded | str | None = None,
    backend: str | Backend | None = None,
    options: Options | None = None,
    non_finite: NonFinite = "error",
    progress: Progress = None,
    client: Client | None = None,
) -> Grid:
    """Compute pictures that are larger than memory, tile by tile; the results equal those of the whole, bit for bit.

    Each tile is read and computed with a halo as wide as the graph's passes read together, and written without it.
    Kernels see the full picture's coordinates and sizes. While a tile is computed, the next one is read and the last
    one written.

    Parameters
    ----------
    graph
        An argument of `passgraph.compile`, or a program with its backend, options and changed parameters.
    source
        The input: the path of a TIFF or OpenEXR file (``shot.exr:diffuse`` for a layer) or Zarr array, or an array
        (NumPy, memory map, Zarr, HDF5, dask …), (h, w) or (h, w, 1 to 4). For several inputs, a mapping by name. Inputs
        of another size than the results are read whole.
    sink
        The output: a path that ends in .tif, .tiff, .exr or .zarr, or an array that supports
        ``array[rows, columns] = numbers``. For several results, a mapping by name. A TIFF file keeps the color profile
        and resolution of a TIFF input, and has no alpha if the input has none and the result is opaque. Files and
        stores are replaced atomically when they are complete. Outputs of 8 and 16 bits hold values from 0 to 1.
    memory
        Limit for pictures, decoded blocks and compiled passes, besides what the process uses already, such as
        ``"1 GB"`` or ``512 << 20``. The tile size is chosen within it.
    values
        Run values by name.
    dtype
        The dtype of new files; by default that of the target's format.
    tile
        (width, height) of a tile without its halo, instead of one chosen from ``memory``.
    size
        (width, height) of results that do not take an input's size.
    color
        The color space of the results, for color tags, as for `passgraph.save`; by default the tags of the input.
    backend, options, non_finite
        As in `passgraph.compile`; ``reference`` is not supported, since it runs kernels as written.
    progress
        A function called with (tiles done, all tiles) after each tile; by default a progress bar on a terminal; False
        for none.
    client
        A ``distributed.Client`` whose workers read and compute the tiles, on the backend of the same name; the caller
        writes them. See docs/clusters.md. ``memory`` is then the limit of each worker.

    Returns
    -------
    The tiling of the picture, with the estimated memory.

    Raises
    ------
    GraphError
        If the graph cannot be computed in tiles: draws, `passgraph.previous`, reads at computed positions
        (``image.sample``, ``image.texel``), passes of another size; the message names the pass.
    InputError
        For a source or sink that does not fit, a damaged file, a full disk, and too little memory.

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
    request = TileRequest(graph, source, memory, values, tile, size, backend, options, non_finite)
    with ExitStack() as stack:
        job = prepared(request, lambda plan, sources: _sinks(plan, sink, dtype, sources, source, color), stack)
        run = _runner(job, client, memory, stack)
        for output in job.sinks.values():
            stack.callback(output.abandon)
            output.open()
        with report_progress(progress, len(job.grid)) as advance:
            run(advance)
        for output in job.sinks.values():
            output.finish()
    return job.grid


def _runner(job: Job, client: Client | None, memory: int | str, stack: ExitStack) -> Callable[[Advance], None]:
    """Return the function that computes all tiles of a job, in this process or on a cluster."""
    if client is None:
        windows = stack.enter_context(closing(job.windows()))
        return lambda advance: run_tiles(job, windows, advance)
    from passgraph.files.remote import check_unchanged, checked_client
    from passgraph.tiles.remote_tiles import ClusterRun

    checked_client(client)
    check_unchanged(job.bound.overrides)
    return lambda advance: ClusterRun(client, job, block_cache_bytes(memory)).all(advance)


def _notes(sources: Mapping[str, Source], pictures: object, color: ColorSpace | Recoded | str | None) -> Metadata:
    """Return the metadata that a result keeps of the first input: color profile, resolution, and opacity."""
    name, source = next(iter(sources.items()), ("", None))
    picture = pictures.get(name) if isinstance(pictures, Mapping) else pictures
    metadata = metadata_of(Path(picture)) if isinstance(picture, (str, os.PathLike)) else Metadata()
    if color is not None:
        if not isinstance(color, (ColorSpace, Recoded)):
            color = ColorSpace(color, arguments.string(color, "tiled: color"))
        metadata = metadata.in_space(color)
    return replace(metadata, opaque=source is not None and source.shape[2] in (1, 3))


def _sinks(
    plan: Plan,
    outputs: object,
    dtype: object,
    sources: Mapping[str, Source],
    pictures: object,
    color: ColorSpace | Recoded | str | None,
) -> dict[str, Sink]:
    names = list(plan.outputs)
    if not isinstance(outputs, Mapping):
        if len(names) != 1:
            raise InputError(f"the graph has the results {', '.join(names)}; give sink as a mapping by name")
        outputs = {names[0]: outputs}
    unknown = [name for name in outputs if not arguments.among(name, names)]
    if unknown or len(outputs) != len(names):
        got = arguments.shown(unknown[0]) if unknown else ", ".join(map(repr, outputs)) or "none"
        raise InputError(f"sink must name each result ({', '.join(names)}) and nothing else, got {got}")
    sinks, notes = {}, _notes(sources, pictures, color)
    for name, resource in plan.outputs.items():
        info = plan.resources[resource]
        shape = info.size[1], info.size[0], info.format.channels
        sinks[name] = planned_sink(outputs[name], shape, info.format, dtype, f"sink of {name!r}", notes)
        _check_not_source(outputs[name], sources, f"sink of {name!r}")
    return sinks


def _check_not_source(sink: object, sources: Mapping[str, Source], what: str) -> None:
    """Raise InputError for a sink that is also a source; tiles would read what others have written."""
    for source in sources.values():
        array = getattr(getattr(source, "source", source), "array", None)
        overlap = isinstance(array, np.ndarray) and isinstance(sink, np.ndarray) and np.may_share_memory(array, sink)
        if array is not None and (array is sink or overlap):
            raise InputError(f"{what} is the array of {source.name} too; write into another one")
