"""Arrays that a program's results are written into."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from passgraph.run.program import Program


def room_of(program: Program) -> dict[str, NDArray[Any]]:
    """New arrays by output name, of the sizes and in the types of the program's results: what ``into=`` takes.

    Runs that are given the same ones again allocate nothing of a picture's size.

    >>> import passgraph as pg
    >>> dim = pg.kernel(source="def dim(color: Image) -> vec4: return color[0, 0] * 0.5")
    >>> dimmed = dim(pg.Input("frame", "rgba8", (4, 2)), into=pg.target("dimmed", "rgba8"))
    >>> with pg.compile(dimmed, results="stored") as program:
    ...     room = room_of(program)
    ...     made = program(frame=np.full((2, 4, 4), 100, np.uint8), into=room)
    >>> made["dimmed"] is room["dimmed"], room["dimmed"][0, 0].tolist()
    (True, [50, 50, 50, 50])
    """
    plan, stored = program.plan, program.settings()["results"] == "stored"
    made = {name: plan.resources[resource] for name, resource in plan.outputs.items()}
    return {
        name: np.empty((one.size[1], one.size[0], one.format.channels), one.format.number if stored else np.float32)
        for name, one in made.items()
    }
