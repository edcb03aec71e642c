"""Drop passes and targets that no output needs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TypeVar

from passgraph.graph.targets import DrawPass, Pass, PixelPass, Target
from passgraph.language.ir import TypedKernel
from passgraph.language.kernel import Kernel
from passgraph.language.lower_cache import LoweredPrograms, lower_once
from passgraph.plan.draft import Draft, Lowered, LoweredDraw, LoweredPixels
from passgraph.plan.specialize import link, varyings_of


def cull(draft: Draft) -> Draft:
    """Keep the passes that an output or history still needs once unused images are known."""
    if not draft.options.cull:
        return draft
    needed: set[Pass] = set()
    still_read: set[object] = set()
    pending = [t.made_by for t in draft.outputs.values() if t.made_by is not None]
    while pending:
        node = pending.pop()
        if node in needed:
            continue
        needed.add(node)
        lowered = draft.passes[node]
        # History that is read must be written in this run.
        history = [t.spec for t in lowered.images.values() if t.is_previous]
        still_read.update(history)
        needs = [*lowered.reads, *(draft.final[s] for s in history)]  # type: ignore[index]
        pending += [t.made_by for t in needs if t.made_by is not None]
    left_out = (node.name for node in draft.passes if node not in needed)
    return replace(
        draft,
        passes={node: lowered for node, lowered in draft.passes.items() if node in needed},
        final={spec: target for spec, target in draft.final.items() if spec in still_read},
        notes=(*draft.notes, *(f"left out pass {n}: nothing that reaches an output reads it" for n in left_out)),
    )


T = TypeVar("T")


def trim(draft: Draft) -> Draft:
    """Drop unused targets of passes; return the draft itself if there are none.  Passes that lose one may read less."""
    if not draft.options.cull:
        return draft
    live = _live(draft)
    # A pass without live targets is drawn over unread, and is dropped once the draws over it are trimmed.
    makers = {target.made_by for target in live}
    changed: dict[Pass, Lowered] = {}
    notes: list[str] = []
    for node, lowered in [row for row in draft.passes.items() if row[0] in makers]:
        dead = [target for target in lowered.colours if target not in live]
        live_slots = _kept(lowered, dead)
        if len(live_slots) < len(lowered.slots):
            names = ", ".join(target.name for target in dead)
            notes.append(f"left out {names} of pass {lowered.name}: nothing that reaches an output reads it")
            changed[node] = _with_targets(lowered, live_slots, draft.programs)
    if not changed:
        return draft
    return replace(draft, passes={**draft.passes, **changed}, notes=(*draft.notes, *notes))


def _live(draft: Draft) -> set[Target]:
    """Return the contents that an output or the next run needs, each target of a pass separately."""
    live: set[Target] = set()
    seen: set[Pass] = set()
    pending = [target.content for target in draft.roots()]
    while pending:
        target = pending.pop()
        lowered = draft.passes.get(target.made_by) if target.made_by is not None else None
        if lowered is None or target in live:
            continue
        live.add(target)
        pass_ = lowered.done
        if lowered.node not in seen:
            seen.add(lowered.node)
            pending += [image.content for image in lowered.images.values() if not image.is_previous]
            if isinstance(pass_, DrawPass) and pass_.depth_load is not None:
                pending.append(pass_.depth_load.content)  # its tests read it
        if isinstance(pass_, DrawPass) and target.slot in lowered.slots:
            over = pass_.loads[lowered.slots.index(target.slot)]
            pending += [] if over is None else [over.content]
    return live


def _kept(lowered: Lowered, dead: Sequence[Target]) -> list[int]:
    """Return the color targets that stay, by number."""
    live_slots = [number for number, target in enumerate(lowered.colours) if target not in dead]
    # Without color targets there is no fragment program, which may be what discards depth.
    discards = any(program.keep is not None for program in lowered.programs)
    return live_slots or ([0] if discards else [])


def _with_targets(lowered: Lowered, slots: Sequence[int], known: LoweredPrograms) -> Lowered:
    """Return a pass that is lowered again with some of its color targets."""
    facts = replace(lowered.facts, stores=_chosen(lowered.facts.stores, slots))
    lowered = replace(lowered, facts=facts, slots=_chosen(lowered.slots, slots))
    if isinstance(lowered, LoweredDraw):
        lowered = _draw_with(lowered, slots, known)
    elif isinstance(lowered, LoweredPixels):
        lowered = _pixels_with(lowered, slots, known)
    read = {use.name for program in lowered.programs for use in program.images}
    return replace(lowered, images={name: target for name, target in lowered.images.items() if name in read})


def _pixels_with(lowered: LoweredPixels, slots: Sequence[int], known: LoweredPrograms) -> LoweredPixels:
    node = lowered.done
    assert isinstance(node, PixelPass)
    kernel = Kernel.of_program(_with_results(node.kernel.program, slots))
    done = replace(node, kernel=kernel, into=_chosen(node.into, slots))
    return replace(lowered, done=done, program=lower_once(kernel.program, lowered.facts, known))


def _draw_with(lowered: LoweredDraw, slots: Sequence[int], known: LoweredPrograms) -> LoweredDraw:
    drawn = lowered.done
    assert isinstance(drawn, DrawPass)
    state = replace(
        drawn.state, blend=_chosen(drawn.state.blend, slots), color_mask=_chosen(drawn.state.color_mask, slots)
    )
    kernel = None
    if drawn.fragment is not None and slots:
        kernel = Kernel.of_program(_with_results(drawn.fragment.program, slots))
    fragment = None if kernel is None else lower_once(kernel.program, lowered.facts, known)
    varyings = varyings_of(fragment)
    vertex = link(lower_once(drawn.vertex.program, lowered.vertex_facts, known), varyings)
    into, loads = _chosen(drawn.into, slots), _chosen(drawn.loads, slots)
    done = replace(drawn, fragment=kernel, into=into, loads=loads, state=state)
    return replace(lowered, done=done, vertex=vertex, fragment=fragment, varyings=varyings)


def _with_results(program: TypedKernel, slots: Sequence[int]) -> TypedKernel:
    """Return the same kernel with some of its results."""
    return replace(program, results=_chosen(program.results, slots))


def _chosen(parts: Sequence[T], slots: Sequence[int]) -> tuple[T, ...]:
    """Return the parts of the targets that stay."""
    return tuple(parts[number] for number in slots) if parts else ()
