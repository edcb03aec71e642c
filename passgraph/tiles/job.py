"""Prepare a job from a graph, sources and sinks: footprint, cost and tiling."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from contextlib import ExitStack
from dataclasses import dataclass, replace
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

from passgraph import arguments
from passgraph.errors import InputError
from passgraph.formats import Format
from passgraph.graph.targets import InputSpec
from passgraph.plan.data import Memory, Options, Plan
from passgraph.plan.limits import bytes_of, format_bytes
from passgraph.plan.window import Footprint, footprint
from passgraph.run.finite_checks import NonFinite
from passgraph.tiles.grid import PIECE_PIXELS, Cost, grid_of
from passgraph.tiles.sinks import Sink
from passgraph.tiles.sources import Grey, Source, open_source
from passgraph.tiles.tile_run import Bound, Graph, Job, admitted_part, bound, result_size, whole_plan

if TYPE_CHECKING:
    from passgraph.backends.base import Backend


#: Beyond, neighbouring pixels' centres are one number in float32, and ``uv()`` could not tell them apart.
MOST_SIDE = 1 << 23
#: Bytes for what does not grow with tiles: machine code, the directories of files, what allocators keep.
RESERVE = 48 << 20
#: Of the memory, the share in which decoded blocks of files wait for the next tile.
BLOCKS_SHARE = 0.2
#: Pictures of each kind that exist at a time at most: an input that is computed with, the one that it replaces and the
#: next one; a result that is made and one that is written.
INPUTS_ALIVE, RESULTS_ALIVE = 3, 2


@dataclass(frozen=True, eq=False)
class Wanted:
    """The request besides sinks, as :func:`passgraph.tiled` describes it."""

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
    wanted: Wanted, sinks_for: Callable[[Plan, Mapping[str, Source]], dict[str, Sink]], stack: ExitStack
) -> Job:
    """A job, ready to run; ``stack`` gives back what it holds, and nothing is written yet."""
    allowed = bytes_of(wanted.memory)
    tile = None if wanted.tile is None else _pair(wanted.tile, "tile")
    bound_graph = bound(wanted.graph, wanted.backend, wanted.options, wanted.non_finite, stack)
    if wanted.size is not None:
        bound_graph = replace(bound_graph, size=_pair(wanted.size, "size"))
    given = _by_name(bound_graph.inputs, wanted.source)
    sources = _sources(bound_graph.inputs, given, blocks_room(allowed), stack)
    pictures = {name: (source.shape, source.dtype) for name, source in sources.items()}
    plan = whole_plan(bound_graph, pictures)
    needs = footprint(plan)
    uncut = {name for name, resource in plan.inputs.items() if resource in needs.whole}
    _check_blocks([sources[name] for name in plan.inputs if name not in uncut], allowed)
    sinks = sinks_for(plan, sources)
    cost = _cost(plan, needs, sources, sinks)
    block = max(s.block[0] for s in sinks.values()), max(s.block[1] for s in sinks.values())
    grid = grid_of(result_size(plan), needs, cost, allowed, block, tile)
    return Job(
        bound_graph, plan, needs, grid,
        {name: sources[name] for name in plan.inputs if name not in uncut},
        {name: _read_uncut(name, sources[name], bound_graph) for name in uncut},
        sinks, _values(wanted.values),
        {name: Path(picture) for name, picture in given.items() if isinstance(picture, (str, PathLike))},
    )  # fmt: skip


def blocks_room(memory: int | str) -> int:
    """Bytes in which decoded blocks of files wait for the next tile."""
    return int(bytes_of(memory) * BLOCKS_SHARE)


def _pair(given: object, what: str) -> tuple[int, int]:
    if not isinstance(given, (tuple, list)) or len(given) != 2:
        raise InputError(f"{what} must be (width, height) in pixels, got {arguments.shown(given)}")
    width, height = (arguments.whole_number(side, f"{what}: each side", 1, MOST_SIDE, InputError) for side in given)
    return width, height


def _by_name(specs: Mapping[str, InputSpec], given: object) -> dict[str, Any]:
    """Return the sources by name: the given ones, or the inputs' default pictures."""
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
    return {name: pictures.get(name, spec.default) for name, spec in specs.items()}


def _sources(
    specs: Mapping[str, InputSpec], given: Mapping[str, Any], room: int, stack: ExitStack
) -> dict[str, Source]:
    """A source for each input, opened."""
    found: dict[str, Source] = {}
    for name, spec in specs.items():
        picture = given[name]
        if picture is None:
            raise InputError(f"input {name!r} is missing; give its file or array as the source")
        if isinstance(picture, (list, tuple)):
            picture = arguments.numbers(picture, f"input {name!r}")
        source = open_source(picture, f"input {name!r}", room // len(specs))
        found[name] = source = Grey(source) if source.is_grey and spec.format is None else source
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
    """An input that every tile needs whole."""
    height, width, _ = source.shape
    return admitted_part(bound_graph, name, source.read((0, height, 0, width)))


def _values(given: object) -> Mapping[str, object]:
    values: Mapping[str, object] = {} if given is None else given  # type: ignore[assignment]
    arguments.instance(values, Mapping, "values", "a mapping from names to run values", InputError)
    for name in values:
        arguments.text(name, "the name of a value", InputError)
    return values


def _cost(plan: Plan, needs: Footprint, sources: Mapping[str, Source], sinks: Mapping[str, Sink]) -> Cost:
    """Bytes by kind; see docs/large-pictures.md."""
    inside = {r.memory: Memory(r.format, (1, 1)) for r in plan.resources if r.id not in needs.whole}
    pixel = sum(_pixel_bytes(memory.format) for memory in inside.values())
    fixed = RESERVE + sum(
        _pixel_bytes(m.format) * m.size[0] * m.size[1] for n, m in enumerate(plan.memories) if n not in inside
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
        fixed += piece * channels * (8 + 3 * sink.dtype.itemsize) + sink.cost
    return Cost(fixed, pixel)


def _pixel_bytes(format_: Format) -> int:
    """Bytes that a pixel takes on a device that computes in float32, or as specified where that is more."""
    return max(4 * format_.channels, format_.bytes_per_pixel)
