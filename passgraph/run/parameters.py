"""Parameters of a plan's steps: numbers packed into blocks, long arrays uploaded to their storages."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from passgraph.arguments import text
from passgraph.backends.base import Block
from passgraph.errors import GraphError, InputError
from passgraph.graph.draw_state import is_fixed
from passgraph.graph.run_values import Derived, Value
from passgraph.language.long_arrays import picture_of
from passgraph.language.parameter_name import ParameterName
from passgraph.language.scalar import ScalarProgram
from passgraph.language.uniform_layout import in_range
from passgraph.plan.data import CopyStep, PixelStep, Plan, Step

if TYPE_CHECKING:
    from passgraph.backends.base import Backend

#: Values of plain parameters that replace those of the graph, by the name of the step.
Overrides: TypeAlias = Mapping[tuple[str, ParameterName], object]


def picked(value: object, fields: Sequence[str], name: object) -> object:
    """Return the nested field of a value; for a list, a list of each entry's field."""
    for i, field in enumerate(fields):
        # Lists have methods, such as count, that fields may be named like; a named tuple is a struct.
        if isinstance(value, (list, tuple)) and not hasattr(value, "_fields"):
            return [picked(one, fields[i:], name) for one in value]
        if not hasattr(value, field):
            raise InputError(f"{str(name)!r} needs a field {field!r}, which {type(value).__name__} lacks")
        value = getattr(value, field)
    return value


def resolve(handle: object, values: dict[Any, object]) -> object:
    """Return the value of a handle in this run."""
    if isinstance(handle, Value):
        return values[handle.name]
    assert isinstance(handle, Derived)
    # Compared by identity: a default in the handle may be an array, which is not hashable.
    if id(handle) not in values:
        values[id(handle)] = handle.function(*(values[source.name] for source in handle.sources))
    return values[id(handle)]


class Uniforms:
    """The parameters of one stage: constants packed once, run values at each run."""

    def __init__(self, program: ScalarProgram, step: Step, overrides: Overrides) -> None:
        self.step, self.overrides = step, overrides
        self.floats = np.zeros(max(1, program.float_count), np.float32)
        self.ints = np.zeros(max(1, program.int_count), np.int32)
        self.block: Block = Block(self.floats, self.ints)
        self.constant: list[Any] = []
        self.changing: list[Any] = []
        for slot in program.uniforms:
            key, fields = slot.name.whole, slot.name.path
            block = self.floats if slot.block == "float" else self.ints
            place = block[slot.offset : slot.offset + slot.count]
            entry = (key, fields, place, slot, f"{slot.name} of pass {step.name!r}")
            value = step.values[key]
            (self.changing if isinstance(value, (Value, Derived)) else self.constant).append(entry)
        for entry in self.constant:
            self._store(entry, step.values[entry[0]])

    def _store(self, entry: Any, value: object) -> None:
        key, fields, place, slot, name = entry
        place[:] = in_range(picked(value, fields, key), slot.type, slot.range, name)

    def pack(self, values: dict[Any, object]) -> Block:
        """Return the parameter block for this run."""
        for entry in self.changing:
            handle = self.step.values[entry[0]]
            self._store(entry, self.overrides.get((self.step.name, entry[0]), resolve(handle, values)))
        if self.overrides:
            for entry in self.constant:
                key = (self.step.name, entry[0])
                if key in self.overrides:
                    self._store(entry, self.overrides[key])
        return self.block


class LongArrayValues:
    """The values of a plan's long array parameters; ``storages`` has the storage of each by resource."""

    def __init__(self, plan: Plan, backend: Backend, storages: Mapping[int, Any]) -> None:
        self.plan, self.backend, self.storages = plan, backend, storages
        #: By resource, the parameter's value: an array, or a handle that each run sets.
        self.given: dict[int, object] = {resource: spec.value for resource, spec in plan.buffers.items()}
        #: By resource, the value whose numbers it holds, if that cannot change unnoticed.
        self.written: dict[int, object] = {}
        for resource, value in self.given.items():
            if not isinstance(value, (Value, Derived)):
                self._write(resource, value)

    def bring(self, values: dict[Any, object]) -> None:
        """Upload the values that changed since the last run.

        Raises
        ------
        InputError
            For a value of the wrong type or shape.
        """
        for resource, source in self.given.items():
            value = resolve(source, values) if isinstance(source, (Value, Derived)) else source
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
        """Return True if a value is the one uploaded last."""
        source = self.given[resource]
        if not isinstance(source, (Value, Derived)) or source.static:
            return True
        return isinstance(value, np.ndarray) and is_fixed(value)

    def override(self, step: Step, key: ParameterName, value: object) -> None:
        """Set a parameter of a step."""
        mine = self._of(step, key)
        for other in self.plan.steps:
            names = [key] if other is step else []
            if any(resource in mine and parameter not in names for resource, parameter in self._used(other)):
                raise GraphError(
                    f"parameter {str(key)!r} of pass {step.name!r} is one array with what pass {other.name!r} reads; "
                    "give both a pg.Value, which each run brings, or two arrays"
                )
        for resource in mine:
            self.given[resource] = value
            self.written.pop(resource, None)

    def _of(self, step: Step, key: ParameterName) -> set[int]:
        return {resource for resource, parameter in self._used(step) if parameter == key}

    def _used(self, step: Step) -> list[tuple[int, ParameterName]]:
        """Return the long arrays that a step reads, each with its parameter's name."""
        resources = {} if isinstance(step, CopyStep) else dict(step.images)
        return [(resources[name], part.whole) for program in step.programs for name, part, _ in program.buffers]


class Parameters:
    """The parameters of a plan on a device, and the values that replace some of them."""

    def __init__(self, plan: Plan, backend: Backend, storages: Mapping[int, Any]) -> None:
        self.plan, self.long_arrays = plan, LongArrayValues(plan, backend, storages)
        self._overrides: dict[tuple[str, ParameterName], object] = {}

    def of(self, program: ScalarProgram, step: Step) -> Uniforms:
        """Return the parameters of one stage of a step."""
        return Uniforms(program, step, self._overrides)

    def override(self, step: str, name: str, value: object) -> None:
        """Set a plain parameter of a step."""
        step, name = text(step, "the name of a pass"), text(name, "the name of a parameter")
        steps = [s for s in self.plan.steps if s.name == step or (isinstance(s, PixelStep) and step in s.fused)]
        if not steps:
            raise GraphError(f"there is no pass {step!r}; there are {', '.join(s.name for s in self.plan.steps)}")
        keys = [key for key in steps[0].values if name in (key.parameter, str(key))]
        if not keys:
            known = ", ".join(map(str, steps[0].values)) or "none"
            raise GraphError(f"pass {step!r} has no parameter {name!r} to set; it has {known}")
        self.long_arrays.override(steps[0], keys[0], value)
        self._overrides[steps[0].name, keys[0]] = value
