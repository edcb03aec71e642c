"""The code of a dask worker: one window of a picture, with a graph that the worker compiled once."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from passgraph.files.worker import Named, Programs, compiled
from passgraph.plan.window import footprint
from passgraph.tiles.grid import Numbers, Tile
from passgraph.tiles.sources import Source, open_source
from passgraph.tiles.tile_run import Windows, admitted_part, bound, whole_plan

#: What workers know such graphs by, and how many shapes of windows they keep: chunks at edges have shapes of their own.
WINDOWS, MOST_WINDOWS = "passgraph-windows", 8


@dataclass(frozen=True)
class Told:
    """Data shared by all windows of a picture.

    Attributes
    ----------
    digest, text : the graph as data with what to compile it with, see `passgraph.files.remote.digest_and_text`
    shapes : (height, width, channels) and type of each whole input
    values : run values by name
    stored : whether results are what their targets hold, in place of values
    room : bytes in which a worker keeps decoded blocks of files
    """

    digest: str
    text: str
    shapes: Mapping[str, tuple[tuple[int, int, int], str]]
    values: Mapping[str, Any]
    stored: bool = False
    room: int = 0


@dataclass(frozen=True)
class Pieces:
    """The places of pieces in a part of a picture: (first row, first column) of each."""

    shape: tuple[int, int, int]
    places: Sequence[tuple[int, int]]

    def joined(self, pieces: Sequence[Any]) -> Numbers:
        """The part as one array; a piece that is the whole of it, as it is."""
        arrays = [_shaped(piece) for piece in pieces]  # of one channel, where all are to have its value
        if len(arrays) == 1 and arrays[0].shape == self.shape:
            return arrays[0]
        full = np.empty(self.shape, arrays[0].dtype)
        for array, (y, x) in zip(arrays, self.places, strict=True):
            full[y : y + array.shape[0], x : x + array.shape[1]] = array
        return full


def _shaped(piece: Any) -> Numbers:
    array = np.asarray(piece)
    return array[:, :, None] if array.ndim == 2 else array


@dataclass(eq=False)
class _Compiled:
    """A graph that is ready for windows of one shape, and the files that it reads."""

    windows: Windows
    held: ExitStack
    sources: dict[Named, Source] = field(default_factory=dict)

    @staticmethod
    def of(task: Told, window: tuple[int, int]) -> _Compiled:
        with ExitStack() as stack:
            program = stack.enter_context(compiled(task.text))
            bound_program = bound(program, None, None, program._non_finite, stack)
            plan = whole_plan(bound_program, {name: (shape, np.dtype(d)) for name, (shape, d) in task.shapes.items()})
            windows = Windows(bound_program, plan, footprint(plan), window)
            stack.callback(windows.close)
            return _Compiled(windows, stack.pop_all())

    def source(self, name: str, file: Named, room: int) -> Source:
        """An opened file, which stays open for other windows."""
        if file not in self.sources:
            opened = open_source(Path(file.path), f"input {name!r}", room)
            self.held.callback(opened.close)
            self.sources[file] = opened
        return self.sources[file]

    def close(self) -> None:
        self.held.close()


def computed(
    task: Told, tile: Tile, pictures: Mapping[str, Numbers | Named], whole: Mapping[str, Any]
) -> dict[str, NDArray[Any]] | None:
    """Return the exact part of a window's results; None if a named file is different on this machine."""
    files = [picture for picture in pictures.values() if isinstance(picture, Named)]
    if not all(file.is_here for file in files):
        return None
    top, bottom, left, right = tile.window
    key = f"{task.digest} {sorted(task.shapes.items())} {bottom - top} {right - left}"
    here = Programs.here(WINDOWS, MOST_WINDOWS)
    with here.using(key, lambda: _Compiled.of(task, (right - left, bottom - top))) as compiled:
        windows = compiled.windows
        given = {name: admitted_part(windows.bound, name, picture) for name, picture in whole.items()}
        for name, picture in pictures.items():
            if isinstance(picture, Named):
                picture = compiled.source(name, picture, task.room).read(tile.window)
            given[name] = windows.admitted(name, picture, tile.window)
        results = windows.compute(tile.window, given, task.values, stored=task.stored)
    y0, y1, x0, x1 = tile.core
    cut = slice(y0 - top, y1 - top), slice(x0 - left, x1 - left)
    return {name: np.ascontiguousarray(result[cut]) for name, result in results.items()}


@dataclass(frozen=True)
class Chunk:
    """A chunk of a result: what it is computed from, by input; `pieces` are those of windows, `whole` of the others."""

    tile: Tile
    pieces: Mapping[str, Pieces]
    whole: tuple[str, ...]


def chunk(task: Told, asked: Chunk, pieces: Sequence[Sequence[Any]], whole: Sequence[Any]) -> NDArray[Any]:
    """A chunk of a picture's only result, from pieces of its inputs in the order of ``asked``."""
    joined = {name: at.joined(given) for (name, at), given in zip(asked.pieces.items(), pieces, strict=True)}
    results = computed(task, asked.tile, joined, dict(zip(asked.whole, whole, strict=True)))
    assert results is not None  # no file is named
    return next(iter(results.values()))


def joined(pieces: Pieces, given: Sequence[Any]) -> Numbers:
    """A whole picture from its chunks."""
    return pieces.joined(given)
