"""The numbers that depend on the camera, as a table of poses: a page cannot call the functions that compute them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import pi, prod, sqrt
from typing import Any

import numpy as np

from passgraph.arguments import instance, whole_number
from passgraph.errors import InputError
from passgraph.graph.run_values import Derived, Value
from passgraph.language.parameter_name import ParameterName
from passgraph.language.scalar import UniformSlot
from passgraph.language.uniform_layout import in_range
from passgraph.plan.data import Plan
from passgraph.run.parameters import picked, resolve
from passgraph.scene.camera import HIGHEST_RAD, Camera, angles_of

#: Angle between two elevations, and factor between two distances.
ELEVATION_STEP_RAD, DISTANCE_STEP = 0.15, sqrt(2.0)
#: Most bytes of a table; a larger one gets fewer azimuths.
MOST_BYTES = 4_000_000


@dataclass(frozen=True)
class Orbit:
    """The number of poses of a camera: round its target, above and below it, and nearer and farther.

    >>> Orbit(azimuths=36, elevations=3, distances=1)
    Orbit(azimuths=36, elevations=3, distances=1)
    """

    azimuths: int = 120
    elevations: int = 7
    distances: int = 3

    def __post_init__(self) -> None:
        for name, most in {"azimuths": 1000, "elevations": 99, "distances": 17}.items():
            object.__setattr__(self, name, whole_number(getattr(self, name), f"orbit: {name}", 1, most, InputError))


class PoseTable:
    """The table of a plan's poses.

    Attributes
    ----------
    camera : name of the value that orbits
    axes : azimuths and elevations in radians, relative to the exported camera, and factors of its distance
    numbers : (poses, columns) float32, or int32 by its bits; the distance changes first, then the elevation
    """

    def __init__(
        self, plan: Plan, constants: Mapping[Any, object], orbit: Orbit, progress: Callable[..., None]
    ) -> None:  # fmt: skip
        instance(orbit, Orbit, "orbit", "passgraph.web.Orbit(...)", InputError)
        self.camera = _camera_of(constants)
        for spec in plan.buffers.values():
            if self._is_posed(spec.value, constants):
                raise InputError(
                    f"orbit: {spec.name!r} is a long array that depends on the camera; leave out the orbit"
                )
        parameters = {_key(h, f, slot): (h, f, slot, where) for h, f, slot, where in self._parameters(plan, constants)}
        starts = np.cumsum([0, *(slot.count for _, _, slot, _ in parameters.values())]).tolist()
        self.axes = _axes(constants[self.camera], orbit, 4 * starts[-1])  # type: ignore[arg-type]
        poses = [(a, e, d) for a in self.axes[0] for e in self.axes[1] for d in self.axes[2]]
        table = np.zeros((len(poses), starts[-1]), "<f4")
        for number, (row, pose) in enumerate(zip(table, poses, strict=True)):
            progress("orbit", number, len(poses))
            values = {**constants, self.camera: constants[self.camera].orbited(*pose)}  # type: ignore[attr-defined]
            for start, (handle, fields, slot, where) in zip(starts, parameters.values(), strict=False):
                place = row[start : start + slot.count]
                stored = place if slot.block == "float" else place.view("<i4")
                stored[:] = in_range(picked(resolve(handle, values), fields, where), slot.type, slot.range, where)
        self.columns: dict[Any, int] = {}
        kept: list[int] = []
        for start, (key, (_, _, slot, _)) in zip(starts, parameters.items(), strict=False):
            columns = range(start, start + slot.count)
            if (table.view("<u4")[:, columns] != table.view("<u4")[0, columns]).any():
                self.columns[key] = len(kept)
                kept += columns
        self.numbers = np.ascontiguousarray(table[:, kept])

    def _parameters(self, plan: Plan, constants: Mapping[Any, object]) -> Iterator[tuple[Any, Any, Any, str]]:
        """Yield each parameter that depends on the camera: value, fields, uniform, and a name for errors."""
        for step in plan.steps:
            for slot in [slot for program in step.programs for slot in program.uniforms]:
                value = step.values[slot.name.whole]
                if self._is_posed(value, constants):
                    yield value, slot.name.path, slot, f"{slot.name} of pass {step.name!r}"

    def _is_posed(self, handle: object, constants: Mapping[Any, object]) -> bool:
        names = [one.name for one in handle.sources] if isinstance(handle, (Value, Derived)) else []
        return self.camera in names and all(name in constants for name in names)

    def column(self, slot: UniformSlot, values: Mapping[ParameterName, object]) -> int | None:
        """Return the first column of a parameter; None for one that is the same in every pose."""
        return self.columns.get(_key(values[slot.name.whole], slot.name.path, slot))

    def described(self, file: str) -> dict[str, Any]:
        """Return the table's entry in effect.json."""
        azimuths, elevations, distances = self.axes
        return {"file": file, "bytes": self.numbers.nbytes, "columns": self.numbers.shape[1],
                "azimuths": len(azimuths), "elevations": elevations, "distances": distances}  # fmt: skip


def _key(handle: object, fields: Sequence[str], slot: UniformSlot) -> tuple[Any, ...]:
    return id(handle), *fields, slot.block, slot.count


def _camera_of(constants: Mapping[Any, object]) -> str:
    cameras = [name for name, value in constants.items() if isinstance(value, Camera)]
    if len(cameras) != 1:
        raise InputError(
            f"orbit: expected an effect with one camera, got {', '.join(cameras) or 'none'}; leave out the orbit"
        )
    return str(cameras[0])


def _axes(camera: Camera, orbit: Orbit, row_bytes: int) -> tuple[list[float], list[float], list[float]]:
    """Return the relative azimuths, elevations and distances; the exported camera is among them."""
    _, begun = angles_of(-camera.forward)
    steps = [round(ELEVATION_STEP_RAD * k, 6) for k in range(-((orbit.elevations - 1) // 2), orbit.elevations // 2 + 1)]
    elevations = [step for step in steps if abs(begun + step) <= HIGHEST_RAD or step == 0.0]
    distances = [DISTANCE_STEP**k for k in range(-((orbit.distances - 1) // 2), orbit.distances // 2 + 1)]
    most = MOST_BYTES // max(1, prod((len(elevations), len(distances), row_bytes)))
    count = max(1, min(orbit.azimuths, most))
    return [2.0 * pi * k / count for k in range(count)], elevations, distances
