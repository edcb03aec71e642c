"""Prepare a tiled run from a graph, sources and sinks: footprint, memory cost and tiling."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import ExitStack, closing
from dataclasses import dataclass, replace
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

from passgraph import arguments
from passgraph.errors import GraphError, InputError
from passgraph.formats import Format
from passgraph.graph.targets import InputSpec, Target
from passgraph.plan.data import Memory, Options, Plan
from passgraph.plan.limits import bytes_of, format_bytes
from passgraph.plan.window import Footprint, footprint
from passgraph.run.finite_checks import NonFinite
from passgraph.tiles.grid import PIECE_PIXELS, Cost, Source, grid_of
from passgraph.tiles.reductions import BLOCK, PartialSink, Reduction, resolved
from passgraph.tiles.sinks import Sink
from passgraph.tiles.sources import Grey, open_source
from passgraph.tiles.tile_run import Bound, Graph, Job, admitted_part, bound, result_size, run_tiles, whole_plan

if TYPE_CHECKING:
    from passgraph.backends.base import Backend


#: Longest side; beyond it the centers of neighboring pixels are the same number in float32, as is their ``uv()``.
MOST_SIDE = 1 << 23
#: Memory that does not depend on the tile: machine code, the directories of files, and what allocators keep.
RESERVE = 48 << 20
#: Share of the memory for decoded blocks of files that the next tiles need too.
BLOCKS_SHARE = 0.2
#: Most pictures alive at a time: for each input, the current tile's, the last one's and the next one's; for each
#: result, the one being computed and the one being written.
INPUTS_ALIVE, RESULTS_ALIVE = 3, 2


@dataclass(frozen=True, eq=False)
class TileRequest:
    """The arguments of :func:`passgraph.tiled`, without sinks."""

    graph: Graph
    source: object
    memory: int | str
    values: Mapping[str, object] | None
    tile: tuple[int, int] | None
    size: tuple[int, int] | None
    backend: str | Backend | None
    options: Options | None
    non_finite: NonFinite


def prepared(
    request: TileRequest, sinks_for: Callable[[Plan, Mapping[str, Source]], dict[str, Sink]], stack: ExitStack
) -> Job:
    """Prepare a job; ``stack`` releases its resources. Nothing is written yet."""
    bound_graph = bound(request.graph, request.backend, request.options, request.non_finite, stack)
    if request.size is not None:
        bound_graph = replace(bound_graph, size=arguments.size_in_pixels(request.size, "size", MOST_SIDE))
    pictures = _by_name(bound_graph.inputs, request.source)
    try:
        return _prepared(bound_graph, pictures, request, sinks_for, stack)
    except GraphError:
        outputs, computed = resolved(
            bound_graph.outputs,
            lambda *found: _reduced(bound_graph, pictures, request, *found),
        )
        if not computed:
            raise
        return _prepared(replace(bound_graph, outputs=outputs), {**pictures, **computed}, request, sinks_for, stack)


def _reduced(
    bound_graph: Bound, pictures: Mapping[str, Any], request: TileRequest, sources: dict[str, Target],
    reductions: Mapping[str, list[Reduction]], computed: Mapping[str, Any],
) -> Iterator[tuple[Reduction, Any]]:  # fmt: skip
    """Compute reductions in a pass over tiles of their own; the tiles are along blocks of partial results."""
    sinks = {}

    def sinks_for(plan: Plan, _: Mapping[str, Source]) -> dict[str, Sink]:
        sinks.update({name: PartialSink(found, result_size(plan)) for name, found in reductions.items()})
        return dict(sinks)

    stage = replace(bound_graph, outputs=sources)
    with ExitStack() as stack:
        given = {**pictures, **computed}
        job = _prepared(stage, given, replace(request, tile=None), sinks_for, stack)
        if not job.grid.is_along(BLOCK):
            job = _prepared(stage, given, replace(request, tile=(BLOCK, BLOCK)), sinks_for, stack)
        run_tiles(job, stack.enter_context(closing(job.windows())), lambda: None)
    for sink in sinks.values():
        yield from sink.results()


def _prepared(
    bound_graph: Bound, pictures: Mapping[str, Any], request: TileRequest,
    sinks_for: Callable[[Plan, Mapping[str, Source]], dict[str, Sink]], stack: ExitStack,
) -> Job:  # fmt: skip
    memory_limit = bytes_of(request.memory)
    tile = None if request.tile is None else arguments.size_in_pixels(request.tile, "tile", MOST_SIDE)
    sources = _sources(bound_graph.inputs, pictures, block_cache_bytes(memory_limit), stack)
    plan = whole_plan(bound_graph, {name: (source.shape, source.dtype) for name, source in sources.items()})
    needs = footprint(plan)
    uncut = {name for name, resource in plan.inputs.items() if resource in needs.uncut}
    _check_blocks([sources[name] for name in plan.inputs if name not in uncut], memory_limit)
    sinks = sinks_for(plan, sources)
    cost = _cost(plan, needs, sources, sinks)
    block = max(s.block[0] for s in sinks.values()), max(s.block[1] for s in sinks.values())
    return Job(
        bound=bound_graph,
        plan=plan,
        needs=needs,
        grid=grid_of(result_size(plan), needs, cost, memory_limit, block, tile),
        sources={name: sources[name] for name in plan.inputs if name not in uncut},
        uncut={name: _read_uncut(name, sources[name], bound_graph) for name in uncut},
        sinks=sinks,
        values=_values(request.values),
        paths={name: Path(picture) for name, picture in pictures.items() if isinstance(picture, (str, PathLike))},
    )


def block_cache_bytes(memory: int | str) -> int:
    """Return the bytes for decoded blocks of files that the next tiles need too."""
    return int(bytes_of(memory) * BLOCKS_SHARE)


def _by_name(specs: Mapping[str, InputSpec], source: object) -> dict[str, Any]:
    """Return the paths or arrays by input: those of ``source``, or the inputs' default pictures."""
    missing = [name for name, spec in specs.items() if spec.default is None]
    if source is not None and not isinstance(source, Mapping):
        if len(missing) != 1:
            raise InputError(f"the graph has the inputs {', '.join(specs) or 'none'}; give source as a mapping by name")
        source = {missing[0]: source}
    pictures: dict[Any, Any] = {} if source is None else dict(source)
    for name in pictures:
        if not arguments.among(name, specs):
            known = ", ".join(specs) or "none"
            raise InputError(f"source: there is no input {arguments.shown(name)} in this graph; it has {known}")
    return {name: pictures.get(name, spec.default) for name, spec in specs.items()}


def _sources(
    specs: Mapping[str, InputSpec], pictures: Mapping[str, Any], cache_bytes: int, stack: ExitStack
) -> dict[str, Source]:
    """Open a source for each input."""
    sources: dict[str, Source] = {}
    for name, spec in specs.items():
        picture = pictures[name]
        if picture is None:
            raise InputError(f"input {name!r} is missing; give its file or array as the source")
        if isinstance(picture, (list, tuple)):
            picture = arguments.numbers(picture, f"input {name!r}")
        source = open_source(picture, f"input {name!r}", cache_bytes // len(specs))
        sources[name] = source = Grey(source) if source.is_grey and spec.format is None else source
        stack.callback(source.close)
        _check_declared(source, spec)
    return sources


def _check_declared(source: Source, spec: InputSpec) -> None:
    height, width, channels = source.shape
    if max(width, height) > MOST_SIDE:
        raise InputError(f"{source.name} is {width}x{height} pixels; each side may be {MOST_SIDE} at most")
    if spec.format is not None and channels != spec.format.channels:
        raise InputError(f"{source.name} has {channels} channel(s), and is declared {spec.format.name}")
    if spec.size is not None and (width, height) != spec.size:
        raise InputError(f"{source.name} is {width}x{height} pixels, and is declared {spec.size[0]}x{spec.size[1]}")


def _check_blocks(sources: Iterable[Source], memory: int) -> None:
    for source in sources:
        if source.cost > memory:
            height, width = source.block
            raise InputError(
                f"{source.name} is stored in blocks of {width}x{height} pixels, which takes "
                f"{format_bytes(source.cost)} to read, and memory is {format_bytes(memory)}; give more, or store it in "
                "smaller tiles"
            )


def _read_uncut(name: str, source: Source, bound_graph: Bound) -> Any:
    """Read an input that every tile needs whole."""
    height, width, _ = source.shape
    return admitted_part(bound_graph, name, source.read((0, height, 0, width)))


def _values(values: object) -> Mapping[str, object]:
    by_name: Mapping[str, object] = {} if values is None else values  # type: ignore[assignment]
    arguments.instance(by_name, Mapping, "values", "a mapping from names to run values", InputError)
    for name in by_name:
        arguments.text(name, "the name of a value", InputError)
    return by_name


def _cost(plan: Plan, needs: Footprint, sources: Mapping[str, Source], sinks: Mapping[str, Sink]) -> Cost:
    """Estimate the memory of a tile; see docs/large-pictures.md."""
    inside = {r.memory: Memory(r.format, (1, 1)) for r in plan.resources if r.id not in needs.uncut}
    pixel = sum(_pixel_bytes(memory.format) for memory in inside.values())
    fixed = RESERVE + sum(
        _pixel_bytes(m.format) * m.size[0] * m.size[1] for n, m in enumerate(plan.memories) if n not in inside
    )
    for name, resource in plan.inputs.items():
        source, format_ = sources[name], plan.resources[resource].format
        stored = source.shape[2] * source.dtype.itemsize
        # During the upload of an 8- or 16-bit format, its integers and the float values exist together.
        uploading = 0 if format_.number == "f4" else format_.bytes_per_pixel + 4 * format_.channels
        if resource in needs.uncut:
            fixed += (stored + uploading + 4 * format_.channels) * source.shape[0] * source.shape[1]
        else:
            fixed += source.cost
            pixel += stored + uploading + INPUTS_ALIVE * 4 * format_.channels
    for name, resource in plan.outputs.items():
        channels, sink = plan.resources[resource].format.channels, sinks[name]
        pixel += RESULTS_ALIVE * 4 * channels
        # A piece of the result is copied, converted, and copied again in the file's byte order.
        piece = max(PIECE_PIXELS, sink.block[0] * sink.block[1])
        fixed += piece * channels * (8 + 3 * sink.dtype.itemsize) + sink.cost
    return Cost(fixed, pixel)


def _pixel_bytes(format_: Format) -> int:
    """Return the bytes of a pixel on a device that stores float32, or of the format if that is more."""
    return max(4 * format_.channels, format_.bytes_per_pixel)
