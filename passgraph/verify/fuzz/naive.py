"""Evaluate a graph naively: compile and run each pass as its own program, without a plan of the whole graph.

Backends and the reference run the same plans, so comparing them cannot reveal a wrong plan. Here the value of every
handle is an array that is never overwritten, so execution order, aliasing and static passes play no role.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from passgraph.backends.base import Backend
from passgraph.graph.calls import kernel
from passgraph.graph.targets import (
    Absolute,
    Blocks,
    DrawPass,
    Input,
    InputSpec,
    Like,
    Pass,
    Target,
    TargetSpec,
)
from passgraph.plan.data import Options
from passgraph.run.compile import compile as compile_graph
from passgraph.run.program import Program

Picture = NDArray[Any]  # as targets store them
_OPTIONS = Options(cull=False, fuse=False, order=False, alias=False, static=False, simplify=False)


class Naive:
    """Evaluate the outputs of a graph for one frame after another.

    Parameters
    ----------
    outputs : the graph
    backend : runs the single passes; it stays open

    Handles are evaluated one by one: inputs from the frame's pictures, targets by their pass, history from earlier
    frames.
    """

    def __init__(self, outputs: Mapping[str, Target], backend: Backend) -> None:
        self.outputs, self.backend = dict(outputs), backend
        self._programs: dict[Pass, tuple[Program, dict[str, Target]]] = {}
        self._final = _final_contents(self.outputs.values())
        self._earlier: list[dict[Target, Picture]] = []  # contents of earlier frames, the latest first
        self._values: dict[Target, Picture] = {}
        self._given: Mapping[str, Any] = {}

    def run(self, **inputs: Any) -> dict[str, Picture]:
        """Evaluate one frame; return the outputs by name."""
        self._given, self._values = inputs, {}
        result = {name: self._value(target) for name, target in self.outputs.items()}
        for target in self._final.values():
            self._value(target)
        self._earlier.insert(0, self._values)
        return result

    def close(self) -> None:
        for program, _ in self._programs.values():
            program.close()

    def _value(self, target: Target) -> Picture:
        content = target.content
        if content not in self._values:
            if isinstance(content.spec, InputSpec):
                self._values[content] = np.asarray(self._given[content.spec.name], np.float32)
            elif content.is_previous:
                self._values[content] = self._previous(content)
            else:
                assert content.made_by is not None
                self._run_pass(content.made_by)
        return self._values[content]

    def _previous(self, content: Target) -> Picture:
        assert isinstance(content.spec, TargetSpec)
        final = self._final[content.spec]
        if content.frames_ago <= len(self._earlier):
            return self._earlier[content.frames_ago - 1][final]
        # Random graphs have only zeros as initial values, which every format holds.
        assert not np.any(content.spec.initial)
        assert isinstance(content.spec.size, Absolute)
        size = content.spec.size
        return np.zeros((size.height, size.width, content.spec.format.channels), content.spec.format.number)

    def _run_pass(self, node: Pass) -> None:
        if node not in self._programs:
            self._programs[node] = self._compiled(node)
        program, contents = self._programs[node]
        pictures = {_name(source): self._value(source) for source in (*node.reads, *_size_sources(node))}
        brought: dict[str, Any] = {name: picture for name, picture in pictures.items() if name in program.inputs}
        brought |= {name: self._given[name] for name in program.plan.values}
        results = program(**brought)
        self._values |= {contents[name]: np.array(result) for name, result in results.items()}

    def _compiled(self, node: Pass) -> tuple[Program, dict[str, Target]]:
        """Return a pass compiled as its own graph, and the contents that its results represent."""
        inputs = {source.content: self._input(source) for source in (*node.reads, *_size_sources(node))}
        specs = {spec: replace(spec, size=_size_of(spec, inputs)) for spec in node.writes}
        images = {
            name: replace(image, spec=inputs[image.content].spec, made_by=None, slot=0, frames_ago=0)
            for name, image in node.images.items()
        }
        into = tuple(specs[spec] for spec in node.into)
        alone: Pass
        if isinstance(node, DrawPass):
            assert node.depth is None, "random graphs draw without depth"
            loads = tuple(
                None if load is None else _copy(inputs[load.content], specs[spec])
                for spec, load in zip(node.into, node.loads, strict=True)
            )
            alone = replace(node, images=images, into=into, loads=loads)
        else:
            alone = replace(node, images=images, into=into)
        outputs = {f"o{slot}": Target(spec, alone, slot) for slot, spec in enumerate(into)}
        contents = {f"o{slot}": Target(spec, node, slot) for slot, spec in enumerate(node.into)}
        return compile_graph(outputs, self.backend, options=_OPTIONS, results="stored"), contents

    def _input(self, source: Target) -> Target:
        picture = self._value(source)
        height, width = picture.shape[:2]
        format_ = source.spec.format
        return Input(_name(source), "rgba32f" if format_ is None else format_.name, (width, height))


def _copy(source: Target, into: TargetSpec) -> Target:
    copy = kernel(source="def copy(color: Image) -> vec4: return color[0, 0]")
    target: Target = copy(source, into=into)
    return target


def _size_sources(node: Pass) -> list[Target]:
    """Return the targets whose sizes decide that of a pass's targets."""
    return [spec.size.other for spec in node.writes if isinstance(spec.size, (Like, Blocks))]


def _size_of(spec: TargetSpec, inputs: Mapping[Target, Target]) -> Any:
    size = spec.size
    return replace(size, other=inputs[size.other.content]) if isinstance(size, (Like, Blocks)) else size


def _name(source: Target) -> str:
    content = source.content
    return f"i{abs(hash((id(content.spec), id(content.made_by), content.slot, content.frames_ago)))}"


def _final_contents(outputs: Any) -> dict[TargetSpec, Target]:
    """Return the last content of each target, which no other pass draws over."""
    passes: dict[Pass, None] = {}
    pending = list(outputs)
    while pending:
        node = pending.pop().made_by
        if node is not None and node not in passes:
            passes[node] = None
            pending += [*node.reads, *_size_sources(node)]
    drawn_over = {content for node in passes for content in node.drawn_over}
    contents = {Target(spec, node, slot) for node in passes for slot, spec in enumerate(node.into)}
    final: dict[TargetSpec, Target] = {}
    for content in contents - drawn_over:
        assert isinstance(content.spec, TargetSpec)
        final[content.spec] = content
    return final


def naive_difference(
    outputs: Mapping[str, Target], backend: Backend, frames: Sequence[Mapping[str, Any]], options: Options
) -> str:
    """Return where a plan gives other bits than the naive evaluation; empty if it does not."""
    from passgraph.verify.fuzz.cases import same_bits

    naive = Naive(outputs, backend)
    try:
        with compile_graph(dict(outputs), backend, options=options, results="stored") as program:
            names = {*program.plan.inputs, *program.plan.values, *program.inputs}
            for number, frame in enumerate(frames):
                results = program(**{name: value for name, value in frame.items() if name in names})
                expected = naive.run(**frame)
                for name, picture in expected.items():
                    if not same_bits(picture, results[name]):
                        return f"{name} of frame {number} is not what its passes give one by one"
    finally:
        naive.close()
    return ""
