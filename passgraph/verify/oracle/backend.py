"""The reference backend, which also finds for each pass what a conforming backend may write."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import ClassVar

import numpy as np

from passgraph.backends.base import Block
from passgraph.backends.reference import ReferenceBackend
from passgraph.backends.reference.draw_pass import ReferenceDrawPass
from passgraph.backends.reference.pixel_pass import ReferencePixelPass
from passgraph.backends.reference.storage import Storage
from passgraph.graph.geometry import Geometry
from passgraph.plan.data import DrawStep, PixelStep, Step
from passgraph.verify.oracle.allowed import Allowed
from passgraph.verify.oracle.draw import DrawOracle, Ints
from passgraph.verify.oracle.interval import Interval
from passgraph.verify.oracle.pace import Pace
from passgraph.verify.oracle.stage import StageOracle
from passgraph.verify.oracle.storage import stored
from passgraph.verify.oracle.watch import Watch


class OracleBackend(ReferenceBackend):
    """Runs as the reference does; ``found`` has, by step, what its targets may hold.

    Parameters
    ----------
    snapped
        Whether the backends in question put corners on the grid of docs/rasterisation.md; OpenGL promises none.
    known
        ``found`` of a run that differs in ``snapped`` alone: pixel passes, which rasterise nothing, take theirs
        from it.
    watches
        Take notes of their steps; given any, bounds of other steps are not looked for.
    pace
        How long it may take, and who is told.
    """

    name: ClassVar[str] = "oracle"

    def __init__(
        self,
        snapped: bool = True,
        known: Mapping[int, list[Allowed]] | None = None,
        watches: Sequence[Watch] = (),
        pace: Pace | None = None,
    ) -> None:
        super().__init__()
        self.pace = pace or Pace()
        self.snapped = snapped
        self.watches = {id(watch.step): watch for watch in watches}
        self.known = known or {}
        self.found: dict[int, list[Allowed]] = {}
        #: What pictures with a stencil may hold: they cannot be replaced between passes, so it adds up.
        self.carried: dict[int, Interval] = {}
        self.stencils: dict[int, tuple[Ints, Ints]] = {}

    def wants(self, step: Step) -> bool:
        """Whether bounds of a step are looked for."""
        return not self.watches or id(step) in self.watches

    def copy(self, source: Storage, destination: Storage) -> None:
        super().copy(source, destination)
        if id(source) in self.carried:
            self.carried[id(destination)] = self.carried[id(source)]
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
        super().__call__(outputs, images, block)
        if not self.oracle.wants(self.step):
            return
        # A picture with a stencil is the run's own, all others are the reference's.
        own = any(id(image) in self.oracle.carried for image in images)
        if id(self.step) in self.oracle.known and not own and not self.oracle.watches:
            self.oracle.found[id(self.step)] = self.oracle.known[id(self.step)]
        else:
            self.oracle.found[id(self.step)] = self._allowed(outputs, images, block)

    def _allowed(self, outputs: Sequence[Storage], images: Sequence[Storage], block: Block) -> list[Allowed]:
        width, height = self.step.size
        names, watch = [name for name, _ in self.step.images], self.oracle.watches.get(id(self.step))
        stage = StageOracle(self.stage, block, names, images, self.oracle.carried, watch, self.oracle.pace)
        self.oracle.pace.begin(self.step.name)
        y, x = np.divmod(np.arange(width * height), width)
        bounds = stage.bounds(
            width * height,
            {"pixel": lambda: np.stack([x, y], axis=1), "output_size": lambda: np.array([[width, height]], np.int64)},
            first_only=watch is not None,
        )
        untried = self.oracle.pace.end()
        return [
            Allowed(
                stored(output.format, values).map(lambda v: v.reshape(height, width, -1)),
                bounds.ambiguous.reshape(height, width),
                bounds.unpromised.reshape(height, width),
                bounds.names,
                untried,
            )
            for output, values in zip(outputs, bounds.outputs, strict=True)
        ]


class _DrawPass(ReferenceDrawPass):
    def __init__(self, step: DrawStep, oracle: OracleBackend) -> None:
        super().__init__(step)
        self.oracle = oracle

    def __call__(
        self, outputs: Sequence[Storage], depth: Storage | None, images: Sequence[Storage], geometry: Geometry,
        vertex: Block, fragment: Block,
    ) -> None:  # fmt: skip
        if self.oracle.wants(self.step):
            self._find(outputs, depth, images, geometry, vertex, fragment)
        super().__call__(outputs, depth, images, geometry, vertex, fragment)

    def _find(
        self, outputs: Sequence[Storage], depth: Storage | None, images: Sequence[Storage], geometry: Geometry,
        vertex: Block, fragment: Block,
    ) -> None:  # fmt: skip
        """What the draw may leave, from what its targets hold before it."""
        draw = DrawOracle(
            self, outputs, depth, images, geometry, vertex, fragment, self.oracle.snapped, self.oracle.carried,
            self.oracle.watches.get(id(self.step)), self.oracle.pace,
        )  # fmt: skip
        if depth is not None and self.step.depth_clear is None and id(depth) in self.oracle.carried:
            draw.state.depth = self.oracle.carried[id(depth)].map(np.copy)
            draw.state.stencil = self.oracle.stencils[id(depth)]
        self.oracle.found[id(self.step)] = draw.run()
        state = draw.state
        if depth is not None and state.depth is not None and state.stencil is not None:
            self.oracle.carried[id(depth)] = state.depth.map(np.copy)
            self.oracle.stencils[id(depth)] = state.stencil
