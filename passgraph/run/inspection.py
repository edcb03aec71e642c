"""Trace a kernel at one pixel, line by line, on the reference: `passgraph.Program.inspect`."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from passgraph.arguments import near, shown, whole_number
from passgraph.backends.base import Block
from passgraph.backends.reference import ReferenceBackend
from passgraph.backends.reference.stage import BoundStage, Stage, Storage, constant, stored
from passgraph.backends.reference.traced import Branch, Drawn, Event, Fragment, Loop, Taken, TracedDraw, plain, traced
from passgraph.errors import GraphError, InputError
from passgraph.graph.draw_state import Geometry
from passgraph.language.builtin_name import WHOLE_PIXEL, WHOLE_SIZE
from passgraph.plan.build import build
from passgraph.plan.data import DrawStep, Options, PixelStep, Plan, Step
from passgraph.run.execution import Execution

if TYPE_CHECKING:
    from passgraph.formats import Format
    from passgraph.graph.targets import Target
    from passgraph.language.ir import TypedKernel


#: Columns of source text to the left of the values.
_SOURCE_COLUMNS = 56
#: Longer arrays are abbreviated.
_SHOWN_NUMBERS = 16


@dataclass(frozen=True)
class Inspection:
    """A trace of a pass at one pixel, in float64; ``str()`` shows it next to the lines of the source.

    Attributes
    ----------
    step : the pass's name
    kernel, file : the kernel's name, and its source file
    pixel, size : (x, y), row 0 on top, and (width, height) of the pass
    parameters : values of the kernel's parameters that it read, by name
    events : in execution order, see `passgraph.backends.reference.traced`
    results : the kernel's results, by target
    stored : the results as the target's format stores them
    texels : positions that a full-screen pass reads, each once and in order, by image parameter; border rules may map
        those outside of the picture to others
    drawn : for a draw, the triangles that cover the pixel and the fate of each; None for a full-screen pass

    For a draw, parameters, events and results are those of the visible fragment: the last that passes its tests (or is
    blended in last); empty if there is none.  ``stored`` is what the targets hold after the draw, including depth and
    stencil, the latter as ``depth (stencil)``.

    Examples
    --------
    >>> import numpy as np
    >>> import passgraph as pg
    >>> text = '''class Corner:
    ...     position: vec4
    ...     height: float
    ...
    ... def place(v: Vertex) -> Corner: return Corner(vec4(v.position, 1.0), v.position.y)
    ... def shade(c: Corner) -> float: return c.height * 0.5'''
    >>> corners = np.array([[-1, -1, 0.5], [3, -1, 0.5], [-1, 3, 0.5], [-1, -1, 0], [3, -1, 0], [-1, 3, 0]], np.float32)
    >>> made = pg.draw(
    ...     pg.Mesh.make(corners, [[0, 1, 2], [3, 4, 5]]), vertex=pg.vertex(source=text, name="place"),
    ...     fragment=pg.fragment(source=text, name="shade"), into=pg.target("made", "r32f"),
    ...     depth=pg.target("depth", "depth32f"),
    ... )
    >>> with pg.compile(made, size=(4, 4)) as program:
    ...     found = program.inspect(0, 3)
    >>> [(each.triangle, each.depth, each.fate) for each in found.drawn.fragments], found.results
    ([(0, 0.75, 'passed'), (1, 0.5, 'passed')], {'made': -0.375})
    >>> seen = found.drawn.visible
    >>> [corner.values["height"] for corner in seen.corners], seen.lines.inputs  # print(found) shows all
    ([-1.0, -1.0, 3.0], {'varying.height': -0.75})
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
    drawn: Drawn | None = None
    texels: Mapping[str, Sequence[tuple[int, int]]] = field(default_factory=dict)

    def values(self, name: str) -> list[Any]:
        """Return every value that a variable took, in order; for loops, those of the recorded iterations."""
        return [event.value for event in _all(self.events) if isinstance(event, Taken) and event.name == name]

    def __str__(self) -> str:
        x, y = self.pixel
        lines = [f"pass {self.step} at ({x}, {y}) of {self.size[0]}x{self.size[1]}: kernel {self.kernel}, {self.file}"]
        lines += [f"  {name} = {text_of(value)}" for name, value in self.parameters.items()]
        if self.drawn is not None:
            return "\n".join([*lines, *_draw_lines(self.drawn, list(self.stored)), *_stored_lines(self.stored)])
        lines += _lines(self.events)
        for name, value in self.results.items():
            stored = self.stored[name]
            stored_text = "" if stored == value else f", held as {text_of(stored)}"
            lines.append(f"{name} = {text_of(value)}{stored_text}")
        return "\n".join(lines)


def _all(events: Sequence[Event]) -> Iterator[Event]:
    for event in events:
        yield event
        if isinstance(event, Loop):
            for _, inner in event.trips:
                yield from _all(inner)


def _lines(events: Sequence[Event]) -> list[str]:
    lines, before = list[str](), None
    for event in events:
        place = event.span.file, event.span.line
        source = "" if place == before else event.span.text.expandtabs().rstrip()
        number = "" if place == before else str(event.span.line)
        before = place
        lines.append(f"{number:>5}  {source:<{_SOURCE_COLUMNS}}  {_event_text(event)}")
        if isinstance(event, Loop):
            left, text = event.count - len(event.trips), event.span.text.expandtabs()
            indent = " " * (len(text) - len(text.lstrip()) + 2)
            for at, (index, inner) in enumerate(event.trips):
                if left and at == len(event.trips) // 2:
                    lines.append(f"{'':5}  {indent}… {left} more")
                lines.append(f"{'':5}  {indent}{event.name} = {index}:")
                lines += _lines(inner)
            before = None
    return lines


def _event_text(event: Event) -> str:
    if isinstance(event, Taken):
        name = f"{event.name} = " if event.name else ""
        return f"{'returns ' if event.returns else ''}{name}{text_of(event.value)}"
    if isinstance(event, Branch):
        return "holds" if event.holds else "does not hold"
    return f"{event.count} trip{'' if event.count == 1 else 's'}"


def text_of(value: Any) -> str:
    """Return a number with 9 digits, or a tuple of them; long tuples are abbreviated."""
    if isinstance(value, tuple):
        parts = [text_of(part) for part in value[:_SHOWN_NUMBERS]]
        more = f", … {len(value) - _SHOWN_NUMBERS} more" if len(value) > _SHOWN_NUMBERS else ""
        return f"({', '.join(parts)}{more})"
    return f"{value:.9g}" if isinstance(value, float) else str(value)


# Draws


def _draw_lines(drawn: Drawn, names: Sequence[str]) -> list[str]:
    if not drawn.covering:
        return [f"none of {drawn.triangles} triangles covers the pixel"]
    covers = "covers" if drawn.covering == 1 else "cover"
    lines = [f"{drawn.covering} of {drawn.triangles} triangles {covers} the pixel, in this order:"]
    last = -1
    for fragment in drawn.fragments:
        if fragment.order > last + 1:
            lines.append(f"  … {fragment.order - last - 1} more")
        last = fragment.order
        side = "front" if fragment.front else "back"
        lines.append(
            f"  triangle {fragment.triangle}, {side}, depth {text_of(fragment.depth)}: {_fate(fragment, drawn)}"
        )
    for fragment in drawn.detailed:
        lines += _fragment_lines(fragment, names)
    return lines


def _fate(fragment: Fragment, drawn: Drawn) -> str:
    against = (
        ""
        if fragment.tested_against is None
        else f" ({drawn.state.depth_compare} against {text_of(fragment.tested_against)})"
    )
    if fragment.fate == "discarded":
        return "discarded"
    if fragment.fate == "stencil":
        return "fails the stencil test"
    if fragment.fate == "depth":
        return f"fails the depth test{against}"
    if any(drawn.state.blend):
        return f"passes{against}, blended"
    return f"passes{against}{', visible' if fragment is drawn.visible else ', drawn over'}"


def _fragment_lines(fragment: Fragment, names: Sequence[str]) -> list[str]:
    lines = [f"triangle {fragment.triangle}:"]
    for corner in fragment.corners:
        values = ", ".join(f"{name} = {text_of(value)}" for name, value in corner.values.items())
        lines.append(f"  vertex {corner.vertex}: {values}")
    if fragment.lines is not None:
        lines += [f"  {name} = {text_of(value)}" for name, value in fragment.lines.inputs.items()]
        lines += _lines(fragment.lines.events)
        if fragment.fate == "passed":
            lines += [f"{name} = {text_of(v)}" for name, v in zip(names, fragment.lines.results, strict=False)]
    return lines


def _stored_lines(stored: Mapping[str, Any]) -> list[str]:
    return [f"{name} holds {text_of(value)}" for name, value in stored.items()]


#: Plan options: every pass as written, each target with an allocation of its own.
OPTIONS = Options(fuse=False, alias=False, static=False)


@dataclass(frozen=True)
class Known:
    """A program's graph and the inputs of a run."""

    outputs: Mapping[str, Target]
    size: tuple[int, int] | None
    bound: Mapping[str, tuple[Format, tuple[int, int]]]
    pictures: Mapping[str, Any]
    values: Mapping[str, Any]
    overrides: Mapping[tuple[str, str], object]


def inspected(known: Known, name: str | None, x: int, y: int) -> Inspection:
    """Implement `passgraph.Program.inspect`."""
    for given_name, picture in known.pictures.items():
        if not isinstance(picture, np.ndarray):
            raise InputError(f"input {given_name!r} is on the device; inspect needs an array")
    plan = build(dict(known.outputs), known.size, dict(known.bound), OPTIONS)
    step = step_named(plan, name)
    width, height = step.size
    x = whole_number(x, f"inspect: x, in pass {step.name!r}", 0, width - 1)
    y = whole_number(y, f"inspect: y, in pass {step.name!r}", 0, height - 1)
    backend = _InspectingBackend(plan, step, (x, y))
    execution = Execution(plan, backend)
    try:
        for (pass_name, parameter), value in known.overrides.items():
            execution.override(pass_name, parameter, value)
        execution.run(dict(known.pictures), dict(known.values), None)
    finally:
        execution.release()
    assert backend.found is not None
    return backend.found


def step_named(plan: Plan, name: str | None) -> PixelStep | DrawStep:
    """Return the pass with this name or numbered name; by default, or among passes of one name, the last one."""
    steps = [step for step in plan.steps if isinstance(step, (PixelStep, DrawStep))]
    if not steps:
        raise GraphError("inspect needs a pass, and this graph has none")
    named: dict[str, list[PixelStep | DrawStep]] = {}
    for step in steps:
        named.setdefault(step.name, []).append(step)
    numbered = {
        f"{candidates} {number}" if len(several) > 1 else candidates: step
        for candidates, several in named.items()
        for number, step in enumerate(several, 1)
    }
    if name is None:
        return steps[-1]
    if name in named:
        return named[name][-1]
    if name not in numbered:
        raise GraphError(f"there is no pass {shown(name)}{near(str(name), numbered)}; there are {', '.join(numbered)}")
    return numbered[name]


class _InspectingBackend(ReferenceBackend):
    """The reference up to one pass, restricted to one pixel of it; steps that the pass does not need are skipped."""

    def __init__(self, plan: Plan, step: PixelStep | DrawStep, pixel: tuple[int, int]) -> None:
        super().__init__()
        self.plan, self.wanted, self.pixel = plan, step, pixel
        self.found: Inspection | None = None
        self._needed = _behind(plan, step)

    def pixel_pass(self, step: PixelStep) -> Any:
        if step is self.wanted:
            return partial(self._look, step)
        return super().pixel_pass(step) if id(step) in self._needed else _skip

    def draw_pass(self, step: DrawStep) -> Any:
        if step is self.wanted:
            return partial(self._look_at_draw, step)
        return super().draw_pass(step) if id(step) in self._needed else _skip

    def _look(self, step: PixelStep, outputs: Sequence[Storage], images: Sequence[Storage], block: Block) -> None:
        x, y = self.pixel
        program = step.source.kernel.program
        stage = Stage(program, step.program, step.facts)
        bound = stage.bind(block, [name for name, _ in step.images], images)
        here = {WHOLE_PIXEL: constant(np.array([[x, y]])), WHOLE_SIZE: constant(np.array([step.size], np.int64))}
        lane, results = traced(bound, here)
        holds = dict(zip(self._names(step), map(_as_stored, outputs, results), strict=True))
        self._store(step, program, bound, lane.events, map(plain, results), holds)
        assert self.found is not None
        self.found = replace(self.found, texels={image: tuple(read) for image, read in lane.texels.items()})

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
        self._store(step, program, draw.bound, events, results, holds, drawn)

    def _names(self, step: PixelStep | DrawStep) -> list[str]:
        """Return the names of the targets that it writes, in order."""
        return [self.plan.resources[resource].name for resource in step.outputs]

    def _store(
        self,
        step: PixelStep | DrawStep,
        kernel: TypedKernel,
        bound: BoundStage | None,
        events: Sequence[Event],
        results: Iterable[Any] | None,
        holds: Mapping[str, Any],
        drawn: Drawn | None = None,
    ) -> None:
        """Store the trace; a draw without a visible fragment has no stage, events or results."""
        self.found = Inspection(
            step.name, kernel.name, f"{kernel.source.file}:{kernel.source.line}", self.pixel, step.size,
            {} if bound is None else {name: plain(value) for name, value in bound.read.items()}, events,
            {} if results is None else dict(zip(self._names(step), results, strict=True)), holds, drawn,
        )  # fmt: skip


def _pixel(values: np.ndarray[Any, Any]) -> Any:
    """Return a texel as kernels see it: a number if it has one channel."""
    return float(values[0]) if len(values) == 1 else tuple(values.tolist())


def _as_stored(output: Storage, value: Any) -> Any:
    row = plain(stored(output.format, value.reshape(1, -1)))
    return row[0] if value.ndim == 1 else row


def _skip(*_: Any) -> None:
    """Skip a step that the inspected pass does not need."""


def _behind(plan: Plan, target_step: Step) -> set[int]:
    """Return the steps that a step depends on, by identity."""
    needed, resources = set[int](), set(target_step.reads)
    before = plan.steps[: plan.steps.index(target_step)]
    for step in reversed(before):
        if resources.intersection(step.writes):
            needed.add(id(step))
            resources.update(step.reads)
    return needed
