"""Values of static steps: these steps run again only if one has changed."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from passgraph.graph.run_values import Derived
from passgraph.plan.data import Plan
from passgraph.run.parameters import resolve


class StaticValues:
    """The values of a plan's static steps in the last run that was completed."""

    def __init__(self, plan: Plan) -> None:
        self._names = [name for name, handle in plan.values.items() if handle.static]
        #: Values that are derived from sources that are not static.
        self._by_value = [
            value
            for step in plan.steps
            if step.static
            for value in step.values.values()
            if isinstance(value, Derived) and value.by_value
        ]
        self._seen: dict[str, object] | None = None

    def of(self, values: dict[Any, object]) -> dict[str, object]:
        """Return the static ones among the values of a run."""
        static = {name: values[name] for name in self._names}
        for number, handle in enumerate(self._by_value):
            static[str(number)] = _contents(resolve(handle, values))
        return static

    def changed(self, static: Mapping[str, object]) -> bool:
        """Return True if a value differs from the last run's; an array passed again counts as changed."""
        last = self._seen
        return last is None or any(not _same(last.get(name), value) for name, value in static.items())

    def keep(self, static: dict[str, object] | None) -> None:
        """Keep the values of a run that was completed; None if static steps have to run again."""
        self._seen = static


def _same(one: object, other: object) -> bool:
    plain = (bool, int, float, str, bytes, tuple)
    return one is other or (type(one) is type(other) and isinstance(one, plain) and bool(one == other))


def _contents(value: object) -> object:
    """Return a key of a derived value: numbers as bytes, struct fields one by one."""
    if isinstance(value, (list, tuple)) and any(hasattr(part, "__dict__") for part in value):
        return tuple(map(_contents, value))
    if isinstance(value, np.ndarray) or not hasattr(value, "__dict__"):
        return np.asarray(value, np.float64).tobytes()
    return tuple(_contents(part) for part in vars(value).values())
