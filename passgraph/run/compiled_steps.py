"""Steps of a plan as a backend compiled them: functions of one run's values."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeAlias, cast

import numpy as np

from passgraph.backends.base import Block
from passgraph.plan.chains import Chains
from passgraph.plan.data import CopyStep, CountStep, DrawStep, PixelStep, Plan, Step
from passgraph.run.parameters import Parameters
from passgraph.run.storages import Storages

if TYPE_CHECKING:
    from passgraph.backends.base import Backend

#: Runs steps with the values of a run.
Execute: TypeAlias = Callable[[dict[Any, object]], None]
_EMPTY = Block(np.zeros(1, np.float32), np.zeros(1, np.int32))


@dataclass(frozen=True)
class RunUnit:
    """Steps that run as one."""

    steps: tuple[Step, ...]
    execute: Execute


class StepCompiler:
    """Compiles the steps of a plan.  What it returns does not refer to it, unless it still has to be compiled."""

    def __init__(self, backend: Backend, storages: Storages, parameters: Parameters) -> None:
        self.backend, self.storages, self.parameters = backend, storages, parameters
        self._geometries: dict[int, Any] = {}

    def compile(self, plan: Plan) -> tuple[tuple[RunUnit, ...], tuple[RunUnit, ...]]:
        """Return the units of a plan, and each step singly, for runs under observation."""
        chains, units, singly = Chains(plan), list[RunUnit](), list[RunUnit]()
        while len(singly) < len(plan.steps):
            unit = self._next_unit(plan, chains, len(singly))
            units.append(unit)
            is_chain = len(unit.steps) > 1
            singly += [RunUnit((step,), self._when_run(step)) for step in unit.steps] if is_chain else [unit]
        return tuple(units), tuple(singly)

    def release(self) -> None:
        """Release the meshes."""
        for geometry in self._geometries.values():
            self.backend.release_geometry(geometry)
        self._geometries.clear()

    def _next_unit(self, plan: Plan, chains: Chains, start: int) -> RunUnit:
        """Compile the next chain that the backend runs as one, or else the next single step."""
        for end in chains.ends(start):
            steps = plan.steps[start:end]
            execute = self._chain(cast("tuple[PixelStep, ...]", steps))
            if execute is not None:
                return RunUnit(steps, execute)
        return RunUnit((plan.steps[start],), self._step(plan.steps[start]))

    def _when_run(self, step: Step) -> Execute:
        """Return a function that compiles a chain's step when first called: single steps run only under observation."""
        compiled: list[Execute] = []

        def execute(values: dict[Any, object]) -> None:
            if not compiled:
                compiled.append(self._step(step))
            compiled[0](values)

        return execute

    def _chain(self, steps: tuple[PixelStep, ...]) -> Execute | None:
        run, storages = self.backend.pixel_chain(steps), self.storages
        if run is None:
            return None
        blocks = [self.parameters.of(step.program, step) for step in steps]
        outputs, reads = steps[-1].outputs, [step.reads for step in steps]
        inner = {resource for step in steps[:-1] for resource in step.outputs}
        storages.keep_apart(outputs, {resource for read in reads for resource in read} - inner)
        return lambda values: run(
            [storages.of(r) for r in outputs],
            [[storages.of(r) for r in read] for read in reads],
            [block.pack(values) for block in blocks],
        )

    def _step(self, step: Step) -> Execute:
        backend, storages = self.backend, self.storages
        if isinstance(step, CopyStep):
            return lambda _: backend.copy(storages.of(step.source_resource), storages.of(step.outputs[0]))
        if isinstance(step, DrawStep):
            return self._draw(step)
        run = backend.count_pass(step) if isinstance(step, CountStep) else backend.pixel_pass(step)
        block, reads = self.parameters.of(step.program, step), step.reads
        return lambda values: run(
            [storages.of(r) for r in step.outputs], [storages.of(r) for r in reads], block.pack(values)
        )

    def _draw(self, step: DrawStep) -> Execute:
        run, storages, mesh = self.backend.draw_pass(step), self.storages, step.source.geometry
        if id(mesh) not in self._geometries:
            self._geometries[id(mesh)] = self.backend.geometry(mesh)
        geometry = self._geometries[id(mesh)]
        vertex = self.parameters.of(step.vertex, step)
        fragment = None if step.fragment is None else self.parameters.of(step.fragment, step)
        images = [resource for _, resource in step.images]

        def draw(values: dict[Any, object]) -> None:
            run(
                [storages.of(r) for r in step.outputs],
                None if step.depth is None else storages.of(step.depth),
                [storages.of(r) for r in images],
                geometry,
                vertex.pack(values),
                _EMPTY if fragment is None else fragment.pack(values),
            )

        return draw
