"""A draw over intervals: fragments in the order of submission, each surely or perhaps there."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from functools import partial

import numpy as np
from numpy.typing import NDArray

from passgraph.backends.base import Block, vertex_builtins
from passgraph.backends.reference.draw_pass import ReferenceDrawPass
from passgraph.backends.reference.output_tests import layers
from passgraph.backends.reference.stage import on_quads
from passgraph.backends.reference.storage import Storage
from passgraph.graph.geometry import Geometry
from passgraph.plan.data import DrawStep
from passgraph.verify.oracle.allowed import Allowed
from passgraph.verify.oracle.coverage import Corners, Fragments, Triangles, cover, depth_of, triangles, varying_of
from passgraph.verify.oracle.decisions import Bounds
from passgraph.verify.oracle.interval import Bounded, Interval
from passgraph.verify.oracle.merge import State
from passgraph.verify.oracle.pace import Pace
from passgraph.verify.oracle.stage import StageOracle
from passgraph.verify.oracle.watch import Watch

Ints = NDArray[np.int64]


class DrawOracle:
    """One draw of one run: ``state`` ends up with what its targets may hold, ``untried`` with the number of fragments
    of which time left nothing to say."""

    def __init__(
        self, made: ReferenceDrawPass, outputs: Sequence[Storage], depth: Storage | None, images: Sequence[Storage],
        geometry: Geometry, vertex: Block, fragment: Block, snapped: bool, carried: Mapping[int, Interval],
        watch: Watch | None = None, pace: Pace | None = None,
    ) -> None:  # fmt: skip
        self.pass_, self.step = made, made.step
        self.geometry, self.snapped = geometry, snapped
        names = [name for name, _ in made.step.images]
        self.pace, self.untried = pace or Pace(), 0
        self.vertex = StageOracle(made.vertex, vertex, names, images, carried, pace=self.pace)
        self.fragment: StageOracle | None = None
        if made.fragment is not None:
            self.fragment = StageOracle(made.fragment, fragment, names, images, carried, watch, self.pace)
        self.state = State.before(made.step, outputs, depth)
        self.names: Counter[str] = Counter()

    def run(self) -> list[Allowed]:
        """What each of its targets may hold, colours first."""
        self._draw()
        state, (width, height) = self.state, self.step.size
        values = [layer.values for layer in state.colours]
        if state.depth is not None:
            values.append(state.depth.map(lambda x: x[:, None]))
        ambiguous = state.ambiguous.reshape(height, width)
        unpromised = ambiguous & ~state.turned.reshape(height, width)
        return [
            Allowed(v.map(lambda x: x.reshape(height, width, -1)), ambiguous, unpromised, self.names, self.untried)
            for v in values
        ]

    def _draw(self) -> None:
        step: DrawStep = self.step
        self.pace.begin(f"{step.name}, vertices")
        with np.errstate(all="ignore"):
            vertices = self._vertices()
        if self.pace.end():
            # Any pixel may be covered where corners may be anywhere.
            self.state.forget()
            self.untried = step.size[0] * step.size[1]
            return
        self.pace.begin(step.name)
        with np.errstate(all="ignore"):
            indices = np.asarray(self.geometry.triangles, np.int64).reshape(-1, 3)
            found = triangles(vertices, indices, step.size, step.state, self.snapped)
            for fragments in cover(found, step.size):
                self._merge(found, fragments)
        self.untried = self.pace.end()

    def _vertices(self) -> Corners:
        """Middle and half width of every column; rows as the reference has them: position, then all results."""
        count = len(self.geometry.positions)
        builtins: dict[str, Callable[[], Bounded]] = {
            name: partial(Interval.of, values.astype(np.float64))
            for name, values in vertex_builtins(self.geometry).items()
        }
        builtins["output_size"] = lambda: np.array([self.step.size], np.int64)
        bounds = self.vertex.bounds(count, builtins)
        self.names.update(bounds.names)
        names = [result.name for result in self.vertex.bound.program.results]
        ordered = [bounds.outputs[names.index("position")], *bounds.outputs]
        lo, hi = (np.concatenate([getattr(o, n) for o in ordered], axis=1) for n in ("lo", "hi"))
        nan = np.concatenate([o.nan for o in ordered], axis=1)
        middle = np.where(lo == hi, lo, 0.5 * (lo + hi))
        return Corners(middle, np.where(nan, np.inf, np.where(lo == hi, 0.0, 0.5 * (hi - lo))))

    def _merge(self, found: Triangles, fragments: Fragments) -> None:
        width, _ = self.step.size
        pixel = fragments.y * width + fragments.x
        depth = depth_of(found, fragments)
        for layer in layers(pixel):
            there, at, here = fragments.take(layer), pixel[layer], depth.take(layer)
            surely, perhaps = there.surely, np.ones(len(layer), np.bool_)
            colours: list[Interval] = []
            turned = unpromised = np.zeros(len(layer), np.bool_)
            if self.fragment is not None:
                possible = self.state.may_pass(at, here)
                if not len(possible):
                    continue
                there, at, here = there.take(possible), at[possible], here.take(possible)
                shaded = self._shade(found, there, here)
                surely, perhaps, colours = there.surely & shaded.surely, shaded.perhaps, shaded.outputs
                turned, unpromised = shaded.ambiguous & ~shaded.unpromised, shaded.unpromised
                self.names.update(shaded.names)
            self.state.add(at, here, surely, perhaps, colours, turned, unpromised)

    def _shade(self, found: Triangles, fragments: Fragments, depth: Interval) -> Bounds:
        """The fragment kernel's results; nothing is known of what a sliver shows."""
        assert self.fragment is not None
        width, height = self.step.size
        builtins: dict[str, Callable[[], Bounded]] = {
            "pixel": lambda: np.stack([fragments.x, fragments.y], axis=1),
            "output_size": lambda: np.array([[width, height]], np.int64),
            "front_facing": lambda: found.area[fragments.triangle] < 0,
        }

        def of_triangle(axes: str) -> dict[str, Callable[[], Bounded]]:
            there = fragments.beside(axes, found) if axes else fragments
            made: dict[str, Callable[[], Bounded]] = {
                name: partial(_varying, found, there, columns, shape)
                for name, (columns, shape) in self.pass_.varyings.items()
            }
            return {"fragment_depth": lambda: depth_of(found, there) if axes else depth, **made}

        builtins |= on_quads(of_triangle)
        bounds = self.fragment.bounds(len(fragments), builtins, fragments.y * width + fragments.x)
        sliver = found.sliver[fragments.triangle]
        outputs = [
            Interval(
                np.where(sliver[:, None], -np.inf, o.lo),
                np.where(sliver[:, None], np.inf, o.hi),
                o.nan | sliver[:, None],
            )
            for o in bounds.outputs
        ]
        return Bounds(
            outputs, bounds.surely, bounds.perhaps, bounds.ambiguous | sliver, bounds.unpromised & ~sliver, bounds.names
        )


def _varying(found: Triangles, fragments: Fragments, columns: slice, shape: tuple[int, ...]) -> Interval:
    return varying_of(found, fragments, columns).map(lambda x: x.reshape(len(x), *shape))
