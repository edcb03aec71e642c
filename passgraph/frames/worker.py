"""What runs in a worker of dask.distributed: one frame, on a program that the worker compiled once."""

from __future__ import annotations

import json
import os
from collections import OrderedDict
from collections.abc import Iterator
from contextlib import contextmanager
from threading import Lock
from typing import Any, cast

from distributed import get_worker
from distributed.diagnostics.plugin import WorkerPlugin

from passgraph.frames.frame import Stored
from passgraph.frames.stored import given
from passgraph.pictures import load_stored
from passgraph.plan.data import Options
from passgraph.run.program import Program, compile
from passgraph.travel import from_data

#: What workers know their programs by.
PLUGIN = "passgraph-programs"
#: Programs that a worker keeps, with their pictures; the one used longest ago is closed for another.
MOST_PROGRAMS = 4


class Programs(WorkerPlugin):
    """The programs of one worker, by digest; the worker closes them when it ends."""

    def __init__(self) -> None:
        self.kept: OrderedDict[str, Program] = OrderedDict()
        self.turn = Lock()
        self.compiled = 0

    @staticmethod
    def here() -> Programs:
        """Those of the worker that this task runs in."""
        # One step of the interpreter, so that two threads find the same.
        return cast("Programs", get_worker().plugins.setdefault(PLUGIN, Programs()))

    def teardown(self, worker: Any) -> None:
        with self.turn:
            while self.kept:
                self.kept.popitem()[1].close()

    @contextmanager
    def program(self, digest: str, text: str) -> Iterator[Program]:
        """The program of a graph, for one thread of the worker at a time."""
        with self.turn:
            if digest not in self.kept:
                while len(self.kept) >= MOST_PROGRAMS:
                    self.kept.popitem(last=False)[1].close()
                self.kept[digest] = _compiled(json.loads(text))
                self.compiled += 1
            self.kept.move_to_end(digest)
            yield self.kept[digest]


def _compiled(told: dict[str, Any]) -> Program:
    settings = dict(told["compile"])
    size, options = settings.pop("size"), Options(**settings.pop("options"))
    return compile(from_data(told["graph"]), size=None if size is None else tuple(size), options=options, **settings)


def same(given: Any) -> Any:
    """What it is given, as the result of a task."""
    return given


def compute(
    graph: tuple[str, str], pictures: dict[str, Any], values: dict[str, Any], linear: bool, output: str | None
) -> tuple[dict[str, tuple[int, int]], Stored] | None:
    """One frame: the sizes of its pictures, and the result; None where a file that is named looks different here."""
    read: dict[str, Stored] = {}
    for name, picture in pictures.items():
        if isinstance(picture, tuple):
            path, size, modified = picture
            try:
                status = os.stat(path)
            except OSError:
                return None
            if (status.st_size, status.st_mtime_ns) != (size, modified):
                return None
            read[name] = load_stored(path)
        else:
            read[name] = picture
    with Programs.here().program(*graph) as program:
        brought: dict[str, Any] = {name: given(picture, program.inputs[name], linear) for name, picture in read.items()}
        results = program(**values, **brought)
    sizes = {name: (picture.shape[1], picture.shape[0]) for name, picture in brought.items()}
    return sizes, results[next(iter(results)) if output is None else output]
