"""Frames on other machines: what travels is the graph as data, names of files or pictures, and results.

Each frame is one task of dask.distributed, which may run twice (where a worker is lost) and gives the same.  The caller
takes results in order and stores each once; where a worker sees the folder, it has written the file, whole or not at
all.  A worker compiles a graph once and keeps it.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterator, Mapping
from concurrent.futures import CancelledError
from contextlib import contextmanager
from dataclasses import dataclass, field
from threading import Lock
from typing import Any

from passgraph.arguments import numbers
from passgraph.errors import BackendError, InputError, PassgraphError
from passgraph.files.flow import Run
from passgraph.files.frame import Frame, OutputError, Stored
from passgraph.files.sequences import Pictures, ToPictures
from passgraph.run.program import Program

#: Frames in flight: at least so many, for workers that join later, and so many a thread of the workers.
LEAST_AHEAD, AHEAD_A_THREAD = 16, 2
_RESUME = "frames that are done are whole: start one, and run again with resume=True (--resume)"


class SchedulerLostError(OutputError):
    """The scheduler went away: no further frame can be computed, and those that are done stay."""


def checked_client(client: Any) -> Any:
    """The client, if it is a synchronous one of dask.distributed; InputError else."""
    if not isinstance(client, _client_class()) or client.asynchronous:
        raise InputError(f"client must be a distributed.Client (not asynchronous), got {type(client).__name__}")
    return client


def check_travels(program: Program) -> None:
    """Refuse programs whose frames other machines cannot compute, before any is sent.

    Raises
    ------
    InputError
        For those whose frames need each other, and those with parameters that were changed by ``program.set``.
    """
    if program.has_history:
        raise InputError(
            "this program reads last frame's picture (pg.previous), so that frames need each other in order; run it on "
            "one machine: leave the client out"
        )
    check_unchanged(program._overrides)


def check_unchanged(overrides: Mapping[tuple[str, str], object]) -> None:
    """Refuse parameters that ``program.set`` changed: they are no part of the graph as data."""
    if overrides:
        raise InputError(
            "what program.set changed cannot be serialized; give it as a pg.Value, and its value with values="
        )


def travelling_values(values: Mapping[str, Any], what: str) -> dict[str, Any]:
    """Run values as numbers and arrays only: of what else is given, code would travel."""
    for name, value in values.items():
        numbers(value, f"{what}: value {name!r}", "be numbers, to go to another machine")
    return dict(values)


@contextmanager
def lost_reported(client: Any, what: str, then: str) -> Iterator[None]:
    """Errors of a cluster as those of this package; ``then`` says what to do once the scheduler is back."""
    try:
        yield
    except PassgraphError:
        raise
    except Exception as error:
        if isinstance(error, CancelledError) or client.status != "running":
            address = client.scheduler.address if client.scheduler is not None else "its address"
            raise SchedulerLostError(f"the scheduler at {address} went away ({type(error).__name__}); {then}") from None
        raise BackendError(f"{what}: no worker could compute it: {error}") from error


#: How long a scheduler is waited for.
CONNECT_SECONDS = 5


def connected(address: str) -> Any:
    """A client of the scheduler at an address; the caller closes it.

    Raises
    ------
    InputError
        Where none answers.
    """
    Client = _client_class()
    try:
        return Client(address, set_as_default=False, timeout=CONNECT_SECONDS)
    except (OSError, ValueError, TimeoutError) as error:
        raise InputError(
            f"no scheduler answers at {address!r} within {CONNECT_SECONDS} s ({type(error).__name__}); start one with "
            "dask scheduler, and give the address that it prints, such as tcp://host:8786"
        ) from None


def _client_class() -> Any:
    try:
        from distributed import Client
    except ImportError:
        raise InputError("frames on other machines need dask.distributed: pip install 'passgraph[dask]'") from None
    return Client


def digest_and_text(graph: dict[str, Any], settings: dict[str, Any]) -> tuple[str, str]:
    """A graph as data and what to compile it with, as text, and what tells it from others."""
    text = json.dumps({"graph": graph, "compile": settings}, sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest(), text


def threads_for(client: Any) -> int:
    """Threads here that wait for frames of the cluster: one for each frame in flight."""
    threads: int = sum(client.nthreads().values())
    return max(LEAST_AHEAD, AHEAD_A_THREAD * threads)


@dataclass
class RemoteRun(Run):
    """A run whose frames workers read, compute and, where they see the folder, write; others are stored here."""

    client: Any = None
    _brought: Lock = field(default_factory=Lock)

    def __post_init__(self) -> None:
        from passgraph.files.worker import Written, same

        self._written = Written
        digest, text = digest_and_text(self.program.to_data(), self.program.settings())
        # As the result of a task it is sent to a worker once, and made again where a worker is lost that held it.
        self._graph = self.client.submit(same, (digest, text), key=f"passgraph-graph-{digest}")
        self._constants = None
        if isinstance(self.values, Mapping) and not self.program.has_frame_index:
            self._constants = self.client.submit(same, self._values(0), pure=False)

    def _load(self, item: Any) -> Any:
        if item.skipped:
            return {}
        with lost_reported(self.client, item.frame.name, _RESUME):
            answer = self._asked(item, {name: self._named(name, frame) for name, frame in item.frames.items()})
            if answer is None:  # that worker does not see the files
                answer = self._asked(item, {name: frame.read() for name, frame in item.frames.items()})
        return answer

    def _values(self, number: int) -> dict[str, Any]:
        return travelling_values(super()._values(number), "frames")

    def _asked(self, item: Any, pictures: dict[str, Any]) -> Any:
        from passgraph.files.worker import compute

        values: Any = self._constants
        if values is None:
            with self._brought:  # a function of the caller's is called by one thread at a time
                values = self._values(item.frame.number)
        given = self._graph, pictures, values, self.linear, self.output, None if item.held else self._room(item.frame)
        future = self.client.submit(compute, *given, pure=False)
        return future.result()

    def _named(self, name: str, frame: Frame) -> Any:
        """A picture's file by name, where it is one, and what it looked like here; else its pixels."""
        from passgraph.files.worker import Named

        source = self.sources[name]
        if not isinstance(source, Pictures) or frame.number not in source.paths:
            return frame.read()
        return Named.of(source.paths[frame.number]) or frame.read()  # which says what is wrong

    def _room(self, frame: Frame) -> Any:
        """Where a worker may write: results that are files of their own, of which encoding is most of the work."""
        from passgraph.files.worker import Room, inode

        if type(self.sink) is not ToPictures:
            return None
        path = os.path.abspath(self.sink.path(frame))
        folder = inode(os.path.dirname(path))
        dtype = self.sink.stores(frame, (1, 1)).str  # of a picture file the suffix says it
        return None if folder is None else Room(path, folder, dtype, frame.name, self.sink.notes(frame))

    def _prepare(self, item: Any) -> Any:
        return None if isinstance(item.made, self._written) else super()._prepare(item)

    def _run(self, item: Any, answer: Any) -> Stored | None:
        sizes, result = answer
        self._check_sizes(item, sizes)
        self.ran += 1
        made: Stored = result
        return made
