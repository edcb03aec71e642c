"""From a graph, sources and sinks to a job: what is needed, what it costs, and how the picture is cut."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from contextlib import ExitStack
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, TypeAlias

from passgraph import arguments
from passgraph.errors import BackendError, GraphError, InputError
from passgraph.formats import Format
from passgraph.frames.tiles_grid import Cost, bytes_of, grid_of, told
from passgraph.frames.tiles_parts import PIECE_PIXELS
from passgraph.frames.tiles_run import Job, admitted_part
from passgraph.frames.tiles_sinks import Sink
from passgraph.frames.tiles_sources import Source, open_source
from passgraph.graph.outputs import named_outputs
from passgraph.graph.targets import InputSpec, Target
from passgraph.plan.build import build
from passgraph.plan.data import Memory, Options, Plan
from passgraph.plan.footprint import Footprint, footprint
from passgraph.plan.limits import check
from passgraph.plan.reach import inputs_behind
from passgraph.plan.window import window_plan
from passgraph.run.admission import format_of
from passgraph.run.execution import Execution
from passgraph.run.finite_checks import NonFinite, checked_choice
from passgraph.run.program import Program

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


@dataclass(frozen=True, eq=False)
class Wanted:
    """What is asked for beside sinks, as :func:`passgraph.tiled` describes it."""

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
    bound = _bound(wanted, stack)
    sources = _sources(bound.inputs, wanted.source, int(allowed * BLOCKS_SHARE), stack)
    plan = _plan(bound, sources, None if wanted.size is None else _pair(wanted.size, "size"))
    needs = footprint(plan)
    whole = {name for name, resource in plan.inputs.items() if resource in needs.whole}
    _check_blocks([sources[name] for name in plan.inputs if name not in whole], allowed)
    sinks = sinks_for(plan, sources)
    cost = _cost(plan, needs, sources, sinks)
    block = max(s.block[0] for s in sinks.values()), max(s.block[1] for s in sinks.values())
    size = plan.resources[next(iter(plan.outputs.values()))].size
    grid = grid_of(size, needs, cost, allowed, block, tile)
    made = window_plan(plan, needs, grid.window)
    check(made, bound.backend.limits)
    with bound.backend.turn:
        execution = Execution(made, bound.backend)
        stack.callback(_release, execution)
        for (step, name), value in bound.overrides.items():
            execution.override(step, name, value)
    return Job(
        grid, execution, bound.inputs,
        {name: sources[name] for name in plan.inputs if name not in whole},
        {name: _whole(name, sources[name], bound) for name in whole},
        sinks, _values(wanted.values), bound.non_finite,
    )  # fmt: skip


def _release(execution: Execution) -> None:
    with execution.backend.turn:
        execution.release()


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

    @property
    def inputs(self) -> dict[str, InputSpec]:
        return inputs_behind(list(self.outputs.values()))


def _bound(wanted: Wanted, stack: ExitStack) -> _Bound:
    from passgraph.backends.base import Backend as Class
    from passgraph.backends.registry import open_backend

    graph, backend, options = wanted.graph, wanted.backend, wanted.options
    if isinstance(graph, Program):
        if backend is not None or options is not None:
            raise GraphError("a program has its backend and options already; give them where it is compiled")
        graph._check_open()
        if graph._check_finite:
            raise GraphError("check_finite looks at what passes of a whole run write; compile without it for tiles")
        overrides = dict(graph._overrides)
        made = _Bound(graph._outputs, graph.backend, graph._options, graph._non_finite, overrides, graph._size)
    else:
        expected = "a name such as 'gl' or an open backend"
        if backend is None or isinstance(backend, str):
            opened = stack.enter_context(open_backend(backend))
        else:
            opened = arguments.instance(backend, Class, "backend", expected, BackendError)
        chosen = arguments.instance(Options() if options is None else options, Options, "options", "pg.Options(...)")
        made = _Bound(named_outputs(graph), opened, chosen, checked_choice(wanted.non_finite), {}, None)
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


def _check_blocks(sources: Iterable[Source], memory: int) -> None:
    for source in sources:
        if source.cost > memory:
            height, width = source.block
            raise InputError(
                f"{source.name} is stored in blocks of {width}x{height} pixels, which takes {told(source.cost)} to "
                f"read, and memory is {told(memory)}; give more, or store it in smaller tiles"
            )


def _plan(bound: _Bound, sources: Mapping[str, Source], size: tuple[int, int] | None) -> Plan:
    """The plan of the whole picture, which is never run."""
    inputs = {}
    for name, spec in bound.inputs.items():
        height, width, channels = sources[name].shape
        inputs[name] = (spec.format or format_of(sources[name].dtype, channels), (width, height))
    # What runs once would hold one tile's pixels in all others.
    options = replace(bound.options, static=False)
    return build(bound.outputs, size or bound.size, inputs, options, bound.backend.limits, in_windows=True)


def _whole(name: str, source: Source, bound: _Bound) -> Any:
    """An input that every tile needs whole."""
    height, width, _ = source.shape
    numbers = source.read((0, height, 0, width))
    return admitted_part(numbers, name, bound.inputs[name].format, bound.non_finite, ())


def _values(given: object) -> Mapping[str, object]:
    values: Mapping[str, object] = {} if given is None else given  # type: ignore[assignment]
    arguments.instance(values, Mapping, "values", "a mapping from names to run values", InputError)
    for name in values:
        arguments.text(name, "the name of a value", InputError)
    return values


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
