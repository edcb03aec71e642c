"""Tasks of dask.distributed workers: compute a frame with a program that the worker compiles once."""

from __future__ import annotations

import json
import os
from collections import OrderedDict
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from threading import Lock
from typing import Any, Protocol, TypeVar, cast

import numpy as np
from distributed import get_worker
from distributed.diagnostics.plugin import WorkerPlugin

from passgraph.files.digests import file_state
from passgraph.files.frame import Stored
from passgraph.files.stored import as_program_input, stored
from passgraph.pictures import in_layer, load_stored, save
from passgraph.plan.data import Options
from passgraph.run.compile import compile
from passgraph.run.program import Program
from passgraph.serialize import from_data

#: Name of the worker plugin that holds the programs.
PLUGIN = "passgraph-programs"
#: Programs that a worker keeps, with their pictures; the least recently used one is closed.
MOST_PROGRAMS = 4


class Closable(Protocol):
    """A compiled object that a worker keeps."""

    def close(self) -> None: ...


_Kept = TypeVar("_Kept", bound=Closable)


class Programs(WorkerPlugin):
    """The programs of one worker, by digest; the worker closes them when it ends."""

    def __init__(self, most: int = MOST_PROGRAMS) -> None:
        self.kept: OrderedDict[str, Closable] = OrderedDict()
        self.most = most
        self.turn = Lock()
        self.compiled = 0

    @staticmethod
    def here(name: str = PLUGIN, most: int = MOST_PROGRAMS) -> Programs:
        """Return the programs of the current task's worker; outside of workers, those of the process."""
        try:
            plugins: Any = get_worker().plugins
        except ValueError:
            plugins = _PROCESS
        # Atomic, so that all threads get the same object.
        return cast("Programs", plugins.setdefault(name, Programs(most)))

    def teardown(self, worker: Any) -> None:
        with self.turn:
            while self.kept:
                self.kept.popitem()[1].close()

    @contextmanager
    def using(self, digest: str, compiled: Callable[[], _Kept]) -> Iterator[_Kept]:
        """Yield the object with a digest, compiled if it is not kept; locks it to one thread at a time."""
        with self.turn:
            if digest not in self.kept:
                while len(self.kept) >= self.most:
                    self.kept.popitem(last=False)[1].close()
                self.kept[digest] = compiled()
                self.compiled += 1
            self.kept.move_to_end(digest)
            yield cast("_Kept", self.kept[digest])


#: Programs of tasks outside of workers: in threads of the caller's process, or in processes of a pool.
_PROCESS: dict[str, Programs] = {}


def compiled(text: str) -> Program:
    """Compile a program from the JSON text of a graph and its compile settings."""
    data = json.loads(text)
    settings = dict(data["compile"])
    size, options = settings.pop("size"), Options(**settings.pop("options"))
    return compile(from_data(data["graph"]), size=None if size is None else tuple(size), options=options, **settings)


def identity(value: Any) -> Any:
    """Return the argument, so that the cluster keeps it as a task's result."""
    return value


@dataclass(frozen=True)
class Named:
    """A file as the caller sees it: its size and modification time; and how it is read, see `passgraph.load`."""

    path: str
    size: int
    modified: int
    overscan: bool = False

    @staticmethod
    def from_path(path: str | os.PathLike[str]) -> Named | None:
        """Describe a file, or the metadata file of a Zarr array; None if it does not exist."""
        state = file_state(full := os.path.abspath(path))
        return None if state is None else Named(full, *state[1:])

    @property
    def is_here(self) -> bool:
        """True if this worker sees the same file as the caller (same size and modification time)."""
        return Named.from_path(self.path) == replace(self, overscan=False)


@dataclass(frozen=True)
class OutputFile:
    """A picture file that a worker writes as `passgraph.files.sequences.ToPictures.prepare` does.

    ``folder`` is the inode number of its folder, ``frame`` the frame's name for errors, ``layer`` the layer of the
    result, and ``settings`` are further arguments of `passgraph.save`.
    """

    path: str
    folder: int
    dtype: str
    frame: str
    layer: str | None = None
    settings: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Written:
    """The shape of a result that a worker has written to its file."""

    shape: tuple[int, ...]


def compute(
    graph: tuple[str, str],
    pictures: dict[str, Any],
    values: dict[str, Any],
    linear: bool,
    output: str | None,
    output_file: OutputFile | None,
) -> tuple[dict[str, tuple[int, int]], Stored | Written] | None:
    """Compute a frame; return the sizes of its pictures and the result.

    Returns None if this worker does not see the same input files as the caller. If it does not see the same output
    folder, it returns the pixels for the caller to write.
    """
    loaded: dict[str, Stored] = {}
    for name, picture in pictures.items():
        if isinstance(picture, Named):
            if not picture.is_here:
                return None
            loaded[name] = load_stored(Path(picture.path), linear=linear, overscan=picture.overscan)
        else:
            loaded[name] = picture
    digest, text = graph
    with Programs.here().using(digest, lambda: compiled(text)) as program:
        inputs = program.inputs
        converted: dict[str, Any] = {n: as_program_input(picture, inputs[n], linear) for n, picture in loaded.items()}
        results = program(**values, **converted)
    sizes = {name: (picture.shape[1], picture.shape[0]) for name, picture in converted.items()}
    result = results[next(iter(results)) if output is None else output]
    if output_file is None or inode(os.path.dirname(output_file.path)) != output_file.folder:
        return sizes, result
    dtype = np.dtype(output_file.dtype)
    path = in_layer(Path(output_file.path), output_file.layer)
    save(path, stored(result, dtype, output_file.frame), **output_file.settings)
    return sizes, Written(result.shape)


def inode(folder: str) -> int | None:
    """Return a folder's inode number, which differs for folders of the same path that machines do not share."""
    try:
        return os.stat(folder).st_ino
    except OSError:
        return None
