"""Tiles on their way: the next one is read and the last one written while one is computed."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, TypeAlias

from passgraph import arguments
from passgraph.errors import InputError
from passgraph.frames.tiles_grid import Grid, Tile
from passgraph.frames.tiles_parts import Numbers, Part
from passgraph.frames.tiles_sinks import Sink, converted
from passgraph.frames.tiles_sources import Source
from passgraph.graph.targets import InputSpec
from passgraph.graph.values import OUTPUT_SIZE
from passgraph.plan.window import WINDOW
from passgraph.run.admission import admitted_picture
from passgraph.run.execution import Execution
from passgraph.run.finite_checks import NonFinite

Pictures: TypeAlias = dict[str, Any]
Progress: TypeAlias = "Callable[[int, int], None] | bool | None"


@dataclass(frozen=True, eq=False)
class Job:
    """Everything that the tiles of one picture share."""

    grid: Grid
    execution: Execution
    inputs: Mapping[str, InputSpec]
    sources: Mapping[str, Source]  # of inputs that each tile reads a window of
    whole: Mapping[str, Numbers]  # those that each tile needs whole
    sinks: Mapping[str, Sink]
    values: Mapping[str, object]
    non_finite: NonFinite

    def read(self, tile: Tile) -> Pictures:
        """The inputs of a tile, ready to be computed with."""
        return {name: self._admitted(name, source.read(tile.window), tile) for name, source in self.sources.items()}

    def _admitted(self, name: str, numbers: Numbers, tile: Tile) -> Any:
        try:
            return admitted_part(numbers, name, self.inputs[name].format, self.non_finite, self._readers(name))
        except InputError as error:
            raise InputError(
                f"{error} (counted in a tile that begins at column {tile.window[2]}, row {tile.window[0]})"
            ) from None

    def _readers(self, name: str) -> Iterator[str]:
        """Passes that read an input, by name."""
        plan = self.execution.plan
        return (step.name for step in plan.steps if plan.inputs[name] in step.reads)

    def compute(self, tile: Tile, pictures: Pictures) -> Pictures:
        """The results of a tile, as large as its window."""
        plan = self.execution.plan
        top, _, left, _ = tile.window
        asked = {WINDOW.name: (left, top, *self.grid.size), OUTPUT_SIZE.name: self.grid.size}
        given = {**self.values, **{name: value for name, value in asked.items() if name in plan.values}}
        backend = self.execution.backend
        # Between two tiles others may use the backend, the one that computes a source among them.
        with backend.turn:
            self.execution.run({**self.whole, **pictures}, given, None)
            with backend.running():
                return {name: self.execution.download(resource) for name, resource in plan.outputs.items()}

    def write(self, tile: Tile, results: Pictures) -> None:
        """What is right of a tile's results, to where it belongs."""
        for name, sink in self.sinks.items():
            sink.write(tile.core, _Cut(results[name], tile, sink))


@dataclass(frozen=True, eq=False)
class _Cut:
    """Parts of a result, by their place in the picture, as the sink's numbers."""

    result: Numbers
    tile: Tile
    sink: Sink

    def __call__(self, part: Part) -> Numbers:
        (y, _, x, _), (top, bottom, left, right) = self.tile.window, part
        return converted(self.result[top - y : bottom - y, left - x : right - x], self.sink.dtype)


def admitted_part(numbers: Numbers, name: str, format_: Any, non_finite: NonFinite, readers: Iterable[str]) -> Any:
    """A part of an input as a run takes it: the one place where what tiles read goes into a program."""
    return admitted_picture(numbers, InputSpec(name, format_), non_finite, readers)


def run_tiles(job: Job, advance: Callable[[], None]) -> None:
    """Read, compute and write every tile; one of each is under way at a time."""
    tiles = iter(job.grid)
    written: Future[None] | None = None
    with ThreadPoolExecutor(1, "passgraph-read") as reader, ThreadPoolExecutor(1, "passgraph-write") as writer:
        tile = next(tiles, None)
        ahead = None if tile is None else reader.submit(job.read, tile)
        while tile is not None and ahead is not None:
            pictures = ahead.result()
            following = next(tiles, None)
            ahead = None if following is None else reader.submit(job.read, following)
            results = job.compute(tile, pictures)
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
def shown(progress: Progress, total: int) -> Iterator[Callable[[], None]]:
    """A function to call after each tile: a bar on a terminal where nothing else is asked for."""
    if progress is not None and not isinstance(progress, bool):
        call = arguments.function(progress, "progress")
        done = 0

        def told() -> None:
            nonlocal done
            done += 1
            call(done, total)

        yield told
    elif progress is False or (progress is None and not sys.stderr.isatty()):
        yield lambda: None
    else:
        from rich.console import Console
        from rich.progress import Progress as Bar

        with Bar(console=Console(stderr=True), transient=True) as bar:
            task = bar.add_task("tiles", total=total)
            yield lambda: bar.advance(task)
