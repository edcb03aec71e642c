"""State shared by the phases of planning: every pass and its known properties."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from passgraph.formats import Format, float_format
from passgraph.graph.targets import InputSpec, Pass, Target, TargetSpec
from passgraph.language.builtin_name import BuiltinName
from passgraph.language.long_arrays import layout_of
from passgraph.language.lower import Facts
from passgraph.language.lower_cache import Programs
from passgraph.language.scalar import ScalarProgram
from passgraph.language.types import Array
from passgraph.plan.data import BufferSpec, Options
from passgraph.plan.limits import Limits


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
    values: Mapping[str, object]

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


@dataclass
class Work:
    """State shared by the phases of planning."""

    outputs: dict[str, Target]
    size: tuple[int, int] | None  # None if neither requested nor known from an input
    options: Options
    inputs: dict[InputSpec, tuple[Format, tuple[int, int]]]
    limits: Limits = field(default_factory=Limits)  # of the device
    in_windows: bool = False  # pictures are never allocated whole, so any size is allowed
    sized: list[Sized] = field(default_factory=list)
    passes: dict[Pass, Lowered] = field(default_factory=dict)
    #: For history: the last content of each target that is read in a later run.
    final: dict[TargetSpec, Target] = field(default_factory=dict)
    sizes: dict[TargetSpec, tuple[int, int]] = field(default_factory=dict)
    #: For each target why its size does not depend on the output's; empty if it does.
    not_asked: dict[TargetSpec, str] = field(default_factory=dict)
    #: The first writer of each target: a size may be taken from a target that is not read.
    makers: dict[TargetSpec, Pass] = field(default_factory=dict)
    #: Programs lowered so far: passes of one kernel share one.
    programs: Programs = field(default_factory=Programs)
    #: Pictures of long arrays, by the parameter's value, the field names from it to the array, and its type: passes
    #: that are given one array share one.
    buffers: dict[tuple[int, tuple[str, ...], Array], BufferSpec] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)

    def size_of(self, target: Target) -> tuple[int, int]:
        if isinstance(target.spec, InputSpec):
            return self.inputs[target.spec][1]
        return self.sizes[target.spec]

    def format_of(self, target: Target) -> Format:
        return self.inputs[target.spec][0] if isinstance(target.spec, InputSpec) else target.spec.format

    def buffer(self, node: Pass, name: str, type_: Array) -> Target:
        """Return the picture of a pass's long array parameter, or of one within a parameter, by its dotted name."""
        parameter, *fields = name.split(".")
        value = node.values[parameter]
        key = id(value), tuple(fields), type_  # the graph keeps the value
        if key not in self.buffers:
            layout = layout_of(type_)
            format_ = float_format(layout.channels)
            self.buffers[key] = spec = BufferSpec(
                f"{name} of {node.name}", format_, layout.size, True, value=value, fields=tuple(fields), type=type_
            )
            self.inputs[spec] = format_, layout.size
        return Target(self.buffers[key])

    def roots(self) -> list[Target]:
        """Return the contents to compute: outputs, and history for the next run."""
        return [*self.outputs.values(), *self.final.values()]
