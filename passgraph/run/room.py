"""Arrays that a program's results are written into."""

from __future__ import annotations

import weakref
from collections.abc import Iterable, Mapping
from math import prod
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from passgraph.plan.data import Plan
    from passgraph.run.program import Program

#: Shape and type of an array.
Kind: TypeAlias = "tuple[tuple[int, int, int], np.dtype[Any]]"


class Rooms:
    """Room for one run after another, each in memory that nobody has any more, where there is some.

    A result belongs to whom it is handed to, so that its memory cannot simply be written again; but once the last array
    that looks at it is gone, it is.  New memory would be asked of the system, and zeroed by it, with each run.
    """

    def __init__(self, program: Program, most: int = 4) -> None:
        self._program, self._most = program, most
        self._free: list[NDArray[np.uint8]] = []
        self._plan: Plan | None = None
        self._kinds: Mapping[str, Kind] = {}

    def room(self) -> dict[str, NDArray[Any]]:
        """As `room_of`, for the sizes of the program's last run."""
        if self._plan is not self._program.plan:
            self._plan, self._kinds = self._program.plan, _kinds(self._program)
        return {name: self._array(*kind) for name, kind in self._kinds.items()}

    def _array(self, shape: tuple[int, ...], dtype: np.dtype[Any]) -> NDArray[Any]:
        needed = prod(shape) * dtype.itemsize
        place = next((n for n, memory in enumerate(self._free) if memory.nbytes == needed), None)
        memory = np.empty(needed, np.uint8) if place is None else self._free.pop(place)
        lent = _Lent(memory)
        weakref.finalize(lent, self._given_back, memory).atexit = False
        return np.asarray(lent).view(dtype).reshape(shape)

    def _given_back(self, memory: NDArray[np.uint8]) -> None:
        self._free = [memory, *self._free][: self._most]


class _Lent:
    """What every array in a memory keeps alive."""

    def __init__(self, memory: NDArray[np.uint8]) -> None:
        self.__array_interface__ = memory.__array_interface__


def room_of(program: Program, names: Iterable[str] | None = None) -> dict[str, NDArray[Any]]:
    """New arrays by output name, of the sizes and in the types of the program's results: what ``into=`` takes.

    Of ``names``, else of all.  Runs that are given the same ones again allocate nothing of a picture's size.

    >>> import passgraph as pg
    >>> dim = pg.kernel(source="def dim(color: Image) -> vec4: return color[0, 0] * 0.5")
    >>> dimmed = dim(pg.Input("frame", "rgba8", (4, 2)), into=pg.target("dimmed", "rgba8"))
    >>> with pg.compile(dimmed, results="stored") as program:
    ...     room = room_of(program)
    ...     made = program(frame=np.full((2, 4, 4), 100, np.uint8), into=room)
    >>> made["dimmed"] is room["dimmed"], room["dimmed"][0, 0].tolist()
    (True, [50, 50, 50, 50])
    """
    kinds = _kinds(program)
    return {name: np.empty(*kinds[name]) for name in (kinds if names is None else names)}


def _kinds(program: Program) -> dict[str, Kind]:
    """Shape and type of each result."""
    plan, stored = program.plan, program.settings()["results"] == "stored"
    made = {name: plan.resources[resource] for name, resource in plan.outputs.items()}
    return {
        name: ((*one.size[::-1], one.format.channels), np.dtype(one.format.number if stored else np.float32))
        for name, one in made.items()
    }
