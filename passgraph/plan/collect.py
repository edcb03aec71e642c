"""First phase: everything behind the outputs, checked, with formats and sizes known."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from passgraph.errors import GraphError
from passgraph.formats import Format, format_named
from passgraph.graph import DrawPass, Pass, PixelPass
from passgraph.language.lower import Facts
from passgraph.language.scalar import ScalarProgram
from passgraph.plan.data import Options
from passgraph.plan.remembered import remembered
from passgraph.targets import (
    MAX_SIDE,
    Absolute,
    Derived,
    InputSpec,
    Like,
    Relative,
    Target,
    TargetSpec,
    Value,
)

#: Largest picture that a plan will ask memory for, in bytes: a typing error in a size should not swap a machine to
#: death.
MAX_PICTURE_BYTES = 16 << 30


@dataclass
class Lowered:
    """A pass with its scalar programs, growing through the phases."""

    node: Pass
    size: tuple[int, int]
    index: int  # position in writing order
    program: ScalarProgram | None = None  # pixel passes
    facts: Facts = field(default_factory=Facts)
    vertex: ScalarProgram | None = None  # draws
    vertex_facts: Facts = field(default_factory=Facts)
    fragment: ScalarProgram | None = None
    varyings: tuple[str, ...] = ()
    #: Image name in the program → what it reads; after culling only what is really read.
    images: dict[str, Target] = field(default_factory=dict)
    values: dict[str, object] = field(default_factory=dict)
    fused: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        return self.node.name


@dataclass
class Work:
    """What the phases hand on to each other."""

    outputs: dict[str, Target]
    size: tuple[int, int]
    options: Options
    inputs: dict[InputSpec, tuple[Format, tuple[int, int]]]
    passes: dict[Pass, Lowered] = field(default_factory=dict)
    #: For history: the last content of each target that is read as last frame's.
    final: dict[TargetSpec, Target] = field(default_factory=dict)
    sizes: dict[TargetSpec, tuple[int, int]] = field(default_factory=dict)
    #: Who writes a target first: a size may be taken from a target that is not read.
    makers: dict[TargetSpec, Pass] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)

    def size_of(self, target: Target) -> tuple[int, int]:
        if isinstance(target.spec, InputSpec):
            return self.inputs[target.spec][1]
        return self.sizes[target.spec]

    def format_of(self, target: Target) -> Format:
        return self.inputs[target.spec][0] if isinstance(target.spec, InputSpec) else target.spec.format

    def roots(self) -> list[Target]:
        """What must be computed: the outputs and what the next run reads as history."""
        return [*self.outputs.values(), *self.final.values()]


def collect(
    outputs: Mapping[str, Target],
    size: tuple[int, int] | None,
    inputs: Mapping[str, tuple[Format, tuple[int, int]]],
    options: Options,
) -> Work:
    if not outputs:
        raise GraphError("nothing to compile: give at least one target")
    for name, target in outputs.items():
        _check_output(name, target)
    passes = _reachable(list(outputs.values()))
    bound = _bind_inputs(passes, inputs)
    work = Work(dict(outputs), _output_size(size, bound, outputs), options, bound)
    _check_names(passes)
    _check_values(passes, bound)
    for node in passes:
        for spec in node.into:
            work.makers.setdefault(spec, node)
    for index, node in enumerate(passes):
        work.passes[node] = Lowered(node, _pass_size(node, work), index)
    written = dict.fromkeys(spec for node in passes for spec in node.into)
    work.notes += [note for spec in written for note in spec.notes]
    work.final = _final_contents(passes)
    return work


def drawn_over(node: Pass) -> list[Target]:
    """Contents that a draw starts from instead of clearing."""
    if not isinstance(node, DrawPass):
        return []
    return [t.content for t in (*node.loads, node.depth_load) if t is not None]


def _check_output(name: str, target: object) -> None:
    if isinstance(target, TargetSpec):
        raise GraphError(f"target {target.name!r} is declared but not written; compile what its pass returned")
    if not isinstance(target, Target):
        raise GraphError(f"output {name!r} must be a target, got {type(target).__name__}")
    if target.made_by is None:
        what = "last frame's content" if target.is_previous else "an input"
        raise GraphError(f"output {name!r} is {what}, which no pass computes; put a pass behind it")


def _reachable(outputs: list[Target]) -> list[Pass]:
    """Every pass behind the outputs, producers first; history leads to its writer where that is in reach.

    Handles cannot be made before their passes, so a cycle can only be forged by hand; it is refused all the same.
    """
    ranks: dict[Pass, int] = {}
    edges: list[tuple[Pass, Pass]] = []
    pending = [t.made_by for t in outputs if t.made_by is not None]
    while pending:
        node = pending.pop()
        if node in ranks:
            continue
        ranks[node] = len(ranks)
        makers = [target.made_by for target in node.reads if target.made_by is not None]
        edges += [(maker, node) for maker in makers]
        pending += makers
    described = ("reachable", len(ranks), [(ranks[maker], ranks[node]) for maker, node in edges])
    nodes = list(ranks)
    (sequence,) = remembered(described, lambda: [[ranks[node] for node in _producers_first(ranks, edges)]])
    return [nodes[rank] for rank in sequence]


def _producers_first(ranks: Mapping[Pass, int], edges: list[tuple[Pass, Pass]]) -> list[Pass]:
    """Of passes that may come next the one with the highest rank."""
    import networkx as nx

    dependencies = nx.DiGraph()
    dependencies.add_nodes_from(ranks)
    dependencies.add_edges_from(edges)
    try:
        return list(nx.lexicographical_topological_sort(dependencies, key=lambda n: -ranks[n]))
    except nx.NetworkXUnfeasible:
        cycle = " → ".join(edge[0].name for edge in nx.find_cycle(dependencies))
        raise GraphError(
            f"passes form a cycle: {cycle}; read last frame's content with pg.previous() where it closes"
        ) from None


def _bind_inputs(
    passes: list[Pass], given: Mapping[str, tuple[Format, tuple[int, int]]]
) -> dict[InputSpec, tuple[Format, tuple[int, int]]]:
    specs = _input_specs(passes)
    bound = {}
    for name, spec in specs.items():
        given_format, given_size = given.get(name, (None, None))
        format_ = spec.format or given_format
        size = spec.size or given_size
        if format_ is None or size is None:
            raise GraphError(
                f"input {name!r} has no size or format yet; run the program with it, or "
                f"declare them: pg.Input({name!r}, 'rgba32f', (w, h))"
            )
        bound[spec] = (format_named(format_), size)
    return bound


def inputs_behind(outputs: list[Target]) -> dict[str, InputSpec]:
    """Every input behind some targets, by name."""
    return _input_specs(_reachable(outputs))


def _input_specs(passes: list[Pass]) -> dict[str, InputSpec]:
    specs: dict[str, InputSpec] = {}
    lenders = [Target(spec) for node in passes for spec in node.into]
    for target in [*(t for node in passes for t in node.reads), *lenders]:
        for found in _inputs_behind(target):
            if specs.setdefault(found.name, found) is not found:
                raise GraphError(
                    f"two different inputs are called {found.name!r}; use one handle, or give them two names"
                )
    return specs


def _inputs_behind(target: Target) -> list[InputSpec]:
    """The input itself, and inputs that only lend their size."""
    if isinstance(target.spec, InputSpec):
        return [target.spec]
    size = target.spec.size
    return _inputs_behind(size.other) if isinstance(size, Like) else []


def _output_size(
    size: tuple[int, int] | None,
    inputs: Mapping[InputSpec, tuple[Format, tuple[int, int]]],
    outputs: Mapping[str, Target],
) -> tuple[int, int]:
    if size is not None:
        return size
    for target in outputs.values():
        if isinstance(target.spec, TargetSpec) and isinstance(target.spec.size, Absolute):
            return target.spec.size.width, target.spec.size.height
    for spec, (_, input_size) in inputs.items():
        if spec.default is None:  # textures do not set the output's size
            return input_size
    raise GraphError("the output's size is not known: give pg.compile(..., size=(width, height))")


def _check_names(passes: list[Pass]) -> None:
    """One name means one target, so that results and messages are clear."""
    names: dict[str, TargetSpec] = {}
    for node in passes:
        depth = node.depth if isinstance(node, DrawPass) else None
        for spec in (*node.into, *((depth,) if depth is not None else ())):
            if names.setdefault(spec.name, spec) is not spec:
                raise GraphError(
                    f"two different targets are called {spec.name!r} (one in pass {node.name!r}); give them two names"
                )


def _check_values(passes: list[Pass], inputs: Mapping[InputSpec, object]) -> None:
    """One name means one run value, and no input too: runs bring both by name."""
    known: dict[str, Value] = {}
    names = {spec.name for spec in inputs}
    for node in passes:
        for given in node.values.values():
            sources = (given,) if isinstance(given, Value) else given.sources if isinstance(given, Derived) else ()
            for value in sources:
                first = known.setdefault(value.name, value)
                if first.type is not value.type or first.static != value.static:
                    raise GraphError(
                        f"two different values are called {value.name!r} (one in pass {node.name!r}); "
                        "use one handle, or give them two names"
                    )
                if value.name in names:
                    raise GraphError(f"an input and a value are both called {value.name!r}; give them two names")


def _pass_size(node: Pass, work: Work) -> tuple[int, int]:
    depth = node.depth if isinstance(node, DrawPass) else None
    specs = [*node.into, *((depth,) if depth is not None else ())]
    for spec in specs:
        if spec not in work.sizes:
            work.sizes[spec] = _checked(_target_size(spec, node, work), spec)
    sizes = {work.sizes[spec] for spec in specs}
    if len(sizes) > 1:
        listed = ", ".join(f"{s.name} {work.sizes[s][0]}x{work.sizes[s][1]}" for s in specs)
        raise GraphError(f"pass {node.name!r} writes targets of different sizes ({listed}); give them one size")
    return sizes.pop()


def _target_size(spec: TargetSpec, node: Pass, work: Work) -> tuple[int, int]:
    if isinstance(spec.size, Absolute):
        return spec.size.width, spec.size.height
    if isinstance(spec.size, Relative):
        return _scaled(work.size, spec.size.scale)
    if isinstance(spec.size, Like):
        return _scaled(_known_size(spec.size.other, node, work), spec.size.scale)
    if isinstance(node, PixelPass):
        for image in node.images.values():
            if not image.is_previous:
                return _known_size(image, node, work)
    return work.size


def _known_size(target: Target, node: Pass, work: Work) -> tuple[int, int]:
    if isinstance(target.spec, InputSpec):
        return work.inputs[target.spec][1]
    if target.spec not in work.sizes:
        if isinstance(target.spec.size, Absolute):
            return target.spec.size.width, target.spec.size.height
        if target.spec in work.makers:
            return _target_size(target.spec, work.makers[target.spec], work)
        raise GraphError(
            f"pass {node.name!r} takes its size from {target.name!r}, which no pass before it makes; "
            "give that one a size"
        )
    return work.sizes[target.spec]


def _scaled(size: tuple[int, int], scale: float) -> tuple[int, int]:
    return max(1, math.ceil(size[0] * scale)), max(1, math.ceil(size[1] * scale))


def _checked(size: tuple[int, int], spec: TargetSpec) -> tuple[int, int]:
    width, height = size
    total = width * height * spec.format.bytes_per_pixel
    if width > MAX_SIDE or height > MAX_SIDE or total > MAX_PICTURE_BYTES:
        raise GraphError(
            f"target {spec.name!r} would be {width}x{height} {spec.format.name} ({total / 2**30:.1f} GiB); "
            f"the limits are {MAX_SIDE} a side and {MAX_PICTURE_BYTES >> 30} GiB"
        )
    return size


def _final_contents(passes: list[Pass]) -> dict[TargetSpec, Target]:
    wanted = {t.spec for node in passes for t in node.reads if t.is_previous}
    final: dict[TargetSpec, Target] = {}
    for spec in wanted:
        assert isinstance(spec, TargetSpec)
        writers = [node for node in passes if spec in node.into or (isinstance(node, DrawPass) and node.depth is spec)]
        if not writers:
            raise GraphError(
                f"last frame's {spec.name!r} is read, and no pass behind the outputs writes it; compile its pass too"
            )
        last = writers[-1]
        slot = last.into.index(spec) if spec in last.into else -1
        final[spec] = Target(spec, last, slot)
    return final
