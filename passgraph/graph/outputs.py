"""Targets as results: by their own names, or by names given for them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any, TypeAlias

import numpy as np

from passgraph import arguments
from passgraph.errors import GraphError
from passgraph.graph.targets import Target, TargetSpec

Outputs: TypeAlias = "Target | Iterable[Target] | Mapping[str, Target]"


def named_outputs(outputs: Any) -> dict[str, Target]:
    """One target, several, or a mapping, as a mapping by result name."""
    if isinstance(outputs, (Target, TargetSpec)):
        outputs = [outputs]
    if isinstance(outputs, Mapping):
        for name, target in outputs.items():
            arguments.text(name, "the name of an output")
            _check_target(target)
        return dict(outputs)
    if isinstance(outputs, (str, bytes, np.ndarray)) or not isinstance(outputs, Iterable):
        raise GraphError(f"compile takes targets that passes returned, got {arguments.shown(outputs)}")
    named: dict[str, Target] = {}
    for target in outputs:
        _check_target(target)
        if target.name in named:
            raise GraphError(
                f"two outputs are called {target.name!r}; give a mapping: pg.compile({{'first': ..., 'second': ...}})"
            )
        named[target.name] = target
    return named


def _check_target(target: object) -> None:
    if isinstance(target, TargetSpec):
        raise GraphError(
            f"compile takes targets that passes returned, got target {target.name!r} is declared but not written"
        )
    if not isinstance(target, Target):
        raise GraphError(f"compile takes targets that passes returned, got {arguments.shown(target)}")
