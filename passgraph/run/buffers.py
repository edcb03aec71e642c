"""Long arrays of parameters on the device: each goes there when it is another one than what lies there."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from passgraph.errors import GraphError
from passgraph.graph.geometry import is_fixed
from passgraph.graph.values import Derived, Value
from passgraph.language.buffers import picture_of
from passgraph.plan.data import DrawStep, PixelStep, Plan, Step
from passgraph.run.given import picked, resolve

if TYPE_CHECKING:
    from passgraph.backends.base import Backend


class Buffers:
    """The pictures of a plan's long arrays; ``storages`` has each by its resource."""

    def __init__(self, plan: Plan, backend: Backend, storages: Mapping[int, Any]) -> None:
        self.plan, self.backend, self.storages = plan, backend, storages
        #: By resource, what the parameter has: an array, or what each run brings.
        self.given: dict[int, object] = {resource: spec.value for resource, spec in plan.buffers.items()}
        #: By resource, the value whose numbers lie there, where it holds them as long as it is the same.
        self.written: dict[int, object] = {}
        for resource, value in self.given.items():
            if not isinstance(value, (Value, Derived)):
                self._write(resource, value)

    def bring(self, values: dict[Any, object]) -> None:
        """What a run needs: values that are new since the last one.

        Raises
        ------
        InputError
            For a value that does not fit.
        """
        for resource, given in self.given.items():
            value = resolve(given, values) if isinstance(given, (Value, Derived)) else given
            if resource not in self.written or self.written[resource] is not value or not self._stays(resource, value):
                self._write(resource, value)

    def _write(self, resource: int, value: object) -> None:
        self.written.pop(resource, None)
        stays, spec = self._stays(resource, value), self.plan.buffers[resource]
        picture = picture_of(picked(value, spec.fields, spec.name), spec.type, spec.name)
        self.backend.upload(self.storages[resource], picture)
        if stays:
            self.written[resource] = value

    def _stays(self, resource: int, value: object) -> bool:
        """Whether a value that is given again holds what it held."""
        given = self.given[resource]
        if not isinstance(given, (Value, Derived)) or given.static:
            return True
        return isinstance(value, np.ndarray) and is_fixed(value)

    def override(self, step: Step, key: str, value: object) -> None:
        """Another value for a parameter of a step, by its name with the prefix of a fused pass."""
        mine = self._of(step, key)
        for other in self.plan.steps:
            names = [key] if other is step else []
            if any(resource in mine and parameter not in names for resource, parameter in self._used(other)):
                raise GraphError(
                    f"parameter {key!r} of pass {step.name!r} is one array with what pass {other.name!r} reads; give "
                    "both a pg.Value, which each run brings, or two arrays"
                )
        for resource in mine:
            self.given[resource] = value
            self.written.pop(resource, None)

    def _of(self, step: Step, key: str) -> set[int]:
        return {resource for resource, parameter in self._used(step) if parameter == key}

    def _used(self, step: Step) -> list[tuple[int, str]]:
        """The long arrays that a step reads, each with its parameter's name."""
        if not isinstance(step, (PixelStep, DrawStep)):
            return []
        return [(resource, name.partition(".")[0]) for name, resource in step.images if resource in self.plan.buffers]
