"""Drops the passes that no output needs."""

from __future__ import annotations

from passgraph.graph.targets import Pass
from passgraph.plan.work import Work


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
        # What is read of the last run must be written in this one.
        history = [t.spec for t in lowered.images.values() if t.is_previous]
        still_read.update(history)
        needs = [*lowered.reads, *(work.final[s] for s in history)]  # type: ignore[index]
        pending += [t.made_by for t in needs if t.made_by is not None]
    for node in [n for n in work.passes if n not in needed]:
        work.notes.append(f"left out pass {node.name}: nothing that reaches an output reads it")
        del work.passes[node]
    for spec in [s for s in work.final if s not in still_read]:
        del work.final[spec]
