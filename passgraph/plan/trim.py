"""Drop passes and targets that no output needs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TypeVar

from passgraph.graph.targets import DrawPass, Pass, PixelPass, Target
from passgraph.language.ir import TypedKernel
from passgraph.language.kernel import Kernel
from passgraph.language.lower_cache import lower_once
from passgraph.plan.specialize import link, varyings_of
from passgraph.plan.work import Lowered, Work


def cull(work: Work) -> None:
    """Keep the passes that an output or history still needs once unused images are known."""
    if not work.options.cull:
        return
    needed: set[Pass] = set()
    still_read: set[object] = set()
    pending = [t.made_by for t in work.outputs.values() if t.made_by is not None]
    while pending:
        node = pending.pop()
        if node in needed:
            continue
        needed.add(node)
        lowered = work.passes[node]
        # History that is read must be written in this run.
        history = [t.spec for t in lowered.images.values() if t.is_previous]
        still_read.update(history)
        needs = [*lowered.reads, *(work.final[s] for s in history)]  # type: ignore[index]
        pending += [t.made_by for t in needs if t.made_by is not None]
    for node in [n for n in work.passes if n not in needed]:
        work.notes.append(f"left out pass {node.name}: nothing that reaches an output reads it")
        del work.passes[node]
    for spec in [s for s in work.final if s not in still_read]:
        del work.final[spec]


T = TypeVar("T")


def trim(work: Work) -> bool:
    """Drop unused targets of passes; return True if a pass lost one, and so may read less."""
    if not work.options.cull:
        return False
    live = _live(work)
    # A pass without live targets is drawn over unread, and is dropped once the draws over it are trimmed.
    makers = {target.made_by for target in live}
    changed = False
    for lowered in (lowered for node, lowered in work.passes.items() if node in makers):
        dead = [target for target in lowered.colours if target not in live]
        live_slots = _kept(lowered, dead)
        if len(live_slots) < len(lowered.slots):
            names = ", ".join(target.name for target in dead)
            work.notes.append(f"left out {names} of pass {lowered.name}: nothing that reaches an output reads it")
            _keep_targets(lowered, live_slots, work)
            changed = True
    return changed


def _live(work: Work) -> set[Target]:
    """Return the contents that an output or the next run needs, each target of a pass separately."""
    live: set[Target] = set()
    seen: set[Pass] = set()
    pending = [target.content for target in work.roots()]
    while pending:
        target = pending.pop()
        lowered = work.passes.get(target.made_by) if target.made_by is not None else None
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
    discards = lowered.fragment is not None and lowered.fragment.keep is not None
    return live_slots or ([0] if discards else [])


def _keep_targets(lowered: Lowered, slots: Sequence[int], work: Work) -> None:
    """Lower a pass again with some of its color targets."""
    lowered.facts = replace(lowered.facts, stores=_chosen(lowered.facts.stores, slots))
    if isinstance(lowered.done, DrawPass):
        lowered.trimmed = _draw_with(lowered, lowered.done, slots, work)
    else:
        lowered.trimmed = _pixels_with(lowered, lowered.done, slots, work)
    lowered.slots = _chosen(lowered.slots, slots)
    programs = (lowered.program, lowered.vertex, lowered.fragment)
    read = {use.name for program in programs if program is not None for use in program.images}
    lowered.images = {name: target for name, target in lowered.images.items() if name in read}


def _pixels_with(lowered: Lowered, node: PixelPass, slots: Sequence[int], work: Work) -> PixelPass:
    kernel = Kernel.of_program(_with_results(node.kernel.program, slots))
    lowered.program = lower_once(kernel.program, lowered.facts, work.programs)
    return replace(node, kernel=kernel, into=_chosen(node.into, slots))


def _draw_with(lowered: Lowered, drawn: DrawPass, slots: Sequence[int], work: Work) -> DrawPass:
    state = replace(
        drawn.state, blend=_chosen(drawn.state.blend, slots), color_mask=_chosen(drawn.state.color_mask, slots)
    )
    fragment = None
    if drawn.fragment is not None and slots:
        fragment = Kernel.of_program(_with_results(drawn.fragment.program, slots))
    lowered.fragment = None if fragment is None else lower_once(fragment.program, lowered.facts, work.programs)
    lowered.varyings = varyings_of(lowered.fragment)
    vertex = lower_once(drawn.vertex.program, lowered.vertex_facts, work.programs)
    lowered.vertex = link(vertex, lowered.varyings)
    into, loads = _chosen(drawn.into, slots), _chosen(drawn.loads, slots)
    return replace(drawn, fragment=fragment, into=into, loads=loads, state=state)


def _with_results(program: TypedKernel, slots: Sequence[int]) -> TypedKernel:
    """Return the same kernel with some of its results."""
    return replace(program, results=_chosen(program.results, slots))


def _chosen(parts: Sequence[T], slots: Sequence[int]) -> tuple[T, ...]:
    """Return the parts of the targets that stay."""
    return tuple(parts[number] for number in slots) if parts else ()
