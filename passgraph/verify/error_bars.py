"""Error bars: the interval of each pixel of a program's results, in which every correct backend's value lies."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from passgraph import arguments
from passgraph.backends.base import Promises
from passgraph.errors import GraphError, InputError
from passgraph.pictures import save
from passgraph.plan.data import DrawStep
from passgraph.run.program import Program
from passgraph.verify.oracle.allowed import Allowed
from passgraph.verify.oracle.pass_bounds import Passes


@dataclass(frozen=True, eq=False)
class Bounds:
    """The bounds of one result, (height, width, channels) float64.

    Attributes
    ----------
    low, high : the least and the largest value that rounding allows; infinite where there is no bound
    undecided : (height, width), pixels where rounding may turn a decision; bounds include both outcomes
    """

    low: NDArray[np.float64]
    high: NDArray[np.float64]
    undecided: NDArray[np.bool_]

    @property
    def width(self) -> NDArray[np.float64]:
        """Return how far values of two correct backends may lie apart."""
        return self.high - self.low

    @classmethod
    def of(cls, allowed: Allowed) -> Bounds:
        """Return the bounds without those of NaN, which count as none."""
        low, high = (np.asarray(end, np.float64) for end in (allowed.values.lo, allowed.values.hi))
        unbounded = np.asarray(allowed.values.nan) | np.isnan(low) | np.isnan(high)
        return cls(np.where(unbounded, -np.inf, low), np.where(unbounded, np.inf, high), allowed.ambiguous)

    def save(self, path: str | os.PathLike[str], result: NDArray[Any]) -> None:
        """Write an OpenEXR file: the result, and the layers ``low``, ``high`` and ``width`` in float32, rounded out."""
        file = Path(path)
        if file.suffix.lower() != ".exr":
            raise InputError(f"{file}: bounds are layers of an OpenEXR file; got the suffix {file.suffix!r}; use .exr")
        save(file, result, raw=True)
        for name, picture in (("low", self.low), ("high", self.high), ("width", self.width)):
            save(f"{file}:{name}", _rounded_out(picture, up=name != "low"), layers_of=file, raw=True)


def _rounded_out(values: NDArray[np.float64], *, up: bool) -> NDArray[np.float32]:
    with np.errstate(over="ignore"):
        near = values.astype(np.float32)
    inside = near < values if up else near > values
    return np.where(inside, np.nextafter(near, np.float32(np.inf if up else -np.inf)), near)


def bounds(program: Program, /, **inputs: Any) -> dict[str, Bounds]:
    """Return the bounds of each result of a program for some inputs and values: how wrong may it be?

    The float64 reference runs with intervals from the inputs on, so the rounding of all passes adds up. It takes some
    thousand times as long as a run.

    Parameters
    ----------
    program
        What :func:`passgraph.compile` returned; without draws and history.
    inputs
        Pictures and run values by name, as for a call of the program.

    Raises
    ------
    GraphError
        For draws and history, whose bounds do not accumulate, and for parameters changed by `passgraph.Program.set`.

    Examples
    --------
    >>> import passgraph as pg
    >>> third = pg.kernel(source="def third(color: Image) -> vec4: return color[0, 0] / 3.0")
    >>> with pg.compile(third(pg.Input("frame"))) as program:
    ...     frame = np.ones((2, 3, 4), np.float32)
    ...     bars, result = bounds(program, frame=frame)["third"], program(frame=frame)["third"]
    >>> bool((bars.low <= result).all() and (result <= bars.high).all()), 0.0 < float(bars.width.max()) < 1e-6
    (True, True)
    """
    arguments.instance(program, Program, "bounds: program", "what passgraph.compile() returns")
    if program.has_history:
        raise GraphError("bounds: the program reads last run's content (pg.previous); give that content as an input")
    if program._overrides:
        raise GraphError(
            "bounds: the program has parameters changed by its set(); make them pg.Value and give them here"
        )
    passes = Passes(program.outputs, program._size, [inputs], math=program._options.math)
    return bounds_of(passes, program.backend.promises)


def bounds_of(passes: Passes, promises: Promises | None = None) -> dict[str, Bounds]:
    """Return the bounds of each result of a planned graph, for backends that promise this."""
    drawing = [step.name for step in passes.plan.steps if isinstance(step, DrawStep)]
    if drawing:
        raise GraphError(f"bounds: pass {drawing[0]!r} draws; bounds of draws are those of one pass: passgraph compare")
    found = passes.accumulated() if promises is None else passes.accumulated(promises)
    given: Mapping[int, str] = {resource: name for name, resource in passes.plan.inputs.items()}
    outputs = {name: resource for name, resource in passes.plan.outputs.items() if resource not in given}
    return {name: Bounds.of(found[resource]) for name, resource in outputs.items()}
