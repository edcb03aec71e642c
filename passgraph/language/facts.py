"""Compile-time facts of a kernel, and state shared with the kernels fused into it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field, replace

from passgraph.formats import Store
from passgraph.language import ir
from passgraph.language import scalar as s
from passgraph.language.border_rules import BORDERS
from passgraph.language.emitter import Emitter
from passgraph.language.native import Accuracy
from passgraph.language.parameter_name import ParameterName
from passgraph.language.source import Span
from passgraph.language.types import BOOL, INT, Array, Scalar, Type, component_count, element_of
from passgraph.ranges import Range
from passgraph.records import dataclass

#: Properties of an image that kernels can read (``image.levels``), and their types.
PROPERTIES: dict[str, Scalar] = {"is_nearest": BOOL, "is_blank": BOOL, "border": INT, "levels": INT, "slices": INT,
                                "bits": INT}  # fmt: skip


@dataclass(frozen=True)
class ImageFacts:
    """Compile-time facts of an image that a kernel reads."""

    channels: int = 4
    border: str = "clamp"
    decode: str | None = None  # prelude function for r, g and b of each texel, such as decode_srgb
    fused: Fused | None = None
    size: tuple[int, int] | None = None  # known size; None if it is set at each run
    filter: str = "linear"
    levels: int = 1  # number of mipmap levels, including itself
    slices: int = 1  # number of slices of a volume, stored one below another
    bits: int = 0  # bits of a channel, if a device may filter in hardware
    by_device: bool = False  # True if it does

    def property(self, name: str) -> ir.Number:
        """Return one of :data:`PROPERTIES`."""
        if name == "is_nearest":
            return self.filter == "nearest"
        if name == "is_blank":
            return BORDERS[self.border].blank
        if name == "border":
            return list(BORDERS).index(self.border)
        return {"levels": self.levels, "slices": self.slices, "bits": self.bits}[name]


@dataclass(frozen=True)
class Facts:
    """Compile-time facts of a kernel."""

    constants: Mapping[str, object] = field(default_factory=dict)
    images: Mapping[str, ImageFacts] = field(default_factory=dict)
    #: For each result: operations on its color channels and its alpha before they are stored.
    stores: tuple[tuple[tuple[Store, ...], tuple[Store, ...]], ...] = ()
    simplify: bool = True
    size: tuple[int, int] | None = None  # size of the output; as for images
    native: Mapping[str, Accuracy] = field(default_factory=dict)  # functions that the device itself computes
    contracts: bool = False  # True if a product and a sum may be rounded once


@dataclass(frozen=True)
class Fused:
    """A producer computed inside its consumer, which numbers its producers."""

    program: ir.TypedKernel
    facts: Facts
    producer: int
    output: int


def fused_in(facts: Facts) -> list[Fused]:
    """Return the kernels that are computed in place of images."""
    return [image.fused for image in facts.images.values() if image.fused is not None]


def inner_first(facts: Facts) -> list[Facts]:
    """Return these facts and those of everything fused inside, each once, inner ones first; without recursion."""
    ordered: dict[int, Facts] = {}
    pending = [facts]
    while pending:
        top = pending[-1]
        inner = [fused.facts for fused in fused_in(top) if id(fused.facts) not in ordered]
        if inner:
            pending += inner
        else:
            ordered[id(pending.pop())] = top
    return list(ordered.values())


class Shared:
    """State shared by a kernel and everything fused into it."""

    def __init__(self, emitter: Emitter, by_table: bool = False) -> None:
        self.emitter = emitter
        self.by_table = by_table  # texels are decoded by a table, which is shorter and mostly slower than computing
        self.slots: dict[ParameterName, s.UniformSlot] = {}
        self.uses: dict[str, s.ImageUse] = {}
        self.buffers: dict[str, tuple[ParameterName, Array]] = {}
        self.counts = {"float": 0, "int": 0}
        self.fused: dict[int, list[list[s.Operand]]] = {}
        self.sources: list[Span] = []
        self.unrolled = 0  # instructions from unrolled loops so far

    def slot(self, name: ParameterName, type_: Type, range_: Range | None) -> s.UniformSlot:
        if name not in self.slots:
            block = "float" if element_of(type_).name == "float" else "int"
            count = component_count(type_)
            self.slots[name] = s.UniformSlot(name, type_, block, self.counts[block], count, range_)
            self.counts[block] += count
        return self.slots[name]

    def finish(
        self,
        program: ir.TypedKernel,
        body: tuple[s.Instruction, ...],
        outputs: tuple[s.Output, ...],
        keep: s.Operand | None,
    ) -> s.ScalarProgram:
        used = list(s.walk(body))
        names = {i.variable for i in used if isinstance(i, (s.Read, s.Write))}
        arrays = {i.array for i in used if isinstance(i, (s.ReadAt, s.WriteAt))}
        tables = {i.table for i in used if isinstance(i, s.LoadTable)}
        builtins = {i.name for i in used if isinstance(i, s.LoadBuiltin)}
        read = {i.image for i in used if isinstance(i, s.LoadTexel)}
        read |= {builtin.of for builtin in builtins if builtin.kind == "size"}
        return s.ScalarProgram(
            program.name,
            program.stage,
            body,
            outputs,
            keep,
            tuple((n, t) for n, t in self.emitter.variables.items() if n in names),
            tuple(self.slots.values()),
            tuple((n, t, v) for n, (t, v) in self.emitter.tables.items() if n in tables),
            tuple(self._live_use(use, used) for use in self.uses.values() if use.name in read),
            tuple((n, t) for n, t in self.emitter.builtins.items() if n in builtins),
            (program.source, *self.sources),
            tuple((n, t, length) for n, (t, length) in self.emitter.arrays.items() if n in arrays),
            tuple((n, *part) for n, part in self.buffers.items() if n in read),
        )

    def _live_use(self, use: s.ImageUse, used: list[s.Instruction]) -> s.ImageUse:
        """Return an image's footprint after dead code elimination."""
        live = s.ImageUse(use.name, use.channels)
        for i in used:
            if not (isinstance(i, s.LoadTexel) and i.image == use.name):
                continue
            x, y = self.emitter.range_of(i.x), self.emitter.range_of(i.y)
            if i.relative and x is not None and y is not None:
                live = live.reaching(x, y)
            else:
                live = replace(live, absolute=True)
        return live
