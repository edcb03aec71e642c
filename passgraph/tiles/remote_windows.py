"""Tasks of dask workers: compute a window of a picture with a graph that the worker compiles once."""

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
from passgraph.tiles.grid import Numbers, Source, Tile
from passgraph.tiles.sources import open_source
from passgraph.tiles.tile_run import Windows, admitted_part, bound, whole_plan

#: Name of the worker plugin, and most compiled window shapes that it keeps; chunks at edges have other shapes.
WINDOWS, MOST_WINDOWS = "passgraph-windows", 8


@dataclass(frozen=True)
class SharedData:
    """Data shared by all windows of a picture.

    Attributes
    ----------
    digest, text : the serialized graph with its compile settings, see `passgraph.files.remote.digest_and_text`
    shapes : (height, width, channels) and dtype of each full input
    values : run values by name
    stored : True for results in the dtype of their targets, False for float32
    cache_bytes : bytes of decoded blocks of files that a worker keeps
    """

    digest: str
    text: str
    shapes: Mapping[str, tuple[tuple[int, int, int], str]]
    values: Mapping[str, Any]
    stored: bool = False
    cache_bytes: int = 0


@dataclass(frozen=True)
class Pieces:
    """The layout of pieces in a part of a picture: (first row, first column) of each."""

    shape: tuple[int, int, int]
    places: Sequence[tuple[int, int]]

    def joined(self, pieces: Sequence[Any]) -> Numbers:
        """Assemble the part from its pieces; a piece that covers it is returned as it is."""
        arrays = [_shaped(piece) for piece in pieces]  # one channel is broadcast
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
    """A graph compiled for windows of one shape, with its open files."""

    windows: Windows
    resources: ExitStack
    sources: dict[Named, Source] = field(default_factory=dict)

    @staticmethod
    def compile(shared: SharedData, window: tuple[int, int]) -> _Compiled:
        with ExitStack() as stack:
            program = stack.enter_context(compiled(shared.text))
            bound_program = bound(program, None, None, program._non_finite, stack)
            plan = whole_plan(bound_program, {name: (shape, np.dtype(d)) for name, (shape, d) in shared.shapes.items()})
            windows = Windows(bound_program, plan, footprint(plan), window)
            stack.callback(windows.close)
            return _Compiled(windows, stack.pop_all())

    def source(self, name: str, file: Named, cache_bytes: int) -> Source:
        """Return the source of a file, opened at its first use and kept open."""
        if file not in self.sources:
            opened = open_source(Path(file.path), f"input {name!r}", cache_bytes)
            self.resources.callback(opened.close)
            self.sources[file] = opened
        return self.sources[file]

    def close(self) -> None:
        self.resources.close()


def computed(
    shared: SharedData, tile: Tile, pictures: Mapping[str, Numbers | Named], uncut: Mapping[str, Any]
) -> dict[str, NDArray[Any]] | None:
    """Return the core of a tile's results; None if this worker does not see the same files as the caller."""
    files = [picture for picture in pictures.values() if isinstance(picture, Named)]
    if not all(file.is_here for file in files):
        return None
    top, bottom, left, right = tile.window
    key = f"{shared.digest} {sorted(shared.shapes.items())} {bottom - top} {right - left}"
    programs = Programs.here(WINDOWS, MOST_WINDOWS)
    with programs.using(key, lambda: _Compiled.compile(shared, (right - left, bottom - top))) as compiled:
        windows = compiled.windows
        inputs = {name: admitted_part(windows.bound, name, picture) for name, picture in uncut.items()}
        for name, picture in pictures.items():
            if isinstance(picture, Named):
                picture = compiled.source(name, picture, shared.cache_bytes).read(tile.window)
            inputs[name] = windows.admitted(name, picture, tile.window)
        results = windows.compute(tile.window, inputs, shared.values, stored=shared.stored)
    y0, y1, x0, x1 = tile.core
    cut = slice(y0 - top, y1 - top), slice(x0 - left, x1 - left)
    return {name: np.ascontiguousarray(result[cut]) for name, result in results.items()}


@dataclass(frozen=True)
class Chunk:
    """A chunk of a result: its tile, the layout of each input's pieces, and the names of the full inputs."""

    tile: Tile
    pieces: Mapping[str, Pieces]
    uncut: tuple[str, ...]


def chunk(shared: SharedData, spec: Chunk, pieces: Sequence[Sequence[Any]], uncut: Sequence[Any]) -> NDArray[Any]:
    """Compute a chunk of a picture's only result, from pieces and full inputs in the order of ``spec``."""
    layouts = spec.pieces.items()
    windows = {name: layout.joined(arrays) for (name, layout), arrays in zip(layouts, pieces, strict=True)}
    results = computed(shared, spec.tile, windows, dict(zip(spec.uncut, uncut, strict=True)))
    assert results is not None  # no input is a file
    return next(iter(results.values()))
