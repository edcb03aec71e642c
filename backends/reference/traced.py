"""Trace one lane of a kernel line by line: values of variables, branches taken, iterations of loops."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from passgraph.backends.reference.draw_pass import Covered, ReferenceDrawPass, allows
from passgraph.backends.reference.interpreter import Interpreter, Lanes, NumberDomain, Numbers, Surroundings
from passgraph.backends.reference.rasterizer import Fragments, ScreenTriangles
from passgraph.backends.reference.stage import BoundStage, Builtins, Storage
from passgraph.graph.draw_state import DrawState
from passgraph.language import ir
from passgraph.language.builtin_name import BuiltinName
from passgraph.language.library import LIBRARY
from passgraph.language.source import Span
from passgraph.language.types import IVEC2
from passgraph.plan.data import DrawStep

#: Iterations of a loop recorded at its beginning, and as many at its end.
KEPT_TRIPS = 2


@dataclass(frozen=True)
class Taken:
    """A variable is assigned, or a function returns a value (``name`` is then empty, or the field of a result)."""

    span: Span
    name: str
    value: Any
    returns: bool = False


@dataclass(frozen=True)
class Branch:
    """An ``if`` and the value of its condition."""

    span: Span
    holds: bool


@dataclass
class Loop:
    """A ``for``: its number of iterations; the first and the last :data:`KEPT_TRIPS` of them with their indices."""

    span: Span
    name: str
    count: int = 0
    trips: list[tuple[int, list[Event]]] = field(default_factory=list)


Event: TypeAlias = Taken | Branch | Loop

_VARIABLE = re.compile(r"(\w+)\.\d+((?:\.\w+)*)")
_RESULT = re.compile(r"\w+\.result\.\d+((?:\.\w+)*)")


def is_of_source(span: Span) -> bool:
    """Return True for a line of the user's source, False for the language's own library."""
    return span.line > 0 and span.file != LIBRARY


def variable_of(local: str) -> tuple[str, bool] | None:
    """Return a local's name in the source, and True for a function's result; None for the parser's own locals.

    >>> variable_of("a.3.xy"), variable_of("f.result.1"), variable_of("f.returned.2")
    (('a.xy', False), ('', True), None)
    """
    if match := _VARIABLE.fullmatch(local):
        return match[1] + match[2], False
    if match := _RESULT.fullmatch(local):
        return match[1][1:], True
    return None


class Traced(Interpreter[Numbers, Lanes]):
    """The interpreter on one lane, which records events in terms of the source."""

    def __init__(self, program: ir.TypedKernel, domain: NumberDomain, around: Surroundings[Numbers]) -> None:
        super().__init__(program, domain, around)
        self.events: list[Event] = []
        #: Positions that were read, by image: keys of a dict, each once and in order.
        self.texels: dict[str, dict[tuple[int, int], None]] = {}
        self._open = [self.events]
        self._loops: list[Loop] = []

    def _note(self, event: Event) -> None:
        if is_of_source(event.span):
            self._open[-1].append(event)

    def _assign(self, statement: ir.Assign, active: Lanes) -> None:
        super()._assign(statement, active)
        if (variable := variable_of(statement.name)) is not None:
            name, returns = variable
            self._note(Taken(statement.span, name, plain(self.locals[statement.name]), returns))

    def value(self, expression: ir.Expr) -> Numbers:
        if isinstance(expression, ir.Texel):
            x, y = (int(self.value(position)[0]) for position in (expression.x, expression.y))
            if expression.relative:
                right, down = self.surroundings.builtin(ir.Builtin(IVEC2, "pixel"))[0].tolist()
                x, y = x + right, y + down
            self.texels.setdefault(expression.image, {})[x, y] = None
        return super().value(expression)

    def _if(self, statement: ir.If, active: Lanes) -> Lanes:
        if not is_about_returns(statement.condition):
            self._note(Branch(statement.span, bool(self.value(statement.condition)[0])))
        return super()._if(statement, active)

    def _for(self, statement: ir.For, active: Lanes) -> None:
        variable = variable_of(statement.name)
        loop = Loop(statement.span, variable[0] if variable else statement.name)
        self._note(loop)
        self._loops.append(loop)
        depth = len(self._open)
        super()._for(statement, active)
        del self._open[depth:]
        self._loops.pop()

    def _trip(self, statement: ir.For, index: Numbers) -> None:
        super()._trip(statement, index)
        loop, events = self._loops[-1], list[Event]()
        if loop.count:
            self._open.pop()
        loop.count += 1
        loop.trips.append((int(index[0]), events))
        if len(loop.trips) > 2 * KEPT_TRIPS:
            del loop.trips[KEPT_TRIPS]
        self._open.append(events)


def traced(bound: BoundStage, builtins: Builtins) -> tuple[Traced, list[Numbers]]:
    """Trace one lane of a stage: return its events and results."""
    runs: list[Traced] = []

    def make(*parts: Any) -> Traced:
        runs.append(Traced(*parts))
        return runs[0]

    results, _ = bound.run(1, builtins, make)
    return runs[0], results


def is_about_returns(condition: ir.Expr) -> bool:
    """Return True if a condition tests for an early return, which is no line of the source."""
    if isinstance(condition, ir.Apply) and condition.operation == "logical_not":
        condition = condition.arguments[0]
    return isinstance(condition, ir.Local) and ".returned." in condition.name


def plain(value: Numbers) -> Any:
    """Return the value of the only lane: a number, or nested tuples (a matrix by columns)."""

    def tuples(part: Any) -> Any:
        return tuple(map(tuples, part)) if isinstance(part, list) else part

    return tuples(np.asarray(value[0]).tolist())


#: Triangles recorded of the first that cover the pixel, and as many of the last.
KEPT_ENDS = 8
#: Most fragments with recorded lines.
KEPT_RUNS = 4


@dataclass(frozen=True)
class Corner:
    """Result of the vertex kernel for one vertex: ``position`` in clip space, and each varying, by name."""

    vertex: int
    values: Mapping[str, Any]


@dataclass(frozen=True)
class Lines:
    """A run of the fragment kernel.

    ``inputs`` are the stage values that it read: ``varying.uv``, ``varying@x.uv`` of the neighbor in its quad,
    ``pixel``.  ``results`` are its return values, in order; a discarded fragment's are not stored.
    """

    inputs: Mapping[str, Any]
    events: Sequence[Event]
    results: Sequence[Any]


@dataclass(frozen=True)
class Fragment:
    """A triangle at the pixel.

    Attributes
    ----------
    order : number of earlier triangles of the draw that cover the pixel
    triangle : its index in the mesh, from 0
    front : True if it is front-facing
    depth : 0 (near) to 1 (far), float32, with polygon offset
    fate : "discarded", "stencil" or "depth" (the test that it fails), or "passed"
    tested_against : the depth it was tested against; None without a depth target, or if it was discarded
    corners : corners of the triangle in the mesh; empty if not recorded
    lines : trace of the fragment kernel; None if not recorded, or without a fragment kernel
    """

    order: int
    triangle: int
    front: bool
    depth: float
    fate: str
    tested_against: float | None
    corners: tuple[Corner, ...] = ()
    lines: Lines | None = None


@dataclass(frozen=True)
class Drawn:
    """The trace of a draw at one pixel.

    Attributes
    ----------
    triangles : number of triangles in the mesh
    covering : number of those that cover the pixel
    fragments : covering triangles in draw order: the first and the last `KEPT_ENDS`, and those in ``detailed``
    detailed : fragments with corners and lines, at most `KEPT_RUNS`: the last that passes, those before it, backwards,
        then discarded ones
    state : tests and blending of the draw
    """

    triangles: int
    covering: int
    fragments: tuple[Fragment, ...]
    detailed: tuple[Fragment, ...]
    state: DrawState

    @property
    def visible(self) -> Fragment | None:
        """Return the last fragment that passes its tests."""
        return self.detailed[0] if self.detailed and self.detailed[0].fate == "passed" else None


@dataclass(frozen=True)
class _Batch:
    """Fragments at the pixel, their fates, and the depths they were tested against."""

    covered: Covered
    fates: list[str]
    tested_against: list[float | None]

    def __len__(self) -> int:
        return len(self.fates)


class TracedDraw(ReferenceDrawPass):
    """A draw restricted to one pixel (x, y), which it traces."""

    def __init__(self, step: DrawStep, pixel: tuple[int, int]) -> None:
        super().__init__(step)
        self.pixel = pixel
        self.bound: BoundStage | None = None
        self._batches: list[_Batch] = []

    def _fragments(self, screen: ScreenTriangles) -> Iterator[Fragments]:
        x, y = self.pixel
        for fragments in super()._fragments(screen):
            here = np.flatnonzero((fragments.x == x) & (fragments.y == y))
            if len(here):
                yield fragments[here]

    def _merge(
        self, covered: Covered, bound: BoundStage | None, outputs: Sequence[Storage], depth: Storage | None
    ) -> None:
        self.bound = bound
        count = len(covered.fragments)
        self._batches.append(_Batch(covered, ["discarded"] * count, [None] * count))
        super()._merge(covered, bound, outputs, depth)

    def _tested(self, covered: Covered, depth: Storage | None) -> NDArray[np.bool_]:
        """Test fragments one by one; those that never arrive here were discarded."""
        batch = self._batches[-1]
        places = np.searchsorted(batch.covered.fragments.triangle, covered.fragments.triangle)
        passed = np.ones(len(places), np.bool_)
        for at, place in enumerate(places.tolist()):
            allowed = True
            if depth is not None:
                batch.tested_against[place] = float(depth.flat[covered.pixel[at], 0])
                allowed = self._allowed(depth, covered.pixel[at : at + 1])
                passed[at] = super()._tested(covered.take(slice(at, at + 1)), depth)[0]
            batch.fates[place] = "passed" if passed[at] else "depth" if allowed else "stencil"
        return passed

    def _allowed(self, depth: Storage, pixel: NDArray[np.int64]) -> bool:
        stencil = self.step.state.stencil
        if stencil is None or depth.stencil is None:
            return True
        return bool(allows(stencil, depth.stencil.reshape(-1)[pixel].astype(np.int64))[0])

    # Results of the trace

    def drawn(self) -> Drawn:
        """Return the trace after the draw has run."""
        fates = [fate for batch in self._batches for fate in batch.fates]
        passed = [order for order, fate in enumerate(fates) if fate == "passed"]
        discarded = [order for order, fate in enumerate(fates) if fate == "discarded"]
        shown = (passed[::-1] + discarded)[:KEPT_RUNS]
        kept_orders = {*range(len(fates))[:KEPT_ENDS], *range(len(fates))[-KEPT_ENDS:], *shown}
        fragments = {order: self._fragment(order, order in shown) for order in sorted(kept_orders)}
        mesh = self.step.source.geometry
        told_of = tuple(fragments[order] for order in shown)
        return Drawn(len(mesh.triangles), len(fates), tuple(fragments.values()), told_of, self.step.state)

    def _fragment(self, order: int, with_lines: bool) -> Fragment:
        at, batches = order, iter(self._batches)
        while at >= len(batch := next(batches)):
            at -= len(batch)
        covered = batch.covered.take(slice(at, at + 1))
        piece = int(covered.fragments.triangle[0])
        triangle, front = int(covered.screen.source[piece]), bool(covered.screen.front[piece])
        corners = self._corners(covered, triangle) if with_lines else ()
        lines = self._lines(covered, self.bound) if with_lines and self.bound is not None else None
        return Fragment(
            order, triangle, front, float(covered.depth[0]), batch.fates[at], batch.tested_against[at], corners, lines
        )

    def _corners(self, covered: Covered, triangle: int) -> tuple[Corner, ...]:
        # Clipping appends corners after the vertices of the mesh, which keep their index.
        vertices = np.asarray(self.step.source.geometry.triangles).reshape(-1, 3)[triangle].tolist()
        return tuple(
            Corner(
                vertex,
                {
                    name.of: plain(covered.vertices.rows[[vertex], columns].reshape(1, *shape))
                    for name, (columns, shape) in self.varyings.items()
                },
            )
            for vertex in vertices
        )

    def _lines(self, covered: Covered, bound: BoundStage) -> Lines:
        inputs: dict[str, Any] = {}

        def read(name: BuiltinName, make: Callable[[], Numbers]) -> Numbers:
            value = make()
            inputs[str(name)] = plain(value)
            return value

        builtins = {name: partial(read, name, make) for name, make in covered.builtins().items()}
        lane, results = traced(bound, builtins)
        return Lines(inputs, lane.events, tuple(map(plain, results)))
