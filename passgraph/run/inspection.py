"""Every value of every line of a kernel at one pixel, by the reference: `passgraph.Program.inspect`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from passgraph.arguments import near, shown, whole
from passgraph.backends.base import Block
from passgraph.backends.reference import ReferenceBackend
from passgraph.backends.reference.stage import Stage, given
from passgraph.backends.reference.storage import Storage, stored
from passgraph.backends.reference.traced import Branch, Event, Loop, Taken, Traced, plain
from passgraph.errors import GraphError, InputError
from passgraph.plan.build import build
from passgraph.plan.data import DrawStep, Options, PixelStep, Plan, Step
from passgraph.run.execution import Execution

if TYPE_CHECKING:
    from passgraph.formats import Format
    from passgraph.graph.targets import Target

#: Every pass as it is written, each target in memory of its own.
OPTIONS = Options(fuse=False, alias=False, static=False)
#: Columns in which source stands before values.
_SOURCE_COLUMNS = 56
#: Arrays longer than this are shown in part.
_SHOWN_NUMBERS = 16


@dataclass(frozen=True)
class Inspection:
    """What a pass does at one pixel, in float64; ``str()`` shows it beside the lines of the source.

    Attributes
    ----------
    step : the pass's name
    kernel, file : the kernel's name, and where its text stands
    pixel, size : (x, y), row 0 on top, and (width, height) of the pass
    parameters : values of the kernel's parameters that were read, by name
    events : in the order in which they happened, see `passgraph.backends.reference.traced`
    results : what the kernel returns, by target
    stored : what of that the target's format holds
    """

    step: str
    kernel: str
    file: str
    pixel: tuple[int, int]
    size: tuple[int, int]
    parameters: Mapping[str, Any]
    events: Sequence[Event]
    results: Mapping[str, Any]
    stored: Mapping[str, Any]

    def values(self, name: str) -> list[Any]:
        """Every value that a variable took, in order; of loops those of the trips that are kept."""
        return [event.value for event in _all(self.events) if isinstance(event, Taken) and event.name == name]

    def __str__(self) -> str:
        x, y = self.pixel
        lines = [f"pass {self.step} at ({x}, {y}) of {self.size[0]}x{self.size[1]}: kernel {self.kernel}, {self.file}"]
        lines += [f"  {name} = {_text(value)}" for name, value in self.parameters.items()]
        lines += _lines(self.events)
        for name, value in self.results.items():
            held = self.stored[name]
            kept = "" if held == value else f", held as {_text(held)}"
            lines.append(f"{name} = {_text(value)}{kept}")
        return "\n".join(lines)


def _all(events: Sequence[Event]) -> Iterator[Event]:
    for event in events:
        yield event
        if isinstance(event, Loop):
            for _, inner in event.trips:
                yield from _all(inner)


def _lines(events: Sequence[Event]) -> list[str]:
    made, before = list[str](), None
    for event in events:
        place = event.span.file, event.span.line
        source = "" if place == before else event.span.text.expandtabs().rstrip()
        number = "" if place == before else str(event.span.line)
        before = place
        made.append(f"{number:>5}  {source:<{_SOURCE_COLUMNS}}  {_said(event)}")
        if isinstance(event, Loop):
            left, text = event.count - len(event.trips), event.span.text.expandtabs()
            indent = " " * (len(text) - len(text.lstrip()) + 2)
            for at, (index, inner) in enumerate(event.trips):
                if left and at == len(event.trips) // 2:
                    made.append(f"{'':5}  {indent}… {left} more")
                made.append(f"{'':5}  {indent}{event.name} = {index}:")
                made += _lines(inner)
            before = None
    return made


def _said(event: Event) -> str:
    if isinstance(event, Taken):
        name = f"{event.name} = " if event.name else ""
        return f"{'returns ' if event.returns else ''}{name}{_text(event.value)}"
    if isinstance(event, Branch):
        return "holds" if event.holds else "does not hold"
    return f"{event.count} trip{'' if event.count == 1 else 's'}"


def _text(value: Any) -> str:
    if isinstance(value, tuple):
        parts = [_text(part) for part in value[:_SHOWN_NUMBERS]]
        more = f", … {len(value) - _SHOWN_NUMBERS} more" if len(value) > _SHOWN_NUMBERS else ""
        return f"({', '.join(parts)}{more})"
    return f"{value:.9g}" if isinstance(value, float) else str(value)


# Finding out


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


def _step(plan: Plan, name: str | None) -> PixelStep:
    """The pass of this name; the last one where none is given."""
    steps = {step.name: step for step in plan.steps if not isinstance(step, DrawStep) and isinstance(step, PixelStep)}
    draws = {step.name for step in plan.steps if isinstance(step, DrawStep)}
    if name is None:
        if not steps:
            raise GraphError("inspect looks into full-screen passes, and this graph has none")
        return list(steps.values())[-1]
    if name in draws:
        raise GraphError(f"pass {name!r} draws triangles; inspect looks into full-screen passes: {', '.join(steps)}")
    if name not in steps:
        raise GraphError(f"there is no pass {shown(name)}{near(str(name), steps)}; there are {', '.join(steps)}")
    return steps[name]


class _Looking(ReferenceBackend):
    """The reference up to one pass, of which it computes one pixel; what that does not need is left out."""

    def __init__(self, plan: Plan, wanted: PixelStep, pixel: tuple[int, int]) -> None:
        super().__init__()
        self.plan, self.wanted, self.pixel = plan, wanted, pixel
        self.found: Inspection | None = None
        self._needed = _behind(plan, wanted)

    def pixel_pass(self, step: PixelStep) -> Any:
        if step is self.wanted:
            return self._look
        return super().pixel_pass(step) if id(step) in self._needed else _nothing

    def draw_pass(self, step: DrawStep) -> Any:
        return super().draw_pass(step) if id(step) in self._needed else _nothing

    def _look(self, outputs: Sequence[Storage], images: Sequence[Storage], block: Block) -> None:
        step, (x, y) = self.wanted, self.pixel
        program = step.source.kernel.program
        stage = Stage(program, step.program, step.facts)
        bound = stage.bind(block, [name for name, _ in step.images], images)
        traces: list[Traced] = []

        def make(*parts: Any) -> Traced:
            traces.append(Traced(*parts))
            return traces[0]

        here = {"pixel": given(np.array([[x, y]])), "output_size": given(np.array([step.size], np.int64))}
        results, _ = bound.run(1, here, make)
        names = [self.plan.resources[resource].name for resource in step.outputs]
        self.found = Inspection(
            step.name, program.name, f"{program.source.file}:{program.source.line}", (x, y), step.size,
            {name: plain(value) for name, value in bound.read.items()}, traces[0].events,
            {name: plain(value) for name, value in zip(names, results, strict=True)},
            {
                name: _held(output, value)
                for name, output, value in zip(names, outputs, results, strict=True)
            },
        )  # fmt: skip


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
