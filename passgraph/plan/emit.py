"""Last phase: resources, lifetimes, shared memory, static steps, and the steps themselves."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from heapq import heappop, heappush
from itertools import pairwise

from passgraph.formats import FORMATS, Format
from passgraph.graph.run_values import Derived, Value
from passgraph.graph.targets import MOST_BINS, CountPass, DrawPass, InputSpec, Pass, PixelPass, Target, TargetSpec
from passgraph.plan.data import (
    BufferSpec,
    CopyStep,
    CountStep,
    DrawStep,
    Memory,
    PixelStep,
    Plan,
    Resource,
    Step,
    lifetimes,
)
from passgraph.plan.draft import Draft, Lowered, LoweredDraw, LoweredPixels
from passgraph.plan.order import Copies

#: Most sharers of an allocation named in a note.
MAX_NAMED = 16
#: Formats of the pictures that a `CountStep` reads and writes.
_COUNTING = (FORMATS["r32f"],), (FORMATS["rgba32f"],)


class Resources:
    """Resources by content; a draw over a content shares its resource."""

    def __init__(self, draft: Draft) -> None:
        self.draft = draft
        self.list: list[Resource] = []
        self.by_content: dict[Target, int] = {}

    def _add(self, target: Target) -> int:
        kind = "history" if target.is_previous else "target"
        if isinstance(target.spec, InputSpec):
            kind = "buffer" if isinstance(target.spec, BufferSpec) else "input"
        initial = target.spec.initial if isinstance(target.spec, TargetSpec) else ()
        format_, size = self.draft.format_of(target), self.draft.size_of(target)
        self.list.append(
            Resource(len(self.list), f"{target.when}{target.name}", format_, size, kind, -1, initial=initial)
        )
        return len(self.list) - 1

    def formats(self, numbers: Iterable[int]) -> tuple[Format, ...]:
        return tuple(self.list[number].format for number in numbers)

    def number_of(self, target: Target) -> int:
        content = target.content
        if content not in self.by_content:
            self.by_content[content] = self._add(content)
        return self.by_content[content]

    def histories(self) -> dict[int, int]:
        """Map the contents of each target with history to the content of one run before, as far back as one is read."""
        deepest = dict.fromkeys(self.draft.final, 1)
        for lowered in self.draft.passes.values():
            for image in lowered.images.values():
                if image.is_previous and isinstance(image.spec, TargetSpec):
                    deepest[image.spec] = max(deepest[image.spec], image.frames_ago)
        histories: dict[int, int] = {}
        for spec, target in self.draft.final.items():
            earlier = (Target(spec, frames_ago=number) for number in range(1, deepest[spec] + 1))
            histories |= {self.number_of(now): self.number_of(before) for now, before in pairwise((target, *earlier))}
        return histories


def emit(draft: Draft, sequence: tuple[list[Pass], Copies]) -> Plan:
    """Return the plan that runs the passes of a draft in this order."""
    order, copies = sequence
    resources = Resources(draft)
    steps: list[Step] = []
    notes = list(draft.notes)
    for node in order:
        _share_pictures(draft.passes[node], resources, copies, steps, notes)
        steps.append(_step(draft.passes[node], resources))
    outputs = {name: resources.number_of(target) for name, target in draft.outputs.items()}
    read = {spec: resources.number_of(Target(spec)) for spec in draft.inputs if Target(spec) in resources.by_content}
    buffers = {resource: spec for spec, resource in read.items() if isinstance(spec, BufferSpec)}
    inputs = {spec.name: resource for spec, resource in read.items() if resource not in buffers}
    before = resources.histories()
    static_inputs = frozenset(s.name for s in draft.inputs if s.static and not isinstance(s, BufferSpec))
    if draft.options.static:
        steps = _mark_static(steps, resources.list, set(before), static_inputs)
    runs_once = [step for step in steps if step.static]
    notes += [f"pass {step.name} depends on static inputs only: runs once" for step in runs_once]
    static = {resource for step in runs_once for resource in step.writes}
    persistent = {*outputs.values(), *before, *before.values(), *read.values(), *_handed_on(steps, static)}
    listed = [replace(r, persistent=r.id in persistent, history=before.get(r.id)) for r in resources.list]
    listed, memories = _memories(listed, steps, draft.options.alias, notes)
    return Plan(
        tuple(steps),
        tuple(listed),
        tuple(memories),
        inputs,
        outputs,
        draft.size,
        draft.options,
        tuple(notes),
        static_inputs,
        buffers,
    )


def _share_pictures(
    lowered: Lowered, resources: Resources, copies: Copies, steps: list[Step], notes: list[str]
) -> None:
    """Let a draw write over its target's picture, or over a copy if the old content is still needed."""
    node = lowered.node
    for new, load in _loads(lowered):
        if load is None:
            continue
        old = resources.number_of(load)
        if (load.content, node) in copies:
            fresh = resources.number_of(new)
            notes.append(f"copied {load.name} before {lowered.name} draws over it: its content is still needed")
            steps.append(CopyStep(f"copy {load.name}", old, (fresh,), resources.list[old].size))
        else:
            resources.by_content[new] = old


def _loads(lowered: Lowered) -> list[tuple[Target, Target | None]]:
    """Return pairs of what a draw makes and what it draws over."""
    pass_ = lowered.done
    if not isinstance(pass_, DrawPass):
        return []
    rows = list(zip(lowered.colours, pass_.loads, strict=True))
    if pass_.depth is not None:
        rows.append((Target(pass_.depth, lowered.node, -1), pass_.depth_load))
    return rows


def _step(low: Lowered, resources: Resources) -> Step:
    names = [use.name for program in low.programs for use in program.images]
    images = tuple((name, resources.number_of(low.images[name])) for name in names)
    outputs = tuple(map(resources.number_of, low.colours))
    pass_ = low.done
    if isinstance(low, LoweredPixels):
        assert isinstance(pass_, PixelPass)
        formats = resources.formats(r for _, r in images), resources.formats(outputs)
        # A count of other formats, or of more bins, runs its kernel.
        is_count = isinstance(pass_, CountPass) and formats == _COUNTING and 4 * low.size[0] <= MOST_BINS
        return (CountStep if is_count else PixelStep)(
            low.name, low.program, images, formats[0], outputs, formats[1], low.size, low.values, pass_, low.facts,
            low.fused,
        )  # fmt: skip
    assert isinstance(low, LoweredDraw) and isinstance(pass_, DrawPass)
    depth = None if pass_.depth is None else resources.number_of(Target(pass_.depth, low.node, -1))
    return DrawStep(
        low.name, low.vertex, low.fragment, low.varyings,
        images, resources.formats(r for _, r in images), outputs, resources.formats(outputs),
        tuple(_clear(spec) if load is None else None for spec, load in zip(pass_.into, pass_.loads, strict=True)),
        depth,
        None if pass_.depth is None or pass_.depth_load is not None else _depth_clear(pass_.depth),
        pass_.state, low.size, low.values, pass_, low.vertex_facts, low.facts,
    )  # fmt: skip


def _clear(spec: TargetSpec) -> tuple[float, ...]:
    values = spec.clear or (0.0,)
    return values * spec.format.channels if len(values) == 1 else values


def _depth_clear(spec: TargetSpec) -> float:
    return spec.clear[0] if spec.clear else 1.0


def _mark_static(
    steps: list[Step], resources: list[Resource], with_history: set[int], static_inputs: frozenset[str]
) -> list[Step]:
    """Mark the steps that run once: every source is static.

    A resource is not static if another step also writes it, or if a step of every run reads it before its last write:
    from the second run on, that step would read the final content.
    """
    # History changes its allocation at each run, so it must be written at each run.
    changing = with_history | {r.id for r in resources if r.kind == "history"}
    changing |= {r.id for r in resources if r.kind == "input" and r.name not in static_inputs}
    for step in steps:
        if any(isinstance(v, (Value, Derived)) and not v.static for v in step.values.values()):
            changing.update(step.writes)
    changing = _spread(changing, steps)
    while overwritten := _read_before_last_write(changing, steps):
        changing = _spread(changing | overwritten, steps)
    return [replace(step, static=not any(r in changing for r in step.writes)) for step in steps]


def _read_before_last_write(changing: set[int], steps: list[Step]) -> set[int]:
    """Return resources outside ``changing`` that a step of every run reads before their last write."""
    last_write = {r: index for index, step in enumerate(steps) for r in step.writes}
    return {
        r
        for index, step in enumerate(steps)
        if any(written in changing for written in step.writes)
        for r in step.reads
        if r not in changing and last_write.get(r, -1) > index
    }


def _spread(changing: set[int], steps: list[Step]) -> set[int]:
    """Return the pictures that change: those given, and all that steps write that read or write one of them."""
    touching: dict[int, list[Step]] = {}
    for step in steps:
        for resource in (*step.reads, *step.writes):
            touching.setdefault(resource, []).append(step)
    reached, pending = set(changing), list(changing)
    while pending:
        for step in touching.pop(pending.pop(), ()):
            fresh = [r for r in step.writes if r not in reached]
            reached.update(fresh)
            pending += fresh
    return reached


def _handed_on(steps: list[Step], static: set[int]) -> set[int]:
    """Return the static pictures that must outlive the run: a step of every run reads them."""
    return {r for step in steps if not step.static for r in step.reads if r in static}


@dataclass
class _Shared:
    """Allocations of one format and size, for static steps or for those of every run."""

    busy: list[tuple[int, int]] = field(default_factory=list)  # heap: last step that needs it, index
    free: list[int] = field(default_factory=list)  # heap of indices

    def taken(self, first: int) -> int | None:
        """Return the first allocation that is free from step ``first`` on; steps must come in order."""
        while self.busy and self.busy[0][0] < first:
            heappush(self.free, heappop(self.busy)[1])
        return heappop(self.free) if self.free else None


def _memories(
    resources: list[Resource], steps: list[Step], alias: bool, notes: list[str]
) -> tuple[list[Resource], list[Memory]]:
    """Assign allocations: targets of one format and size share one if their lifetimes are disjoint."""
    spans = lifetimes(resources, steps)
    static_only = {r for step in steps if step.static for r in step.writes}
    memories: list[Memory] = []
    occupants: list[list[str]] = []
    # A static step must not overwrite a picture of every run, nor the other way round.
    groups: dict[tuple[Memory, bool], _Shared] = {}
    placed: list[Resource] = []
    for resource in sorted(resources, key=lambda r: (spans[r.id][0], r.id)):
        memory = Memory(resource.format, resource.size)
        group = groups.setdefault((memory, resource.id in static_only), _Shared())
        shareable = alias and not resource.persistent
        slot = group.taken(spans[resource.id][0]) if shareable else None
        if slot is None:
            slot = len(memories)
            memories.append(memory)
            occupants.append([])
        else:
            notes.append(f"target {resource.name} shares the memory of {_named(occupants[slot])}")
        if shareable:
            heappush(group.busy, (spans[resource.id][1], slot))
        occupants[slot].append(resource.name)
        placed.append(replace(resource, memory=slot))
    return sorted(placed, key=lambda r: r.id), memories


def _named(occupants: list[str]) -> str:
    """Name the sharers of an allocation; of many, only the last ones."""
    more = len(occupants) - MAX_NAMED
    listed = ", ".join(occupants[-MAX_NAMED:]) + (f" and {more} more" if more > 0 else "")
    return f"{listed}: never alive together"
