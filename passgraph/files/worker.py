"""What runs in a worker of dask.distributed: one frame, on a program that the worker compiled once."""

from __future__ import annotations

import json
import os
from collections import OrderedDict
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from threading import Lock
from typing import Any, Protocol, TypeVar, cast

import numpy as np
from distributed import get_worker
from distributed.diagnostics.plugin import WorkerPlugin

from passgraph.files.frame import Stored
from passgraph.files.stored import as_program_input, stored
from passgraph.image_formats import Metadata
from passgraph.pictures import load_stored, save, split_layer
from passgraph.plan.data import Options
from passgraph.run.compile import compile
from passgraph.run.program import Program
from passgraph.serialize import from_data

#: What workers know their programs by.
PLUGIN = "passgraph-programs"
#: Programs that a worker keeps, with their pictures; the one used longest ago is closed for another.
MOST_PROGRAMS = 4


class Closed(Protocol):
    """What is compiled and kept."""

    def close(self) -> None: ...


_Kept = TypeVar("_Kept", bound=Closed)


class Programs(WorkerPlugin):
    """The programs of one worker, by digest; the worker closes them when it ends."""

    def __init__(self, most: int = MOST_PROGRAMS) -> None:
        self.kept: OrderedDict[str, Closed] = OrderedDict()
        self.most = most
        self.turn = Lock()
        self.compiled = 0

    @staticmethod
    def here(name: str = PLUGIN, most: int = MOST_PROGRAMS) -> Programs:
        """Those of the worker that this task runs in; outside of workers, those of the process."""
        try:
            plugins: Any = get_worker().plugins
        except ValueError:
            plugins = _PROCESS
        # One step of the interpreter, so that two threads find the same.
        return cast("Programs", plugins.setdefault(name, Programs(most)))

    def teardown(self, worker: Any) -> None:
        with self.turn:
            while self.kept:
                self.kept.popitem()[1].close()

    @contextmanager
    def using(self, digest: str, compiled: Callable[[], _Kept]) -> Iterator[_Kept]:
        """What is kept under a digest, or compiled now, for one thread of the worker at a time."""
        with self.turn:
            if digest not in self.kept:
                while len(self.kept) >= self.most:
                    self.kept.popitem(last=False)[1].close()
                self.kept[digest] = compiled()
                self.compiled += 1
            self.kept.move_to_end(digest)
            yield cast("_Kept", self.kept[digest])


#: Those of tasks that run outside of workers, on threads of the caller's process or in processes of a pool.
_PROCESS: dict[str, Programs] = {}


def compiled(text: str) -> Program:
    """The program of a graph that was told as JSON, with what `passgraph.compile` takes beside it."""
    told = json.loads(text)
    settings = dict(told["compile"])
    size, options = settings.pop("size"), Options(**settings.pop("options"))
    return compile(from_data(told["graph"]), size=None if size is None else tuple(size), options=options, **settings)


def same(given: Any) -> Any:
    """What it is given, as the result of a task."""
    return given


@dataclass(frozen=True)
class Named:
    """A file as the caller sees it: its size, and when it last changed."""

    path: str
    size: int
    modified: int

    @staticmethod
    def of(path: str | os.PathLike[str]) -> Named | None:
        """A file by its name; of a Zarr array, that of its description.  None where nothing is there."""
        full = os.path.abspath(path)
        file, _ = split_layer(Path(full))
        for description in (file / "zarr.json", file / ".zarray") if file.is_dir() else (file,):
            try:
                status = os.stat(description)
            except OSError:
                continue
            return Named(full, status.st_size, status.st_mtime_ns)
        return None

    @property
    def is_here(self) -> bool:
        """Whether it looks here as it does to the caller."""
        return Named.of(self.path) == self


@dataclass(frozen=True)
class Room:
    """Where a worker writes a result: a file, the number of its folder's inode, the type that is stored, and what goes
    along of the picture file that it is made of, as :meth:`ToPictures.prepare` writes it.
    """

    path: str
    folder: int
    dtype: str
    frame: str
    notes: Metadata | None = None


@dataclass(frozen=True)
class Written:
    """A result that its worker has written."""

    shape: tuple[int, ...]


def compute(
    graph: tuple[str, str], pictures: dict[str, Any], values: dict[str, Any], linear: bool, output: str | None,
    room: Room | None,
) -> tuple[dict[str, tuple[int, int]], Stored | Written] | None:  # fmt: skip
    """One frame: the sizes of its pictures, and the result; None where a file that is named looks different here.

    Where the folder for the result is not the one that the caller sees, the caller gets the result to write it.
    """
    read: dict[str, Stored] = {}
    for name, picture in pictures.items():
        if isinstance(picture, Named):
            if not picture.is_here:
                return None
            read[name] = load_stored(Path(picture.path))
        else:
            read[name] = picture
    digest, text = graph
    with Programs.here().using(digest, lambda: compiled(text)) as program:
        inputs = program.inputs
        brought: dict[str, Any] = {n: as_program_input(picture, inputs[n], linear) for n, picture in read.items()}
        results = program(**values, **brought)
    sizes = {name: (picture.shape[1], picture.shape[0]) for name, picture in brought.items()}
    result = results[next(iter(results)) if output is None else output]
    if room is None or inode(os.path.dirname(room.path)) != room.folder:
        return sizes, result
    save(room.path, stored(result, np.dtype(room.dtype), room.frame), like=room.notes)
    return sizes, Written(result.shape)


def inode(folder: str) -> int | None:
    """What tells a folder that machines share from another one of its name; None where there is none."""
    try:
        return os.stat(folder).st_ino
    except OSError:
        return None
