"""A plan: steps, their order and their memory.  Plain data that needs no device."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import field
from html import escape
from itertools import pairwise
from typing import TYPE_CHECKING, TypeAlias

import numpy as np
from numpy.typing import NDArray

from passgraph.arguments import flag, one_of
from passgraph.cached import cached_property
from passgraph.formats import Format
from passgraph.graph.draw_state import DrawState
from passgraph.graph.run_values import Value, values_by_name
from passgraph.graph.targets import DrawPass, InputSpec, PixelPass
from passgraph.language.builtin_name import BuiltinName
from passgraph.language.native import MATH, Math
from passgraph.language.parameter_name import ParameterName
from passgraph.language.types import Array
from passgraph.records import dataclass

if TYPE_CHECKING:
    from passgraph.language.facts import Facts
    from passgraph.language.scalar import ScalarProgram


@dataclass(frozen=True, slots=True)
class Options:
    """Optimizations, each of which can be switched off; results are bit-identical either way.

    ``math="native"`` does change results: functions such as ``exp`` and ``sin``, and bilinear filters, are the
    device's own, faster on most and less exact, and products in sums are rounded once (docs/native-math.md).  A kernel
    may choose for itself: ``kernel.with_math("native")``.
    """

    cull: bool = True
    fuse: bool = True
    order: bool = True  # reorder passes for least memory; off: as written
    alias: bool = True
    static: bool = True
    simplify: bool = True
    math: Math = "exact"

    def __post_init__(self) -> None:
        for name in self.__slots__:
            if name != "math":
                flag(getattr(self, name), f"options: {name}")
        one_of(self.math, "options: math", MATH)

    @classmethod
    def without(cls, *names: str) -> Options:
        """Return all optimizations but those named."""
        options = cls()
        for name in names:
            object.__setattr__(options, name, False)
        return options


@dataclass(frozen=True, slots=True)
class Resource:
    """A logical picture: an input, a target, or a target's content from an earlier run."""

    id: int
    name: str
    format: Format
    size: tuple[int, int]  # width, height
    kind: str  # "input", "buffer", "target" or "history"
    memory: int  # index into Plan.memories; several targets may share one
    persistent: bool = False  # keeps its content between runs
    #: For targets with history: the resource with last run's content; for that one, the run before, and so on.
    history: int | None = None
    #: For history: its content before the first write, numbers or a picture.
    initial: tuple[float, ...] | NDArray[np.float32] = field(default=(), compare=False)


@dataclass(frozen=True, slots=True)
class Memory:
    """A physical allocation."""

    format: Format
    size: tuple[int, int]

    @property
    def bytes(self) -> int:
        return self.format.bytes_per_pixel * self.size[0] * self.size[1]


@dataclass(frozen=True, eq=False, kw_only=True)
class BufferSpec(InputSpec):
    """The picture that stores a long array parameter (:mod:`passgraph.language.long_arrays`).

    ``value`` is the parameter's value; ``fields`` are the field names from it to the array.
    """

    value: object
    fields: tuple[str, ...]
    type: Array


@dataclass(frozen=True, eq=False)
class PixelStep:
    """A full-screen pass: ``program`` runs for every pixel of ``outputs``."""

    name: str
    program: ScalarProgram
    images: tuple[tuple[str, int], ...]  # image name → resource id, in the order of the program's images
    image_formats: tuple[Format, ...]
    outputs: tuple[int, ...]
    output_formats: tuple[Format, ...]
    size: tuple[int, int]
    values: Mapping[ParameterName, object]  # whole parameter → number, Value or Derived
    source: PixelPass
    facts: Facts
    fused: tuple[str, ...] = ()  # names of passes computed inside this one
    static: bool = False

    @property
    def work(self) -> str:
        """Describe the step in a few words."""
        return "pixels" + (f" with {', '.join(self.fused)}" if self.fused else "")

    @property
    def programs(self) -> tuple[ScalarProgram, ...]:
        """Return the programs, in the order of their images."""
        return (self.program,)

    @property
    def reads(self) -> tuple[int, ...]:
        return tuple(r for _, r in self.images)

    @property
    def writes(self) -> tuple[int, ...]:
        return self.outputs


@dataclass(frozen=True, eq=False)
class CountStep(PixelStep):
    """A count of the numbers 1 to ``bins`` in each row of an r32f picture, into an rgba32f one: four bins per pixel.

    ``program`` defines the result; see `passgraph.graph.reductions.count_rows`.
    """

    @property
    def bins(self) -> int:
        return 4 * self.size[0]


@dataclass(frozen=True, eq=False)
class DrawStep:
    """A draw.  ``vertex`` has two outputs: the clip-space position and the scalars named in ``varyings``."""

    name: str
    vertex: ScalarProgram
    fragment: ScalarProgram | None
    varyings: tuple[BuiltinName, ...]  # of the fragment's own pixel
    images: tuple[tuple[str, int], ...]  # of the vertex program, then of the fragment program, each in its order
    image_formats: tuple[Format, ...]
    outputs: tuple[int, ...]
    output_formats: tuple[Format, ...]
    clears: tuple[tuple[float, ...] | None, ...]  # for each output: clear to this, or None to draw over
    depth: int | None
    depth_clear: float | None  # None draws over it (stencil too)
    state: DrawState
    size: tuple[int, int]
    values: Mapping[ParameterName, object]
    source: DrawPass
    vertex_facts: Facts
    fragment_facts: Facts
    static: bool = False

    @property
    def work(self) -> str:
        return f"draws {len(self.source.geometry.triangles)} triangles"

    @property
    def programs(self) -> tuple[ScalarProgram, ...]:
        """Return the programs, in the order of their images."""
        return (self.vertex,) if self.fragment is None else (self.vertex, self.fragment)

    @property
    def blending(self) -> tuple[ScalarProgram | None, ...]:
        """Return the blend program of each output, see :func:`passgraph.plan.blending.blend_program` or None."""
        from passgraph.plan.blending import blend_program

        blends = self.state.blend or (None,) * len(self.outputs)
        return tuple(
            None if blend is None else blend_program(blend, format_)
            for blend, format_ in zip(blends, self.output_formats, strict=True)
        )

    @property
    def reads(self) -> tuple[int, ...]:
        over = [r for r, clear in zip(self.outputs, self.clears, strict=True) if clear is None]
        if self.depth is not None and self.depth_clear is None:
            over.append(self.depth)
        return (*(r for _, r in self.images), *over)

    @property
    def writes(self) -> tuple[int, ...]:
        return self.outputs if self.depth is None else (*self.outputs, self.depth)


@dataclass(frozen=True, eq=False)
class CopyStep:
    """Copies a resource into another of the same format and size."""

    name: str
    source_resource: int
    outputs: tuple[int, ...]
    size: tuple[int, int]
    static: bool = False
    values: Mapping[ParameterName, object] = field(default_factory=dict)
    programs: tuple[ScalarProgram, ...] = ()

    @property
    def work(self) -> str:
        return "copies"

    @property
    def reads(self) -> tuple[int, ...]:
        return (self.source_resource,)

    @property
    def writes(self) -> tuple[int, ...]:
        return self.outputs


Step: TypeAlias = PixelStep | DrawStep | CopyStep


def lifetimes(resources: Sequence[Resource], steps: Sequence[Step]) -> dict[int, tuple[int, int]]:
    """Return the first and last step (inclusive) that uses each resource."""
    spans: dict[int, tuple[int, int]] = {}
    for index, step in enumerate(steps):
        for resource in (*step.reads, *step.writes):
            first, _ = spans.get(resource, (index, index))
            spans[resource] = (first, index)
    return {r.id: (0, len(steps)) if r.persistent else spans.get(r.id, (0, 0)) for r in resources}


@dataclass(frozen=True, eq=False)
class Plan:
    """Steps in order, their pictures and allocations, and the planner's decisions (``notes``)."""

    steps: tuple[Step, ...]
    resources: tuple[Resource, ...]
    memories: tuple[Memory, ...]
    inputs: Mapping[str, int]  # input name → resource id
    outputs: Mapping[str, int]  # result name → resource id
    size: tuple[int, int]
    options: Options
    notes: tuple[str, ...] = ()
    static_inputs: frozenset[str] = frozenset()
    buffers: Mapping[int, BufferSpec] = field(default_factory=dict)  # resource id → its array parameter

    @cached_property
    def values(self) -> dict[str, Value]:
        """Return every run value that some step needs, by name."""
        return values_by_name(step.values for step in self.steps)

    @property
    def histories(self) -> list[tuple[int, int]]:
        """Return the resources with history, each with its content one run before.

        Contents move in this order at each run, so that none is overwritten before it has moved.
        """
        follows = {r.id: r.history for r in self.resources if r.history is not None}
        moves: list[tuple[int, int]] = []
        for start in follows.keys() - set(follows.values()):
            contents = [start]
            while contents[-1] in follows:
                contents.append(follows[contents[-1]])
            moves += reversed(list(pairwise(contents)))
        return moves

    @property
    def lifetimes(self) -> dict[int, tuple[int, int]]:
        """Return the first and last step (inclusive) that uses each resource, by id."""
        return lifetimes(self.resources, self.steps)

    @property
    def bytes(self) -> int:
        """Return the memory of all targets in bytes."""
        return sum(memory.bytes for memory in self.memories)

    @property
    def bytes_unaliased(self) -> int:
        """Return the bytes without aliasing: an allocation of its own for each picture."""
        return sum(Memory(r.format, r.size).bytes for r in self.resources)

    def explain(self) -> str:
        """Explain the order of steps, and what was culled, fused or aliased, and why."""
        from passgraph.plan.explain import explain

        return explain(self)

    def svg(self) -> str:
        """Return the plan as a drawing: steps from top to bottom, with pictures and their lifetimes next to them."""
        from passgraph.plan.explain import svg

        return svg(self)

    def _repr_mimebundle_(self, **_: object) -> dict[str, str]:
        """Show the steps in a notebook, with their reads and writes, notes, and the diagram of lifetimes."""
        from passgraph import notebook

        names = {resource.id: resource.name for resource in self.resources}
        rows = [
            (
                number, step.name, ", ".join(dict.fromkeys(names[r] for r in step.reads)),
                ", ".join(names[r] for r in step.writes), f"{step.size[0]}x{step.size[1]}", step.work,
            )
            for number, step in enumerate(self.steps, 1)
        ]  # fmt: skip
        notes = "".join(f"<li>{escape(note)}</li>" for note in self.notes)
        steps = notebook.table(("", "pass", "reads", "writes", "size", "work"), rows)
        memory = f"<p>{self.bytes / 2**20:.1f} MiB in {len(self.memories)} pictures</p>"
        listed = f"<ul>{notes}</ul>" if notes else ""
        svg = self.svg()
        return notebook.bundle(self.explain(), f"{steps}{memory}{listed}{svg}", svg)
