"""The reference backend, extended to compute the bounds of each pass.

A full-screen pass runs its kernel over intervals; a draw runs its fragments in submission order, each certainly or
possibly present.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from functools import partial
from typing import ClassVar

import numpy as np

from passgraph.backends.base import SNAPPED, Block, Promises, vertex_builtins
from passgraph.backends.reference import ReferenceBackend
from passgraph.backends.reference.draw_pass import ReferenceDrawPass, layers
from passgraph.backends.reference.stage import ReferencePixelPass, Storage, on_quads
from passgraph.graph.draw_state import Geometry
from passgraph.language.builtin_name import WHOLE_PIXEL, WHOLE_SIZE, BuiltinName
from passgraph.plan.data import DrawStep, PixelStep, Step
from passgraph.plan.limits import Limits
from passgraph.verify.oracle.allowed import Allowed
from passgraph.verify.oracle.covered import Corners, Fragments, Triangles, cover, depth_of, triangles, varying_of
from passgraph.verify.oracle.decisions import Bounds, Ints
from passgraph.verify.oracle.interval import Bounded, Interval
from passgraph.verify.oracle.interval_stage import StageOracle
from passgraph.verify.oracle.kept import Found, Kept, decides_draw, decides_pixels
from passgraph.verify.oracle.merge import DrawCall, State
from passgraph.verify.oracle.stored_bounds import stored
from passgraph.verify.oracle.time_limit import TimeLimit
from passgraph.verify.oracle.watch import Watch


class OracleBackend(ReferenceBackend):
    """Runs like the reference; ``found`` has the bounds of each step's targets.

    Parameters
    ----------
    promises
        What the tested backends promise: if they snap corners (OpenGL does not), and their own functions.
    kept
        Cache of bounds, read and written.
    watches
        Watches of steps; if there are any, bounds of other steps are not computed.
    limit
        Time limit and progress callback.
    accumulates
        True: passes read the bounds of what earlier passes wrote, so that bounds hold for the graph from its inputs on;
        False: they read the reference's results, so that bounds hold for each pass alone.
    """

    name: ClassVar[str] = "oracle"

    def __init__(
        self,
        promises: Promises = SNAPPED,
        kept: Kept | None = None,
        watches: Sequence[Watch] = (),
        limit: TimeLimit | None = None,
        *,
        accumulates: bool = False,
    ) -> None:
        super().__init__()
        self.limit = limit or TimeLimit()
        self.corner_px = promises.corner_px
        self.limits = Limits(native=dict(promises.native))
        self.watches = {id(watch.step): watch for watch in watches}
        self.kept = kept or Kept()
        self.found: dict[int, list[Allowed]] = {}
        self.accumulates = accumulates
        #: Bounds of pictures whose errors accumulate: those with a stencil, which cannot be replaced between passes.
        self.carried: dict[int, Interval] = {}
        self.stencils: dict[int, tuple[Ints, Ints]] = {}

    def wants(self, step: Step) -> bool:
        """Return True if the bounds of a step are to be computed."""
        return not self.watches or id(step) in self.watches

    def bounds(self, deciding: Iterable[object], find: Callable[[], Found]) -> Found:
        """Return the bounds of a step, cached if possible; watched steps are always computed."""
        return find() if self.watches else self.kept.found(deciding, find)

    def copy(self, source: Storage, destination: Storage) -> None:
        super().copy(source, destination)
        if id(source) in self.carried:
            self.carried[id(destination)] = self.carried[id(source)]
            if id(source) in self.stencils:
                self.stencils[id(destination)] = self.stencils[id(source)]

    def pixel_pass(self, step: PixelStep) -> ReferencePixelPass:
        return _PixelPass(step, self)

    def draw_pass(self, step: DrawStep) -> ReferenceDrawPass:
        return _DrawPass(step, self)


class _PixelPass(ReferencePixelPass):
    def __init__(self, step: PixelStep, oracle: OracleBackend) -> None:
        super().__init__(step)
        self.oracle = oracle

    def __call__(self, outputs: Sequence[Storage], images: Sequence[Storage], block: Block) -> None:
        with self.oracle.limit.spent():
            super().__call__(outputs, images, block)
        if not self.oracle.wants(self.step):
            return
        deciding = decides_pixels(self.step, self.stage, outputs, images, block, self.oracle.carried)
        found = self.oracle.bounds(deciding, partial(self._find, outputs, images, block))
        self.oracle.found[id(self.step)] = found.allowed
        if self.oracle.accumulates:
            self.oracle.carried |= {id(output): one.values for output, one in zip(outputs, found.allowed, strict=True)}

    def _find(self, outputs: Sequence[Storage], images: Sequence[Storage], block: Block) -> Found:
        width, height = self.step.size
        names, watch = [name for name, _ in self.step.images], self.oracle.watches.get(id(self.step))
        stage = StageOracle(self.stage, block, names, images, self.oracle.carried, watch, self.oracle.limit)
        self.oracle.limit.begin(self.step.name)
        y, x = np.divmod(np.arange(width * height), width)
        bounds = stage.bounds(
            width * height,
            {WHOLE_PIXEL: lambda: np.stack([x, y], axis=1), WHOLE_SIZE: lambda: np.array([[width, height]], np.int64)},
            first_only=watch is not None,
        )
        untried = self.oracle.limit.end()
        return Found(
            [
                Allowed(
                    stored(output.format, values).map(lambda v: v.reshape(height, width, -1)),
                    bounds.ambiguous.reshape(height, width),
                    bounds.unpromised.reshape(height, width),
                    bounds.names,
                    untried,
                )
                for output, values in zip(outputs, bounds.outputs, strict=True)
            ]
        )


class _DrawPass(ReferenceDrawPass):
    def __init__(self, step: DrawStep, oracle: OracleBackend) -> None:
        super().__init__(step)
        self.oracle = oracle

    def __call__(
        self, outputs: Sequence[Storage], depth: Storage | None, images: Sequence[Storage], geometry: Geometry,
        vertex: Block, fragment: Block,
    ) -> None:  # fmt: skip
        oracle = self.oracle
        if oracle.wants(self.step):
            call = DrawCall(outputs, depth, images, geometry, vertex, fragment)
            deciding = decides_draw(self, call, oracle.corner_px, oracle.carried, oracle.stencils)
            found = oracle.bounds(deciding, partial(self._find, call))
            oracle.found[id(self.step)] = found.allowed
            if depth is not None and found.stencil is not None:
                oracle.carried[id(depth)] = found.allowed[-1].values.map(np.ravel)
                oracle.stencils[id(depth)] = found.stencil
        with oracle.limit.spent():
            super().__call__(outputs, depth, images, geometry, vertex, fragment)

    def _find(self, call: DrawCall) -> Found:
        """Return the bounds of a draw, given the content of its targets before it."""
        draw, depth = DrawOracle(self, call, self.oracle), call.depth
        if depth is not None and self.step.depth_clear is None and id(depth) in self.oracle.carried:
            draw.state.depth = self.oracle.carried[id(depth)].map(np.copy)
            lowest, highest = self.oracle.stencils[id(depth)]
            draw.state.stencil = lowest.copy(), highest.copy()
        return Found(draw.run(), draw.state.stencil)


class DrawOracle:
    """Bounds of one draw of one run: ``state`` has the bounds of its targets, ``untried`` the number of fragments
    without bounds because of the time limit."""

    def __init__(self, draw_pass: ReferenceDrawPass, call: DrawCall, oracle: OracleBackend) -> None:
        self.pass_, self.step = draw_pass, draw_pass.step
        self.geometry, self.corner_px = call.geometry, oracle.corner_px
        self.limit, self.untried = oracle.limit, 0
        pictures = [name for name, _ in draw_pass.step.images], call.images, oracle.carried
        self.vertex = StageOracle(draw_pass.vertex, call.vertex, *pictures, limit=self.limit)
        self.fragment: StageOracle | None = None
        if draw_pass.fragment is not None:
            watch = oracle.watches.get(id(draw_pass.step))
            self.fragment = StageOracle(draw_pass.fragment, call.fragment, *pictures, watch, self.limit)
        self.state = State.before(draw_pass.step, call.outputs, call.depth)
        self.names: Counter[str] = Counter()

    def run(self) -> list[Allowed]:
        """Return the allowed results of each target, colors first."""
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
        self.limit.begin(f"{step.name}, vertices")
        with np.errstate(all="ignore"):
            vertices = self._vertices()
        if self.limit.end():
            # If a corner may be anywhere, any pixel may be covered.
            self.state.forget()
            self.untried = step.size[0] * step.size[1]
            return
        self.limit.begin(step.name)
        with np.errstate(all="ignore"):
            indices = np.asarray(self.geometry.triangles, np.int64).reshape(-1, 3)
            found = triangles(vertices, indices, step.size, step.state, self.corner_px)
            for fragments in cover(found, step.size):
                self._merge(found, fragments)
        self.untried = self.limit.end()

    def _vertices(self) -> Corners:
        """Return middle and half width of every column; rows as in the reference: position, then all results."""
        count = len(self.geometry.positions)
        builtins: dict[BuiltinName, Callable[[], Bounded]] = {
            name: partial(Interval.as_read, values.astype(np.float64))
            for name, values in vertex_builtins(self.geometry).items()
        }
        builtins[WHOLE_SIZE] = lambda: np.array([self.step.size], np.int64)
        bounds = self.vertex.bounds(count, builtins)
        self.names.update(bounds.names)
        names = [result.name for result in self.vertex.bound.program.results]
        ordered = [bounds.outputs[names.index("position")], *bounds.outputs]
        lo, hi = (np.concatenate([getattr(o, n) for o in ordered], axis=1) for n in ("lo", "hi"))
        nan = np.concatenate([o.nan for o in ordered], axis=1)
        middle = np.where(lo == hi, lo, 0.5 * (lo + hi))
        return Corners(middle, np.where(nan, np.inf, np.where(lo == hi, 0.0, 0.5 * (hi - lo))))

    def _merge(self, mesh: Triangles, fragments: Fragments) -> None:
        width, _ = self.step.size
        pixel = fragments.y * width + fragments.x
        depth = depth_of(mesh, fragments)
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
                shaded = self._shade(mesh, there, here)
                surely, perhaps, colours = there.surely & shaded.surely, shaded.perhaps, shaded.outputs
                turned, unpromised = shaded.ambiguous & ~shaded.unpromised, shaded.unpromised
                self.names.update(shaded.names)
            self.state.add(at, here, surely, perhaps, colours, turned, unpromised)

    def _shade(self, mesh: Triangles, fragments: Fragments, depth: Interval) -> Bounds:
        """Return the fragment kernel's results; those of a sliver are unbounded."""
        assert self.fragment is not None
        width, height = self.step.size
        builtins: dict[BuiltinName, Callable[[], Bounded]] = {
            WHOLE_PIXEL: lambda: np.stack([fragments.x, fragments.y], axis=1),
            WHOLE_SIZE: lambda: np.array([[width, height]], np.int64),
            BuiltinName("front_facing"): lambda: mesh.area[fragments.triangle] < 0,
        }

        def of_triangle(axes: str) -> dict[BuiltinName, Callable[[], Bounded]]:
            there = fragments.beside(axes, mesh) if axes else fragments
            varyings: dict[BuiltinName, Callable[[], Bounded]] = {
                name: partial(_varying, mesh, there, columns, shape)
                for name, (columns, shape) in self.pass_.varyings.items()
            }
            return {BuiltinName("fragment_depth"): lambda: depth_of(mesh, there) if axes else depth, **varyings}

        builtins |= on_quads(of_triangle)
        bounds = self.fragment.bounds(len(fragments), builtins, fragments.y * width + fragments.x)
        sliver = mesh.sliver[fragments.triangle]
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


def _varying(mesh: Triangles, fragments: Fragments, columns: slice, shape: tuple[int, ...]) -> Interval:
    return varying_of(mesh, fragments, columns).map(lambda x: x.reshape(len(x), *shape))
