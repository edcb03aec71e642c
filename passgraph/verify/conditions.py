"""The conditions of a kept result: machine, device and driver, options, and date."""

from __future__ import annotations

import os
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any

from passgraph.backends.base import Backend
from passgraph.environment import Environment, environment

#: Beginnings of environment variables that change what drivers and their compilers compute.
DRIVER_VARIABLES = (
    "CL_CONFIG_", "EGL_", "GALLIUM_", "GALLIVM_", "LIBGL_", "LP_", "MESA_", "OCL_", "OPENCL_", "POCL_", "VK_", "WGPU_",
    "__EGL_", "__GL",
)  # fmt: skip


@dataclass(frozen=True)
class Conditions:
    """What a result of an open backend depends on.

    Attributes
    ----------
    environment : versions of the system, Python and libraries, and the backend's device
    options : those of the run, such as ``math`` and ``seed``
    variables : the environment variables that change drivers
    date : of the run, UTC, in ISO 8601
    """

    environment: Environment
    options: dict[str, Any]
    variables: dict[str, str]
    date: str

    @classmethod
    def now(cls, backend: Backend, **options: Any) -> Conditions:
        """Ask the machine, and the open backend for its device.

        >>> from passgraph.backends.registry import open_backend
        >>> with open_backend("reference") as backend:
        ...     conditions = Conditions.now(backend, math="exact")
        >>> conditions.device.split(";")[0], conditions.options
        ('CPU, float64', {'math': 'exact'})
        """
        variables = {name: os.environ[name] for name in sorted(os.environ) if name.startswith(DRIVER_VARIABLES)}
        date = datetime.now(UTC).isoformat(timespec="seconds")
        return cls(environment(backend), options, variables, date)

    @property
    def device(self) -> str:
        """Return device, driver and version in a line."""
        ((info,),) = self.environment.devices.values()
        return f"{info.name}; {info.driver} {info.version}".strip()

    def as_data(self) -> dict[str, Any]:
        """Return it as values of JSON: the environment's keys, then those of the run."""
        run = {"options": self.options, "variables": self.variables, "date": self.date}
        return {**self.environment.as_data(), **run}

    def rows(self) -> list[tuple[str, str]]:
        """Return what to show beside a result, as name and text."""
        found = self.environment
        return [
            ("device", self.device),
            ("passgraph", found.passgraph),
            ("date", self.date),
            ("options", _listed(self.options)),
            ("variables of drivers", _listed(self.variables) or "none"),
            ("system", found.system),
            ("processor", found.cpu),
            ("Python", found.python),
            ("libraries", ", ".join(f"{name} {version}" for name, version in found.libraries.items())),
        ]


def _listed(values: dict[str, Any]) -> str:
    return ", ".join(f"{name}={value}" for name, value in values.items())
