"""Values that the phases of planning take and return: passes with their known properties, and drafts of the plan."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field
from typing import TypeAlias

from passgraph.formats import Format
from passgraph.graph.targets import InputSpec, Pass, Target, TargetSpec
from passgraph.language.builtin_name import BuiltinName
from passgraph.language.facts import Facts
from passgraph.language.lower_cache import LoweredPrograms
from passgraph.language.parameter_name import ParameterName
from passgraph.language.scalar import ScalarProgram
from passgraph.plan.data import Options
from passgraph.plan.limits import Limits
from passgraph.records import dataclass


@dataclass(frozen=True)
class Sized:
    """A pass with the size of its targets."""

    node: Pass
    size: tuple[int, int]
    index: int  # position in writing order


@dataclass(frozen=True, kw_only=True)
class Lowered(Sized):
    """A pass with what its scalar programs read; phases replace it by changed ones."""

    done: Pass  # the pass with its remaining targets
    slots: tuple[int, ...]  # the indices of the targets that remain
    facts: Facts
    #: Image name in the programs → its target; after culling only images that are really read.
    images: Mapping[str, Target]
    values: Mapping[ParameterName, object]

    @property
    def programs(self) -> tuple[ScalarProgram, ...]:
        """Return its programs in the order of their images."""
        raise NotImplementedError

    @property
    def colours(self) -> list[Target]:
        """Return the contents that it makes, without depth."""
        return [Target(spec, self.node, slot) for spec, slot in zip(self.done.into, self.slots, strict=True)]

    @property
    def name(self) -> str:
        return self.node.name

    @property
    def reads(self) -> list[Target]:
        """Return the images that it really reads, history included, and contents that it draws over."""
        return [*self.images.values(), *self.done.drawn_over]

    @property
    def awaits(self) -> list[Target]:
        """Return the contents that must exist first: images of this run, and what it draws over."""
        return [*(t.content for t in self.images.values() if not t.is_previous), *self.done.drawn_over]


@dataclass(frozen=True, kw_only=True)
class LoweredPixels(Lowered):
    """A pixel pass with its program."""

    program: ScalarProgram
    fused: tuple[str, ...] = ()  # names of passes computed inside this one
    #: These passes as they were, by their index, while passes are being fused.
    inside: Mapping[int, LoweredPixels] = field(default_factory=dict)

    @property
    def programs(self) -> tuple[ScalarProgram, ...]:
        return (self.program,)


@dataclass(frozen=True, kw_only=True)
class LoweredDraw(Lowered):
    """A draw with its linked programs; ``fragment`` is None for a draw of depth alone."""

    vertex: ScalarProgram
    vertex_facts: Facts
    fragment: ScalarProgram | None
    varyings: tuple[BuiltinName, ...]

    @property
    def programs(self) -> tuple[ScalarProgram, ...]:
        return (self.vertex,) if self.fragment is None else (self.vertex, self.fragment)


#: Format and size of each input.
Bound: TypeAlias = Mapping[InputSpec, tuple[Format, tuple[int, int]]]


@dataclass(frozen=True, kw_only=True)
class Collected:
    """The passes behind the outputs, in writing order, with all formats and sizes."""

    outputs: Mapping[str, Target]
    size: tuple[int, int]
    inputs: Bound
    passes: tuple[Sized, ...]
    sizes: Mapping[TargetSpec, tuple[int, int]]
    #: For history: the last content of each target that is read in a later run.
    final: Mapping[TargetSpec, Target]
    notes: tuple[str, ...]


@dataclass(frozen=True, kw_only=True)
class Draft:
    """A plan between two phases: each takes one and returns another."""

    options: Options
    limits: Limits  # of the device
    outputs: Mapping[str, Target]
    size: tuple[int, int]
    inputs: Bound  # pictures of long arrays included
    sizes: Mapping[TargetSpec, tuple[int, int]]
    final: Mapping[TargetSpec, Target]
    passes: Mapping[Pass, Lowered]
    notes: tuple[str, ...]
    #: Programs lowered so far: passes of one kernel share one.
    programs: LoweredPrograms = field(default_factory=LoweredPrograms)

    def size_of(self, target: Target) -> tuple[int, int]:
        return self.inputs[target.spec][1] if isinstance(target.spec, InputSpec) else self.sizes[target.spec]

    def format_of(self, target: Target) -> Format:
        return self.inputs[target.spec][0] if isinstance(target.spec, InputSpec) else target.spec.format

    def roots(self) -> list[Target]:
        """Return the contents to compute: outputs, and history for the next run."""
        return [*self.outputs.values(), *self.final.values()]
