"""Pictures larger than memory: any graph whose passes read at bounded offsets, tile by tile, bit for bit the same."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from contextlib import ExitStack
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from passgraph import arguments
from passgraph.errors import BackendError, GraphError, InputError
from passgraph.formats import Format, format_named
from passgraph.frames.tiles_grid import Cost, Grid, bytes_of, grid_of
from passgraph.frames.tiles_parts import PIECE_PIXELS
from passgraph.frames.tiles_run import Job, Progress, admitted_part, run_tiles, shown
from passgraph.frames.tiles_sinks import Sink, planned_sink
from passgraph.frames.tiles_sources import Source, open_source
from passgraph.graph.targets import InputSpec, Target
from passgraph.plan.build import build
from passgraph.plan.data import Memory, Options, Plan
from passgraph.plan.footprint import Footprint, footprint
from passgraph.plan.limits import check
from passgraph.plan.reach import inputs_behind
from passgraph.plan.window import window_plan
from passgraph.run.execution import Execution
from passgraph.run.finite_checks import NonFinite, checked_choice
from passgraph.run.program import Program, named_outputs

if TYPE_CHECKING:
    from passgraph.backends.base import Backend

Graph: TypeAlias = "Program | Target | Iterable[Target] | Mapping[str, Target]"
#: Beyond, neighbouring pixels' centres are one number in float32, and ``uv()`` could not tell them apart.
MOST_SIDE = 1 << 23
#: Bytes for what does not grow with tiles: machine code, the directories of files, what allocators keep.
RESERVE = 48 << 20
#: Of the memory, the share in which decoded blocks of files wait for the next tile.
BLOCKS_SHARE = 0.2
#: Pictures of each kind that exist at a time at most: an input that is computed with, the one that it replaces and the
#: next one; a result that is made and one that is written.
INPUTS_ALIVE, RESULTS_ALIVE = 3, 2


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
        The input: the path of a TIFF file or Zarr array, or an array (NumPy, memory map, Zarr, HDF5, dask …), (h, w) or
        (h, w, 1 to 4); of several inputs a mapping by name.  Inputs of another size than the results are read whole.
    sink
        Where the result goes: a path that ends in .tif, .tiff or .zarr, or an array that takes
        ``array[rows, columns] = numbers``; of several results a mapping by name.  Files and stores appear under their
        name when they are whole; an older one stays until then.  Into 8 and 16 bits go values from 0 to 1.
    memory
        Bytes that pictures, decoded blocks and compiled passes may take beside what the process holds already, such as
        ``"1 GB"`` or ``512 << 20``; it decides how large tiles are.
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
    >>> from passgraph.effects.pictures.blur import gaussian_blur
    >>> soft = gaussian_blur(pg.Input("frame"), sigma_px=2.0, radius_px=7)
    >>> picture, result = np.ones((64, 96, 4), np.float32), np.zeros((64, 96, 4), np.float32)
    >>> grid = tiled(soft, picture, result, tile=(32, 32), progress=False)
    >>> len(grid), grid.window, bool(abs(result - 1.0).max() < 1e-6)
    (6, (46, 46), True)
    """
    allowed = bytes_of(memory)
    shape = None if tile is None else _pair(tile, "tile")
    with ExitStack() as stack:
        bound = _bound(graph, backend, options, non_finite, stack)
        stack.enter_context(bound.backend.turn)
        sources = _sources(inputs_behind(list(bound.outputs.values())), source, int(allowed * BLOCKS_SHARE), stack)
        plan = _plan(bound, sources, None if size is None else _pair(size, "size"))
        needs = footprint(plan)
        sinks = _sinks(plan, sink, dtype, sources)
        cost = _cost(plan, needs, sources, sinks)
        block = max(s.block[0] for s in sinks.values()), max(s.block[1] for s in sinks.values())
        grid = grid_of(_picture_size(plan), needs, cost, allowed, block, shape)
        job = _job(bound, plan, needs, sources, sinks, grid, {} if values is None else values, stack)
        for each in sinks.values():
            stack.callback(each.abandon)
            each.open()
        with shown(progress, len(grid)) as advance:
            run_tiles(job, advance)
        for each in sinks.values():
            each.finish()
    return grid


def _pair(given: object, what: str) -> tuple[int, int]:
    if not isinstance(given, (tuple, list)) or len(given) != 2:
        raise InputError(f"{what} must be (width, height) in pixels, got {arguments.shown(given)}")
    width, height = (arguments.whole(side, f"{what}: each side", 1, MOST_SIDE, InputError) for side in given)
    return width, height


@dataclass(frozen=True, eq=False)
class _Bound:
    """A graph and what it runs on."""

    outputs: dict[str, Target]
    backend: Backend
    options: Options
    non_finite: NonFinite
    overrides: Mapping[tuple[str, str], object]
    size: tuple[int, int] | None


def _bound(
    graph: Graph, backend: str | Backend | None, options: Options | None, non_finite: NonFinite, stack: ExitStack
) -> _Bound:
    from passgraph.backends.base import Backend as Class
    from passgraph.backends.registry import open_backend

    if isinstance(graph, Program):
        if backend is not None or options is not None:
            raise GraphError("a program has its backend and options already; give them where it is compiled")
        graph._check_open()
        overrides = dict(graph._overrides)
        made = _Bound(graph._outputs, graph.backend, graph._options, graph._non_finite, overrides, graph._size)
    else:
        expected = "a name such as 'gl' or an open backend"
        if backend is None or isinstance(backend, str):
            opened = stack.enter_context(open_backend(backend))
        else:
            opened = arguments.instance(backend, Class, "backend", expected, BackendError)
        chosen = arguments.instance(Options() if options is None else options, Options, "options", "pg.Options(...)")
        made = _Bound(named_outputs(graph), opened, chosen, checked_choice(non_finite), {}, None)
    if not (made.backend.optimises and made.backend.computes):
        raise BackendError(
            f"backend {made.backend.name} cannot compute tiles: it runs kernels as they were written, and tiles need "
            "them rewritten; use numpy, or another one"
        )
    return made


def _sources(specs: Mapping[str, InputSpec], given: object, room: int, stack: ExitStack) -> dict[str, Source]:
    """A source for each input, opened."""
    missing = [name for name, spec in specs.items() if spec.default is None]
    if given is not None and not isinstance(given, Mapping):
        if len(missing) != 1:
            raise InputError(f"the graph has the inputs {', '.join(specs) or 'none'}; give source as a mapping by name")
        given = {missing[0]: given}
    pictures: dict[Any, Any] = {} if given is None else dict(given)
    for name in pictures:
        if not arguments.among(name, specs):
            known = ", ".join(specs) or "none"
            raise InputError(f"source: there is no input {arguments.shown(name)} in this graph; it has {known}")
    found: dict[str, Source] = {}
    for name, spec in specs.items():
        picture = pictures.get(name, spec.default)
        if picture is None:
            raise InputError(f"input {name!r} is missing; give its file or array as the source")
        if isinstance(picture, (list, tuple)):
            picture = arguments.numbers(picture, f"input {name!r}")
        found[name] = source = open_source(picture, f"input {name!r}", room // len(specs))
        stack.callback(source.close)
        _check_declared(source, spec)
    return found


def _check_declared(source: Source, spec: InputSpec) -> None:
    height, width, channels = source.shape
    if max(width, height) > MOST_SIDE:
        raise InputError(f"{source.name} is {width}x{height} pixels; each side may be {MOST_SIDE} at most")
    if spec.format is not None and channels != spec.format.channels:
        raise InputError(f"{source.name} has {channels} channel(s), and is declared {spec.format.name}")
    if spec.size is not None and (width, height) != spec.size:
        raise InputError(f"{source.name} is {width}x{height} pixels, and is declared {spec.size[0]}x{spec.size[1]}")


def _format(source: Source, spec: InputSpec) -> Format:
    return spec.format or format_named({1: "r32f", 2: "rg32f", 3: "rgb32f", 4: "rgba32f"}[source.shape[2]])


def _plan(bound: _Bound, sources: Mapping[str, Source], size: tuple[int, int] | None) -> Plan:
    """The plan of the whole picture, which is never run."""
    specs = inputs_behind(list(bound.outputs.values()))
    inputs = {name: (_format(sources[name], spec), _size(sources[name])) for name, spec in specs.items()}
    # What runs once would hold one tile's pixels in all others.
    options = replace(bound.options, static=False)
    return build(bound.outputs, size or bound.size, inputs, options, bound.backend.limits, in_windows=True)


def _size(source: Source) -> tuple[int, int]:
    return source.shape[1], source.shape[0]


def _picture_size(plan: Plan) -> tuple[int, int]:
    return plan.resources[next(iter(plan.outputs.values()))].size


def _sinks(plan: Plan, given: object, dtype: object, sources: Mapping[str, Source]) -> dict[str, Sink]:
    names = list(plan.outputs)
    if not isinstance(given, Mapping):
        if len(names) != 1:
            raise InputError(f"the graph has the results {', '.join(names)}; give sink as a mapping by name")
        given = {names[0]: given}
    strangers = [name for name in given if not arguments.among(name, names)]
    if strangers or len(given) != len(names):
        got = arguments.shown(strangers[0]) if strangers else ", ".join(map(repr, given)) or "none"
        raise InputError(f"sink must name each result ({', '.join(names)}) and nothing else, got {got}")
    found = {}
    for name, resource in plan.outputs.items():
        made = plan.resources[resource]
        shape = made.size[1], made.size[0], made.format.channels
        found[name] = planned_sink(given[name], shape, made.format, dtype, f"sink of {name!r}")
        _check_apart(given[name], sources, f"sink of {name!r}")
    return found


def _check_apart(sink: object, sources: Mapping[str, Source], what: str) -> None:
    """Tiles read around what others have written: an array may not be both."""
    for source in sources.values():
        array = getattr(getattr(source, "source", source), "array", None)
        both = isinstance(array, np.ndarray) and isinstance(sink, np.ndarray) and np.may_share_memory(array, sink)
        if array is not None and (array is sink or both):
            raise InputError(f"{what} is the array of {source.name} too; write into another one")


def _cost(plan: Plan, needs: Footprint, sources: Mapping[str, Source], sinks: Mapping[str, Sink]) -> Cost:
    """Bytes by kind; see docs/large-pictures.md."""
    inside = {r.memory: Memory(r.format, (1, 1)) for r in plan.resources if r.id not in needs.whole}
    pixel = sum(_held(memory.format) for memory in inside.values())
    fixed = RESERVE + sum(
        _held(m.format) * m.size[0] * m.size[1] for n, m in enumerate(plan.memories) if n not in inside
    )
    for name, resource in plan.inputs.items():
        source, format_ = sources[name], plan.resources[resource].format
        stored = source.shape[2] * source.dtype.itemsize
        # While a format of 8 or 16 bits is uploaded, its numbers lie beside the values.
        uploading = 0 if format_.number == "f4" else format_.bytes_per_pixel + 4 * format_.channels
        if resource in needs.whole:
            fixed += (stored + uploading + 4 * format_.channels) * source.shape[0] * source.shape[1]
        else:
            fixed += source.cost
            pixel += stored + uploading + INPUTS_ALIVE * 4 * format_.channels
    for name, resource in plan.outputs.items():
        channels, sink = plan.resources[resource].format.channels, sinks[name]
        pixel += RESULTS_ALIVE * 4 * channels
        # A piece is cut out, converted, and copied into the file's order.
        piece = max(PIECE_PIXELS, sink.block[0] * sink.block[1])
        fixed += piece * channels * (8 + 3 * sink.dtype.itemsize)
    return Cost(fixed, pixel)


def _held(format_: Format) -> int:
    """Bytes that a pixel takes on a device that computes in float32, or as specified where that is more."""
    return max(4 * format_.channels, format_.bytes_per_pixel)


def _job(
    bound: _Bound, plan: Plan, needs: Footprint, sources: Mapping[str, Source], sinks: Mapping[str, Sink],
    grid: Grid, values: Mapping[str, object], stack: ExitStack,
) -> Job:  # fmt: skip
    arguments.instance(values, Mapping, "values", "a mapping from names to run values", InputError)
    for name in values:
        arguments.text(name, "the name of a value", InputError)
    made = window_plan(plan, needs, grid.window)
    check(made, bound.backend.limits)
    execution = Execution(made, bound.backend)
    stack.callback(execution.release)
    for (step, name), value in bound.overrides.items():
        execution.override(step, name, value)
    specs = inputs_behind(list(bound.outputs.values()))
    windowed = {name for name, resource in plan.inputs.items() if resource not in needs.whole}
    whole = {}
    for name in plan.inputs.keys() - windowed:
        height, width, _ = sources[name].shape
        numbers = sources[name].read((0, height, 0, width))
        whole[name] = admitted_part(numbers, name, specs[name].format, bound.non_finite, iter(()))

    def readers(name: str) -> Any:
        return (s.name for s in made.steps if plan.inputs[name] in s.reads)

    read = {name: source for name, source in sources.items() if name in windowed}
    return Job(grid, execution, specs, read, whole, sinks, values, bound.non_finite, readers)
