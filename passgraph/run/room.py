"""Arrays that a program's results are written into."""

from __future__ import annotations

import weakref
from collections import defaultdict, deque
from collections.abc import Iterable
from math import prod
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from passgraph.run.program import Program

#: Shape and type of an array.
Kind: TypeAlias = "tuple[tuple[int, int, int], np.dtype[Any]]"
#: Bytes of a result from which on its memory is kept: less than that the allocator keeps itself.
LEAST = 1 << 17
#: Bytes of a cache line: vectors that straddle two are stored in twice the time.
LINE = 64


class Spare:
    """Memory of results, handed out again once nobody has it any more.

    A result belongs to whom it is handed to, so that its memory cannot simply be written again; but once the last array
    that looks at it is gone, it is.  New memory would be asked of the system, and zeroed by it, with each run.
    """

    def __init__(self, most: int = 2) -> None:
        #: By size in bytes.  Whoever drops a result may do so in any thread: adding and taking are one step each.
        self._free: defaultdict[int, deque[NDArray[np.uint8]]] = defaultdict(lambda: deque(maxlen=most))

    def array(self, shape: tuple[int, ...], dtype: np.dtype[Any]) -> NDArray[Any]:
        """An array that holds anything."""
        needed = prod(shape) * dtype.itemsize
        if needed < LEAST:
            return np.empty(shape, dtype)
        free = self._free[needed]
        try:
            memory = free.pop()
        except IndexError:
            whole = np.empty(needed + LINE, np.uint8)
            first = -whole.ctypes.data % LINE
            memory = whole[first : first + needed]
        lent = _Lent(memory)
        weakref.finalize(lent, free.append, memory).atexit = False
        return np.asarray(lent).view(dtype).reshape(shape)


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
