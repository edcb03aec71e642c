"""First phase: everything behind the outputs, checked, with formats and sizes known."""

from __future__ import annotations

import math
from collections.abc import Container, Mapping
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
    OUTPUT_SIZE,
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
    size: tuple[int, int] | None  # None as long as neither asked for nor known from an input
    options: Options
    inputs: dict[InputSpec, tuple[Format, tuple[int, int]]]
    passes: dict[Pass, Lowered] = field(default_factory=dict)
    #: For history: the last content of each target that is read as last frame's.
    final: dict[TargetSpec, Target] = field(default_factory=dict)
    sizes: dict[TargetSpec, tuple[int, int]] = field(default_factory=dict)
    #: For each target why its size does not hang on the output's; empty where it does.
    not_asked: dict[TargetSpec, str] = field(default_factory=dict)
    #: Who writes a target first: a size may be taken from a target that is not read.
    makers: dict[TargetSpec, Pass] = field(default_factory=dict)
    #: Programs lowered so far, by digest: many passes of one kernel share one.
    programs: dict[str, ScalarProgram] = field(default_factory=dict)
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
    work = Work(dict(outputs), size or _output_size(bound, outputs), options, bound)
    _check_names(passes)
    _check_values(passes, bound)
    for node in passes:
        for spec in specs_written(node):
            work.makers.setdefault(spec, node)
    for index, node in enumerate(passes):
        work.passes[node] = Lowered(node, _pass_size(node, work), index)
    if size is not None:
        _check_asked(size, work)
    work.size = work.size or work.size_of(next(iter(outputs.values())))
    written = dict.fromkeys(spec for node in passes for spec in node.into)
    work.notes += [note for spec in written for note in spec.notes]
    work.final = _final_contents(passes)
    return work


def specs_written(node: Pass) -> tuple[TargetSpec, ...]:
    """The targets of a pass, a draw's depth last."""
    depth = node.depth if isinstance(node, DrawPass) else None
    return node.into if depth is None else (*node.into, depth)


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
    lenders = [spec for node in passes for spec in specs_written(node)]
    seen: set[TargetSpec] = set()
    for given in [*(t.spec for node in passes for t in node.reads), *lenders]:
        found = given
        # The input itself, and inputs that only lend their size.
        while isinstance(found, TargetSpec) and isinstance(found.size, Like) and found not in seen:
            seen.add(found)
            found = found.size.other.spec
        if isinstance(found, InputSpec) and specs.setdefault(found.name, found) is not found:
            raise GraphError(f"two different inputs are called {found.name!r}; use one handle, or give them two names")
    return specs


def _output_size(
    inputs: Mapping[InputSpec, tuple[Format, tuple[int, int]]], outputs: Mapping[str, Target]
) -> tuple[int, int] | None:
    """What targets take for the output's size where none is asked for."""
    for target in outputs.values():
        if isinstance(target.spec, TargetSpec) and isinstance(target.spec.size, Absolute):
            return target.spec.size.width, target.spec.size.height
    for spec, (_, input_size) in inputs.items():
        if spec.default is None:  # textures do not set the output's size
            return input_size
    return None


def _check_names(passes: list[Pass]) -> None:
    """One name means one target, so that results and messages are clear."""
    names: dict[str, TargetSpec] = {}
    for node in passes:
        for spec in specs_written(node):
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
    specs = specs_written(node)
    for spec in specs:
        _find_size(spec, work)
    sizes = {work.sizes[spec] for spec in specs}
    if len(sizes) > 1:
        listed = ", ".join(f"{s.name} {work.sizes[s][0]}x{work.sizes[s][1]}" for s in specs)
        raise GraphError(f"pass {node.name!r} writes targets of different sizes ({listed}); give them one size")
    return sizes.pop()


def _find_size(spec: TargetSpec, work: Work) -> None:
    """The size of a target into ``work.sizes``, and before it those that it is taken from."""
    pending = {spec: None}
    while pending:
        last = next(reversed(pending))
        source, scale = _size_source(last, work)
        size = _known_size(source, work) if isinstance(source, Target) else source
        if last in work.sizes:
            pending.popitem()
        elif size is not None:
            work.sizes[last] = _checked(_scaled(size, scale), last)
            work.not_asked[last] = _why_not_asked(last, source, work)
        else:
            assert isinstance(source, Target) and isinstance(source.spec, TargetSpec)
            _check_lender(source.spec, last, pending, work)
            pending[source.spec] = None


def _size_source(spec: TargetSpec, work: Work) -> tuple[Target | tuple[int, int], float]:
    """What a target takes its size from, and the factor on it."""
    if isinstance(spec.size, Absolute):
        return (spec.size.width, spec.size.height), 1.0
    if isinstance(spec.size, Like):
        return spec.size.other, spec.size.scale
    if not isinstance(spec.size, Relative):
        node = work.makers[spec]
        for image in node.images.values() if isinstance(node, PixelPass) else ():
            if not image.is_previous:
                return image, 1.0
    if work.size is None:
        raise GraphError("the output's size is not known: give pg.compile(..., size=(width, height))")
    return work.size, spec.size.scale if isinstance(spec.size, Relative) else 1.0


def _why_not_asked(spec: TargetSpec, source: Target | tuple[int, int], work: Work) -> str:
    """Why a target's size does not hang on the output's; empty where it does."""
    if isinstance(spec.size, Absolute):
        return f"as target {spec.name!r} is declared"
    if not isinstance(source, Target):
        return ""
    if isinstance(source.spec, InputSpec):
        return f"the size of input {source.name!r}"
    return work.not_asked.get(source.spec, f"the size of target {source.name!r}")


def _check_asked(size: tuple[int, int], work: Work) -> None:
    """A size that nothing takes is refused, and one that outputs do not take because an input has another one."""
    specs = {name: target.spec for name, target in work.outputs.items() if isinstance(target.spec, TargetSpec)}
    if any(work.sizes[spec] == size or not work.not_asked[spec] for spec in specs.values()):
        return
    taken = any(not reason for reason in work.not_asked.values()) or any(
        given is OUTPUT_SIZE or (isinstance(given, Derived) and any(v is OUTPUT_SIZE for v in given.sources))
        for node in work.passes
        for given in node.values.values()
    )
    for name, spec in specs.items():
        reason, (width, height) = work.not_asked[spec], work.sizes[spec]
        if not taken or reason.startswith("the size of input"):
            raise GraphError(
                f"size=({size[0]}, {size[1]}) is asked for, and output {name!r} is {width}x{height}, {reason}; "
                "leave size out, or declare the target with scale=1.0, which takes the size asked for"
            )


def _known_size(target: Target, work: Work) -> tuple[int, int] | None:
    if isinstance(target.spec, InputSpec):
        return work.inputs[target.spec][1]
    if target.spec not in work.sizes and isinstance(target.spec.size, Absolute):
        return target.spec.size.width, target.spec.size.height
    return work.sizes.get(target.spec)


def _check_lender(lender: TargetSpec, spec: TargetSpec, pending: Container[TargetSpec], work: Work) -> None:
    where = f"pass {work.makers[spec].name!r} takes its size from {lender.name!r}, which"
    if lender not in work.makers:
        raise GraphError(f"{where} no pass before it makes; give that one a size")
    if lender in pending:
        raise GraphError(f"{where} takes its own from {spec.name!r}; give one of the two a size")


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
    writers = {spec: node for node in passes for spec in specs_written(node)}  # the last one of each
    final: dict[TargetSpec, Target] = {}
    for spec in dict.fromkeys(t.spec for node in passes for t in node.reads if t.is_previous):
        assert isinstance(spec, TargetSpec)
        if spec not in writers:
            raise GraphError(
                f"last frame's {spec.name!r} is read, and no pass behind the outputs writes it; compile its pass too"
            )
        last = writers[spec]
        slot = last.into.index(spec) if spec in last.into else -1
        final[spec] = Target(spec, last, slot)
    return final
