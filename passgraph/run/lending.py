"""Arrays of the caller in the place of a plan's memories, as far as a run goes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from passgraph.backends.base import OVERWRITTEN, READ, DevicePicture, Use
from passgraph.cached import cached_property
from passgraph.plan.data import DrawStep, Plan
from passgraph.run.admission import Picture
from passgraph.run.result import Results
from passgraph.run.room import Spare

if TYPE_CHECKING:
    from passgraph.backends.base import Backend


#: Bytes of a result from which on passes write it where its caller will have it.
WORTH_MAKING = 1 << 13


class Lending:
    """What the caller lends to one run after another.

    Attributes
    ----------
    storages : those that the backend made of such arrays, by the place of the memory that they stand for
    room : where the caller wants results of the last run, by resource
    made : memory for others of them, which will be the caller's, written as the caller wants them
    """

    def __init__(self, plan: Plan, backend: Backend) -> None:
        self.plan, self.backend = plan, backend
        self.storages: dict[int, Any] = {}
        self.room: dict[int, Picture] = {}
        self.made: dict[int, NDArray[Any]] = {}
        self._handed_out: set[int] = set()
        self._names = {resource: name for name, resource in plan.outputs.items()}
        self.spare = Spare()
        #: How each array of the last run came in or went out: in words, and what tells of its layout.
        self._transfers: dict[str, tuple[str, tuple[object, ...]]] = {}

    @property
    def transfers(self) -> dict[str, str]:
        """How each array of the last run came in or went out, in words, which few runs are asked for."""
        return {what: f"{how} {_in_words(layout)}" for what, (how, layout) in self._transfers.items()}

    def begin(self, room: Mapping[int, Picture], results: Results | None = None) -> None:
        """Another run begins: what the one before was lent is the caller's alone.

        ``results``: as what its caller wants those that are not in ``room``; None for one that reads none.
        """
        self.storages.clear()
        self._transfers.clear()
        self.made.clear()
        self._handed_out.clear()
        self.room = dict(room)
        for resource in self._worth_making if results else ():
            number = self.plan.resources[resource].format.number
            if resource not in room and (results == "stored" or number == "f4"):
                self.made[resource] = self.array(resource, np.dtype(number))

    def array(self, resource: int, dtype: np.dtype[Any]) -> NDArray[Any]:
        """An array of a result's size, which is the caller's from then on."""
        made = self.plan.resources[resource]
        return self.spare.array((*made.size[::-1], made.format.channels), dtype)

    def result(self, resource: int) -> Picture | None:
        """A result that is where its caller wants it; None for one that must be moved."""
        made = self.made.get(resource)
        if made is None:
            return self.room.get(resource)
        if resource in self._handed_out:
            return made.copy()
        self._handed_out.add(resource)
        return made

    def takes(self, name: str, resource: int, place: int, picture: Picture) -> bool:
        """Whether an input's picture is read where it lies, or a copy of it on the device."""
        format_ = self.plan.resources[resource].format
        is_overwritten = isinstance(picture, DevicePicture) and self._is_overwritten(resource, picture)
        use = OVERWRITTEN if is_overwritten else READ
        storage = self.backend.adopt(picture, format_, use) if resource in self._read_only else None
        how = "read in place"
        if storage is None:
            how = f"moved to {format_.name}"
        elif isinstance(picture, DevicePicture) and not picture.is_in(storage):
            how = f"copied on the device{', since a result is written there,' if use.is_overwritten else ''}"
        self._transfers[f"input {name!r}"] = f"{how} from", _layout(picture)
        if storage is not None:
            self.storages[place] = storage
        return storage is not None

    def _is_overwritten(self, resource: int, picture: DevicePicture) -> bool:
        """Whether a step reads an input's picture where, or after, a result is written over it."""
        over = [
            self._uses[self.plan.resources[result].memory].first_written
            for result, room in self.room.items()
            if isinstance(room, DevicePicture) and room.overlaps(picture)
        ]
        return any(resource in step.reads for first in over for step in self.plan.steps[first:])

    def take_room(self, places: Sequence[int]) -> None:
        """Results that the backend can write where the caller wants them are written there."""
        for resource in (self.room.keys() & self._plain_results) | self.made.keys():
            target = self.plan.resources[resource]
            array = self.room[resource] if resource in self.room else self.made[resource]
            storage = self.backend.adopt(array, target.format, self._uses[target.memory].use)
            if storage is not None:
                self.storages[places[resource]] = storage
            else:
                self.made.pop(resource, None)

    def end(self, places: Sequence[int], memories: Sequence[Any]) -> None:
        """Move the other results to where they are wanted, and give the inputs back.

        Results stay lent until the next run, so that they can be read.
        """
        for resource, array in self.room.items():
            moved = places[resource] not in self.storages
            if moved:
                self.backend.download_into(memories[places[resource]], array, self.plan.resources[resource].format)
            how = "moved into" if moved else "written in place in"
            self._transfers[f"output {self._names[resource]!r}"] = how, _layout(array)
        for resource in self._read_only:
            self.storages.pop(places[resource], None)

    @cached_property
    def _read_only(self) -> set[int]:
        """Inputs of which nothing is needed after a run, and that no step draws over."""
        plan = self.plan
        kept = {*plan.outputs.values(), *(r for name, r in plan.inputs.items() if name in plan.static_inputs)}
        written = {plan.resources[r].memory for step in plan.steps for r in step.writes}
        return {r for r in plan.inputs.values() if r not in kept and plan.resources[r].memory not in written}

    @cached_property
    def _uses(self) -> list[_PlaceUse]:
        """What steps do with each memory; results may share theirs with what is done with before."""
        plan = self.plan
        uses = [Use(is_read=False, is_written=True) for _ in plan.memories]
        first = [len(plan.steps)] * len(plan.memories)
        for number, step in enumerate(plan.steps):
            for resource in step.reads:
                place = plan.resources[resource].memory
                uses[place] = replace(uses[place], is_read=True)
            for resource in step.writes:
                place = plan.resources[resource].memory
                first[place] = min(first[place], number)
                drawn, beside = isinstance(step, DrawStep), len(step.writes) > 1
                uses[place] = replace(
                    uses[place], is_drawn=uses[place].is_drawn or drawn,
                    beside_others=uses[place].beside_others or beside,
                )  # fmt: skip
        return [_PlaceUse(*both) for both in zip(uses, first, strict=True)]

    @cached_property
    def _plain_results(self) -> set[int]:
        """Results that every run writes anew, and that the next one does not need."""
        plan = self.plan
        static = {r for step in plan.steps if step.static for r in step.writes}
        plain = (plan.resources[r] for r in plan.outputs.values() if r not in static)
        return {made.id for made in plain if made.kind == "target" and made.history is None}

    @cached_property
    def _worth_making(self) -> list[int]:
        """Plain results that take longer to be moved than to be lent memory."""
        memories = ((r, self.plan.memories[self.plan.resources[r].memory]) for r in self._plain_results)
        return [resource for resource, memory in memories if memory.bytes >= WORTH_MAKING]


@dataclass(frozen=True)
class _PlaceUse:
    """What a run does with a memory, and the first step that writes it."""

    use: Use
    first_written: int


def _layout(array: Picture) -> tuple[object, ...]:
    """What `_in_words` tells of; nothing of the array itself is kept."""
    return (str(array),) if isinstance(array, DevicePicture) else (array.dtype, array.shape, array.strides)


def _in_words(layout: tuple[object, ...]) -> str:
    if len(layout) == 1:
        return str(layout[0])
    dtype, shape, strides = layout
    return f"{dtype} {shape}, strides {strides}"
