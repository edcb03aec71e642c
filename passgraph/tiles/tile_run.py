"""Compute the tiles of a picture in a pipeline: the next one is read and the last one written meanwhile."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import ExitStack, contextmanager
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias, cast

import numpy as np

from passgraph import arguments
from passgraph.backends.base import Backend as Class
from passgraph.errors import BackendError, GraphError, InputError
from passgraph.graph.run_values import FRAME_INDEX, OUTPUT_SIZE
from passgraph.graph.targets import InputSpec, Target, named_outputs
from passgraph.plan.build import build
from passgraph.plan.data import Options, Plan
from passgraph.plan.dependencies import inputs_behind
from passgraph.plan.limits import check
from passgraph.plan.window import WINDOW, Footprint, window_plan
from passgraph.run.caller_arrays import admitted_picture, format_of
from passgraph.run.execution import Execution
from passgraph.run.finite_checks import NonFinite, checked_choice, readers_of
from passgraph.run.program import Program
from passgraph.run.result import Results
from passgraph.tiles.grid import Grid, Numbers, Part, Source, Tile
from passgraph.tiles.sinks import Sink, converted

if TYPE_CHECKING:
    from passgraph.backends.base import Backend


Graph: TypeAlias = "Program | Target | Iterable[Target] | Mapping[str, Target]"
#: (height, width, channels) and dtype of a picture.
Shape: TypeAlias = tuple[tuple[int, int, int], np.dtype[Any]]


@dataclass(frozen=True, eq=False)
class Bound:
    """A graph with its backend and settings."""

    outputs: dict[str, Target]
    backend: Backend
    options: Options
    non_finite: NonFinite
    overrides: Mapping[tuple[str, str], object]
    size: tuple[int, int] | None

    @property
    def inputs(self) -> dict[str, InputSpec]:
        return inputs_behind(list(self.outputs.values()))

    def settings(self) -> dict[str, Any]:
        """Return the arguments of `passgraph.compile` besides the outputs as plain data, with the backend's name."""
        return {
            "backend": self.backend.name,
            "size": self.size,
            "options": asdict(self.options),
            "non_finite": self.non_finite,
        }


def bound(
    graph: Graph, backend: str | Backend | None, options: Options | None, non_finite: NonFinite, stack: ExitStack
) -> Bound:
    """Bind a graph to a backend and options, or take those of a program; ``stack`` closes a backend opened here.

    Raises
    ------
    GraphError, BackendError
        If the settings or the backend rule out tiles.
    """
    from passgraph.backends.registry import open_backend

    if isinstance(graph, Program):
        if backend is not None or options is not None:
            raise GraphError("a program has its backend and options already; give them where it is compiled")
        graph._check_open()
        if graph._check_finite:
            raise GraphError("check_finite looks at what passes of a whole run write; compile without it for tiles")
        overrides = dict(graph._overrides)
        result = Bound(graph._outputs, graph.backend, graph._options, graph._non_finite, overrides, graph._size)
    else:
        expected = "a name such as 'gl' or an open backend"
        if backend is None or isinstance(backend, str):
            opened = stack.enter_context(open_backend(backend))
        else:
            opened = arguments.instance(backend, Class, "backend", expected, BackendError)
        chosen = arguments.instance(Options() if options is None else options, Options, "options", "pg.Options(...)")
        result = Bound(named_outputs(graph), opened, chosen, checked_choice(non_finite), {}, None)
    if not (result.backend.optimises and result.backend.computes):
        raise BackendError(
            f"backend {result.backend.name} cannot compute tiles: it runs kernels as they were written, and tiles need "
            "them rewritten; use numpy, or another one"
        )
    return result


def whole_plan(bound: Bound, pictures: Mapping[str, Shape]) -> Plan:
    """Return the plan of the full picture, which is never run."""
    inputs = {}
    for name, spec in bound.inputs.items():
        (height, width, channels), dtype = pictures[name]
        inputs[name] = (spec.format or format_of(dtype, channels, spec.srgb), (width, height))
    # A static pass would run once, and its result for one tile would be used in all others.
    options = replace(bound.options, static=False)
    return build(bound.outputs, bound.size, inputs, options, bound.backend.limits, in_windows=True)


def result_size(plan: Plan) -> tuple[int, int]:
    """Return (width, height) of the results."""
    return plan.resources[next(iter(plan.outputs.values()))].size


class Windows:
    """A graph compiled for windows of one shape, at any position in a picture of one size."""

    def __init__(self, bound: Bound, plan: Plan, needs: Footprint, window: tuple[int, int]) -> None:
        self.bound, self.size = bound, result_size(plan)
        plan_of_window = window_plan(plan, needs, window)
        check(plan_of_window, bound.backend.limits)
        with bound.backend.turn:
            self.execution = Execution(plan_of_window, bound.backend)
            # Reductions are computed apart, by some of the steps.
            steps = {name for step in plan.steps for name in (step.name, *getattr(step, "fused", ()))}
            for (step, name), value in bound.overrides.items():
                if step in steps:
                    self.execution.override(step, name, value)

    @property
    def plan(self) -> Plan:
        return self.execution.plan

    def admitted(self, name: str, numbers: Numbers, window: Part) -> Any:
        """Check and convert a window of an input for a run."""
        try:
            return admitted_part(self.bound, name, numbers)
        except InputError as error:
            raise InputError(
                f"{error} (counted in a tile that begins at column {window[2]}, row {window[0]})"
            ) from None

    def compute(
        self, window: Part, pictures: Mapping[str, Any], values: Mapping[str, object], *, stored: bool = False
    ) -> dict[str, Numbers]:
        """Compute the results in a window, in float32 or, if ``stored``, in the dtype of their targets."""
        top, _, left, _ = window
        # All tiles of a picture are one frame.
        all_values = {FRAME_INDEX.name: 0, **values, WINDOW.name: (left, top, *self.size), OUTPUT_SIZE.name: self.size}
        run_values = {name: value for name, value in all_values.items() if name in values or name in self.plan.values}
        results: Results = "stored" if stored else "float32"
        backend = self.bound.backend
        # Between two windows other threads may use the backend, for example to compute a source.
        with backend.turn:
            self.execution.run(pictures, run_values, None, results=results)
            with backend.running():
                results_by_name = {
                    name: self.execution.result(resource, results) for name, resource in self.plan.outputs.items()
                }
        # Results are arrays, since the run had no result arrays of the caller.
        return cast("dict[str, Numbers]", results_by_name)

    def close(self) -> None:
        """Release pictures and compiled passes."""
        with self.bound.backend.turn:
            self.execution.release()


def admitted_part(bound: Bound, name: str, numbers: Numbers) -> Any:
    """Check and convert a part of an input for a run."""
    readers = readers_of(name, bound.outputs.values())
    return admitted_picture(numbers, InputSpec(name, bound.inputs[name].format), bound.non_finite, readers)


Pictures: TypeAlias = dict[str, Any]
Progress: TypeAlias = "Callable[[int, int], None] | bool | None"
#: Called after each tile.
Advance: TypeAlias = Callable[[], None]


@dataclass(frozen=True, eq=False)
class Job:
    """The data shared by all tiles of a picture."""

    bound: Bound
    plan: Plan  # of the full picture
    needs: Footprint
    grid: Grid
    sources: Mapping[str, Source]  # inputs that tiles read in windows
    uncut: Mapping[str, Any]  # pictures of the inputs that tiles read whole
    sinks: Mapping[str, Sink]
    values: Mapping[str, object]
    paths: Mapping[str, Path]  # paths of the sources that are files

    def windows(self) -> Windows:
        """Compile the graph for the tiles' windows; the caller closes the result."""
        return Windows(self.bound, self.plan, self.needs, self.grid.window)

    def admitted(self, windows: Windows, tile: Tile) -> Pictures:
        """Read the inputs of a tile and convert them for a run."""
        pictures = {name: source.read(tile.window) for name, source in self.sources.items()}
        return {name: windows.admitted(name, numbers, tile.window) for name, numbers in pictures.items()}

    def compute(self, windows: Windows, tile: Tile, pictures: Pictures) -> Pictures:
        """Compute the results of a tile, in the size of its window."""
        return windows.compute(tile.window, {**self.uncut, **pictures}, self.values)

    def write(self, tile: Tile, results: Pictures) -> None:
        """Write the core of a tile's results."""
        for name, sink in self.sinks.items():
            sink.write(tile.core, _Cut(results[name], tile, sink))


@dataclass(frozen=True, eq=False)
class _Cut:
    """A function that returns parts of a tile's result, in picture coordinates, in the sink's dtype."""

    result: Numbers
    tile: Tile
    sink: Sink

    def __call__(self, part: Part) -> Numbers:
        (y, _, x, _), (top, bottom, left, right) = self.tile.window, part
        return converted(self.result[top - y : bottom - y, left - x : right - x], self.sink.dtype)


def run_tiles(job: Job, windows: Windows, advance: Advance) -> None:
    """Read, compute and write every tile in a pipeline, with one tile in each of the three stages."""
    tiles = iter(job.grid)
    written: Future[None] | None = None
    with ThreadPoolExecutor(1, "passgraph-read") as reader, ThreadPoolExecutor(1, "passgraph-write") as writer:
        tile = next(tiles, None)
        ahead = None if tile is None else reader.submit(job.admitted, windows, tile)
        while tile is not None and ahead is not None:
            pictures = ahead.result()
            following = next(tiles, None)
            ahead = None if following is None else reader.submit(job.admitted, windows, following)
            results = job.compute(windows, tile, pictures)
            del pictures
            if written is not None:
                written.result()
                advance()
            written = writer.submit(job.write, tile, results)
            del results
            tile = following
        if written is not None:
            written.result()
            advance()


@contextmanager
def report_progress(progress: Progress, total: int) -> Iterator[Advance]:
    """Yield a function to call after each tile; by default it draws a progress bar on a terminal."""
    if progress is not None and not isinstance(progress, bool):
        call = arguments.function(progress, "progress")
        done = 0

        def count_tile() -> None:
            nonlocal done
            done += 1
            call(done, total)

        yield count_tile
    elif progress is False or (progress is None and not sys.stderr.isatty()):
        yield lambda: None
    else:
        from rich.console import Console
        from rich.progress import Progress as Bar

        with Bar(console=Console(stderr=True), transient=True) as bar:
            task = bar.add_task("tiles", total=total)
            yield lambda: bar.advance(task)
