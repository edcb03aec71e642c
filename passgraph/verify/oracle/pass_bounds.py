"""A graph pass by pass: what each step writes on a backend, and the oracle's bounds."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from passgraph.backends.base import SNAPPED, Backend, Promises
from passgraph.errors import GraphError, InputError
from passgraph.formats import Format
from passgraph.graph.targets import Target
from passgraph.language.native import Accuracy, Math
from passgraph.plan.build import build
from passgraph.plan.data import CopyStep, DrawStep, Options, PixelStep, Plan, Step
from passgraph.plan.dependencies import inputs_behind
from passgraph.plan.limits import Limits, check
from passgraph.run.caller_arrays import admitted_picture, bound_to
from passgraph.run.execution import Execution
from passgraph.verify.oracle.allowed import Allowed
from passgraph.verify.oracle.backend import OracleBackend
from passgraph.verify.oracle.kept import Kept
from passgraph.verify.oracle.time_limit import TimeLimit
from passgraph.verify.oracle.watch import Watch

Picture: TypeAlias = NDArray[np.float32]
#: (frame, step, resource)
Key: TypeAlias = tuple[int, int, int]

#: Plan options: every pass as written, each picture in its own allocation, so that single passes can be compared.
OPTIONS = Options(fuse=False, alias=False, static=False)


class Passes:
    """A graph planned as written, with the pictures and values of each run.

    Parameters
    ----------
    outputs
        Results by name.
    size
        (width, height) of the output, pixels; None if every target declares its size.
    frames
        Inputs and values of each run, by name.
    limit
        Time limit of the reference and its bounds, and the progress callback.
    kept
        Cache of bounds; default: a cache for this graph only.
    math
        As in :class:`passgraph.Options`.

    Raises
    ------
    GraphError, InputError
        As for compiling and running.
    """

    def __init__(
        self,
        outputs: Mapping[str, Target],
        size: tuple[int, int] | None,
        frames: Sequence[Mapping[str, Any]],
        limit: TimeLimit | None = None,
        kept: Kept | None = None,
        math: Math = "exact",
    ) -> None:
        self.limit, self.kept = limit or TimeLimit(), kept or Kept()
        specs = inputs_behind(list(outputs.values()))
        bound: dict[str, tuple[Format, tuple[int, int]]] = {}
        #: For each run, pictures by input and values by name.
        self.frames: list[tuple[dict[str, Picture], dict[str, Any]]] = []
        for frame in frames:
            pictures = {}
            for name, spec in specs.items():
                picture = frame.get(name, spec.default)
                if picture is None:
                    raise InputError(f"input {name!r} is missing; give {name}=picture")
                pictures[name] = admitted_picture(picture, spec)
                bound[name] = bound_to(pictures[name], spec)
            self.frames.append((pictures, {name: value for name, value in frame.items() if name not in specs}))
        self._build = partial(build, outputs, size, bound, replace(OPTIONS, math=math))
        self.plan: Plan = self._build()
        #: Plans for devices that filter under these border rules, call these functions, and contract products.
        self._plans: dict[tuple[tuple[str, ...], tuple[tuple[str, Accuracy], ...], bool], Plan] = {}
        #: Results of :meth:`allowed`.
        self.found: dict[Promises, tuple[dict[Key, Picture], dict[Key, Allowed]]] = {}

    def written(self, backend: Backend, fed: Mapping[Key, Picture] | None = None) -> Iterator[dict[Key, Picture]]:
        """Yield the results of every step of each run; pictures of ``fed`` replace them before the next step reads
        them."""
        plan = self._plan_within(backend.limits)
        check(plan, backend.limits)
        execution = Execution(plan, backend)
        order = {id(step): number for number, step in enumerate(plan.steps)}
        try:
            for frame, (pictures, values) in enumerate(self.frames):
                by_key: dict[Key, Picture] = {}

                def observe(step: Step, _: Any, frame: int = frame, by_key: dict[Key, Picture] = by_key) -> None:
                    for resource in step.writes:
                        key = frame, order[id(step)], resource
                        by_key[key] = execution.download(resource)
                        # A stencil cannot be uploaded, so a picture with one stays the backend's own.
                        if fed is not None and not self.plan.resources[resource].format.stencil:
                            execution.replace(resource, fed[key])

                execution.run(pictures, values, observe)
                yield by_key
        finally:
            execution.release()

    def _plan_within(self, limits: Limits) -> Plan:
        """Return the same steps, with other programs where a device filters, calls its own functions or contracts."""
        filters = limits.filters if self._may_filter() else ()
        native, contracts = (limits.native, limits.contracts) if self._may_be_native() else ({}, False)
        if not filters and not native and not contracts:
            return self.plan
        key = filters, tuple(native.items()), contracts
        if key not in self._plans:
            self._plans[key] = self._build(Limits(filters=filters, native=native, contracts=contracts))
        return self._plans[key]

    def _may_filter(self) -> bool:
        steps = [step for step in self.plan.steps if isinstance(step, PixelStep)]
        return any(image.bits for step in steps for image in step.facts.images.values())

    def _may_be_native(self) -> bool:
        steps = [step for step in self.plan.steps if isinstance(step, (PixelStep, DrawStep))]
        kernels = [kernel for step in steps for kernel in step.source.kernels]
        return any((kernel.math or self.plan.options.math) == "native" for kernel in kernels)

    def allowed(self, promises: Promises = SNAPPED) -> tuple[dict[Key, Picture], dict[Key, Allowed]]:
        """Return the reference's pictures, and the bounds for backends that promise this."""
        if not any(isinstance(step, DrawStep) for step in self.plan.steps):
            promises = replace(promises, corner_px=0.0)
        if not self._may_be_native():
            promises = replace(promises, native=())
        if promises not in self.found:
            oracle = OracleBackend(promises, self.kept, limit=self.limit)
            expected: dict[Key, Picture] = {}
            allowed: dict[Key, Allowed] = {}
            plan = self._plan_within(Limits(native=dict(promises.native)))
            for written in self.written(oracle):
                expected |= written
                for key, picture in written.items():
                    step = plan.steps[key[1]]
                    moved = isinstance(step, CopyStep)
                    place = step.writes.index(key[2])
                    allowed[key] = Allowed.exactly(picture) if moved else oracle.found[id(step)][place]
            self.found[promises] = expected, allowed
        return self.found[promises]

    def accumulated(self, promises: Promises = SNAPPED) -> dict[int, Allowed]:
        """Return the bounds of each resource from the inputs on, after the last run: errors of passes accumulate."""
        oracle = OracleBackend(promises, limit=self.limit, accumulates=True)
        plan, found = self._plan_within(Limits(native=dict(promises.native))), dict[int, Allowed]()
        for _ in self.written(oracle):
            for step in plan.steps:
                if isinstance(step, CopyStep):
                    raise GraphError(f"pass {step.name!r} copies what it draws over, for which no bounds accumulate")
                found |= dict(zip(step.writes, oracle.found[id(step)], strict=True))
        return found

    def watched(self, promises: Promises, steps: Iterable[int]) -> dict[int, Watch]:
        """Run the graph again with watches on some steps, to find the causes of their bounds."""
        plan = self._plan_within(Limits(native=dict(promises.native)))
        watches = {step: Watch(plan.steps[step]) for step in steps}
        if watches:
            for _ in self.written(OracleBackend(promises, watches=tuple(watches.values()))):
                pass
        return watches
