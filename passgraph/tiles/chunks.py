"""Run a program over the chunks of a dask array; each chunk is read with its halo.

The halo consists of strips of the neighboring chunks. Only these strips are sent to the worker that computes the
chunk. Unlike `dask.array.overlap`, no array of overlapping chunks is built.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from itertools import accumulate
from typing import Any

import numpy as np

from passgraph import arguments
from passgraph.errors import GraphError, InputError
from passgraph.files.remote import check_unchanged, digest_and_text, serializable_values
from passgraph.graph.run_values import sources_of
from passgraph.graph.targets import Target
from passgraph.plan.dependencies import passes_behind
from passgraph.plan.window import footprint
from passgraph.run.caller_arrays import GREY_CHANNELS
from passgraph.run.program import Program
from passgraph.tiles.grid import Numbers, Part, Tile, checked_dtype, checked_shape
from passgraph.tiles.reductions import BLOCK, Merging, Reduction, resolved
from passgraph.tiles.tile_run import bound, result_size, whole_plan

#: (start, stop) of a chunk along an axis, and of the window that it is computed from.
Spans = tuple[tuple[int, int], tuple[int, int]]


def map_blocks(program: Program, array: Any = None, /, **inputs: Any) -> Any:
    """Run a program over a dask array lazily; return a dask array of the same chunks.

    The result equals that of the whole picture bit for bit. Each chunk is a task, which reads its own chunk and, as its
    halo, strips of the neighboring chunks. The graph is serialized; a worker of dask.distributed compiles it once for
    each chunk shape and keeps it.

    Parameters
    ----------
    program
        The result of :func:`passgraph.compile`, with one output.
    array
        The picture of the one input without a default, ``(h, w)`` or ``(h, w, 1 to 4)``, in chunks of any shape.
    inputs
        Inputs (dask arrays of any chunks, or other arrays) and run values (numbers and arrays) by name.

    Returns
    -------
    dask.array.Array
        (height, width, channels) in float32, or in the target's dtype if compiled with ``results="stored"``; chunked
        as the first input that is not read whole.

    Raises
    ------
    GraphError
        If the graph cannot be computed in parts (see docs/large-pictures.md) or serialized (docs/serialization.md).
    InputError
        For a picture or value that does not fit, chunks of unknown sizes, and several outputs.

    Examples
    --------
    >>> import dask.array
    >>> import passgraph as pg
    >>> from passgraph.effects.filters.blur import gaussian_blur
    >>> picture = dask.array.ones((64, 96, 4), chunks=(40, 50, 4), dtype="float32")
    >>> with pg.compile(gaussian_blur(pg.Input("frame"), sigma_px=2.0, radius_px=7)) as program:
    ...     soft = pg.map_blocks(program, picture)
    >>> soft.chunks, bool(abs(soft - 1.0).max().compute() < 1e-6)
    (((40, 24), (50, 46), (4,)), True)
    """
    arguments.instance(program, Program, "map_blocks: program", "what passgraph.compile() returns")
    program._check_open()
    dask_array = _dask()
    pictures, values = _pictures_and_values(program, array, inputs)
    arrays = {
        name: _Chunked.from_array(picture, f"input {name!r}", dask_array, program.inputs[name].format is None)
        for name, picture in pictures.items()
    }
    check_unchanged(program._overrides)
    with ExitStack() as stack:
        bound_program = bound(program, None, None, program._non_finite, stack)
        shapes = {name: (chunked.shape, chunked.dtype) for name, chunked in arrays.items()}
        plan = whole_plan(bound_program, shapes)
    try:
        needs = footprint(plan)
    except GraphError:
        outputs, computed = resolved(program.outputs, lambda *found: _reduced(program, pictures, values, *found))
        if not computed:
            raise
        return _mapped(program, outputs, {**pictures, **computed}, values)
    if len(plan.outputs) != 1:
        raise InputError(f"the program has the results {', '.join(plan.outputs)}; compile it for one of them")
    target = plan.resources[next(iter(plan.outputs.values()))].format
    stored = program._results == "stored"
    dtype = np.dtype(target.number if stored else np.float32)
    uncut = tuple(name for name, resource in plan.inputs.items() if resource in needs.uncut)
    cut = [name for name in plan.inputs if name not in uncut]
    if not cut:
        raise InputError("map_blocks cuts along the chunks of an input, and each of this program's is needed whole")
    leading, halo = arrays[cut[0]], needs.halo
    width, height = result_size(plan)
    rows = list(_spans(leading.rows, height, halo.up, halo.down, include_all=bool(needs.high)))
    columns = list(_spans(leading.columns, width, halo.left, halo.right, include_all=bool(needs.wide)))
    shared = _Shared(
        *digest_and_text(program.to_data(), program.settings()),
        values,
        stored,
        {name: arrays[name] for name in cut},
        {name: arrays[name] for name in uncut},
    )
    name, layer = shared.layer(rows, columns)
    from dask.highlevelgraph import HighLevelGraph

    graph = HighLevelGraph.from_collections(name, layer, dependencies=[chunked.array for chunked in arrays.values()])
    chunks = tuple(end - start for (start, end), _ in rows), tuple(end - start for (start, end), _ in columns)
    return dask_array.Array(graph, name, (*chunks, (target.channels,)), dtype=dtype)


def _mapped(
    program: Program, outputs: dict[str, Target], pictures: Mapping[str, Any], values: Mapping[str, Any]
) -> Any:
    """Run another graph over dask arrays, as the program runs its own."""
    settings = program._size, program._options, program._non_finite, False, program._results
    with Program(outputs, program.backend, False, *settings) as part:
        given = {name: pictures[name] for name in part.inputs}
        used = {
            name for node in passes_behind(list(outputs.values())) for name in map(_name_of, sources_of(node.values))
        }
        return map_blocks(part, **given, **{name: value for name, value in values.items() if name in used})


def _name_of(value: Any) -> str:
    name: str = value.name
    return name


def _reduced(
    program: Program, pictures: Mapping[str, Any], values: Mapping[str, Any], sources: Mapping[str, Target],
    reductions: Mapping[str, list[Reduction]], computed: Mapping[str, Any],
) -> Iterator[tuple[Reduction, Any]]:  # fmt: skip
    """Yield reductions with their results as dask arrays: partial results of chunks, merged in one task."""
    for name, source in sources.items():
        array = _mapped(program, {name: source}, {**pictures, **computed}, values)
        array = array.rechunk((*(max(BLOCK, max(axis) // BLOCK * BLOCK) for axis in array.chunks[:2]), -1))
        height, width = array.shape[:2]
        for one in reductions[name]:
            merging = one.merging
            channels, number = (merging.bins, np.int64) if merging.how is None else (merging.channels, np.float32)
            side = BLOCK if merging.how is not None else max(height, width)
            blocks = [tuple(-(-count // side) for count in axis) for axis in array.chunks[:2]]
            meta = np.empty((0, 0, 0), number)  # without it dask calls the function with an empty array
            partials = array.map_blocks(_partial, merging, dtype=number, chunks=(*blocks, (channels,)), meta=meta)
            shape = (1,), (merging.bins or 1,), (merging.channels,)
            settings = {"dtype": np.float32, "chunks": shape, "meta": np.empty((0, 0, 0), np.float32)}
            yield one, partials.rechunk(-1).map_blocks(_merged, merging, (width, height), **settings)


def _partial(values: Numbers, merging: Merging) -> Numbers:
    return merging.partial(values)


def _merged(partials: Numbers, merging: Merging, size: tuple[int, int]) -> Numbers:
    return merging.merged(partials, size)


def _dask() -> Any:
    try:
        import dask.array
        import distributed  # noqa: F401 (the tasks need it)
    except ImportError:
        raise InputError("map_blocks needs dask: pip install 'passgraph[dask]'") from None
    return dask.array


def _pictures_and_values(
    program: Program, array: Any, inputs: Mapping[str, Any]
) -> tuple[dict[str, Any], dict[str, Any]]:
    """Split the arguments into pictures by input, and run values that can be serialized."""
    pictures = {name: spec.default for name, spec in program.inputs.items() if spec.default is not None}
    pictures |= {name: value for name, value in inputs.items() if name in program.inputs}
    missing = [name for name in program.inputs if name not in pictures]
    if array is not None:
        if len(missing) != 1:
            known = ", ".join(program.inputs) or "none"
            raise InputError(f"map_blocks: the program has the inputs {known}; give each by its name")
        pictures[missing.pop()] = array
    if missing:
        raise InputError(f"input {missing[0]!r} is missing; call map_blocks(program, {missing[0]}=array)")
    values = {name: value for name, value in inputs.items() if name not in program.inputs}
    return pictures, serializable_values(values, "map_blocks")


def _spans(lengths: Sequence[int], length: int, before: int, behind: int, *, include_all: bool) -> Iterator[Spans]:
    """Yield each chunk along an axis and its window, which lies inside the picture.

    A program is compiled for each window length. To have few of them, a chunk's length is rounded up to that of the
    longest chunk, its half, its quarter, and so on.

    >>> list(_spans((4, 4, 1), 9, 1, 1, include_all=False))
    [((0, 4), (0, 6)), ((4, 8), (3, 9)), ((8, 9), (6, 9))]
    """
    start = 0
    for count in lengths:
        rounded = max(lengths)
        while (rounded + 1) // 2 >= count and rounded > 1:
            rounded = (rounded + 1) // 2
        window = length if include_all else min(length, rounded + before + behind)
        begin = min(max(0, start - before), length - window)
        yield (start, start + count), (begin, begin + window)
        start += count


@dataclass(frozen=True, eq=False)
class _Chunked:
    """A dask array as a picture, with a single chunk along the channels."""

    array: Any
    shape: tuple[int, int, int]
    dtype: np.dtype[Any]

    @staticmethod
    def from_array(array: Any, what: str, dask_array: Any, grey: bool) -> _Chunked:
        """Wrap an array; with ``grey``, an array without channels becomes gray RGB, as in a call of the program."""
        if not isinstance(array, dask_array.Array):
            array = dask_array.from_array(arguments.numbers(array, what))
        if any(math.isnan(side) for side in array.shape):
            raise InputError(f"{what} has chunks of unknown sizes; call its compute_chunk_sizes() first")
        shape, dtype = checked_shape(array.shape, what), checked_dtype(array.dtype, what)
        if grey and array.ndim == 2:
            shape = (*shape[:2], GREY_CHANNELS)
        if 0 in {count for axis in array.chunks for count in axis}:
            array = array.rechunk(tuple(tuple(count for count in axis if count) for axis in array.chunks))
        return _Chunked(array.rechunk({2: -1}) if array.ndim == 3 else array, shape, dtype)

    @property
    def rows(self) -> tuple[int, ...]:
        heights: tuple[int, ...] = self.array.chunks[0]
        return heights

    @property
    def columns(self) -> tuple[int, ...]:
        widths: tuple[int, ...] = self.array.chunks[1]
        return widths

    def touched(self, part: Part) -> Iterator[tuple[Any, Part, tuple[int, int]]]:
        """Yield the chunks that overlap a part: the key, the overlap in the chunk, and its position in the part."""
        top, bottom, left, right = part
        for i, y in _cut(self.rows, top, bottom):
            for j, x in _cut(self.columns, left, right):
                y0, y1 = max(top, y), min(bottom, y + self.rows[i])
                x0, x1 = max(left, x), min(right, x + self.columns[j])
                key = (self.array.name, i, j, 0)[: 1 + self.array.ndim]
                yield key, (y0 - y, y1 - y, x0 - x, x1 - x), (y0 - top, x0 - left)


def _cut(lengths: Sequence[int], start: int, stop: int) -> Iterator[tuple[int, int]]:
    """Yield the number and the start of each chunk along an axis that overlaps a span."""
    ends = list(accumulate(lengths))
    for number in range(bisect_right(ends, start), len(ends)):
        first = ends[number] - lengths[number]
        if first >= stop:
            return
        yield number, first


@dataclass(frozen=True, eq=False)
class _Shared:
    """State shared by all chunks of a result."""

    digest: str
    text: str
    values: Mapping[str, Any]
    stored: bool
    cut: Mapping[str, _Chunked]  # inputs that tasks read in windows
    uncut: Mapping[str, _Chunked]  # inputs that tasks read whole

    def layer(self, rows: Sequence[Spans], columns: Sequence[Spans]) -> tuple[str, dict[Any, Any]]:
        """Return the name of the result's chunks, and its tasks."""
        from dask.base import tokenize

        from passgraph.tiles import remote_windows as worker

        arrays = {**self.cut, **self.uncut}
        shapes = {name: (chunked.shape, chunked.dtype.str) for name, chunked in arrays.items()}
        token = tokenize(self.digest, self.values, [(name, chunked.array.name) for name, chunked in arrays.items()])
        name, graph_key = f"passgraph-{token}", f"passgraph-graph-{token}"
        layer: dict[Any, Any] = {graph_key: worker.SharedData(self.digest, self.text, shapes, self.values, self.stored)}
        whole_keys = []
        for number, chunked in enumerate(self.uncut.values()):
            whole_keys.append(f"passgraph-whole-{number}-{token}")
            keys, pieces = self._pieces(chunked, (0, chunked.shape[0], 0, chunked.shape[1]), layer, token)
            layer[whole_keys[-1]] = (worker.Pieces.joined, pieces, keys)
        for i, ((top, bottom), (y0, y1)) in enumerate(rows):
            for j, ((left, right), (x0, x1)) in enumerate(columns):
                tile = Tile((y0, y1, x0, x1), (top, bottom, left, right))
                pieces_by_input = {
                    key: self._pieces(chunked, tile.window, layer, token) for key, chunked in self.cut.items()
                }
                chunk = worker.Chunk(
                    tile, {key: pieces for key, (_, pieces) in pieces_by_input.items()}, tuple(self.uncut)
                )
                piece_keys = [keys for keys, _ in pieces_by_input.values()]
                layer[name, i, j, 0] = worker.chunk, graph_key, chunk, piece_keys, whole_keys
        return name, layer

    def _pieces(self, chunked: _Chunked, part: Part, layer: dict[Any, Any], token: str) -> tuple[list[Any], Any]:
        """Return the keys of the pieces of a part, and their positions; add a task for each piece of a chunk."""
        from dask.array.chunk import getitem

        from passgraph.tiles.remote_windows import Pieces

        keys, places = [], []
        for key, inside, place in chunked.touched(part):
            places.append(place)
            if inside == (0, chunked.rows[key[1]], 0, chunked.columns[key[2]]):
                keys.append(key)
                continue
            top, bottom, left, right = inside
            strip_key = (f"passgraph-strip-{chunked.array.name}-{token}", *key[1:3], *inside)
            layer[strip_key] = (getitem, key, (slice(top, bottom), slice(left, right)))
            keys.append(strip_key)
        return keys, Pieces((part[1] - part[0], part[3] - part[2], chunked.shape[2]), tuple(places))
