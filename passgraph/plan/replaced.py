"""Replace targets of a graph by inputs: the same graph behind other passes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from passgraph.graph.targets import Blocks, InputSpec, Like, Pass, PixelPass, Target, TargetSpec
from passgraph.plan.dependencies import passes_behind


def with_inputs(outputs: Mapping[str, Target], inputs: Mapping[Target, InputSpec]) -> dict[str, Target]:
    """Return the outputs with some targets (`Target.content`) read from inputs; passes that nothing needs are gone.

    Draws stay as they are.
    """
    passes: dict[Pass, Pass] = {}
    specs: dict[TargetSpec, TargetSpec] = {}

    def handle(target: Target) -> Target:
        if target.content in inputs:
            return replace(target, spec=inputs[target.content], made_by=None, slot=0)
        maker = passes.get(target.made_by) if target.made_by is not None else None
        if not isinstance(maker, PixelPass):
            return target
        return replace(target, made_by=maker, spec=maker.into[target.slot])

    def declared(spec: TargetSpec) -> TargetSpec:
        if spec not in specs:
            size = spec.size
            other = handle(size.other) if isinstance(size, Like | Blocks) else None
            same = other is None or other == size.other  # type: ignore[union-attr]
            specs[spec] = spec if same else replace(spec, size=replace(size, other=other))  # type: ignore[type-var]
        return specs[spec]

    for node in passes_behind(list(outputs.values())):
        if isinstance(node, PixelPass):
            images = {name: handle(image) for name, image in node.images.items()}
            into = tuple(map(declared, node.into))
            passes[node] = node if images == node.images and into == node.into else replace(
                node, images=images, into=into
            )  # fmt: skip
    return {name: handle(target) for name, target in outputs.items()}
