"""A graph pass by pass: what each step writes on a backend, and the oracle's bounds."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import partial
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from passgraph.backends.base import Backend
from passgraph.errors import InputError
from passgraph.formats import Format
from passgraph.graph.targets import Target
from passgraph.plan.build import build
from passgraph.plan.data import CopyStep, DrawStep, Options, PixelStep, Plan, Step
from passgraph.plan.dependencies import inputs_behind
from passgraph.plan.limits import Limits
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
        self._build = partial(build, outputs, size, bound, OPTIONS)
        self.plan: Plan = self._build()
        #: Results of :meth:`allowed`, with snapped and unsnapped corners.
        self.found: dict[bool, tuple[dict[Key, Picture], dict[Key, Allowed]]] = {}

    def written(self, backend: Backend, fed: Mapping[Key, Picture] | None = None) -> Iterator[dict[Key, Picture]]:
        """Yield the results of every step of each run; pictures of ``fed`` replace them before the next step reads
        them."""
        # A device may filter by itself where the graph allows it: the same steps with other programs.
        plan = self._build(Limits(filters=True)) if backend.limits.filters and self._may_filter() else self.plan
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

    def _may_filter(self) -> bool:
        steps = [step for step in self.plan.steps if isinstance(step, PixelStep)]
        return any(image.bits for step in steps for image in step.facts.images.values())

    def allowed(self, snaps: bool) -> tuple[dict[Key, Picture], dict[Key, Allowed]]:
        """Return the reference's pictures, and the bounds for backends that snap corners as documented, or need not."""
        snaps = snaps or not any(isinstance(step, DrawStep) for step in self.plan.steps)
        if snaps not in self.found:
            oracle = OracleBackend(snaps, self.kept, limit=self.limit)
            expected: dict[Key, Picture] = {}
            allowed: dict[Key, Allowed] = {}
            for written in self.written(oracle):
                expected |= written
                for key, picture in written.items():
                    step = self.plan.steps[key[1]]
                    moved = isinstance(step, CopyStep)
                    place = step.writes.index(key[2])
                    allowed[key] = Allowed.exactly(picture) if moved else oracle.found[id(step)][place]
            self.found[snaps] = expected, allowed
        return self.found[snaps]

    def watched(self, snaps: bool, steps: Iterable[int]) -> dict[int, Watch]:
        """Run the graph again with watches on some steps, to find the causes of their bounds."""
        watches = {step: Watch(self.plan.steps[step]) for step in steps}
        if watches:
            for _ in self.written(OracleBackend(snaps, watches=tuple(watches.values()))):
                pass
        return watches
