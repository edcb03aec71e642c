"""Storages of a plan's resources: its own allocations on a device, or memory of the caller."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from passgraph.backends.base import DevicePicture
from passgraph.errors import BackendError
from passgraph.plan.data import Plan
from passgraph.run.caller_arrays import CallerArrays
from passgraph.run.caller_arrays import Picture as Given
from passgraph.run.result import Results

if TYPE_CHECKING:
    from passgraph.backends.base import Backend


class Storages:
    """The storages of a plan, until :meth:`release`.

    Attributes
    ----------
    memories : the storage of each of the plan's allocations
    places : resource → its allocation; history moves on after each run
    caller_arrays : arrays of the caller that take the place of allocations in a run
    """

    def __init__(self, plan: Plan, backend: Backend) -> None:
        self.plan, self.backend = plan, backend
        self.memories: list[Any] = []
        self.places = [resource.memory for resource in plan.resources]
        self.caller_arrays = CallerArrays(plan, backend)
        #: Results of chains whose allocation also backs one of the chain's images, and their replacement allocation.
        self.apart: dict[int, int] = {}
        self._uploaded: dict[str, object] = {}
        self._histories, self._moves_due = plan.histories, False

    def allocate(self) -> None:
        """Make every allocation."""
        for number in range(len(self.plan.memories)):
            self.memories.append(self._new(number))
        self._begin_history(started=True)

    def of(self, resource: int) -> Any:
        """Return the storage of a resource in this run."""
        place, lent = self.places[resource], self.caller_arrays.storages
        return lent[place] if place in lent else self.memories[place]

    def _new(self, number: int) -> Any:
        memory = self.plan.memories[number]
        try:
            return self.backend.make(memory.format, memory.size)
        except MemoryError as error:
            name = next(resource.name for resource in self.plan.resources if resource.memory == number)
            raise BackendError(
                f"{name!r} is {memory.size[0]}x{memory.size[1]} {memory.format.name} ({memory.bytes / 2**20:.0f} MiB), "
                f"for which {self.backend.name} finds no memory; use a smaller size or format, or work tile by tile"
            ) from error

    @contextmanager
    def reports_memory(self, doing: str) -> Iterator[None]:
        """Report an out-of-memory error with the failed operation and the memory of the graph's targets."""
        try:
            yield
        except MemoryError as error:
            mebibytes = sum(memory.bytes for memory in self.plan.memories) / 2**20
            raise BackendError(
                f"{self.backend.name} finds no memory to {doing} ({error}); its targets take {mebibytes:.0f} MiB, and "
                "the results come on top; use a smaller size or format, or work tile by tile"
            ) from error

    def keep_apart(self, results: Collection[int], read: Collection[int]) -> None:
        """Give results of a chain allocations of their own where the chain reads theirs.

        Single steps may write over an image that only an earlier step reads; a chain still reads it at that time.
        """
        used = {self.apart.get(resource, self.places[resource]) for resource in read}
        for resource in results:
            if self.places[resource] in used:
                self.memories.append(self._new(self.places[resource]))
                self.apart[resource] = len(self.memories) - 1

    def place_results(self, *, singly: bool) -> None:
        """Choose the allocations of chains' results: the plan's own if steps run singly."""
        for resource, apart in self.apart.items():
            self.places[resource] = self.plan.resources[resource].memory if singly else apart

    # Contents

    def upload(self, pictures: Mapping[str, Given]) -> bool:
        """Upload the inputs; return True if a static one is new."""
        changed = False
        static = self.plan.static_inputs
        for name, resource in self.plan.inputs.items():
            picture = pictures[name]
            if name in static and self._uploaded.get(name) is picture:
                continue
            if self.caller_arrays.takes(name, resource, self.places[resource], picture):
                continue
            if not isinstance(picture, DevicePicture) and picture.dtype == np.float32:
                self.backend.upload(self.of(resource), picture)
            else:
                self.backend.upload_stored(self.of(resource), picture, self.plan.resources[resource].format)
            if name in static:
                self._uploaded[name] = picture
                changed = True
        return changed

    def download(self, resource: int) -> NDArray[np.float32]:
        """Return a picture of the last run."""
        with self.reports_memory(f"read {self.plan.resources[resource].name!r}"):
            return self.backend.download(self.of(resource))

    def result(self, resource: int, results: Results) -> Given:
        """Return a picture in the requested form: the caller's array, the format's dtype, or float32."""
        result = self.caller_arrays.result(resource)
        if result is None:
            info = self.plan.resources[resource]
            with self.reports_memory(f"read {info.name!r} ({info.size[0]}x{info.size[1]} {info.format.name})"):
                dtype = np.dtype(info.format.number if results == "stored" else np.float32)
                result = self.caller_arrays.array(resource, dtype)
                self.backend.download_into(self.of(resource), result, info.format)
        return result

    # History

    def age(self) -> None:
        """Note that a run was completed: :meth:`move_history` ages the history by it."""
        self._moves_due = True

    def move_history(self) -> None:
        """Age the history; done at the start of a run, so that results can be read after the last one."""
        if self._moves_due:
            self._moves_due = False
            places = self.places
            for now, before in self._histories:
                places[now], places[before] = places[before], places[now]

    def reset(self) -> None:
        """Reset the history to its state before the first run: the targets' initial values."""
        self._moves_due = False
        self._begin_history(started=False)

    def _begin_history(self, started: bool) -> None:
        """Fill the history from before the first run. ``started``: memory is new, and 0."""
        for resource in self.plan.resources:
            is_zero = not isinstance(resource.initial, np.ndarray) and not any(resource.initial)
            if resource.kind == "history" and not (started and is_zero):
                width, height = resource.size
                shape = (height, width, resource.format.channels)
                picture = np.broadcast_to(np.asarray(resource.initial, np.float32), shape)
                self.backend.upload(self.of(resource.id), np.ascontiguousarray(picture))

    def continue_from(self, earlier: Storages) -> None:
        """Copy the history of targets that match in name, size and format."""
        earlier.move_history()
        earlier_history = {(r.name, r.size, r.format): r.id for r in earlier.plan.resources if r.kind == "history"}
        for resource in self.plan.resources:
            source = earlier_history.get((resource.name, resource.size, resource.format))
            if source is not None and resource.kind == "history":
                self.backend.copy(earlier.of(source), self.of(resource.id))

    def release(self) -> None:
        """Release every allocation."""
        for memory in self.memories:
            self.backend.release(memory)
        self.memories = []
