"""A plan on a device: runs its compiled steps on its storages."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import nullcontext
from functools import partial
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from passgraph.backends.base import DevicePicture
from passgraph.errors import InputError
from passgraph.graph.run_values import FRAME_INDEX, OUTPUT_SIZE, Value
from passgraph.plan.data import Plan, Step
from passgraph.run.caller_arrays import Picture as Given
from passgraph.run.compiled_steps import RunUnit, StepCompiler
from passgraph.run.parameters import Parameters
from passgraph.run.result import Results
from passgraph.run.static_values import StaticValues
from passgraph.run.storages import Storages

if TYPE_CHECKING:
    from passgraph.backends.base import Backend
    from passgraph.run.finite_checks import PassCheck

Picture = NDArray[np.float32]
#: Is called after each step with what it wrote.
Observe: TypeAlias = Callable[[Step, dict[str, Picture]], None]
#: Runs a step that it is given, and measures the time.
Timed: TypeAlias = Callable[[Step, Callable[[], None]], None]


class Execution:
    """A plan on a device.  It owns its storages and compiled steps until :meth:`release`.

    Attributes
    ----------
    units : steps that run as one, in order
    runs : completed runs, since history began
    """

    def __init__(self, plan: Plan, backend: Backend) -> None:
        self.plan, self.backend = plan, backend
        self.runs = 0
        self.units: tuple[RunUnit, ...] = ()
        self._singly: tuple[RunUnit, ...] = ()
        self.storages, self._static = Storages(plan, backend), StaticValues(plan)
        self._compiler: StepCompiler | None = None
        try:
            self.storages.allocate()
            self._parameters = Parameters(plan, backend, {r: self.storages.of(r) for r in plan.buffers})
            self._compiler = StepCompiler(backend, self.storages, self._parameters)
            with backend.compiling(), self.storages.reports_memory("compile this graph"):
                self.units, self._singly = self._compiler.compile(plan)
        except BaseException:
            self.release()
            raise

    def run(
        self,
        pictures: Mapping[str, Given],
        inputs: Mapping[str, object],
        observe: Observe | None,
        check: PassCheck | None = None,
        result_arrays: Mapping[int, Given] | None = None,
        timed: Timed | None = None,
        results: Results | None = None,
    ) -> None:
        """Run every step in order; static steps only if a source changed.

        ``observe`` and ``check`` get the results of each step, which are read back: slow, for debugging.
        ``result_arrays`` has the destination arrays, by resource; ``results`` says how other results are returned, None
        if they are not.  ``timed`` runs each step.
        """
        lent = self.storages.caller_arrays
        with self.storages.reports_memory("allocate the results"):
            lent.begin(result_arrays or {}, results)
        values = self._values(inputs)
        static = self._static.of(values)
        static_changed = self._static.changed(static)
        self._static.keep(None)  # until this run completes, static steps count as not done
        if check is not None:
            check.begin()
        try:
            with self.storages.reports_memory("run this graph"):
                self._run_steps(pictures, values, observe, check, static_changed, timed)
        except BaseException:
            lent.begin({})
            raise
        self._static.keep(static)
        self.storages.age()
        self.runs += 1

    def _run_steps(
        self, pictures: Mapping[str, Given], values: dict[Any, object], observe: Observe | None,
        check: PassCheck | None, static_changed: bool, timed: Timed | None,
    ) -> None:  # fmt: skip
        storages, looking = self.storages, observe is not None or check is not None
        # The observer may use the device between two steps.
        with nullcontext() if looking else self.backend.running():
            static_changed |= storages.upload(pictures)
            if check is not None:
                for name, resource in self.plan.inputs.items():
                    stored = pictures[name]
                    check.admit(resource, self.download(resource) if isinstance(stored, DevicePicture) else stored)
            self._parameters.long_arrays.bring(values)
            storages.move_history()
            storages.place_results(singly=looking)
            storages.caller_arrays.bind_results(storages.places)
            for unit in self._singly if looking else self.units:
                step = unit.steps[-1]
                if step.static and not static_changed:
                    continue
                if timed is None:
                    unit.execute(values)
                else:
                    timed(step, partial(unit.execute, values))
                if observe is not None or check is not None:
                    written = {resource: self.download(resource) for resource in step.writes}
                    if observe is not None:
                        observe(step, {self.plan.resources[r].name: picture for r, picture in written.items()})
                    if check is not None:
                        check.look(step, written)
            storages.caller_arrays.end(storages.places, storages.memories)

    def ends(self, looking: bool) -> list[Step]:
        """Return the last step of each unit, in order; when observed, each step is a unit."""
        return [unit.steps[-1] for unit in (self._singly if looking else self.units)]

    def reset(self) -> None:
        """Reset to the state before the first run: history holds the targets' initial values."""
        self.runs = 0
        self._static.keep(None)
        self.storages.reset()

    def continue_from(self, earlier: Execution) -> None:
        """Copy the run count, and history of targets that match in name, size and format."""
        self.storages.continue_from(earlier.storages)
        self.runs = earlier.runs

    def _values(self, run_values: Mapping[str, object]) -> dict[Any, object]:
        """Return run values by handle; derived values are computed on first use."""
        needed = self.plan.values
        if run_values and (surplus := [name for name in run_values if name not in needed]):
            names = ", ".join([*self.plan.inputs, *needed]) or "nothing"
            raise InputError(f"there is no input or value {surplus[0]!r} in this graph; it takes {names}")
        values: dict[Any, object] = {}
        for name, handle in needed.items():
            value = run_values.get(name, self._default_value(handle))
            if value is None:
                raise InputError(f"value {name!r} is missing; run the program as program({name}=...)")
            handle.check(value)
            values[name] = value
        return values

    def _default_value(self, handle: Value) -> object:
        """Return the default of a value that a run does not set."""
        if handle is OUTPUT_SIZE:
            return self.plan.size
        return self.runs if handle is FRAME_INDEX else handle.default

    def override(self, step: str, name: str, value: object) -> None:
        """Set a plain parameter of a step."""
        self._parameters.override(step, name, value)
        self._static.keep(None)

    def download(self, resource: int) -> Picture:
        """Return a picture of the last run."""
        return self.storages.download(resource)

    def result(self, resource: int, results: Results) -> Given:
        """Return a picture in the requested form: the caller's array, the format's dtype, or float32."""
        return self.storages.result(resource, results)

    def replace(self, resource: int, picture: Picture) -> None:
        """Replace what a step wrote by another picture, to compare pass by pass."""
        self.backend.upload(self.storages.of(resource), picture)

    def release(self) -> None:
        """Release pictures, meshes and compiled steps."""
        self.units = self._singly = ()
        self.storages.release()
        if self._compiler is not None:
            self._compiler.release()
