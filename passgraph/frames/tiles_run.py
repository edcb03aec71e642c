"""Tiles on their way: the next one is read and the last one written while one is computed."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeAlias

from passgraph import arguments
from passgraph.frames.tiles_bound import Bound, Windows
from passgraph.frames.tiles_grid import Grid, Tile
from passgraph.frames.tiles_parts import Numbers, Part
from passgraph.frames.tiles_sinks import Sink, converted
from passgraph.frames.tiles_sources import Source
from passgraph.plan.data import Plan
from passgraph.plan.footprint import Footprint

Pictures: TypeAlias = dict[str, Any]
Progress: TypeAlias = "Callable[[int, int], None] | bool | None"
#: Called after each tile.
Advance: TypeAlias = Callable[[], None]


@dataclass(frozen=True, eq=False)
class Job:
    """Everything that the tiles of one picture share."""

    bound: Bound
    plan: Plan  # of the whole picture
    needs: Footprint
    grid: Grid
    sources: Mapping[str, Source]  # of inputs that each tile reads a window of
    whole: Mapping[str, Any]  # those that each tile needs whole
    sinks: Mapping[str, Sink]
    values: Mapping[str, object]
    paths: Mapping[str, Path]  # of sources that are files

    def windows(self) -> Windows:
        """What computes its tiles; the caller closes it."""
        return Windows(self.bound, self.plan, self.needs, self.grid.window)

    def read(self, tile: Tile) -> Pictures:
        """The inputs of a tile, as they are stored."""
        return {name: source.read(tile.window) for name, source in self.sources.items()}

    def admitted(self, windows: Windows, tile: Tile) -> Pictures:
        """The inputs of a tile, ready to be computed with."""
        read = self.read(tile).items()
        return {name: windows.admitted(name, numbers, tile.window) for name, numbers in read}

    def compute(self, windows: Windows, tile: Tile, pictures: Pictures) -> Pictures:
        """The results of a tile, as large as its window."""
        return windows.compute(tile.window, {**self.whole, **pictures}, self.values)

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


def run_tiles(job: Job, windows: Windows, advance: Advance) -> None:
    """Read, compute and write every tile; one of each is under way at a time."""
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
def shown(progress: Progress, total: int) -> Iterator[Advance]:
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
