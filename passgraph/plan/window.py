"""A plan for one window of its picture: the same passes on fewer pixels, with the results of the whole.

Kernels ask where they are and how large pictures are; in a window the answers are those of the whole picture, so the
scalar programs are rewritten: ``pixel()`` becomes the window's origin and the pixel within it, a size that of the
whole.  Both come as a parameter, so one compiled program serves every window of one shape, whatever the picture.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable
from dataclasses import replace
from itertools import chain

from passgraph.errors import GraphError
from passgraph.graph.values import Value
from passgraph.language import scalar as s
from passgraph.language.types import IVEC4
from passgraph.plan.data import PixelStep, Plan, Step
from passgraph.plan.footprint import Footprint

#: Where the window lies and how large the picture is: (x, y, width, height), in pixels.  No kernel has a parameter of
#: this name: it is no identifier.
WINDOW = Value("tile window", tuple)


def window_plan(plan: Plan, footprint: Footprint, size: tuple[int, int]) -> Plan:
    """The plan of a window of so many (width, height) pixels; :data:`WINDOW` tells each run where it lies.

    ``plan`` is that of the whole picture, made without static passes; it is never run.

    Raises
    ------
    GraphError
        Where a run value has the name of :data:`WINDOW`.
    """
    if WINDOW.name in plan.values:
        raise GraphError(
            f"{WINDOW.name!r} is the name of the value that tells tiles where they are; give your value another one"
        )
    inside = [r for r in plan.resources if r.id not in footprint.whole]
    held = {r.memory for r in inside}
    resources = tuple(r if r.id in footprint.whole else replace(r, size=size) for r in plan.resources)
    memories = tuple(replace(m, size=size) if n in held else m for n, m in enumerate(plan.memories))
    names = {r.id for r in inside}
    steps = tuple(_step(step, plan, names, size) for step in plan.steps)
    return replace(plan, steps=steps, resources=resources, memories=memories, size=size)


def _step(step: Step, plan: Plan, inside: Collection[int], size: tuple[int, int]) -> Step:
    assert isinstance(step, PixelStep)
    if not set(step.outputs) <= set(inside):
        return step
    program = placed(step.program, [name for name, resource in step.images if resource in inside])
    values = step.values if program is step.program else {**step.values, WINDOW.name: WINDOW}
    return replace(step, program=program, values=values, size=size)


def placed(program: s.ScalarProgram, inside: Iterable[str]) -> s.ScalarProgram:
    """The program of a window; ``inside`` are the images of which it has a window too."""
    sizes = {"output_size": 2, **{f"size.{name}": 2 for name in inside}}
    entries = {f"{name}.{axis}": first + axis for name, first in {"pixel": 0, **sizes}.items() for axis in (0, 1)}
    if not any(name in entries for name, _ in program.builtins):
        return program
    slot = s.UniformSlot(WINDOW.name, IVEC4, "int", program.int_count, 4)
    body = _Rewriting(program, {name: s.Lit("int", slot.offset + entry) for name, entry in entries.items()})
    builtins = tuple((name, type_) for name, type_ in program.builtins if name.rpartition(".")[0] not in sizes)
    return replace(program, body=body.block(program.body), uniforms=(*program.uniforms, slot), builtins=builtins)


class _Rewriting:
    """Instructions with builtins taken from the parameter."""

    def __init__(self, program: s.ScalarProgram, entries: dict[str, s.Lit]) -> None:
        self.entries = entries
        walked = list(s.walk(program.body))
        results = chain.from_iterable(s.results_of(i) for i in walked)
        indices = (i.index for i in walked if isinstance(i, s.For))
        self.last = max((value.id for value in chain(results, indices)), default=0)

    def block(self, body: tuple[s.Instruction, ...]) -> tuple[s.Instruction, ...]:
        made: list[s.Instruction] = []
        for i in body:
            if isinstance(i, s.LoadBuiltin) and i.name in self.entries:
                made += self._load(i)
            elif isinstance(i, s.If):
                made.append(s.If(i.condition, self.block(i.then), self.block(i.orelse)))
            elif isinstance(i, s.For):
                made.append(replace(i, body=self.block(i.body)))
            else:
                made.append(i)
        return tuple(made)

    def _load(self, i: s.LoadBuiltin) -> list[s.Instruction]:
        if not i.name.startswith("pixel."):
            return [s.LoadUniform(i.to, "int", self.entries[i.name])]
        here, origin = self._fresh(), self._fresh()
        return [
            s.LoadBuiltin(here, i.name),
            s.LoadUniform(origin, "int", self.entries[i.name]),
            s.Op(i.to, "add", "int", (here, origin)),
        ]

    def _fresh(self) -> s.Val:
        self.last += 1
        return s.Val("int", self.last)
