"""Sizes of pictures as rules of the sizes of inputs and output, so that an export runs on pictures of any size."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any, TypeAlias

import numpy as np

from passgraph.errors import PassgraphError
from passgraph.formats import Format
from passgraph.graph.run_values import computed_side, is_computed_from_size
from passgraph.graph.targets import (
    Absolute,
    Blocks,
    Computed,
    InputSpec,
    Like,
    Pass,
    PixelPass,
    Relative,
    Target,
    TargetSpec,
)
from passgraph.plan.build import build
from passgraph.plan.data import DrawStep, Options, PixelStep, Plan
from passgraph.plan.dependencies import passes_behind
from passgraph.plan.limits import Limits

Size: TypeAlias = tuple[int, int]
#: A rule as plain data, see :func:`evaluated`.
Rule: TypeAlias = dict[str, Any]


class SizeRules:
    """The size rules of a graph's targets."""

    def __init__(self, outputs: Mapping[str, Target]) -> None:
        self.makers: dict[TargetSpec, Pass] = {}
        for node in passes_behind(list(outputs.values())):
            for spec in node.writes:
                self.makers.setdefault(spec, node)

    def of(self, spec: TargetSpec | InputSpec) -> Rule:
        """Return the rule of a target or input."""
        if isinstance(spec, InputSpec):
            return {"input": spec.name}
        size = spec.size
        if isinstance(size, Absolute):
            return {"fixed": [size.width, size.height]}
        if isinstance(size, Like):
            return _scaled(self.of(size.other.spec), size.scale)
        if isinstance(size, Blocks):
            return {"of": self.of(size.other.spec), "blocks": [size.width, size.height, size.each]}
        if isinstance(size, Computed):
            return {"formulas": [size.width, size.height]}
        if isinstance(size, Relative):
            return _scaled({"output": True}, size.scale)
        node = self.makers.get(spec)
        if isinstance(node, PixelPass):
            for image in node.images.values():
                if not image.is_previous:
                    return self.of(image.spec)
        return {"output": True}


def _scaled(rule: Rule, scale: tuple[float, float]) -> Rule:
    return rule if scale == (1.0, 1.0) else {"of": rule, "scale": list(scale)}


def evaluated(rule: Rule, output: Size, inputs: Mapping[str, Size]) -> Size:
    """Return the size that a rule gives.

    >>> evaluated({"of": {"input": "frame"}, "scale": [0.5, 0.5]}, (9, 9), {"frame": (5, 4)})
    (3, 2)
    """
    if "fixed" in rule:
        return rule["fixed"][0], rule["fixed"][1]
    if "input" in rule:
        return inputs[rule["input"]]
    if "formulas" in rule:
        width, height = rule["formulas"]
        return computed_side(width, output, "a size"), computed_side(height, output, "a size")
    if "of" not in rule:
        return output
    width, height = evaluated(rule["of"], output, inputs)
    if "blocks" in rule:
        across, down, each = rule["blocks"]
        return each * -(-width // across), -(-height // down)
    return max(1, math.ceil(width * rule["scale"][0])), max(1, math.ceil(height * rule["scale"][1]))


def rules_of(plan: Plan, rules: SizeRules) -> list[Rule] | None:
    """Return the rule of each resource of a plan; None if the planner made a target that the graph does not name."""
    specs: dict[int, TargetSpec] = {}
    for step in plan.steps:
        if isinstance(step, (PixelStep, DrawStep)):
            if len(step.outputs) != len(step.source.into):
                return None
            specs |= dict(zip(step.outputs, step.source.into, strict=True))
            if isinstance(step, DrawStep) and step.depth is not None and step.source.depth is not None:
                specs[step.depth] = step.source.depth
        elif step.source_resource in specs:
            specs[step.outputs[0]] = specs[step.source_resource]
    for resource in plan.resources:
        now = resource
        while now.id in specs and now.history is not None:
            specs[now.history] = specs[now.id]
            now = plan.resources[now.history]
    found: list[Rule] = []
    for resource in plan.resources:
        if resource.kind == "input":
            found.append({"input": resource.name})
        elif resource.kind == "buffer":
            found.append({"fixed": list(resource.size)})
        elif resource.id in specs:
            found.append(rules.of(specs[resource.id]))
        else:
            return None
    return found


def resizable_rules(
    outputs: Mapping[str, Target], plan: Plan, inputs: Mapping[str, tuple[Format, Size]], options: Options,
    limits: Limits,
) -> list[Rule] | None:  # fmt: skip
    """Return the rule of each resource if the plan holds for other sizes; else None.

    The graph is planned for other sizes.  Steps, programs and allocations must be the same, and sizes those of the
    rules.  A value that Python computes from the output's size is a constant of the export, so it fixes the size.
    """
    if any(is_computed_from_size(step.values) for step in plan.steps):
        return None
    sizes = SizeRules(outputs)
    rules = rules_of(plan, sizes)
    if rules is None or any(isinstance(r.initial, np.ndarray) for r in plan.resources):
        return None
    if not set(map(_input_of, rules)) <= {None, *plan.inputs}:  # the size of an input that no pass reads
        return None
    for change in _CHANGES:
        changed = {name: (format_, change(size)) for name, (format_, size) in inputs.items()}
        output = change(plan.size)
        try:
            other = build(outputs, None if inputs else output, changed, options, limits)
        except PassgraphError:
            return None
        given = {name: size for name, (_, size) in changed.items()}
        if _signature(other) != _signature(plan) or other.size != output:
            return None
        if any(len(shared) > 1 for shared in _sizes_in_memory(plan, other).values()):
            return None
        for resource, rule in zip(other.resources, rules, strict=True):
            if resource.kind != "buffer" and evaluated(rule, output, given) != resource.size:
                return None
    return rules


def _input_of(rule: Rule) -> str | None:
    """Return the input whose size a rule begins with."""
    return _input_of(rule["of"]) if "of" in rule else rule.get("input")


def _scaled_by(across: float, down: float, more: int) -> Any:
    return lambda size: (max(1, int(size[0] * across)) + more, max(1, int(size[1] * down)) + more)


_CHANGES = (_scaled_by(2, 2, 1), _scaled_by(0.37, 1.4, 0), _scaled_by(1, 0.5, 3))


def _sizes_in_memory(plan: Plan, other: Plan) -> dict[int, set[Size]]:
    """Return the sizes, in another plan, of the resources that share an allocation in this plan."""
    sizes: dict[int, set[Size]] = {}
    for resource in plan.resources:
        sizes.setdefault(resource.memory, set()).add(other.resources[resource.id].size)
    return sizes


def _signature(plan: Plan) -> list[object]:
    """Return what must be equal in plans for two sizes."""
    return [*_steps(plan), *[(r.name, r.format, r.kind, r.history) for r in plan.resources]]


def _steps(plan: Plan) -> Iterator[object]:
    for step in plan.steps:
        keys: tuple[object, ...] = ()
        if isinstance(step, PixelStep):
            keys = (step.program.key, step.images)
        elif isinstance(step, DrawStep):
            keys = (step.vertex.key, step.fragment and step.fragment.key, step.images, step.depth, step.clears)
        yield type(step).__name__, step.name, step.outputs, step.static, keys
