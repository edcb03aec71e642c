"""Drops targets of draws that nobody reads: their memory, their attachment, and what only they are computed for."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TypeVar

from passgraph.graph.targets import DrawPass, Pass, Target
from passgraph.language.ir import TypedKernel
from passgraph.language.kernel import Kernel
from passgraph.language.lower_cache import lower_once
from passgraph.plan.specialise import link, varyings_of
from passgraph.plan.work import Lowered, Work

T = TypeVar("T")


def trim(work: Work) -> bool:
    """True where a draw was left with fewer targets, and so may read less."""
    if not work.options.cull:
        return False
    live = _live(work)
    found = False
    for lowered in work.passes.values():
        if isinstance(lowered.done, DrawPass):
            dead = [target for target in lowered.colours if target not in live]
            kept = _kept(lowered, dead)
            if len(kept) < len(lowered.slots):
                names = ", ".join(target.name for target in dead)
                work.notes.append(f"left out {names} of pass {lowered.name}: nothing that reaches an output reads it")
                _leave(lowered, lowered.done, kept, work)
                found = True
    return found


def _live(work: Work) -> set[Target]:
    """Contents that an output or the next run needs, each target of a draw by itself."""
    live: set[Target] = set()
    seen: set[Pass] = set()
    pending = [target.content for target in work.roots()]
    while pending:
        target = pending.pop()
        lowered = work.passes.get(target.made_by) if target.made_by is not None else None
        if lowered is None or target in live:
            continue
        live.add(target)
        done = lowered.done
        if lowered.node not in seen:
            seen.add(lowered.node)
            pending += [image.content for image in lowered.images.values() if not image.is_previous]
            if isinstance(done, DrawPass) and done.depth_load is not None:
                pending.append(done.depth_load.content)  # its tests read it
        if isinstance(done, DrawPass) and target.slot in lowered.slots:
            over = done.loads[lowered.slots.index(target.slot)]
            pending += [] if over is None else [over.content]
    return live


def _kept(lowered: Lowered, dead: Sequence[Target]) -> list[int]:
    """Which of its colour targets stay, counted among those that it has."""
    kept = [number for number, target in enumerate(lowered.colours) if target not in dead]
    # Without any there is no fragment program, which may be what says where depth is not written.
    discards = lowered.fragment is not None and lowered.fragment.keep is not None
    return kept or ([0] if discards else [])


def _leave(lowered: Lowered, drawn: DrawPass, kept: Sequence[int], work: Work) -> None:
    """Lower a draw anew with these of its colour targets."""
    state = replace(
        drawn.state, blend=_chosen(drawn.state.blend, kept), color_mask=_chosen(drawn.state.color_mask, kept)
    )
    fragment = None
    if drawn.fragment is not None and kept:
        fragment = Kernel.of_program(_with_results(drawn.fragment.program, kept))
    lowered.facts = replace(lowered.facts, stores=_chosen(lowered.facts.stores, kept))
    lowered.trimmed = replace(
        drawn, fragment=fragment, into=_chosen(drawn.into, kept), loads=_chosen(drawn.loads, kept), state=state
    )
    lowered.slots = _chosen(lowered.slots, kept)
    lowered.fragment = None if fragment is None else lower_once(fragment.program, lowered.facts, work.programs)
    lowered.varyings = varyings_of(lowered.fragment)
    vertex = lower_once(drawn.vertex.program, lowered.vertex_facts, work.programs)
    lowered.vertex = link(vertex, lowered.varyings)
    read = {use.name for made in (lowered.vertex, lowered.fragment) if made is not None for use in made.images}
    lowered.images = {name: target for name, target in lowered.images.items() if name in read}


def _with_results(program: TypedKernel, kept: Sequence[int]) -> TypedKernel:
    """The same kernel with some of its results; what is kept of lowered programs tells it from the whole."""
    digest = program.digest and f"{program.digest} {' '.join(map(str, kept))} of {len(program.results)}"
    return replace(program, results=_chosen(program.results, kept), digest=digest)


def _chosen(parts: Sequence[T], kept: Sequence[int]) -> tuple[T, ...]:
    """Those of each target's parts; none where they stand for none."""
    return tuple(parts[number] for number in kept) if parts else ()
