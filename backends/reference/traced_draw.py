"""A draw at one pixel: which triangles cover it, what becomes of each, and the fragment kernel line by line."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from passgraph.backends.reference.draw_pass import Covered, ReferenceDrawPass
from passgraph.backends.reference.number_domain import Numbers
from passgraph.backends.reference.output_tests import allows
from passgraph.backends.reference.raster_cover import Fragments
from passgraph.backends.reference.raster_setup import ScreenTriangles
from passgraph.backends.reference.stage import BoundStage
from passgraph.backends.reference.storage import Storage
from passgraph.backends.reference.traced import Event, plain, traced
from passgraph.graph.draw_state import DrawState
from passgraph.plan.data import DrawStep

#: Triangles that are kept of the first that cover the pixel, and as many of the last.
KEPT_ENDS = 8
#: Fragments whose lines are told.
KEPT_RUNS = 4


@dataclass(frozen=True)
class Corner:
    """What the vertex kernel gave for a vertex of the mesh: ``position`` in clip space, and each varying, by name."""

    vertex: int
    values: Mapping[str, Any]


@dataclass(frozen=True)
class Lines:
    """One run of the fragment kernel.

    ``inputs`` are the stage values that it read: ``varying.uv``, ``varying@x.uv`` of the pixel beside it in its
    quad, ``pixel``.  ``results`` are what it returns, in order; where it discards, nobody sees them.
    """

    inputs: Mapping[str, Any]
    events: Sequence[Event]
    results: Sequence[Any]


@dataclass(frozen=True)
class Fragment:
    """A triangle at the pixel.

    Attributes
    ----------
    order : how many triangles of the draw cover the pixel before it
    triangle : its number in the mesh, from 0
    front : whether it shows its front
    depth : 0 (near) to 1 (far), float32, with polygon offset
    fate : "discarded", "stencil" or "depth" (the test that it fails), or "passed"
    held : the depth it was tested against; None where there is no depth target and where it is discarded
    corners : of the triangle in the mesh; empty where the fragment is not told
    lines : what the fragment kernel does; None where that is not told, or the draw has none
    """

    order: int
    triangle: int
    front: bool
    depth: float
    fate: str
    held: float | None
    corners: tuple[Corner, ...] = ()
    lines: Lines | None = None


@dataclass(frozen=True)
class Drawn:
    """What a draw does at one pixel.

    Attributes
    ----------
    triangles : how many the mesh has
    covering : how many of them cover the pixel
    fragments : of these, in the order in which they are drawn, the first and the last `KEPT_ENDS` and those told
    told : fragments with corners and lines, at most `KEPT_RUNS`: the last that passes, those before it, backwards,
        then discarded ones
    state : tests and blending of the draw
    """

    triangles: int
    covering: int
    fragments: tuple[Fragment, ...]
    told: tuple[Fragment, ...]
    state: DrawState

    @property
    def visible(self) -> Fragment | None:
        """The last fragment that passes its tests."""
        return self.told[0] if self.told and self.told[0].fate == "passed" else None


@dataclass(frozen=True)
class _Batch:
    """Fragments at the pixel, what became of each, and the depths they were tested against."""

    covered: Covered
    fates: list[str]
    held: list[float | None]

    def __len__(self) -> int:
        return len(self.fates)


class TracedDraw(ReferenceDrawPass):
    """A draw that touches one pixel (x, y) and remembers how."""

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
        """One after another; fragments that do not come here were discarded."""
        batch = self._batches[-1]
        places = np.searchsorted(batch.covered.fragments.triangle, covered.fragments.triangle)
        passed = np.ones(len(places), np.bool_)
        for at, place in enumerate(places.tolist()):
            allowed = True
            if depth is not None:
                batch.held[place] = float(depth.flat[covered.pixel[at], 0])
                allowed = self._allowed(depth, covered.pixel[at : at + 1])
                passed[at] = super()._tested(covered.take(slice(at, at + 1)), depth)[0]
            batch.fates[place] = "passed" if passed[at] else "depth" if allowed else "stencil"
        return passed

    def _allowed(self, depth: Storage, pixel: NDArray[np.int64]) -> bool:
        stencil = self.step.state.stencil
        if stencil is None or depth.stencil is None:
            return True
        return bool(allows(stencil, depth.stencil.reshape(-1)[pixel].astype(np.int64))[0])

    # What is told of it

    def drawn(self) -> Drawn:
        """What happened, once it has run."""
        fates = [fate for batch in self._batches for fate in batch.fates]
        passed = [order for order, fate in enumerate(fates) if fate == "passed"]
        discarded = [order for order, fate in enumerate(fates) if fate == "discarded"]
        told = (passed[::-1] + discarded)[:KEPT_RUNS]
        kept = {*range(len(fates))[:KEPT_ENDS], *range(len(fates))[-KEPT_ENDS:], *told}
        made = {order: self._fragment(order, order in told) for order in sorted(kept)}
        mesh = self.step.source.geometry
        told_of = tuple(made[order] for order in told)
        return Drawn(len(mesh.triangles), len(fates), tuple(made.values()), told_of, self.step.state)

    def _fragment(self, order: int, told: bool) -> Fragment:
        at, batches = order, iter(self._batches)
        while at >= len(batch := next(batches)):
            at -= len(batch)
        covered = batch.covered.take(slice(at, at + 1))
        piece = int(covered.fragments.triangle[0])
        triangle, front = int(covered.screen.source[piece]), bool(covered.screen.front[piece])
        corners = self._corners(covered, triangle) if told else ()
        lines = self._lines(covered, self.bound) if told and self.bound is not None else None
        return Fragment(
            order, triangle, front, float(covered.depth[0]), batch.fates[at], batch.held[at], corners, lines
        )

    def _corners(self, covered: Covered, triangle: int) -> tuple[Corner, ...]:
        # Clipping adds its corners behind the vertices of the mesh, which stay where they are.
        vertices = np.asarray(self.step.source.geometry.triangles).reshape(-1, 3)[triangle].tolist()
        return tuple(
            Corner(
                vertex,
                {
                    name.removeprefix("varying."): plain(covered.vertices.rows[[vertex], columns].reshape(1, *shape))
                    for name, (columns, shape) in self.varyings.items()
                },
            )
            for vertex in vertices
        )

    def _lines(self, covered: Covered, bound: BoundStage) -> Lines:
        inputs: dict[str, Any] = {}

        def read(name: str, make: Callable[[], Numbers]) -> Numbers:
            value = make()
            inputs[name] = plain(value)
            return value

        builtins = {name: partial(read, name, make) for name, make in covered.builtins().items()}
        events, results = traced(bound, builtins)
        return Lines(inputs, events, tuple(map(plain, results)))
