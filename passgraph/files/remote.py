"""Compute frames on the workers of dask.distributed; workers get the serialized graph, file names or pictures.

Each frame is a task. A task may run twice, if a worker is lost, with the same result. The caller stores results in
order, each once. A worker that shares the output folder writes picture files itself, atomically. Workers compile a
graph once and keep the program.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterator, Mapping
from concurrent.futures import CancelledError
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Any

from passgraph.arguments import numbers
from passgraph.errors import BackendError, InputError, PassgraphError
from passgraph.files.flow import Run
from passgraph.files.frame import Frame, OutputError, Stored
from passgraph.files.sequences import Pictures, ToPictures
from passgraph.run.program import Program

#: Frames in flight: the minimum, for workers that join later, and the number a worker thread.
LEAST_AHEAD, AHEAD_A_THREAD = 16, 2
_RESUME = "frames that are done are whole: start one, and run again with resume=True (--resume)"


class SchedulerLostError(OutputError):
    """The connection to the scheduler is lost: no further frame can be computed; finished ones are kept."""


def checked_client(client: Any) -> Any:
    """Return the client; raise InputError if it is not a synchronous one of dask.distributed."""
    if not isinstance(client, _client_class()) or client.asynchronous:
        raise InputError(f"client must be a distributed.Client (not asynchronous), got {type(client).__name__}")
    return client


def check_remote(program: Program) -> None:
    """Check that workers can compute a program's frames, before any is sent.

    Raises
    ------
    InputError
        If the program has history, or if ``program.set`` changed parameters.
    """
    if program.has_history:
        raise InputError(
            "this program reads last frame's picture (pg.previous), so that frames need each other in order; run it on "
            "one machine: leave the client out"
        )
    check_unchanged(program._overrides)


def check_unchanged(overrides: Mapping[tuple[str, str], object]) -> None:
    """Raise InputError if ``program.set`` changed parameters, which the serialized graph does not contain."""
    if overrides:
        raise InputError(
            "what program.set changed cannot be serialized; give it as a pg.Value, and its value with values="
        )


def serializable_values(values: Mapping[str, Any], what: str) -> dict[str, Any]:
    """Return run values after checking that they are numbers or arrays; pickles of other objects can hold code."""
    for name, value in values.items():
        numbers(value, f"{what}: value {name!r}", "be numbers, to go to another machine")
    return dict(values)


@contextmanager
def cluster_errors(client: Any, what: str, then: str) -> Iterator[None]:
    """Convert errors of a cluster to those of this package; ``then`` tells the user how to continue."""
    try:
        yield
    except PassgraphError:
        raise
    except Exception as error:
        if isinstance(error, CancelledError) or client.status != "running":
            address = client.scheduler.address if client.scheduler is not None else "its address"
            raise SchedulerLostError(f"the scheduler at {address} went away ({type(error).__name__}); {then}") from None
        raise BackendError(f"{what}: no worker could compute it: {error}") from error


#: Timeout of a connection to a scheduler.
CONNECT_SECONDS = 5


def connected(address: str) -> Any:
    """Connect to the scheduler at an address; the caller closes the client.

    Raises
    ------
    InputError
        If no scheduler answers.
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
    """Return the digest and the JSON text of a serialized graph with its compile settings."""
    text = json.dumps({"graph": graph, "compile": settings}, sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest(), text


def threads_for(client: Any) -> int:
    """Return the number of local threads that wait for the cluster: one for each frame in flight."""
    threads: int = sum(client.nthreads().values())
    return max(LEAST_AHEAD, AHEAD_A_THREAD * threads)


@dataclass
class RemoteRun(Run):
    """A run whose frames are read and computed by workers, which also write them if they share the output folder."""

    client: Any = None

    def __post_init__(self) -> None:
        from passgraph.files.worker import Written, identity

        self._written = Written
        digest, text = digest_and_text(self.program.to_data(), self.program.settings())
        # The result of a task is sent to each worker once, and recomputed if the worker that holds it is lost.
        self._graph = self.client.submit(identity, (digest, text), key=f"passgraph-graph-{digest}")
        self._constants = None
        if isinstance(self.values, Mapping) and not self.program.has_frame_index:
            self._constants = self.client.submit(identity, self._values(0), pure=False)

    def _load(self, item: Any) -> Any:
        if item.skipped:
            return {}
        with cluster_errors(self.client, item.frame.name, _RESUME):
            result = self._submit(
                item, {name: self._file_or_pixels(name, frame) for name, frame in item.frames.items()}
            )
            if result is None:  # the worker does not see the same files
                result = self._submit(item, {n: frame.pixels(linear=self.linear) for n, frame in item.frames.items()})
        return result

    def _values(self, number: int) -> dict[str, Any]:
        return serializable_values(super()._values(number), "frames")

    def _submit(self, item: Any, pictures: dict[str, Any]) -> Any:
        """Compute a frame on a worker and wait for the result; see `passgraph.files.worker.compute`."""
        from passgraph.files.worker import compute

        values: Any = item.checked_values() if self._constants is None else self._constants
        output_file = None if item.resumed else self._output_file(item.frame)
        future = self.client.submit(
            compute, self._graph, pictures, values, self.linear, self.output, output_file, pure=False
        )
        return future.result()

    def _file_or_pixels(self, name: str, frame: Frame) -> Any:
        """Return the name, size and modification time of a picture's file; of other frames the pixels."""
        from passgraph.files.worker import Named

        source = self.sources[name]
        if not isinstance(source, Pictures) or frame.number not in source.paths:
            return frame.pixels(linear=self.linear)
        named = Named.from_path(source.paths[frame.number])
        if named is None:
            return frame.pixels(linear=self.linear)  # raises the error of a missing file
        return replace(named, overscan=source.overscan)

    def _output_file(self, frame: Frame) -> Any:
        """Return the picture file that a worker may write, since encoding is most of the work; None for other sinks."""
        from passgraph.files.worker import OutputFile, inode

        if type(self.sink) is not ToPictures:
            return None
        path = os.path.abspath(self.sink.file(frame))
        folder = inode(os.path.dirname(path))
        dtype = self.sink.stores(frame, (1, 1)).str  # does not depend on the size for picture files
        if folder is None:
            return None
        settings = self.sink.settings(frame)
        if settings["layers_of"] is not None:
            settings["layers_of"] = os.path.abspath(settings["layers_of"])
        return OutputFile(path, folder, dtype, frame.name, self.sink.layer, settings)

    def _prepare(self, item: Any) -> Any:
        return None if isinstance(item.result, self._written) else super()._prepare(item)

    def _run(self, item: Any, sizes_and_result: Any) -> Stored | None:
        result: Stored
        sizes, result = sizes_and_result
        self._check_sizes(item, sizes)
        self.ran += 1
        return result
