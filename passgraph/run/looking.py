"""Runs the reference up to one pass, of which it computes one pixel, and tells what it saw there."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from passgraph.arguments import near, shown, whole
from passgraph.backends.base import Block
from passgraph.backends.reference import ReferenceBackend
from passgraph.backends.reference.stage import BoundStage, Stage, given
from passgraph.backends.reference.storage import Storage, stored
from passgraph.backends.reference.traced import Event, plain, traced
from passgraph.backends.reference.traced_draw import Drawn, TracedDraw
from passgraph.errors import GraphError, InputError
from passgraph.graph.geometry import Geometry
from passgraph.plan.build import build
from passgraph.plan.data import DrawStep, Options, PixelStep, Plan, Step
from passgraph.run.execution import Execution
from passgraph.run.inspection import Inspection

if TYPE_CHECKING:
    from passgraph.formats import Format
    from passgraph.graph.targets import Target
    from passgraph.language.ir import TypedKernel

#: Every pass as it is written, each target in memory of its own.
OPTIONS = Options(fuse=False, alias=False, static=False)


@dataclass(frozen=True)
class Known:
    """What a program knows of a run: its graph, and what is given."""

    outputs: Mapping[str, Target]
    size: tuple[int, int] | None
    bound: Mapping[str, tuple[Format, tuple[int, int]]]
    pictures: Mapping[str, Any]
    values: Mapping[str, Any]
    overrides: Mapping[tuple[str, str], object]


def inspected(known: Known, name: str | None, x: int, y: int) -> Inspection:
    """What `passgraph.Program.inspect` does."""
    for given_name, picture in known.pictures.items():
        if not isinstance(picture, np.ndarray):
            raise InputError(f"input {given_name!r} is on the device, and the reference inspects; give an array")
    plan = build(dict(known.outputs), known.size, dict(known.bound), OPTIONS)
    step = _step(plan, name)
    width, height = step.size
    x = whole(x, f"inspect: x, in pass {step.name!r}", 0, width - 1)
    y = whole(y, f"inspect: y, in pass {step.name!r}", 0, height - 1)
    backend = _Looking(plan, step, (x, y))
    execution = Execution(plan, backend)
    try:
        for (pass_name, parameter), value in known.overrides.items():
            execution.override(pass_name, parameter, value)
        execution.run(dict(known.pictures), dict(known.values), None)
    finally:
        execution.release()
    assert backend.found is not None
    return backend.found


def _step(plan: Plan, name: str | None) -> PixelStep | DrawStep:
    """The pass of this name; the last one where none is given, or several have it and no number is behind it."""
    steps = [step for step in plan.steps if isinstance(step, (PixelStep, DrawStep))]
    if not steps:
        raise GraphError("inspect looks into passes, and this graph has none")
    named: dict[str, list[PixelStep | DrawStep]] = {}
    for step in steps:
        named.setdefault(step.name, []).append(step)
    numbered = {
        f"{of} {number}" if len(several) > 1 else of: step
        for of, several in named.items()
        for number, step in enumerate(several, 1)
    }
    if name is None:
        return steps[-1]
    if name in named:
        return named[name][-1]
    if name not in numbered:
        raise GraphError(f"there is no pass {shown(name)}{near(str(name), numbered)}; there are {', '.join(numbered)}")
    return numbered[name]


class _Looking(ReferenceBackend):
    """The reference up to one pass, of which it computes one pixel; what that does not need is left out."""

    def __init__(self, plan: Plan, wanted: PixelStep | DrawStep, pixel: tuple[int, int]) -> None:
        super().__init__()
        self.plan, self.wanted, self.pixel = plan, wanted, pixel
        self.found: Inspection | None = None
        self._needed = _behind(plan, wanted)

    def pixel_pass(self, step: PixelStep) -> Any:
        if step is self.wanted:
            return partial(self._look, step)
        return super().pixel_pass(step) if id(step) in self._needed else _nothing

    def draw_pass(self, step: DrawStep) -> Any:
        if step is self.wanted:
            return partial(self._look_at_draw, step)
        return super().draw_pass(step) if id(step) in self._needed else _nothing

    def _look(self, step: PixelStep, outputs: Sequence[Storage], images: Sequence[Storage], block: Block) -> None:
        x, y = self.pixel
        program = step.source.kernel.program
        stage = Stage(program, step.program, step.facts)
        bound = stage.bind(block, [name for name, _ in step.images], images)
        here = {"pixel": given(np.array([[x, y]])), "output_size": given(np.array([step.size], np.int64))}
        events, results = traced(bound, here)
        holds = map(_held, outputs, results)
        self._tell(step, program, bound, events, map(plain, results), dict(zip(self._names(step), holds, strict=True)))

    def _look_at_draw(
        self,
        step: DrawStep,
        outputs: Sequence[Storage],
        depth: Storage | None,
        images: Sequence[Storage],
        geometry: Geometry,
        vertex: Block,
        fragment: Block,
    ) -> None:
        x, y = self.pixel
        draw = TracedDraw(step, self.pixel)
        draw(outputs, depth, images, geometry, vertex, fragment)
        drawn = draw.drawn()
        program = (step.source.vertex if step.source.fragment is None else step.source.fragment).program
        holds = {name: _pixel(output.pixels[y, x]) for name, output in zip(self._names(step), outputs, strict=True)}
        if depth is not None and step.depth is not None:
            name = self.plan.resources[step.depth].name
            holds[name] = float(depth.pixels[y, x, 0])
            if depth.stencil is not None:
                holds[f"{name} (stencil)"] = int(depth.stencil[y, x])
        lines = None if drawn.visible is None else drawn.visible.lines
        events, results = ((), None) if lines is None else (lines.events, lines.results)
        self._tell(step, program, draw.bound, events, results, holds, drawn)

    def _names(self, step: PixelStep | DrawStep) -> list[str]:
        """Of the targets that it writes, in order."""
        return [self.plan.resources[resource].name for resource in step.outputs]

    def _tell(
        self,
        step: PixelStep | DrawStep,
        kernel: TypedKernel,
        bound: BoundStage | None,
        events: Sequence[Event],
        results: Iterable[Any] | None,
        holds: Mapping[str, Any],
        drawn: Drawn | None = None,
    ) -> None:
        """What was seen: of a draw without a visible fragment no stage, events nor results."""
        self.found = Inspection(
            step.name, kernel.name, f"{kernel.source.file}:{kernel.source.line}", self.pixel, step.size,
            {} if bound is None else {name: plain(value) for name, value in bound.read.items()}, events,
            {} if results is None else dict(zip(self._names(step), results, strict=True)), holds, drawn,
        )  # fmt: skip


def _pixel(values: np.ndarray[Any, Any]) -> Any:
    """A texel as kernels write it: a number where it has one channel."""
    return float(values[0]) if len(values) == 1 else tuple(values.tolist())


def _held(output: Storage, value: Any) -> Any:
    row = plain(stored(output.format, value.reshape(1, -1)))
    return row[0] if value.ndim == 1 else row


def _nothing(*_: Any) -> None:
    """A pass that nobody asked for."""


def _behind(plan: Plan, wanted: Step) -> set[int]:
    """Steps whose results a step reads, by identity."""
    needed, resources = set[int](), set(wanted.reads)
    before = plan.steps[: plan.steps.index(wanted)]
    for step in reversed(before):
        if resources.intersection(step.writes):
            needed.add(id(step))
            resources.update(step.reads)
    return needed
