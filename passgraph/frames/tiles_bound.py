"""A graph and what it runs on, and its plans: of a whole picture, which is never run, and of windows of one shape."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from contextlib import ExitStack
from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING, Any, TypeAlias, cast

import numpy as np

from passgraph import arguments
from passgraph.errors import BackendError, GraphError, InputError
from passgraph.frames.tiles_parts import Numbers, Part
from passgraph.graph.outputs import named_outputs
from passgraph.graph.targets import InputSpec, Target
from passgraph.graph.values import FRAME_INDEX, OUTPUT_SIZE
from passgraph.plan.build import build
from passgraph.plan.data import Options, Plan
from passgraph.plan.footprint import Footprint
from passgraph.plan.reach import inputs_behind
from passgraph.plan.window import WINDOW, window_plan
from passgraph.plan.within_limits import check
from passgraph.run.admission import admitted_picture, format_of
from passgraph.run.execution import Execution
from passgraph.run.finite_checks import NonFinite, checked_choice, readers_of
from passgraph.run.program import Program
from passgraph.run.result import Results

if TYPE_CHECKING:
    from passgraph.backends.base import Backend

Graph: TypeAlias = "Program | Target | Iterable[Target] | Mapping[str, Target]"
#: (height, width, channels) and type of a picture.
Shape: TypeAlias = tuple[tuple[int, int, int], np.dtype[Any]]


@dataclass(frozen=True, eq=False)
class Bound:
    """A graph and what it runs on."""

    outputs: dict[str, Target]
    backend: Backend
    options: Options
    non_finite: NonFinite
    overrides: Mapping[tuple[str, str], object]
    size: tuple[int, int] | None

    @property
    def inputs(self) -> dict[str, InputSpec]:
        return inputs_behind(list(self.outputs.values()))

    def settings(self) -> dict[str, Any]:
        """What `passgraph.compile` takes beside the outputs, as plain data; of the backend its name."""
        return {
            "backend": self.backend.name, "size": self.size, "options": asdict(self.options),
            "non_finite": self.non_finite,
        }  # fmt: skip


def bound(
    graph: Graph, backend: str | Backend | None, options: Options | None, non_finite: NonFinite, stack: ExitStack
) -> Bound:
    """A graph, or a program, whose backend and options then hold; a backend that is opened here ``stack`` closes.

    Raises
    ------
    GraphError, BackendError
        Where windows of it cannot be computed, whatever its passes read.
    """
    from passgraph.backends.base import Backend as Class
    from passgraph.backends.registry import open_backend

    if isinstance(graph, Program):
        if backend is not None or options is not None:
            raise GraphError("a program has its backend and options already; give them where it is compiled")
        graph._check_open()
        if graph._check_finite:
            raise GraphError("check_finite looks at what passes of a whole run write; compile without it for tiles")
        overrides = dict(graph._overrides)
        made = Bound(graph._outputs, graph.backend, graph._options, graph._non_finite, overrides, graph._size)
    else:
        expected = "a name such as 'gl' or an open backend"
        if backend is None or isinstance(backend, str):
            opened = stack.enter_context(open_backend(backend))
        else:
            opened = arguments.instance(backend, Class, "backend", expected, BackendError)
        chosen = arguments.instance(Options() if options is None else options, Options, "options", "pg.Options(...)")
        made = Bound(named_outputs(graph), opened, chosen, checked_choice(non_finite), {}, None)
    if not (made.backend.optimises and made.backend.computes):
        raise BackendError(
            f"backend {made.backend.name} cannot compute tiles: it runs kernels as they were written, and tiles need "
            "them rewritten; use numpy, or another one"
        )
    return made


def whole_plan(bound: Bound, pictures: Mapping[str, Shape]) -> Plan:
    """The plan of the whole picture, which is never run."""
    inputs = {}
    for name, spec in bound.inputs.items():
        (height, width, channels), dtype = pictures[name]
        inputs[name] = (spec.format or format_of(dtype, channels, spec.srgb), (width, height))
    # What runs once would hold one tile's pixels in all others.
    options = replace(bound.options, static=False)
    return build(bound.outputs, bound.size, inputs, options, bound.backend.limits, in_windows=True)


def result_size(plan: Plan) -> tuple[int, int]:
    """(width, height) of the results."""
    return plan.resources[next(iter(plan.outputs.values()))].size


class Windows:
    """A graph on a device, for windows of one shape, wherever they lie in a picture of one size."""

    def __init__(self, bound: Bound, plan: Plan, needs: Footprint, window: tuple[int, int]) -> None:
        self.bound, self.size = bound, result_size(plan)
        made = window_plan(plan, needs, window)
        check(made, bound.backend.limits)
        with bound.backend.turn:
            self.execution = Execution(made, bound.backend)
            for (step, name), value in bound.overrides.items():
                self.execution.override(step, name, value)

    @property
    def plan(self) -> Plan:
        return self.execution.plan

    def admitted(self, name: str, numbers: Numbers, window: Part) -> Any:
        """A window of an input, ready to be computed with."""
        try:
            return admitted_part(self.bound, name, numbers)
        except InputError as error:
            raise InputError(
                f"{error} (counted in a tile that begins at column {window[2]}, row {window[0]})"
            ) from None

    def compute(
        self, window: Part, pictures: Mapping[str, Any], values: Mapping[str, object], *, stored: bool = False
    ) -> dict[str, Numbers]:
        """The results in a window: values, or what their targets hold."""
        top, _, left, _ = window
        # Tiles of one picture are one frame, however many runs they take.
        told = {FRAME_INDEX.name: 0, **values, WINDOW.name: (left, top, *self.size), OUTPUT_SIZE.name: self.size}
        given = {name: value for name, value in told.items() if name in values or name in self.plan.values}
        results: Results = "stored" if stored else "float32"
        backend = self.bound.backend
        # Between two windows others may use the backend, the one that computes a source among them.
        with backend.turn:
            self.execution.run(pictures, given, None, results=results)
            with backend.running():
                made = {name: self.execution.result(resource, results) for name, resource in self.plan.outputs.items()}
        # Nothing was given to write into, so that results are arrays.
        return cast("dict[str, Numbers]", made)

    def close(self) -> None:
        """Give back pictures and compiled passes."""
        with self.bound.backend.turn:
            self.execution.release()


def admitted_part(bound: Bound, name: str, numbers: Numbers) -> Any:
    """A part of an input as a run takes it: the one place where what tiles read goes into a program."""
    readers = readers_of(name, bound.outputs.values())
    return admitted_picture(numbers, InputSpec(name, bound.inputs[name].format), bound.non_finite, readers)
